//! Where an episode can begin, and how pedestrians are lined up.

use schemas::carla::mps;
use schemas::{Pose, SplitMix64, Translation3, Vec3, level_pose};

use super::lanes::{Lanes, Place};
use super::{Common, Placement};

/// Height of a pedestrian's centre above the ground: half of CARLA's walker box.
pub(super) const WALKER_CENTRE_M: f32 = 0.93;
/// Straight road ahead of every start, at least.
pub(super) const STRAIGHT_M: f64 = 40.0;
/// The road ahead counts as straight up to this turn, if no straighter one exists.
pub(super) const STRAIGHT_RAD: [f64; 2] = [1.0 * DEGREE, 15.0 * DEGREE];
/// How often the road ahead is looked at.
const LOOKS: u32 = 8;
const DEGREE: f64 = std::f64::consts::PI / 180.0;
/// Pedestrian blueprints to draw from, `walker.pedestrian.0001` to this number.
const WALKER_BLUEPRINTS: u64 = 49;

/// Lanes of the same direction that must lie beside the ego's.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Beside {
    /// At least one.
    AnySide,
    /// At least these.
    Sides {
        /// To the left.
        left: bool,
        /// To the right.
        right: bool,
    },
}

impl Beside {
    /// None.
    pub(crate) const NOTHING: Self = Self::Sides { left: false, right: false };
}

/// What a place must offer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Wanted {
    /// Beside the ego.
    pub(crate) beside: Beside,
    /// Beside this place ahead as well.
    pub(crate) beside_also_at_m: Option<f64>,
    /// Length of straight road ahead.
    pub(crate) straight_m: f64,
}

/// A place that offers it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Site {
    /// On the ego's lane.
    pub(crate) place: Place,
    /// In the middle of the lane, along it.
    pub(crate) world_from_ego: Pose,
}

impl Site {
    /// The ego here, at a speed along its lane.
    pub(crate) fn ego(&self, common: &Common) -> Placement {
        Placement {
            blueprint: common.vehicle_blueprint.clone(),
            world_from_actor: self.world_from_ego,
            linear_velocity_mps: self.forward() * mps(common.initial_speed_kmh as f32),
            driver: None,
        }
    }

    /// Unit vector along the lane, world frame.
    pub(crate) fn forward(&self) -> Vec3 {
        self.world_from_ego.rotation * Vec3::x()
    }
}

/// One of the map's spawn points that offers what is wanted, every one equally likely. Lanes are
/// never given up for a place, as scores depend on them; a road that turns a little is taken if
/// none is straight.
pub(crate) fn choose(lanes: Lanes<'_>, wanted: &Wanted, rng: &mut SplitMix64) -> Option<Site> {
    let sites: Vec<Site> = lanes
        .spawn_places()
        .filter(|place| has_lanes_beside(lanes, *place, wanted))
        .map(|place| Site { place, world_from_ego: lanes.pose(place) })
        .collect();
    STRAIGHT_RAD.into_iter().find_map(|turn_rad| {
        let straight: Vec<&Site> =
            sites.iter().filter(|site| is_straight(lanes, site.place, wanted, turn_rad)).collect();
        rng.choose(&straight).map(|site| **site)
    })
}

fn has_lanes_beside(lanes: Lanes<'_>, place: Place, wanted: &Wanted) -> bool {
    let beside = |place| match wanted.beside {
        Beside::AnySide => lanes.left(place).is_some() || lanes.right(place).is_some(),
        Beside::Sides { left, right } => {
            (!left || lanes.left(place).is_some()) && (!right || lanes.right(place).is_some())
        }
    };
    let ahead = |distance_m| lanes.ahead(place, distance_m).is_some_and(beside);
    beside(place) && wanted.beside_also_at_m.is_none_or(ahead)
}

fn is_straight(lanes: Lanes<'_>, place: Place, wanted: &Wanted, turn_rad: f64) -> bool {
    // A lane that swings aside and back turns most on its way.
    (1..=LOOKS).all(|look| {
        let there = lanes.ahead(place, wanted.straight_m * f64::from(look) / f64::from(LOOKS));
        there.is_some_and(|there| lanes.turn_rad(place, there).abs() <= turn_rad)
    })
}

/// Between two neighbours of a group, at most.
const SPACING_M: f64 = 0.8;
/// People of a group in one row, at most: more would stand in the lanes beside.
const ABREAST_MAX: u32 = 4;

/// How far behind the first row of a group the last one stands.
pub(crate) fn depth_m(count: u32) -> f64 {
    f64::from(count.div_ceil(ABREAST_MAX).saturating_sub(1)) * SPACING_M
}

/// Adds `count` pedestrians who face a lane's traffic, side by side in rows that are centred on its
/// middle. `None` where the lane ends before the last row.
pub(crate) fn walkers_abreast(
    lanes: Lanes<'_>,
    at: Place,
    count: u32,
    rng: &mut SplitMix64,
    others: &mut Vec<Placement>,
) -> Option<()> {
    let rows = count.div_ceil(ABREAST_MAX);
    for row in 0..rows {
        let place = if row == 0 { at } else { lanes.ahead(at, f64::from(row) * SPACING_M)? };
        let spacing_m = SPACING_M.min(lanes.width_m(place) / f64::from(ABREAST_MAX));
        let abreast = count / rows + u32::from(row < count % rows);
        for index in 0..abreast {
            let right_m = (f64::from(index) - (f64::from(abreast) - 1.0) / 2.0) * spacing_m;
            others.push(walker(lanes, place, right_m, Facing::Traffic, rng));
        }
    }
    Some(())
}

/// Which way a pedestrian looks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Facing {
    /// Towards what comes along the lane.
    Traffic,
    /// The way the lane goes.
    Along,
}

/// Somebody on foot.
pub(super) fn walker_blueprint(rng: &mut SplitMix64) -> String {
    format!("walker.pedestrian.{:04}", 1 + rng.next_u64() % WALKER_BLUEPRINTS)
}

/// A pedestrian beside the middle of a lane, `right_m` to the right of it.
pub(crate) fn walker(
    lanes: Lanes<'_>,
    at: Place,
    right_m: f64,
    facing: Facing,
    rng: &mut SplitMix64,
) -> Placement {
    let turned_rad = if facing == Facing::Traffic { std::f32::consts::PI } else { 0.0 };
    let yaw_rad = lanes.heading_rad(at) as f32 + turned_rad;
    let lane_from_walker = Translation3::new(0.0, -right_m as f32, WALKER_CENTRE_M);
    let position_m = (lanes.pose(at) * lane_from_walker).translation.vector;
    Placement {
        blueprint: walker_blueprint(rng),
        world_from_actor: level_pose(position_m, yaw_rad),
        linear_velocity_mps: Vec3::zeros(),
        driver: None,
    }
}

#[cfg(test)]
mod tests;

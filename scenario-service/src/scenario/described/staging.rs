//! Puts what a file describes on a map.

use roads::{LaneTypes, Map};
use schemas::carla::{mirror_y, mps};
use schemas::{Pose, SplitMix64, Translation3, Vec3, WalkerStage, level_pose, yaw_rad};

use super::text::{Actor, Description, DriverName, Lane, Neighbour};
use crate::scenario::decision::Side;
use crate::scenario::lanes::{Lanes, Place};
use crate::scenario::spawn::{self, Beside, Site, WALKER_CENTRE_M, Wanted};
use crate::scenario::{Common, Driver, Placement, ScenarioError, crowd};

/// Starts that are tried until everybody has a place.
const STARTS_MAX: usize = 32;
/// Lanes between the ego's and one of the other direction, at most.
const LANES_BETWEEN_MAX: usize = 16;
/// People of a group in one row, and how far apart.
const ABREAST_MAX: u32 = 4;
const SPACING_M: f64 = 0.8;
/// Within this of the ego is everybody.
const ANYWHERE_M: f32 = 100_000.0;
const ORDINARY_WALK_MPS: f32 = 1.4;

/// Everybody in their places.
pub(super) struct Staged {
    pub(super) ego: Placement,
    /// World frame.
    pub(super) goal_m: Option<Vec3>,
    /// Those that the file places, then traffic.
    pub(super) others: Vec<Placement>,
}

/// Draws a start at which everybody has a place.
///
/// # Errors
/// [`ScenarioError::Map`] where the map has none.
pub(super) fn stage(
    text: &Description,
    common: &Common,
    map: &Map,
    rng: &mut SplitMix64,
) -> Result<Staged, ScenarioError> {
    let lanes = Lanes::new(map);
    let beside = |side| text.start.lanes_beside.contains(&side);
    let wanted = Wanted {
        beside: Beside::Sides { left: beside(Neighbour::Left), right: beside(Neighbour::Right) },
        beside_also_at_m: None,
        straight_m: text.start.straight_m,
    };
    let mut lacking = "a start with these lanes beside it and as much straight road".to_owned();
    let tries = if text.start.at.is_some() { 1 } else { STARTS_MAX };
    for _ in 0..tries {
        let site = match text.start.at {
            Some(at) => nearest(lanes, map, at),
            None => spawn::choose(lanes, &wanted, rng),
        };
        let Some(site) = site else { break };
        match (Stage { lanes, map, site }).everybody(text, common, rng) {
            Ok(staged) => return Ok(staged),
            Err(what) => lacking = what,
        }
    }
    Err(ScenarioError::Map(format!("{}: this map does not have {lacking}", common.name)))
}

fn nearest(lanes: Lanes<'_>, map: &Map, at: [f64; 2]) -> Option<Site> {
    let place = map.nearest(in_world(at).cast().into(), LaneTypes::DRIVING)?;
    Some(Site { place, world_from_ego: lanes.pose(place) })
}

/// A place of CARLA's frame, at height 0.
fn in_world([x, y]: [f64; 2]) -> Vec3 {
    mirror_y(Vec3::new(x as f32, y as f32, 0.0))
}

/// A place of the file: along a lane from where the ego begins, or of CARLA's frame.
#[derive(Clone, Copy)]
struct Spot {
    ahead_m: Option<f64>,
    lane: Lane,
    at: Option<[f64; 2]>,
}

/// A map with a start.
struct Stage<'m> {
    lanes: Lanes<'m>,
    map: &'m Map,
    site: Site,
}

impl Stage<'_> {
    /// Errors: what is not there.
    fn everybody(
        &self,
        text: &Description,
        common: &Common,
        rng: &mut SplitMix64,
    ) -> Result<Staged, String> {
        let goal_m = text.goal.as_ref().map(|goal| {
            let spot = Spot { ahead_m: goal.ahead_m, lane: Lane::Own, at: goal.at };
            self.anchor(spot).map(|pose| pose.translation.vector)
        });
        let goal_m = goal_m.transpose().map_err(|what| format!("{what} for the goal"))?;
        let ego = self.site.ego(common);
        let mut others = Vec::new();
        for (index, actor) in text.actors.iter().enumerate() {
            self.add(actor, &mut others, rng)
                .map_err(|what| format!("{what} for actors[{index}] ({})", actor.blueprint))?;
        }
        self.add_traffic(text, &ego, &mut others, rng);
        Ok(Staged { ego, goal_m, others })
    }

    fn add(
        &self,
        actor: &Actor,
        others: &mut Vec<Placement>,
        rng: &mut SplitMix64,
    ) -> Result<(), String> {
        let spot = Spot { ahead_m: actor.ahead_m, lane: actor.lane, at: actor.at };
        let anchor = self.anchor(spot)?;
        let driver = self.driver(actor)?;
        let abreast = actor.count.min(ABREAST_MAX);
        for index in 0..actor.count {
            let column = f64::from(index % abreast) - (f64::from(abreast) - 1.0) / 2.0;
            let ahead_m = f64::from(index / abreast) * SPACING_M;
            let right_m = actor.right_m + column * SPACING_M;
            let offset = Translation3::new(ahead_m as f32, -right_m as f32, 0.0);
            let foot = turned(&(anchor * offset), actor.heading_deg);
            others.push(Placement {
                blueprint: blueprint(&actor.blueprint, rng),
                world_from_actor: if actor.walks() { upright(&foot) } else { foot },
                linear_velocity_mps: match actor.walks() {
                    true => Vec3::zeros(),
                    false => foot.rotation * Vec3::x() * mps(actor.speed_kmh as f32),
                },
                driver: driver.clone(),
            });
        }
        Ok(())
    }

    fn driver(&self, actor: &Actor) -> Result<Option<Driver>, String> {
        if !actor.walk.is_empty() {
            let stages = actor.walk.iter().map(|stage| {
                let spot = Spot { ahead_m: stage.ahead_m, lane: stage.lane, at: stage.at };
                let offset = Translation3::new(0.0, -stage.right_m as f32, 0.0);
                Ok(WalkerStage {
                    to_m: (self.anchor(spot)? * offset).translation.vector,
                    speed_mps: stage.speed_mps as f32,
                    wait_secs: stage.wait_secs as f32,
                })
            });
            let stages = stages.collect::<Result<_, String>>()?;
            let within_m = actor.when_within_m.map_or(ANYWHERE_M, |m| m as f32);
            return Ok(Some(Driver::Follows { stages, within_m }));
        }
        let speed_mps = mps(actor.speed_kmh as f32);
        Ok(match actor.driver {
            DriverName::Nobody => None,
            DriverName::Traffic => Some(Driver::Traffic),
            DriverName::Emergency => Some(Driver::Emergency),
            DriverName::OpenDoor => Some(Driver::OpenDoor),
            DriverName::ConstantVelocity => Some(Driver::ConstantVelocity(Vec3::x() * speed_mps)),
            DriverName::Wander => {
                let speed_mps = if speed_mps > 0.0 { speed_mps } else { ORDINARY_WALK_MPS };
                Some(Driver::Walks { speed_mps, crossing_share: 0.0 })
            }
        })
    }

    /// Level ground at a place, x along the traffic of its lane, or of CARLA's frame.
    fn anchor(&self, spot: Spot) -> Result<Pose, String> {
        if let Some(at) = spot.at {
            let at_m = in_world(at);
            let ground = self.map.nearest(at_m.cast().into(), LaneTypes::ANY);
            let z_m = ground.map_or(0.0, |place| self.lanes.pose(place).translation.z);
            return Ok(level_pose(Vec3::new(at_m.x, at_m.y, z_m), 0.0));
        }
        let ahead_m = spot.ahead_m.unwrap_or_default();
        let along = match ahead_m {
            0.0 => Some(self.site.place),
            m if m > 0.0 => self.lanes.ahead(self.site.place, m),
            m => self.lanes.behind(self.site.place, -m),
        };
        let along = along.ok_or_else(|| format!("a lane {ahead_m} m ahead"))?;
        let place = match spot.lane {
            Lane::Own => Some(along),
            Lane::Left => self.lanes.left(along),
            Lane::Right => self.lanes.right(along),
            Lane::Oncoming => self.oncoming(along),
        };
        let place = place.ok_or_else(|| {
            let which = match spot.lane {
                Lane::Own => "own",
                Lane::Left => "left",
                Lane::Right => "right",
                Lane::Oncoming => "oncoming",
            };
            format!("the {which} lane {ahead_m} m ahead")
        })?;
        let pose = self.lanes.pose(place);
        Ok(level_pose(pose.translation.vector, yaw_rad(&pose)))
    }

    /// The nearest driving lane of the other direction.
    fn oncoming(&self, from: Place) -> Option<Place> {
        let is_opposite =
            |place: Place| self.lanes.turn_rad(from, place).abs() > std::f64::consts::FRAC_PI_2;
        let mut place = from;
        for _ in 0..LANES_BETWEEN_MAX {
            // Sides are those of a lane's own traffic.
            let side = if is_opposite(place) { Side::Right } else { Side::Left };
            place = self.lanes.beside(place, side)?;
            let drives = self.lanes.lane_type(place) == roads::LaneType::Driving;
            if drives && is_opposite(place) {
                return Some(place);
            }
        }
        None
    }

    fn add_traffic(
        &self,
        text: &Description,
        ego: &Placement,
        others: &mut Vec<Placement>,
        rng: &mut SplitMix64,
    ) {
        let traffic = &text.traffic;
        let urgent = traffic.emergency_vehicles;
        let placed: Vec<Placement> = std::iter::once(ego).chain(&*others).cloned().collect();
        let counts = (traffic.vehicles + urgent, urgent);
        others.extend(crowd::cars(self.lanes, counts, &placed, rng));
        let parked = crowd::parked(self.map, traffic.parked_cars, (ego, others), None, rng);
        others.extend(parked);
        let walks = Driver::Walks { speed_mps: ORDINARY_WALK_MPS, crossing_share: 0.0 };
        let people = traffic.pedestrians;
        let on_foot = crowd::pedestrians(self.map, people, others, Some(&walks), rng);
        others.extend(on_foot);
    }
}

/// Turned clockwise.
fn turned(pose: &Pose, heading_deg: f64) -> Pose {
    level_pose(pose.translation.vector, yaw_rad(pose) - heading_deg.to_radians() as f32)
}

/// The middle of somebody who stands there.
fn upright(foot: &Pose) -> Pose {
    Translation3::new(0.0, 0.0, WALKER_CENTRE_M) * foot
}

/// A name of CARLA's library for one of the file.
fn blueprint(text: &str, rng: &mut SplitMix64) -> String {
    match text {
        "walker.pedestrian.*" => spawn::walker_blueprint(rng),
        "vehicle.*" => crowd::car_blueprint(rng),
        named => named.to_owned(),
    }
}

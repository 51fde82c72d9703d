//! Where people can cross a road, and from where an ego comes straight at it.

use roads::Map;
use schemas::{SplitMix64, Translation3, Vec3};

use super::kerb::{Kerb, kerb};
use crate::scenario::decision::Side;
use crate::scenario::lanes::{Lanes, Place};
use crate::scenario::spawn::{self, Facing};
use crate::scenario::{Placement, crowd};

/// Places of the way at which its turn is looked at.
const LOOKS: u32 = 16;
/// Marked crossings are looked for so much nearer or farther than asked, in steps.
const MARKED_M: f64 = 15.0;
const STEP_M: f64 = 0.25;

/// Of a lane, as its traffic sees them.
pub(super) const SIDES: [Side; 2] = [Side::Right, Side::Left];

/// The way over a road at a place of a lane.
#[derive(Clone, Copy, Debug)]
pub(super) struct Crossing {
    over: Place,
    right: Kerb,
    left: Kerb,
}

impl Crossing {
    /// `None` where the road does not end within reach on both sides.
    pub(super) fn of(lanes: Lanes<'_>, over: Place) -> Option<Self> {
        let [right, left] = SIDES.map(|side| kerb(lanes, over, side));
        Some(Self { over, right: right?, left: left? })
    }

    /// From the middle of the lane to where people stand on a side.
    pub(super) fn kerb_m(&self, side: Side) -> f64 {
        self.kerb(side).stands_m
    }

    /// From the middle of the lane to where people may begin on a side, the best place first.
    pub(super) fn begins_m(&self, side: Side) -> [f64; 2] {
        let kerb = self.kerb(side);
        [kerb.stands_m, kerb.steps_out_m]
    }

    fn kerb(&self, side: Side) -> &Kerb {
        if side == Side::Right { &self.right } else { &self.left }
    }

    /// A place on the road, ahead of the way over it and right of the middle of the lane; world
    /// frame.
    pub(super) fn at(&self, lanes: Lanes<'_>, ahead_m: f64, right_m: f64) -> Vec3 {
        beside(lanes, self.over, ahead_m, right_m)
    }

    /// Somebody who stands there.
    pub(super) fn walker(
        &self,
        lanes: Lanes<'_>,
        ahead_m: f64,
        right_m: f64,
        rng: &mut SplitMix64,
    ) -> Placement {
        let mut walker = spawn::walker(lanes, self.over, right_m, Facing::Traffic, rng);
        let ahead_m = lanes.pose(self.over).rotation * Vec3::x() * ahead_m as f32;
        let position_m = walker.world_from_actor.translation.vector + ahead_m;
        walker.world_from_actor.translation = Translation3::from(position_m);
        walker
    }
}

/// Whether nothing of the map stands where somebody begins.
pub(super) fn is_free(map: &Map, walker: &Placement) -> bool {
    !crowd::blocked(map, walker.world_from_actor.translation.vector)
}

/// What a site must be like.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Wish {
    /// From the start to where people cross, and on from there.
    pub distance_m: f64,
    pub beyond_m: f64,
    /// The most that the road turns beyond the first part, which is as straight as every start.
    pub turn_rad: f64,
    /// At a crossing that the map has, about as far ahead.
    pub is_marked: bool,
}

impl Wish {
    /// The most wanted first: marked, where that is asked for, and straight.
    pub(super) fn all(distance_m: f64, beyond_m: f64, is_marked: bool) -> Vec<Self> {
        let marked = if is_marked { vec![true, false] } else { vec![false] };
        let straight = |is_marked: bool| {
            spawn::STRAIGHT_RAD.map(|turn_rad| Self { distance_m, beyond_m, turn_rad, is_marked })
        };
        marked.into_iter().flat_map(straight).collect()
    }

    /// The place to cross at for somebody who starts at another; `None` where it is not like this.
    pub(super) fn over(&self, lanes: Lanes<'_>, marked: &[Outline], start: Place) -> Option<Place> {
        let straight = (1..=LOOKS).all(|look| {
            let ahead_m = (self.distance_m + self.beyond_m) * f64::from(look) / f64::from(LOOKS);
            let is_start = ahead_m <= spawn::STRAIGHT_M;
            let most_rad = if is_start { spawn::STRAIGHT_RAD[0] } else { self.turn_rad };
            let there = lanes.ahead(start, ahead_m);
            there.is_some_and(|there| lanes.turn_rad(start, there).abs() <= most_rad)
        });
        match (straight, self.is_marked) {
            (false, _) => None,
            (true, false) => lanes.ahead(start, self.distance_m),
            (true, true) => self.over_marked(lanes, marked, start),
        }
    }

    /// The middle of the first crossing, along the lane.
    fn over_marked(&self, lanes: Lanes<'_>, marked: &[Outline], start: Place) -> Option<Place> {
        let near_m = (self.distance_m - MARKED_M).max(10.0);
        let steps = (2.0 * MARKED_M / STEP_M) as u32;
        let places = (0..steps).map(move |step| near_m + f64::from(step) * STEP_M);
        let is_on = |ahead_m: &f64| {
            let place = lanes.ahead(start, *ahead_m);
            place.is_some_and(|place| {
                let middle = lanes.pose(place).translation.vector.cast::<f64>();
                marked.iter().any(|outline| holds(outline, (middle.x, middle.y)))
            })
        };
        let mut on = places.skip_while(|ahead_m| !is_on(ahead_m)).take_while(is_on);
        let first_m = on.next()?;
        lanes.ahead(start, f64::midpoint(first_m, on.last().unwrap_or(first_m)))
    }
}

/// Corners of a crossing, seen from above.
pub(super) type Outline = Vec<(f64, f64)>;

/// Every crossing of a map.
pub(super) fn marked(map: &Map) -> Vec<Outline> {
    let crosswalks = map.crosswalks();
    crosswalks.iter().map(|corners| corners.iter().map(|it| (it.x, it.y)).collect()).collect()
}

/// Places to start from, in an order drawn by chance.
///
/// **Source:** Fisher and Yates; Durstenfeld, "Algorithm 235: Random permutation", 1964.
pub(super) fn starts(lanes: Lanes<'_>, rng: &mut SplitMix64) -> Vec<Place> {
    let mut starts: Vec<Place> = lanes.spawn_places().collect();
    for last in (1..starts.len()).rev() {
        let other = (rng.next_u64() % (last as u64 + 1)) as usize;
        starts.swap(last, other);
    }
    starts
}

/// Whether a point is within an outline, seen from above: an odd number of its sides lies east.
fn holds(corners: &[(f64, f64)], (x, y): (f64, f64)) -> bool {
    let sides = corners.iter().zip(corners.iter().cycle().skip(1));
    let crossed = sides.filter(|((from_x, from_y), (to_x, to_y))| {
        let spans = (*from_y > y) != (*to_y > y);
        spans && x < from_x + (to_x - from_x) * (y - from_y) / (to_y - from_y)
    });
    crossed.count() % 2 == 1
}

fn beside(lanes: Lanes<'_>, place: Place, ahead_m: f64, right_m: f64) -> Vec3 {
    let lane_from_point = Translation3::new(ahead_m as f32, -right_m as f32, 0.0);
    (lanes.pose(place) * lane_from_point).translation.vector
}

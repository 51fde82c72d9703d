//! Houses along streets, where there is room for them.

use super::block::house;
use super::clearance::Clearance;
use super::course::{Pose, distance_m};
use super::draft::TownDraft;
use super::plan::{Beside, Plan};
use super::random::Random;

/// Free strip between sidewalk and house, in metres, at least and at most.
const FRONT_GAP_M: [f64; 2] = [2.0, 5.0];
/// Width and depth of a house, in metres, at least and at most.
const WIDTH_M: [f64; 2] = [11.0, 20.0];
const DEPTH_M: [f64; 2] = [9.0, 14.0];
/// Distance between neighbours, in metres, at least and at most.
const GAP_M: [f64; 2] = [1.5, 6.0];
/// How deep houses stand in the ground, in metres, below the lowest streets of a town: so none
/// hangs over land that slopes down from a street.
const CELLAR_M: f64 = 1.0;
/// Distance of houses from all roads and squares, in metres.
const CLEAR_M: f64 = 1.0;
/// Distance of houses from things with a place of their own, in metres.
const LOOSE_CLEAR_M: f64 = 10.0;
/// A rectangle in the plane: its middle, and half of its length and width.
#[derive(Clone, Copy)]
struct Footprint {
    middle: Pose,
    half_m: [f64; 2],
}

impl Footprint {
    /// Distance of a point from the rectangle; 0 inside.
    fn distance_m(&self, at: [f64; 2]) -> f64 {
        let [ahead_m, left_m] = self.middle.local(at);
        let beyond = [ahead_m.abs() - self.half_m[0], left_m.abs() - self.half_m[1]];
        beyond[0].max(0.0).hypot(beyond[1].max(0.0))
    }

    fn radius_m(&self) -> f64 {
        self.half_m[0].hypot(self.half_m[1])
    }

    fn corners(&self) -> [[f64; 2]; 4] {
        [[1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0], [1.0, -1.0]]
            .map(|[u, v]| self.middle.ahead(u * self.half_m[0]).left(v * self.half_m[1]).at)
    }

    /// Whether two rectangles share a point. Corners and middles suffice for houses, whose sizes
    /// are alike.
    fn meets(&self, other: &Self) -> bool {
        distance_m(self.middle.at, other.middle.at) < self.radius_m() + other.radius_m()
            && (self.holds_any_of(other) || other.holds_any_of(self))
    }

    fn holds_any_of(&self, other: &Self) -> bool {
        let places = other.corners().into_iter().chain([other.middle.at]);
        places.into_iter().any(|place| self.distance_m(place) < CLEAR_M)
    }
}

/// Builds houses along all streets that are to have some.
pub(super) fn build(plan: &Plan, random: &mut Random, draft: &mut TownDraft) {
    let clearance = Clearance::new(plan, draft);
    let squares: Vec<Footprint> = plan
        .blocks
        .iter()
        .map(|block| {
            let [x, y] = [0, 1].map(|k| (block.min[k] + block.max[k]) / 2.0);
            let half_m = [0, 1].map(|k| (block.max[k] - block.min[k]) / 2.0);
            Footprint { middle: Pose::new([x, y], 0.0), half_m }
        })
        .collect();
    let mut built: Vec<Footprint> = squares;
    let free_of_roads = |house: &Footprint| {
        clearance.is_clear(house.middle.at, house.radius_m(), CLEAR_M, |at| house.distance_m(at))
    };
    for street in &plan.streets {
        let Beside::Houses { storeys } = street.beside else { continue };
        for sign in [1, -1] {
            let edge_m = street.profile.width_m(sign);
            let row = row(draft, street.id, f64::from(sign), edge_m, random);
            for (s, t, footprint) in row {
                let is_free = free_of_roads(&footprint)
                    && plan.loose.iter().all(|l| footprint.distance_m(l.at) > LOOSE_CLEAR_M)
                    && !built.iter().any(|other| other.meets(&footprint));
                if !is_free {
                    continue;
                }
                let size_m = footprint.half_m.map(|half_m| 2.0 * half_m);
                let mut object = house(size_m, random.between(storeys[0], storeys[1]).floor());
                (object.s, object.t) = (s, t);
                if let Some(road) = draft.road_mut(street.id) {
                    let cellar_m = CELLAR_M + road.height_m(s).max(0.0);
                    object.z_offset_m -= cellar_m;
                    object.height_m += cellar_m;
                    road.objects.push(object);
                }
                built.push(footprint);
            }
        }
    }
}

/// Places for houses along one side of a street: road coordinates and footprint.
fn row(
    draft: &TownDraft,
    street: u32,
    sign: f64,
    edge_m: f64,
    random: &mut Random,
) -> Vec<(f64, f64, Footprint)> {
    let mut places = Vec::new();
    let Some(road) = draft.roads.iter().find(|road| road.id == street) else { return places };
    let mut start_s = 0.0;
    for piece in &road.pieces {
        let mut along_m = random.between(0.0, GAP_M[1]);
        let straight_m = if piece.curvature == 0.0 { piece.length_m } else { 0.0 };
        loop {
            let [length_m, depth_m] =
                [WIDTH_M, DEPTH_M].map(|[low, high]| random.between(low, high));
            if along_m + length_m > straight_m {
                break;
            }
            let t =
                sign * (edge_m + random.between(FRONT_GAP_M[0], FRONT_GAP_M[1]) + depth_m / 2.0);
            let middle_m = along_m + length_m / 2.0;
            let middle = piece.pose_at(middle_m).left(t);
            let half_m = [length_m / 2.0, depth_m / 2.0];
            places.push((start_s + middle_m, t, Footprint { middle, half_m }));
            along_m += length_m + random.between(GAP_M[0], GAP_M[1]);
        }
        start_s += piece.length_m;
    }
    places
}

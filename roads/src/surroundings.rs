//! Surroundings for maps that bring none: houses, trees and lamps beside the roads.
//!
//! What is generated stands beside the objects of the nearest road, so that meshes, physics,
//! pictures and the list of environment objects treat it like any other object.

mod footing;

use footing::Footing;

use crate::kinds::LaneType;
use crate::lanes::lateral;
use crate::limits;
use crate::model::{Model, Object, Road, Section};
use crate::town::random::Random;

/// Distance between things along a road, in metres.
const STEP_M: f64 = 15.0;
/// Distance of the first from a road's end, in metres.
const END_GAP_M: f64 = 8.0;
/// Distance of lamps from the outermost lane, in metres.
const LAMP_GAP_M: f64 = 1.8;
/// Distance of houses from the outermost lane, in metres, at least and at most.
const HOUSE_GAP_M: [f64; 2] = [4.0, 7.0];
/// Width and depth of houses, in metres, at least and at most.
const HOUSE_WIDTH_M: [f64; 2] = [10.0, 14.0];
const HOUSE_DEPTH_M: [f64; 2] = [8.0, 12.0];
/// Height of a storey, in metres.
const STOREY_M: f64 = 3.3;
/// How deep houses stand in the ground, in metres, so that none hangs over sloping land.
const CELLAR_M: f64 = 1.0;
/// How deep trees and lamps begin, in metres, for the same reason.
const ROOT_M: f64 = 0.4;
/// Distance of trees from the outermost lane, in metres, at least and at most.
const TREE_GAP_M: [f64; 2] = [3.0, 14.0];
/// Share of the places along a road without sidewalks that get a tree.
const TREE_SHARE: f64 = 0.6;

/// Surroundings of a map without houses and trees of its own, by road.
///
/// **Determinism:** the same map gets the same. **Cost:** linear in the length of all lanes; maps
/// longer than [`limits::SURROUNDINGS_LENGTH_MAX_M`] get none.
pub(crate) fn around(model: &Model) -> Vec<Vec<Object>> {
    let length_m: f64 = model.roads.iter().map(|road| road.length_m).sum();
    if has_surroundings(model) || length_m > limits::SURROUNDINGS_LENGTH_MAX_M {
        return Vec::new();
    }
    let Some(mut footing) = Footing::new(model) else { return Vec::new() };
    let mut count = 0;
    let along = |road: &Road| {
        if road.junction.is_some() || count > limits::SURROUNDINGS_MAX {
            return Vec::new();
        }
        let things = beside(road, &mut footing);
        count += things.len();
        things
    };
    model.roads.iter().map(along).collect()
}

fn has_surroundings(model: &Model) -> bool {
    let mut objects = model.roads.iter().flat_map(|road| &road.objects);
    objects.any(|object| matches!(object.object_type.as_str(), "building" | "tree" | "vegetation"))
}

/// What stands along one road.
fn beside(road: &Road, footing: &mut Footing) -> Vec<Object> {
    let mut random = Random::new(u64::from(road.id));
    let mut things = Vec::new();
    let mut s = END_GAP_M;
    let mut lamp_next = true;
    while s < road.length_m - END_GAP_M {
        let Some(section) = road.sections.get(road.section_index(s)) else { break };
        for sign in [1, -1] {
            let Some(side) = Side::at(road, section, sign, s) else { continue };
            if !footing.is_level(road, s) {
                continue;
            }
            if side.has_sidewalk {
                let lamp = lamp_next.then(|| side.lamp());
                let house = side.house(&mut random);
                things
                    .extend(lamp.into_iter().chain([house]).filter(|one| footing.take(road, one)));
            } else if random.between(0.0, 1.0) < TREE_SHARE {
                things.extend(Some(side.tree(&mut random)).filter(|one| footing.take(road, one)));
            }
        }
        lamp_next = !lamp_next;
        s += STEP_M;
    }
    things
}

/// The land on one side of a road at one place.
struct Side {
    s: f64,
    /// Lateral place of the outermost border of the lanes.
    edge_t: f64,
    sign: f64,
    has_sidewalk: bool,
}

impl Side {
    /// `None` on a side without lanes.
    fn at(road: &Road, section: &Section, sign: i32, s: f64) -> Option<Self> {
        let lanes = || section.lanes.iter().filter(|lane| lane.id.signum() == sign);
        let outermost = lanes().max_by_key(|lane| lane.id.abs())?;
        Some(Self {
            s,
            edge_t: lateral(road, section, outermost.id, s).outer,
            sign: f64::from(sign),
            has_sidewalk: lanes().any(|lane| lane.lane_type == LaneType::Sidewalk),
        })
    }

    /// A thing that looks across the road, its middle at a distance from the lanes.
    fn thing(&self, object_type: &str, name: &str, away_m: f64, size_m: [f64; 3]) -> Object {
        let [length_m, width_m, height_m] = size_m;
        Object {
            name: name.to_owned(),
            object_type: object_type.to_owned(),
            s: self.s,
            t: self.edge_t + self.sign * away_m,
            z_offset_m: -ROOT_M,
            heading_rad: -self.sign * std::f64::consts::FRAC_PI_2,
            length_m,
            width_m,
            height_m: height_m + ROOT_M,
            radius_m: 0.0,
            corners: Vec::new(),
        }
    }

    fn lamp(&self) -> Object {
        self.thing("streetLamp", "StreetLamp", LAMP_GAP_M, [0.2, 0.2, 6.5])
    }

    fn tree(&self, random: &mut Random) -> Object {
        let radius_m = random.between(1.6, 2.8);
        let away_m = random.between(TREE_GAP_M[0], TREE_GAP_M[1]);
        let size_m = [2.0 * radius_m, 2.0 * radius_m, random.between(6.0, 12.0)];
        self.thing("tree", "Tree", away_m, size_m)
    }

    fn house(&self, random: &mut Random) -> Object {
        let [width_m, depth_m] =
            [HOUSE_WIDTH_M, HOUSE_DEPTH_M].map(|[low, high]| random.between(low, high));
        let away_m = random.between(HOUSE_GAP_M[0], HOUSE_GAP_M[1]) + depth_m / 2.0;
        let height_m = random.between(2.0, 6.0).floor() * STOREY_M + 1.0;
        let mut house = self.thing("building", "House", away_m, [depth_m, width_m, height_m]);
        house.z_offset_m = -CELLAR_M;
        house.height_m = height_m + CELLAR_M;
        house
    }
}

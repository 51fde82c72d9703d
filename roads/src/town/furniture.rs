//! Street lamps, trees, benches, bins, hydrants, bus stops and guard rails along the streets.

use super::clearance::Clearance;
use super::draft::{ObjectDraft, RoadDraft, TownDraft};
use super::plan::{Beside, Plan};
use super::profile::{Edge, Extra, Profile, SIDEWALK_M};
use super::random::Random;
use super::street::extra_range;

/// Distance between things along a sidewalk, in metres.
const SPACING_M: f64 = 16.0;
/// Distance of the first from the street's end, in metres.
const END_GAP_M: f64 = 8.0;
/// Things between lamps and trees keep this far away from the street's end, in metres. The
/// centimetre decides where a street is a millimetre longer than a row of them.
const LAST_GAP_M: f64 = 2.0 * END_GAP_M + 0.01;
/// Distance of the middle of posts and trunks from the kerb, in metres.
const KERB_GAP_M: f64 = 0.7;
/// Length of a piece of guard rail, in metres.
const RAIL_M: f64 = 10.0;
/// Distance of rails from the road's edge, in metres.
const RAIL_GAP_M: f64 = 0.6;
/// Motorways lower than this need no rails, in metres.
const RAIL_HEIGHT_MIN_M: f64 = 1.0;
/// How deep things beside the road begin, in metres, so that none hangs over sloping land.
const LAND_DROP_M: f64 = 0.4;
/// Height of a sidewalk above the road, in metres.
pub(super) const SIDEWALK_HEIGHT_M: f64 = 0.15;

/// Every which gap between a lamp and a tree has a bench and a bin.
const BENCH_EVERY: usize = 3;
/// Every which gap has a bus stop, counted so that it never falls on a bench.
const BUS_STOP_EVERY: usize = 6;
/// Every which gap has a hydrant.
const HYDRANT_EVERY: usize = 4;
/// Depth, breadth and height of a bus stop's shelter, in metres.
const BUS_STOP_M: [f64; 3] = [1.4, 3.6, 2.5];
/// Distance of benches from the outer edge of the sidewalk, in metres.
const BENCH_EDGE_GAP_M: f64 = 0.45;
/// Distance between trees along country roads, in metres, at least and at most.
const COUNTRY_SPACING_M: [f64; 2] = [14.0, 34.0];
/// Distance of those from the road's edge, in metres, at least and at most.
const COUNTRY_GAP_M: [f64; 2] = [3.0, 12.0];
/// Distance between lamps along roads without sidewalks, in metres.
const MAST_SPACING_M: f64 = 60.0;

/// Lines all streets with what belongs there.
pub(super) fn line_streets(plan: &Plan, random: &mut Random, draft: &mut TownDraft) {
    let clearance = Clearance::new(plan, draft);
    for (street, road) in plan.streets.iter().zip(&mut draft.roads) {
        let length_m = road.length_m();
        let mut things = Vec::new();
        for sign in [1, -1] {
            let Some(side) = street.profile.side(sign) else { continue };
            if side.edge == Edge::Sidewalk {
                line_sidewalk(street.profile, sign, length_m, &mut things);
            } else if street.beside == Beside::Trees {
                line_with_trees(side.width_m(), sign, length_m, random, &mut things);
            } else if side.edge == Edge::HardShoulder {
                line_with_masts(side.width_m(), sign, length_m, &mut things);
            }
        }
        things.retain(|thing| {
            let radius_m = thing.length_m.max(thing.width_m) / 2.0;
            clearance.is_beside_only(street.id, road.place(thing.s, thing.t), radius_m)
        });
        road.objects.append(&mut things);
        if street.profile.right.edge == Edge::HardShoulder {
            let rails = rails(street.profile, road);
            road.objects.extend(rails);
        }
    }
}

/// Rails on both sides of a motorway where it runs high above the land.
fn rails(profile: Profile, road: &RoadDraft) -> Vec<ObjectDraft> {
    let mut rails = Vec::new();
    for index in 0..count(road.length_m(), RAIL_M) {
        let s = (index as f64 + 0.5) * RAIL_M;
        if road.height_m(s) < RAIL_HEIGHT_MIN_M {
            continue;
        }
        for sign in [1, -1] {
            let t = f64::from(sign) * (profile.width_m(sign) + RAIL_GAP_M);
            let rail = ObjectDraft {
                object_type: "barrier",
                name: "GuardRail",
                s,
                t,
                z_offset_m: -LAND_DROP_M,
                length_m: RAIL_M,
                width_m: 0.3,
                height_m: 1.4,
                ..lamp_post()
            };
            rails.push(rail);
        }
    }
    rails
}

/// Things look across the road.
fn put(object: ObjectDraft, s: f64, t: f64, objects: &mut Vec<ObjectDraft>) {
    let quarter_rad = std::f64::consts::FRAC_PI_2;
    let heading_rad = if t > 0.0 { -quarter_rad } else { quarter_rad };
    objects.push(ObjectDraft { s, t, heading_rad, ..object });
}

#[allow(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "a street of a plan is some thousand metres long"
)]
fn count(length_m: f64, spacing_m: f64) -> usize {
    (length_m / spacing_m).max(0.0) as usize
}

/// Lamps and trees in turn, benches and bins between them.
fn line_sidewalk(profile: Profile, sign: i32, length_m: f64, objects: &mut Vec<ObjectDraft>) {
    let Some(side) = profile.side(sign) else { return };
    let kerb_m = |s: f64| {
        let widened = extra_range(profile, length_m)
            .is_some_and(|[from, to]| (from - 12.0..to + 12.0).contains(&s));
        side.kerb_m() + side.extra.filter(|_| widened).map_or(0.0, Extra::width_m)
    };
    let across = f64::from(sign);
    for index in 0..=count(length_m - 2.0 * END_GAP_M, SPACING_M) {
        let s = END_GAP_M + index as f64 * SPACING_M;
        let lamp = (index % 2 == 0) == (sign > 0);
        let object = if lamp { lamp_post() } else { tree(7.0, 1.6) };
        put(object, s, across * (kerb_m(s) + KERB_GAP_M), objects);
        let between_s = s + SPACING_M / 2.0;
        if index % BENCH_EVERY == 1 && between_s < length_m - LAST_GAP_M {
            let t = across * (kerb_m(between_s) + SIDEWALK_M - BENCH_EDGE_GAP_M);
            put(prop("Bench", [0.5, 1.6, 0.85]), between_s, t, objects);
            put(prop("Bin", [0.45, 0.45, 0.95]), between_s + 1.5, t, objects);
        }
        if index % BUS_STOP_EVERY == 3 && between_s < length_m - LAST_GAP_M {
            let t = across * (kerb_m(between_s) + SIDEWALK_M - BUS_STOP_M[0] / 2.0 - 0.1);
            put(prop("BusStop", BUS_STOP_M), between_s, t, objects);
        }
        if index % HYDRANT_EVERY == 2 && between_s < length_m - LAST_GAP_M {
            let t = across * (kerb_m(between_s) + KERB_GAP_M);
            put(prop("Hydrant", [0.3, 0.3, 0.8]), between_s, t, objects);
        }
    }
}

fn line_with_trees(
    edge_m: f64,
    sign: i32,
    length_m: f64,
    random: &mut Random,
    objects: &mut Vec<ObjectDraft>,
) {
    let mut s = END_GAP_M + random.between(0.0, COUNTRY_SPACING_M[1]);
    while s < length_m - END_GAP_M {
        let beside_m = edge_m + random.between(COUNTRY_GAP_M[0], COUNTRY_GAP_M[1]);
        let grown = tree(random.between(6.0, 12.0), random.between(1.8, 2.8));
        let on_grass = ObjectDraft { z_offset_m: -LAND_DROP_M, ..grown };
        put(on_grass, s, f64::from(sign) * beside_m, objects);
        s += random.between(COUNTRY_SPACING_M[0], COUNTRY_SPACING_M[1]);
    }
}

fn line_with_masts(edge_m: f64, sign: i32, length_m: f64, objects: &mut Vec<ObjectDraft>) {
    for index in 0..count(length_m - MAST_SPACING_M, MAST_SPACING_M) {
        let s = (index as f64 + 1.0) * MAST_SPACING_M;
        let mast = ObjectDraft { z_offset_m: -LAND_DROP_M, height_m: 9.5, ..lamp_post() };
        put(mast, s, f64::from(sign) * (edge_m + 1.0), objects);
    }
}

/// A box with its front along x: length is its depth, width is how broad it is.
fn prop(name: &'static str, [length_m, width_m, height_m]: [f64; 3]) -> ObjectDraft {
    ObjectDraft { object_type: "obstacle", name, length_m, width_m, height_m, ..lamp_post() }
}

fn lamp_post() -> ObjectDraft {
    ObjectDraft {
        object_type: "streetLamp",
        name: "StreetLamp",
        s: 0.0,
        t: 0.0,
        z_offset_m: SIDEWALK_HEIGHT_M,
        heading_rad: 0.0,
        length_m: 0.2,
        width_m: 0.2,
        height_m: 6.5,
        outline: Vec::new(),
    }
}

/// A tree with a crown of this radius.
pub(super) fn tree(height_m: f64, radius_m: f64) -> ObjectDraft {
    ObjectDraft {
        object_type: "tree",
        name: "Tree",
        s: 0.0,
        t: 0.0,
        z_offset_m: SIDEWALK_HEIGHT_M,
        heading_rad: 0.0,
        length_m: 2.0 * radius_m,
        width_m: 2.0 * radius_m,
        height_m,
        outline: Vec::new(),
    }
}

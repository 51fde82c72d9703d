//! Tells ground apart that lies above other ground, so that each storey is a plane figure.

use std::collections::{BTreeMap, BTreeSet};

use super::cover::Cover;
use super::piece::{Class, Piece};
use super::surface::cross;

/// Pieces above each other are on different storeys when this far apart, in metres: a walker's
/// height.
const HEADROOM_M: f64 = 1.8;

/// The pieces of each storey. Roads share a storey unless one leads over the other; crossings
/// belong to every storey that has ground at their height. `cover` is that of all pieces.
pub(super) fn split(pieces: &[Piece], cover: &Cover<'_>) -> Vec<Vec<Piece>> {
    let storey_of = storeys_of_roads(pieces, &overlaps(pieces, cover));
    let count = storey_of.values().max().map_or(0, |highest| highest + 1);
    let mut storeys: Vec<Vec<Piece>> = vec![Vec::new(); count];
    let is_crossing = |piece: &&Piece| piece.class == Class::Crosswalk;
    let mut members: BTreeSet<(usize, usize)> = BTreeSet::new();
    for group in cover.groups() {
        for (index, crossing) in named(pieces, group).filter(|(_, piece)| is_crossing(piece)) {
            let ground = named(pieces, group).filter(|(_, piece)| touches(piece, crossing));
            let storeys = ground.filter_map(|(_, piece)| storey_of.get(&piece.road));
            members.extend(storeys.map(|storey| (*storey, index)));
        }
    }
    for piece in pieces.iter().filter(|piece| !is_crossing(piece)) {
        let storey = storey_of.get(&piece.road).and_then(|storey| storeys.get_mut(*storey));
        storey.into_iter().for_each(|storey| storey.push(piece.clone()));
    }
    for (storey, index) in members {
        if let (Some(storey), Some(crossing)) = (storeys.get_mut(storey), pieces.get(index)) {
            storey.push(crossing.clone());
        }
    }
    storeys
}

/// The lowest free storey for every road, in the order of the pieces; crossings have none.
fn storeys_of_roads(pieces: &[Piece], over: &BTreeSet<(u32, u32)>) -> BTreeMap<u32, usize> {
    let mut storey_of: BTreeMap<u32, usize> = BTreeMap::new();
    for piece in pieces.iter().filter(|piece| piece.class != Class::Crosswalk) {
        if storey_of.contains_key(&piece.road) {
            continue;
        }
        let others = over.range((piece.road, 0)..=(piece.road, u32::MAX));
        let taken: BTreeSet<usize> =
            others.filter_map(|(_, other)| storey_of.get(other).copied()).collect();
        let free = (0..).find(|storey| !taken.contains(storey)).unwrap_or(0);
        storey_of.insert(piece.road, free);
    }
    storey_of
}

/// Some pieces with their positions.
fn named<'p>(pieces: &'p [Piece], group: &'p [usize]) -> impl Iterator<Item = (usize, &'p Piece)> {
    group.iter().filter_map(|index| Some((*index, pieces.get(*index)?)))
}

/// Pairs of roads of which one leads over the other, in both orders.
fn overlaps(pieces: &[Piece], cover: &Cover<'_>) -> BTreeSet<(u32, u32)> {
    let mut over = BTreeSet::new();
    for group in cover.groups() {
        let ground = named(pieces, group).filter(|(_, piece)| piece.class != Class::Crosswalk);
        let group: Vec<&Piece> = ground.map(|(_, piece)| piece).collect();
        let heights = group.iter().map(|piece| heights_m(piece));
        let [low, high] = heights.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], own| {
            [low.min(own[0]), high.max(own[1])]
        });
        // Nearly every group is flat and need not be compared pair by pair.
        if high - low < HEADROOM_M {
            continue;
        }
        for (position, one) in group.iter().enumerate() {
            for other in group.iter().skip(position + 1) {
                if one.road != other.road && gap_m(one, other) >= HEADROOM_M && overlap(one, other)
                {
                    over.insert((one.road, other.road));
                    over.insert((other.road, one.road));
                }
            }
        }
    }
    over
}

fn touches(piece: &Piece, crossing: &Piece) -> bool {
    gap_m(piece, crossing) < HEADROOM_M && overlap(piece, crossing)
}

/// The lowest and the highest corner.
fn heights_m(piece: &Piece) -> [f64; 2] {
    piece.corners.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], corner| {
        [low.min(corner.z), high.max(corner.z)]
    })
}

fn gap_m(one: &Piece, other: &Piece) -> f64 {
    let (one, other) = (heights_m(one), heights_m(other));
    (one[0] - other[1]).max(other[0] - one[1])
}

/// Whether two convex pieces overlap seen from above: no edge of either has the other outside.
fn overlap(one: &Piece, other: &Piece) -> bool {
    let separates = |one: &Piece, other: &Piece| {
        let nexts = one.corners.iter().cycle().skip(1);
        one.corners.iter().zip(nexts).any(|(from, to)| {
            let along = to.xy() - from.xy();
            other.corners.iter().all(|corner| cross(along, corner.xy() - from.xy()) <= 0.0)
        })
    };
    !separates(one, other) && !separates(other, one)
}

//! Forks that end the client when its traffic manager reads the map.
//!
//! It follows every lane into all that continue it. Where these are two and more it looks for the
//! turn each takes through the junction, and reads past the end of a list when one of them is in
//! none. A connecting road counts as in a junction only when traffic of the road before it has two
//! and more connecting roads to choose from there, or when two and more lead to the road behind it.
//! **Source:** the client, by what it survives.

use std::collections::BTreeSet;

use super::fault;
use crate::error::{Report, Severity};
use crate::kinds::LaneType;
use crate::lanes::{LaneEntry, LaneIndex, parts};
use crate::links::Links;
use crate::map::Map;
use crate::model::Road;

/// Distance of the places the traffic manager knows of a road, in metres.
const PLACES_EVERY_M: f64 = 5.0;
/// It knows no place where a lane is this wide or narrower, in metres.
const WIDTH_MIN_M: f64 = 1.0;
/// Lanes without places that are followed, one after another.
const EMPTY_LANES_MAX: usize = 64;

/// Reports every lane whose continuations end the client.
pub(super) fn check(map: &Map, report: &mut Report) {
    for (index, entry) in (0..).zip(&map.table.lanes) {
        let Some((road, _, lane)) = parts(&map.model, entry) else { continue };
        let followers = map.links.next_of(index);
        let repeated = followers.iter().find(|follower| is_repeated(map, road, entry, **follower));
        let count = followers.len() + usize::from(repeated.is_some());
        if count < 2 || road.junction.is_some() || !is_known(map, entry) {
            continue;
        }
        let Some(found) = trouble(map, entry, followers, repeated) else { continue };
        let wanted = format!(
            "lane {} to continue once into each of two and more roads of a junction, or into one",
            lane.id
        );
        let found = format!("{found}; the traffic manager ends there");
        report.push(fault(Severity::BreaksClient, road, Some(entry.exit_s()), wanted, found));
    }
}

fn trouble(
    map: &Map,
    entry: &LaneEntry,
    followers: &[LaneIndex],
    repeated: Option<&LaneIndex>,
) -> Option<String> {
    let outside = followers.iter().find_map(|follower| outside(map, *follower));
    if let Some(road) = outside {
        return Some(format!("road {}, which is in none, among them", road.id));
    }
    if choices(map, entry, Links::next_of) > 1 || followers.iter().all(|lane| merges(map, *lane)) {
        return None;
    }
    let again = repeated.and_then(|lane| road_of(map, *lane));
    Some(match again {
        Some(road) => format!("road {} alone, which several connections name", road.id),
        None => format!("{} lanes of one road", followers.len()),
    })
}

fn road_of(map: &Map, lane: LaneIndex) -> Option<&Road> {
    map.model.roads.get(map.table.get(lane)?.road as usize)
}

/// Id of what the road of a lane leads to where its traffic leaves it.
fn target(road: &Road, entry: &LaneEntry) -> u32 {
    if entry.forward { road.successor } else { road.predecessor }
}

/// Whether several connections of the junction ahead name the road of a follower: the client then
/// finds it as often.
fn is_repeated(map: &Map, road: &Road, entry: &LaneEntry, follower: LaneIndex) -> bool {
    let Some(next) = road_of(map, follower) else { return false };
    let junction = map.model.junction(target(road, entry));
    next.junction.is_some() && junction.is_some_and(|one| one.repeated_roads.contains(&next.id))
}

/// Whether the road behind a lane of a connecting road is led to by others, too.
fn merges(map: &Map, lane: LaneIndex) -> bool {
    let exits = map.links.next_of(lane).iter().filter_map(|exit| map.table.get(*exit));
    exits.map(|exit| choices(map, exit, Links::previous_of)).max().is_some_and(|count| count > 1)
}

/// How many roads through junctions the lanes beside this one, itself included, are linked to on
/// one side.
fn choices(map: &Map, entry: &LaneEntry, side: fn(&Links, LaneIndex) -> &[LaneIndex]) -> usize {
    let beside = map.table.lanes_of(entry.road as usize);
    let is_alike = |index: &LaneIndex| {
        map.table.get(*index).is_some_and(|other| other.forward == entry.forward)
    };
    let roads: BTreeSet<u32> = beside
        .filter(is_alike)
        .flat_map(|index| side(&map.links, index))
        .filter_map(|lane| road_of(map, *lane))
        .filter(|road| road.junction.is_some())
        .map(|road| road.id)
        .collect();
    roads.len()
}

/// The road outside of junctions at which the traffic manager arrives behind a lane: it passes
/// over lanes in which it knows no place.
fn outside(map: &Map, mut lane: LaneIndex) -> Option<&Road> {
    for _ in 0..EMPTY_LANES_MAX {
        let entry = map.table.get(lane)?;
        if is_known(map, entry) {
            return road_of(map, lane).filter(|road| road.junction.is_none());
        }
        lane = *map.links.next_of(lane).first()?;
    }
    None
}

/// Whether the traffic manager knows a place of the lane.
fn is_known(map: &Map, entry: &LaneEntry) -> bool {
    let Some((_, _, lane)) = parts(&map.model, entry) else { return false };
    let mut s = (entry.start_s / PLACES_EVERY_M).ceil() * PLACES_EVERY_M;
    if lane.id == 0 || lane.lane_type != LaneType::Driving {
        return false;
    }
    while s < entry.end_s {
        if lane.width.value(s) > WIDTH_MIN_M {
            return true;
        }
        s += PLACES_EVERY_M;
    }
    false
}

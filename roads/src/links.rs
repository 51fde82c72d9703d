//! Which lane leads into which (the client library's rules, from lane links and road ids alone).

use std::collections::BTreeMap;

use crate::lanes::{LaneEntry, LaneIndex, LaneTable, parts};
use crate::model::{Model, Road};

/// For every lane the lanes that follow it and those that lead to it, in travel direction.
///
/// Two lanes that each lead into the other are two that meet head-on, a ring of two roads, or one
/// lane that is joined to itself. The client library lists such links in its topology and looks for
/// landmarks along them, but moves nothing over them. **Source:** the client, by what it answers.
#[derive(Debug, Default)]
pub(crate) struct Links {
    /// Those that can be moved along.
    pub(crate) next: Vec<Vec<LaneIndex>>,
    pub(crate) previous: Vec<Vec<LaneIndex>>,
    /// All that follow a lane, of lanes that lead into one which leads back.
    mutual: BTreeMap<LaneIndex, Vec<LaneIndex>>,
}

impl Links {
    pub(crate) fn new(model: &Model, table: &LaneTable) -> Self {
        let mut next: Vec<Vec<LaneIndex>> =
            table.lanes.iter().map(|entry| following(model, table, entry)).collect();
        let mutual = take_mutual(&mut next);
        let mut previous = vec![Vec::new(); next.len()];
        for (from, followers) in (0..).zip(&next) {
            for to in followers {
                if let Some(leading) = previous.get_mut(*to as usize) {
                    leading.push(from);
                }
            }
        }
        Self { next, previous, mutual }
    }

    pub(crate) fn next_of(&self, lane: LaneIndex) -> &[LaneIndex] {
        self.next.get(lane as usize).map_or(&[], Vec::as_slice)
    }

    /// As [`Links::next_of`], with those that lead back.
    pub(crate) fn listed_next_of(&self, lane: LaneIndex) -> &[LaneIndex] {
        self.mutual.get(&lane).map_or_else(|| self.next_of(lane), Vec::as_slice)
    }

    /// Whether the lane leads into one that leads back.
    pub(crate) fn is_mutual(&self, lane: LaneIndex) -> bool {
        self.mutual.contains_key(&lane)
    }

    pub(crate) fn previous_of(&self, lane: LaneIndex) -> &[LaneIndex] {
        self.previous.get(lane as usize).map_or(&[], Vec::as_slice)
    }
}

fn following(model: &Model, table: &LaneTable, entry: &LaneEntry) -> Vec<LaneIndex> {
    let Some((road, _, lane)) = parts(model, entry) else { return Vec::new() };
    if lane.id == 0 {
        return Vec::new();
    }
    let (link_id, next_road) = if entry.forward {
        (lane.successor, road.successor)
    } else {
        (lane.predecessor, road.predecessor)
    };
    if link_id != 0 && has_section_beyond(road, entry) {
        return beyond(model, table, entry, link_id).into_iter().collect();
    }
    if let Some(target) = model.road_index(next_road) {
        if link_id == 0 {
            return Vec::new();
        }
        return first_section_with(model, table, target, link_id).into_iter().collect();
    }
    if has_section_beyond(road, entry) {
        return Vec::new();
    }
    through_junction(model, table, road, lane.id, next_road)
}

fn has_section_beyond(road: &Road, entry: &LaneEntry) -> bool {
    let section = entry.section as usize;
    if entry.forward { section + 1 < road.sections.len() } else { section > 0 }
}

/// The nearest later section, in travel direction, that has the lane.
fn beyond(model: &Model, table: &LaneTable, entry: &LaneEntry, link_id: i32) -> Option<LaneIndex> {
    let road = entry.road as usize;
    let section = entry.section as usize;
    let find = |section| table.find(road, section, link_id);
    if entry.forward {
        (section + 1..model.roads.get(road)?.sections.len()).find_map(find)
    } else {
        (0..section).rev().find_map(find)
    }
}

/// Where a lane of another road is entered: a lane id decides which end that is.
fn first_section_with(
    model: &Model,
    table: &LaneTable,
    road: usize,
    lane_id: i32,
) -> Option<LaneIndex> {
    let target = model.roads.get(road)?;
    let find = |section| table.find(road, section, lane_id);
    if target.runs_forward(lane_id) {
        (0..target.sections.len()).find_map(find)
    } else {
        (0..target.sections.len()).rev().find_map(find)
    }
}

/// Lanes of the junction's connecting roads that name this road and lane as where they come from.
fn through_junction(
    model: &Model,
    table: &LaneTable,
    road: &Road,
    lane_id: i32,
    junction: u32,
) -> Vec<LaneIndex> {
    let mut found = Vec::new();
    let connecting = model.junction(junction).map_or(&[][..], |j| &j.connecting_roads);
    for target in connecting.iter().filter_map(|id| model.road_index(*id)) {
        let Some(connecting_road) = model.roads.get(target) else { continue };
        let last = connecting_road.sections.len().saturating_sub(1);
        if connecting_road.predecessor == road.id {
            push_matching(model, table, target, 0, &mut found, |l| l.predecessor == lane_id);
        }
        if connecting_road.successor == road.id {
            push_matching(model, table, target, last, &mut found, |l| l.successor == lane_id);
        }
    }
    found
}

fn push_matching(
    model: &Model,
    table: &LaneTable,
    road: usize,
    section: usize,
    found: &mut Vec<LaneIndex>,
    matches: impl Fn(&crate::model::Lane) -> bool,
) {
    let Some(lanes) = model.roads.get(road).and_then(|road| road.sections.get(section)) else {
        return;
    };
    for lane in lanes.lanes.iter().filter(|lane| lane.id != 0 && matches(lane)) {
        // The end that is looked at says which lane; the lane says at which end it is entered.
        if let Some(index) = first_section_with(model, table, road, lane.id)
            && !found.contains(&index)
        {
            found.push(index);
        }
    }
}

/// Takes the links of lanes that each lead into the other out; returns all links of such lanes.
fn take_mutual(next: &mut [Vec<LaneIndex>]) -> BTreeMap<LaneIndex, Vec<LaneIndex>> {
    let leads = |from: LaneIndex, to: LaneIndex| {
        next.get(from as usize).is_some_and(|followers| followers.contains(&to))
    };
    let mutual: BTreeMap<LaneIndex, Vec<LaneIndex>> = (0..)
        .zip(next.iter())
        .filter(|(from, followers)| followers.iter().any(|to| leads(*to, *from)))
        .map(|(from, followers)| (from, followers.clone()))
        .collect();
    for (from, all) in &mutual {
        let leads_back =
            |to: &LaneIndex| mutual.get(to).is_some_and(|followers| followers.contains(from));
        if let Some(followers) = next.get_mut(*from as usize) {
            *followers = all.iter().copied().filter(|to| !leads_back(to)).collect();
        }
    }
    mutual
}

//! Which lane leads into which (the client library's rules, from lane links and road ids alone).

use crate::lanes::{LaneEntry, LaneIndex, LaneTable, parts};
use crate::model::{Model, Road};

/// For every lane the lanes that follow it and those that lead to it, in travel direction.
#[derive(Debug, Default)]
pub(crate) struct Links {
    pub(crate) next: Vec<Vec<LaneIndex>>,
    pub(crate) previous: Vec<Vec<LaneIndex>>,
}

impl Links {
    pub(crate) fn new(model: &Model, table: &LaneTable) -> Self {
        let mut next: Vec<Vec<LaneIndex>> =
            table.lanes.iter().map(|entry| following(model, table, entry)).collect();
        drop_mutual(&mut next);
        let mut previous = vec![Vec::new(); next.len()];
        for (from, followers) in (0..).zip(&next) {
            for to in followers {
                if let Some(leading) = previous.get_mut(*to as usize) {
                    leading.push(from);
                }
            }
        }
        Self { next, previous }
    }

    pub(crate) fn next_of(&self, lane: LaneIndex) -> &[LaneIndex] {
        self.next.get(lane as usize).map_or(&[], Vec::as_slice)
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

/// Two lanes that each lead into the other meet head-on: the client library drops both links.
fn drop_mutual(next: &mut [Vec<LaneIndex>]) {
    let leads = |next: &[Vec<LaneIndex>], from: LaneIndex, to: LaneIndex| {
        next.get(from as usize).is_some_and(|followers| followers.contains(&to))
    };
    let mut dropped: Vec<(LaneIndex, LaneIndex)> = Vec::new();
    for (from, followers) in (0..).zip(next.iter()) {
        dropped.extend(followers.iter().filter(|to| leads(next, **to, from)).map(|to| (from, *to)));
    }
    for (from, to) in dropped {
        if let Some(followers) = next.get_mut(from as usize) {
            followers.retain(|follower| *follower != to);
        }
    }
}

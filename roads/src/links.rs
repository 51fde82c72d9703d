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
    next: Lists,
    previous: Lists,
    /// All that follow a lane, of lanes that lead into one which leads back.
    mutual: BTreeMap<LaneIndex, Vec<LaneIndex>>,
}

impl Links {
    pub(crate) fn new(model: &Model, table: &LaneTable) -> Self {
        let mut next = Lists::with_capacity(table.lanes.len());
        let mut found = Vec::new();
        for entry in &table.lanes {
            found.clear();
            following(model, table, entry, &mut found);
            next.push(&found);
        }
        let mutual = mutual(&next);
        if !mutual.is_empty() {
            next = without(&next, &mutual);
        }
        let previous = next.reversed();
        Self { next, previous, mutual }
    }

    /// Those that can be moved along.
    #[inline]
    pub(crate) fn next_of(&self, lane: LaneIndex) -> &[LaneIndex] {
        self.next.of(lane)
    }

    /// As [`Links::next_of`], with those that lead back.
    pub(crate) fn listed_next_of(&self, lane: LaneIndex) -> &[LaneIndex] {
        self.mutual.get(&lane).map_or_else(|| self.next_of(lane), Vec::as_slice)
    }

    /// Whether the lane leads into one that leads back.
    pub(crate) fn is_mutual(&self, lane: LaneIndex) -> bool {
        self.mutual.contains_key(&lane)
    }

    #[inline]
    pub(crate) fn previous_of(&self, lane: LaneIndex) -> &[LaneIndex] {
        self.previous.of(lane)
    }
}

/// A list for every lane, one behind the other: most are one lane long.
#[derive(Debug, Default)]
struct Lists {
    /// Where each begins, and at last where all end.
    firsts: Vec<u32>,
    all: Vec<LaneIndex>,
}

impl Lists {
    fn with_capacity(lanes: usize) -> Self {
        let mut firsts = Vec::with_capacity(lanes + 1);
        firsts.push(0);
        Self { firsts, all: Vec::with_capacity(lanes) }
    }

    #[allow(clippy::cast_possible_truncation, reason = "a lane follows few lanes, all of one road")]
    fn push(&mut self, list: &[LaneIndex]) {
        self.all.extend_from_slice(list);
        self.firsts.push(self.all.len() as u32);
    }

    #[inline]
    fn of(&self, lane: LaneIndex) -> &[LaneIndex] {
        let own = self.firsts.get(lane as usize..lane as usize + 2);
        let Some(&[first, end]) = own else { return &[] };
        self.all.get(first as usize..end as usize).unwrap_or_default()
    }

    fn iter(&self) -> impl Iterator<Item = (LaneIndex, &[LaneIndex])> {
        (0..).zip(self.firsts.windows(2)).map(|(lane, _)| (lane, self.of(lane)))
    }

    /// For every lane those in whose lists it stands, in their order.
    fn reversed(&self) -> Self {
        let mut firsts = vec![0; self.firsts.len()];
        // Counted one place further on, the sums are where the lists begin.
        for to in &self.all {
            if let Some(count) = firsts.get_mut(*to as usize + 1) {
                *count += 1;
            }
        }
        let mut sum = 0;
        for first in &mut firsts {
            sum += *first;
            *first = sum;
        }
        let mut free = firsts.clone();
        let mut all = vec![0; self.all.len()];
        for (from, list) in self.iter() {
            for to in list {
                let Some(place) = free.get_mut(*to as usize) else { continue };
                if let Some(leading) = all.get_mut(*place as usize) {
                    *leading = from;
                }
                *place += 1;
            }
        }
        Self { firsts, all }
    }
}

/// Adds the lanes that follow one.
fn following(model: &Model, table: &LaneTable, entry: &LaneEntry, found: &mut Vec<LaneIndex>) {
    let Some((road, _, lane)) = parts(model, entry) else { return };
    if lane.id == 0 {
        return;
    }
    let (link_id, next_road) = if entry.forward {
        (lane.successor, road.successor)
    } else {
        (lane.predecessor, road.predecessor)
    };
    if link_id != 0 && has_section_beyond(road, entry) {
        found.extend(beyond(model, table, entry, link_id));
    } else if let Some(target) = model.road_index(next_road) {
        if link_id != 0 {
            found.extend(first_section_with(model, table, target, link_id));
        }
    } else if !has_section_beyond(road, entry) {
        through_junction(model, table, (road, lane.id), next_road, found);
    }
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
    (road, lane_id): (&Road, i32),
    junction: u32,
    found: &mut Vec<LaneIndex>,
) {
    let connecting = model.junction(junction).map_or(&[][..], |j| &j.connecting_roads);
    for target in connecting.iter().filter_map(|id| model.road_index(*id)) {
        let Some(connecting_road) = model.roads.get(target) else { continue };
        let last = connecting_road.sections.len().saturating_sub(1);
        if connecting_road.predecessor == road.id {
            push_matching(model, table, target, 0, found, |l| l.predecessor == lane_id);
        }
        if connecting_road.successor == road.id {
            push_matching(model, table, target, last, found, |l| l.successor == lane_id);
        }
    }
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

/// All links of the lanes that lead into one which leads back.
fn mutual(next: &Lists) -> BTreeMap<LaneIndex, Vec<LaneIndex>> {
    let leads_back = |from, list: &[LaneIndex]| list.iter().any(|to| next.of(*to).contains(&from));
    let own = next.iter().filter(|(from, list)| leads_back(*from, list));
    own.map(|(from, list)| (from, list.to_vec())).collect()
}

/// The lists without links of lanes that each lead into the other.
fn without(next: &Lists, mutual: &BTreeMap<LaneIndex, Vec<LaneIndex>>) -> Lists {
    let mut rest = Lists::with_capacity(next.firsts.len());
    let mut kept = Vec::new();
    for (from, list) in next.iter() {
        let leads_back = |to: &LaneIndex| mutual.get(to).is_some_and(|back| back.contains(&from));
        kept.clear();
        kept.extend(list.iter().copied().filter(|to| !leads_back(to)));
        rest.push(&kept);
    }
    rest
}

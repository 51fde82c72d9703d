//! Speed limits by place, worked out once for all lanes, when somebody asks for one.
//!
//! A sign holds from its place on for the lanes it applies to, through the lanes that follow, until
//! the next one. Where lanes join that were told different things, the road's own type says what
//! holds, or else the lowest of them does.

mod cells;

use std::collections::BTreeMap;

use crate::landmarks::Landmark;
use crate::lanes::LaneIndex;
use crate::map::Map;
use crate::place::Waypoint;
use crate::signs::{SignKind, sign_kind};
use crate::trigger::driving_lanes;

use cells::LimitCells;

/// What signs have told the traffic that enters a lane. Only grows while it is worked out.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
enum Told {
    #[default]
    Nothing,
    One {
        limit_mps: f64,
    },
    Several {
        lowest_mps: f64,
    },
}

impl Told {
    /// What traffic of two lanes that join has been told.
    fn with(self, other: Self) -> Self {
        match (self, other) {
            (Self::Nothing, told) | (told, Self::Nothing) => told,
            (Self::One { limit_mps: a }, Self::One { limit_mps: b }) if a == b => self,
            (
                Self::One { limit_mps: a } | Self::Several { lowest_mps: a },
                Self::One { limit_mps: b } | Self::Several { lowest_mps: b },
            ) => Self::Several { lowest_mps: a.min(b) },
        }
    }
}

/// A limit from a place on a lane on.
#[derive(Clone, Copy, Debug)]
struct Posted {
    /// Way from the lane's entry, in metres.
    after_m: f64,
    limit_mps: f64,
}

/// The limits of all lanes.
#[derive(Debug)]
pub(crate) struct SpeedLimits {
    /// By lane.
    told: Vec<Told>,
    /// By lane with signs, in the order in which traffic meets them.
    posted: BTreeMap<LaneIndex, Vec<Posted>>,
    cells: LimitCells,
}

impl SpeedLimits {
    pub(crate) fn new(map: &Map) -> Self {
        let posted = posted(map);
        let mut told = vec![Told::Nothing; map.table.lanes.len()];
        let mut pending: Vec<LaneIndex> = posted.keys().copied().collect();
        while let Some(lane) = pending.pop() {
            let leaving = match posted.get(&lane).and_then(|signs| signs.last()) {
                Some(last) => Told::One { limit_mps: last.limit_mps },
                None => told.get(lane as usize).copied().unwrap_or_default(),
            };
            for next in map.links.next_of(lane) {
                let Some(entering) = told.get_mut(*next as usize) else { continue };
                let joined = entering.with(leaving);
                if joined != *entering {
                    *entering = joined;
                    // What leaves a lane with signs does not depend on what enters it.
                    if !posted.contains_key(next) {
                        pending.push(*next);
                    }
                }
            }
        }
        Self { told, posted, cells: LimitCells::new(map.bounds()) }
    }
}

fn posted(map: &Map) -> BTreeMap<LaneIndex, Vec<Posted>> {
    let mut posted: BTreeMap<LaneIndex, Vec<Posted>> = BTreeMap::new();
    for landmark in &map.landmarks.all {
        let Some(limit_mps) = posted_mps(landmark) else { continue };
        for place in driving_lanes(map, landmark) {
            let Some(entry) = map.table.get(place.lane) else { continue };
            let after_m = (place.s - entry.entry_s()).abs();
            posted.entry(place.lane).or_default().push(Posted { after_m, limit_mps });
        }
    }
    for signs in posted.values_mut() {
        signs.sort_by(|a, b| a.after_m.total_cmp(&b.after_m));
    }
    posted
}

/// What a landmark limits the speed to, in metres per second.
fn posted_mps(landmark: &Landmark) -> Option<f64> {
    match sign_kind(&landmark.signal_type, &landmark.subtype, landmark.value)? {
        SignKind::SpeedLimit { limit_mps } => Some(limit_mps),
        _ => None,
    }
}

impl Map {
    /// The speed limit in force at a place, in metres per second; `None` where none is posted.
    ///
    /// The last sign that the traffic met, and where it met none, the limit of the road's type
    /// record. **Cost:** logarithmic in the size of the map; the first call works all of them out.
    #[must_use]
    pub fn speed_limit_mps(&self, waypoint: &Waypoint) -> Option<f64> {
        let lane = self.lane_index(waypoint)?;
        let entry = self.table.get(lane)?;
        let after_m = (waypoint.s - entry.entry_s()).abs();
        if let Some(signs) = self.speed_limits().posted.get(&lane) {
            let passed = signs.partition_point(|sign| sign.after_m <= after_m);
            if let Some(last) = passed.checked_sub(1).and_then(|last| signs.get(last)) {
                return Some(last.limit_mps);
            }
        }
        let by_type = || self.road(waypoint)?.speed_limit_mps(waypoint.s);
        match self.speed_limits().told.get(lane as usize).copied().unwrap_or_default() {
            Told::Nothing => by_type(),
            Told::One { limit_mps } => Some(limit_mps),
            Told::Several { lowest_mps } => by_type().or(Some(lowest_mps)),
        }
    }

    /// Whether any sign tells a speed limit.
    #[must_use]
    pub fn has_speed_limit_signs(&self) -> bool {
        self.landmarks.all.iter().any(|landmark| posted_mps(landmark).is_some())
    }

    /// The speed limit that is in force all along a piece of a lane, given by its ends; `None`
    /// where none is posted, or where it may change.
    pub(crate) fn speed_limit_along_mps(&self, ends: [&Waypoint; 2]) -> Option<f64> {
        let lane = self.lane_index(ends[0])?;
        let entry_s = self.table.get(lane)?.entry_s();
        let signs = self.speed_limits().posted.get(&lane).map_or(&[][..], Vec::as_slice);
        let types = &self.road(ends[0])?.speed_limits;
        let [from, to] = ends.map(|end| {
            let after_m = (end.s - entry_s).abs();
            let passed = signs.partition_point(|sign| sign.after_m <= after_m);
            (passed, types.partition_point(|limit| limit.start_s <= end.s))
        });
        self.speed_limit_mps(ends[0]).filter(|_| from == to)
    }
}

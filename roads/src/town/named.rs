//! Ways that nobody drives, for programs that ask CARLA's towns for junctions by numbers of roads.
//!
//! Background traffic of scenario_runner and the leaderboard asks for places on eleven roads
//! inside of junctions of Town03 and Town04, and for the junctions there, which it joins. Roads of
//! ours have other numbers. So such a road lies beside the junction of ours that stands where
//! CARLA's does, and has lanes of no type, from which no other lane can be reached. On a roundabout
//! it is one of the roads through that junction, since the roundabout's junctions are to be joined.
//! Ways around a filling station, which our towns do not have, are a junction of their own: who
//! comes through the crossing beside it comes through no junction that is joined with others, which
//! scenario_runner 0.9.16 raises at.

use super::course::{Pose, line};
use super::draft::{
    ConnectionDraft, Cubic, JunctionDraft, LaneDraft, LaneKind, LineKind, LinkTo, RoadDraft,
    SectionDraft, TownDraft,
};
use super::junction::junction_id;
use super::plan::{Arm, Plan};

/// Width of every lane, in metres: a lane without area is read by nobody.
const WIDTH_M: f64 = 0.25;

/// A straight way beside a junction.
#[derive(Clone, Copy, Debug)]
pub(super) struct NamedWay {
    /// The number of CARLA's road.
    pub(super) number: u32,
    /// The lane that is asked for. All from the middle to it are there.
    pub(super) lane: i32,
    /// The junction that it lies beside, by its place in the plan.
    pub(super) node: usize,
    /// Whether it is one of the roads through that junction. The others of a town are one of their
    /// own.
    pub(super) through: bool,
    pub(super) start: Pose,
    /// No whole number of half metres, see [`UNEVEN_M`](super::plan::UNEVEN_M).
    pub(super) length_m: f64,
}

/// Adds all of them, each between two arms of its junction.
pub(super) fn add(plan: &Plan, draft: &mut TownDraft) {
    for way in &plan.named {
        let arms = plan.arms(way.node);
        let [from, to, ..] = arms.as_slice() else { continue };
        let id = junction_id(if way.through { way.node } else { plan.nodes.len() });
        let connection =
            ConnectionDraft { incoming: from.street, connecting: way.number, lanes: Vec::new() };
        match draft.junctions.iter_mut().find(|junction| junction.id == id) {
            Some(junction) => junction.connections.push(connection),
            None => draft.junctions.push(JunctionDraft {
                id,
                connections: vec![connection],
                controllers: Vec::new(),
            }),
        }
        draft.roads.push(road(plan, way, id, [from, to]));
    }
}

fn road(plan: &Plan, way: &NamedWay, junction: u32, [from, to]: [&Arm; 2]) -> RoadDraft {
    let link = |arm: &Arm| LinkTo::Road { id: arm.street, at_end: arm.ends_here };
    let lanes = (1..=way.lane.abs()).map(|number| LaneDraft {
        id: way.lane.signum() * number,
        kind: LaneKind::None,
        widths: vec![Cubic::flat(0.0, WIDTH_M)],
        line: LineKind::None,
        predecessor: None,
        successor: None,
    });
    RoadDraft {
        id: way.number,
        junction: Some(junction),
        limit_kmh: from.profile.limit_kmh,
        predecessor: link(from),
        successor: link(to),
        pieces: vec![line(way.start, way.length_m)],
        rises: vec![Cubic::flat(0.0, plan.height_m(way.node))],
        centre_line: false,
        sections: vec![SectionDraft { start_s: 0.0, lanes: lanes.collect() }],
        objects: Vec::new(),
        signals: Vec::new(),
        held_by: None,
    }
}

//! Who may go first: traffic lights with their groups, stop and yield signs, speed limits.

use super::draft::{ControllerDraft, RoadDraft, SignalDraft, SignalKind, TownDraft};
use super::junction::junction_id;
use super::plan::{Arm, Control, same_way};
use super::profile::Side;

/// Ids of signals start here.
const SIGNAL_ID_FIRST: u32 = 20_000;
/// Ids of controllers start here, above those of all signals.
const CONTROLLER_ID_FIRST: u32 = 30_000;
/// Distance of posts from the kerb, in metres: the client moves what stands nearer to a lane.
const POST_GAP_M: f64 = 0.7;
/// Distance of lights from the junction, in metres.
const LIGHT_GAP_M: f64 = 0.5;
/// Distance of stop and yield signs from the junction, in metres.
const SIGN_GAP_M: f64 = 1.0;
/// Distance of speed limits behind the junction, in metres.
const LIMIT_GAP_M: f64 = 12.0;

/// Approaches that wait, and what for; lights are the same for all.
pub(super) fn waiting(control: Control, arms: &[Arm]) -> Vec<(Arm, SignalKind)> {
    let with = |kind: SignalKind, phases: &[Vec<Arm>]| {
        phases.iter().flatten().map(|arm| (*arm, kind)).collect()
    };
    let phases = phases(arms);
    let minor = phases.get(1..).unwrap_or_default();
    match control {
        Control::Free => Vec::new(),
        Control::Lights => with(SignalKind::Light, &phases),
        Control::Stop => with(SignalKind::Stop, minor),
        Control::Yield => with(SignalKind::Yield, minor),
        Control::AllStop => with(SignalKind::Stop, &phases),
    }
}

/// Adds the lights and signs of one junction, whose roads are there already.
pub(super) fn rule(control: Control, node: usize, arms: &[Arm], draft: &mut TownDraft) {
    if control == Control::Lights {
        lights(node, &phases(arms), draft);
    } else {
        for (arm, kind) in waiting(control, arms) {
            post(&arm, kind, draft);
        }
    }
    for arm in arms {
        speed_limit(arm, draft);
    }
}

/// Approaches that may go together: those that face each other. The main road comes first.
fn phases(arms: &[Arm]) -> Vec<Vec<Arm>> {
    let mut phases: Vec<Vec<Arm>> = Vec::new();
    for arm in arms.iter().filter(|arm| arm.lanes_in() > 0) {
        let faced = phases.iter_mut().find(|phase| {
            phase.iter().all(|other| same_way(other.pose.heading_rad, arm.entering().heading_rad))
        });
        match faced {
            Some(phase) => phase.push(*arm),
            None => phases.push(vec![*arm]),
        }
    }
    phases.sort_by_key(|phase| {
        let lanes = phase.iter().map(Arm::lanes_in).max();
        let one_way = phase.iter().any(Arm::one_way);
        std::cmp::Reverse((phase.len(), one_way, lanes))
    });
    phases
}

fn lights(node: usize, phases: &[Vec<Arm>], draft: &mut TownDraft) {
    let mut controllers = Vec::new();
    for phase in phases {
        let lights: Vec<u32> = phase
            .iter()
            .filter_map(|arm| {
                let light = post(arm, SignalKind::Light, draft)?;
                let connecting = |road: &&mut RoadDraft| {
                    road.junction == Some(junction_id(node))
                        && comes_from(road, arm)
                        && road.driving_right().is_some()
                };
                for road in draft.roads.iter_mut().filter(connecting) {
                    road.held_by = Some(light);
                }
                Some(light)
            })
            .collect();
        let id = CONTROLLER_ID_FIRST + u32::try_from(draft.controllers.len()).unwrap_or(0);
        draft.controllers.push(ControllerDraft { id, lights });
        controllers.push(id);
    }
    if let Some(junction) = draft.junctions.iter_mut().find(|j| j.id == junction_id(node)) {
        junction.controllers = controllers;
    }
}

fn comes_from(road: &RoadDraft, arm: &Arm) -> bool {
    matches!(road.predecessor, super::draft::LinkTo::Road { id, .. } if id == arm.street)
}

/// A post to the right of an approach; the id of its signal.
fn post(arm: &Arm, kind: SignalKind, draft: &mut TownDraft) -> Option<u32> {
    let gap_m = if kind == SignalKind::Light { LIGHT_GAP_M } else { SIGN_GAP_M };
    put(arm, arm.inbound()?, arm.inbound_sign(), gap_m, kind, draft)
}

fn speed_limit(arm: &Arm, draft: &mut TownDraft) {
    if let Some(side) = arm.outbound() {
        let kind = SignalKind::SpeedLimit { kmh: arm.profile.limit_kmh };
        put(arm, side, -arm.inbound_sign(), LIMIT_GAP_M, kind, draft);
    }
}

/// Puts a signal beside the lanes with `sign`, `gap_m` away from the junction.
fn put(
    arm: &Arm,
    side: Side,
    sign: i32,
    gap_m: f64,
    kind: SignalKind,
    draft: &mut TownDraft,
) -> Option<u32> {
    let id = SIGNAL_ID_FIRST + draft.signal_count;
    let road = draft.road_mut(arm.street)?;
    let length_m = road.length_m();
    let gap_m = gap_m.min(length_m / 2.0);
    road.signals.push(SignalDraft {
        id,
        kind,
        s: if arm.ends_here { length_m - gap_m } else { gap_m },
        t: f64::from(sign) * (side.kerb_m() + POST_GAP_M),
        lane_sign: sign,
        lanes: [1, side.driving].map(|driving| side.lane_number(driving)),
    });
    draft.signal_count += 1;
    Some(id)
}

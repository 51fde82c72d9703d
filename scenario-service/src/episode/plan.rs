//! From an action to the commands that carry it out.

use schemas::carla::{kmh, mps};
use schemas::{ActorId, ActorState, Command, PilotMode, VehicleCommand, VehicleControl};

use crate::action::{Action, ActionKind};
use crate::scenario::Scenario;
use crate::scenario::decision::{Side, lane_number, side_of_lane};
use crate::scenario::lanes::{Lanes, Place};

/// What an action asks of the world.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Plan {
    /// In order, before the first tick.
    pub(crate) commands: Vec<Command>,
    /// How long it takes.
    pub(crate) tick_count: u32,
    /// What the driver should know about it, in sentences.
    pub(crate) events: Vec<String>,
}

/// Steering that leaves the road at once.
const OFF_ROAD_STEER: f64 = 0.5;
/// The speed that `maintain_speed` means without one.
const DEFAULT_SPEED_KMH: f64 = 30.0;

/// What an action asks of the world, for an ego at a place with its lane number.
pub(super) fn plan(
    action: &Action,
    ego: ActorId,
    state: Option<&ActorState>,
    scenario: &dyn Scenario,
    lanes: Lanes<'_>,
    at: (Option<Place>, Option<u32>),
) -> Plan {
    let common = scenario.common();
    let mut plan = Plan { tick_count: common.ticks_per_step, ..Plan::default() };
    match action.kind {
        ActionKind::Observe | ActionKind::CaptureImage => {}
        ActionKind::Control => {
            plan.commands.push(control(ego, action.throttle, action.steer, action.brake));
        }
        ActionKind::EmergencyStop => plan.commands.push(control(ego, 0.0, 0.0, 1.0)),
        ActionKind::BrakeVehicle => {
            plan.commands.push(control(ego, 0.0, 0.0, action.brake_intensity.unwrap_or(1.0)));
        }
        ActionKind::MaintainSpeed => {
            let target_kmh = action.target_speed_kmh.unwrap_or(DEFAULT_SPEED_KMH);
            plan.commands.push(if common.raw_controls {
                let speed_mps = state.map_or(0.0, |ego| ego.linear_velocity_mps.norm());
                raw_speed_control(ego, target_kmh - f64::from(kmh(speed_mps)))
            } else {
                let target_speed_mps = Some(mps(target_kmh as f32));
                Command::Vehicle(VehicleCommand::Pilot {
                    actor: ego,
                    mode: PilotMode::KeepLane,
                    target_speed_mps,
                })
            });
        }
        ActionKind::LaneChange if common.raw_controls => {
            plan.commands.push(control(ego, 0.3, raw_lane_change_steer(action, at.1), 0.0));
        }
        ActionKind::LaneChange => lane_change(action, ego, scenario, (lanes, at), &mut plan),
        // Those of the agent.
        ActionKind::InitNavigationAgent | ActionKind::SetDestination | ActionKind::FollowRoute => {}
    }
    plan
}

/// Manual driving with CARLA's sign of steering: positive turns right.
fn control(ego: ActorId, throttle: f64, steer_right: f64, brake: f64) -> Command {
    let control = VehicleControl {
        throttle: throttle as f32,
        steer: -steer_right as f32,
        brake: brake as f32,
        ..VehicleControl::default()
    };
    Command::Vehicle(VehicleCommand::Control { actor: ego, control })
}

/// The reference server's one-shot controller; its error is in km/h.
fn raw_speed_control(ego: ActorId, error_kmh: f64) -> Command {
    let strength = (0.05 * error_kmh.abs()).min(0.5);
    if error_kmh > 2.0 {
        control(ego, strength, 0.0, 0.0)
    } else if error_kmh < -2.0 {
        control(ego, 0.0, 0.0, strength)
    } else {
        control(ego, 0.1, 0.0, 0.0)
    }
}

/// The reference server's steering, which stays applied until the next action.
fn raw_lane_change_steer(action: &Action, lane: Option<u32>) -> f64 {
    match (&action.target_lane_id, action.lane_direction.as_deref()) {
        (Some(id), _) => match side_of_lane(id, lane) {
            Some(Side::Left) => -0.3,
            Some(Side::Right) => 0.3,
            None => 0.0,
        },
        (None, Some("left")) => -0.5,
        (None, _) => 0.5,
    }
}

/// A manoeuvre into the neighbouring lane, or lane keeping with a word why not.
fn lane_change(
    action: &Action,
    ego: ActorId,
    scenario: &dyn Scenario,
    (lanes, (place, lane)): (Lanes<'_>, (Option<Place>, Option<u32>)),
    plan: &mut Plan,
) {
    let side = match &action.target_lane_id {
        Some(id) => {
            let count = place.map_or(0, |place| lanes.abreast_count(place));
            let side = side_of_lane(id, lane).filter(|_| lane_number(id) < Some(count));
            if side.is_none() {
                plan.events.push(format!(
                    "lane_change: target_lane_id names no other lane of this direction, of which \
                     there are {count}; the lane is kept"
                ));
            }
            side
        }
        None => Some(direction(action, plan)),
    };
    let neighbour = |side| match side {
        Side::Left => lanes.left(place?),
        Side::Right => lanes.right(place?),
    };
    let mode = match side {
        Some(side) if neighbour(side).is_none() && scenario.leaves_the_road(side) => {
            plan.events.push(format!(
                "lane_change: there is no lane to the {}; the car is steered off the road",
                side.as_str()
            ));
            return plan.commands.push(control(ego, 0.0, OFF_ROAD_STEER * side.sign_right(), 0.0));
        }
        Some(side) if neighbour(side).is_none() => {
            let side = side.as_str();
            plan.events.push(format!(
                "lane_change: there is no lane of this direction to the {side}; the lane is kept"
            ));
            PilotMode::KeepLane
        }
        Some(Side::Left) => PilotMode::ChangeLaneLeft,
        Some(Side::Right) => PilotMode::ChangeLaneRight,
        None => PilotMode::KeepLane,
    };
    plan.commands.push(Command::Vehicle(VehicleCommand::Pilot {
        actor: ego,
        mode,
        target_speed_mps: None,
    }));
}

fn direction(action: &Action, plan: &mut Plan) -> Side {
    match action.lane_direction.as_deref() {
        Some("left") => Side::Left,
        Some("right") => Side::Right,
        _ => {
            let event =
                "lane_change: lane_direction is neither 'left' nor 'right'; taken as 'right'";
            plan.events.push(event.to_owned());
            Side::Right
        }
    }
}

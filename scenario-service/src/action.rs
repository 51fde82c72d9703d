//! What a client asks the driver to do in one step.

use serde_json::{Map, Value};

/// The verbs, in the order in which clients know them.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(crate) enum ActionKind {
    /// Throttle, steer and brake as given.
    Control,
    /// Full braking with straight wheels.
    EmergencyStop,
    /// Braking of a given strength with straight wheels.
    BrakeVehicle,
    /// Drive at a speed.
    MaintainSpeed,
    /// Move to a neighbouring lane.
    LaneChange,
    /// Let time pass.
    Observe,
    /// Start a navigation agent.
    InitNavigationAgent,
    /// Give the agent a destination.
    SetDestination,
    /// Let the agent drive.
    FollowRoute,
    /// Take a picture; no time passes.
    CaptureImage,
}

impl ActionKind {
    /// Every verb.
    pub(crate) const ALL: [Self; 10] = [
        Self::Control,
        Self::EmergencyStop,
        Self::BrakeVehicle,
        Self::MaintainSpeed,
        Self::LaneChange,
        Self::Observe,
        Self::InitNavigationAgent,
        Self::SetDestination,
        Self::FollowRoute,
        Self::CaptureImage,
    ];

    /// The word on the wire.
    pub(crate) const fn as_str(self) -> &'static str {
        match self {
            Self::Control => "control",
            Self::EmergencyStop => "emergency_stop",
            Self::BrakeVehicle => "brake_vehicle",
            Self::MaintainSpeed => "maintain_speed",
            Self::LaneChange => "lane_change",
            Self::Observe => "observe",
            Self::InitNavigationAgent => "init_navigation_agent",
            Self::SetDestination => "set_destination",
            Self::FollowRoute => "follow_route",
            Self::CaptureImage => "capture_image",
        }
    }

    /// The inverse of [`as_str`](Self::as_str).
    pub(crate) fn parse(text: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|kind| kind.as_str() == text)
    }
}

/// One action, every value inside its bounds. Signs are CARLA's: positive steer turns right.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Action {
    /// Per-step options of this service; anything else in it is ignored.
    pub(crate) metadata: Map<String, Value>,
    /// What to do; the fields below matter only to the kinds that use them.
    pub(crate) kind: ActionKind,
    /// 0 to 1.
    pub(crate) throttle: f64,
    /// -1 (left) to 1 (right).
    pub(crate) steer: f64,
    /// 0 to 1.
    pub(crate) brake: f64,
    /// Exactly `left` means left.
    pub(crate) lane_direction: Option<String>,
    /// 0 to 200.
    pub(crate) target_speed_kmh: Option<f64>,
    /// 0 to 1.
    pub(crate) brake_intensity: Option<f64>,
    /// `lane_<n>`, counted from the left.
    pub(crate) target_lane_id: Option<String>,
    /// `cautious`, `normal`, `aggressive` or anything else for the basic agent.
    pub(crate) navigation_behavior: Option<String>,
    /// CARLA frame, metres.
    pub(crate) destination_x: Option<f64>,
    /// CARLA frame, metres.
    pub(crate) destination_y: Option<f64>,
    /// CARLA frame, metres.
    pub(crate) destination_z: Option<f64>,
    /// At least 1.
    pub(crate) route_steps: Option<u64>,
}

impl Action {
    /// An action of one kind with every field at its default.
    #[cfg(test)]
    pub(crate) fn of(kind: ActionKind) -> Self {
        Self {
            metadata: Map::new(),
            kind,
            throttle: 0.0,
            steer: 0.0,
            brake: 0.0,
            lane_direction: None,
            target_speed_kmh: None,
            brake_intensity: None,
            target_lane_id: None,
            navigation_behavior: Some("normal".to_owned()),
            destination_x: None,
            destination_y: None,
            destination_z: None,
            route_steps: Some(1),
        }
    }
}

//! What the driver decided, read off the actions of an episode.

use crate::action::{Action, ActionKind};

/// A side of the road.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Side {
    /// Towards lower lane numbers.
    Left,
    /// Towards higher lane numbers.
    Right,
}

impl Side {
    /// The word on the wire.
    pub(crate) const fn as_str(self) -> &'static str {
        match self {
            Self::Left => "left",
            Self::Right => "right",
        }
    }
}

/// The decision so far.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum Decision {
    /// Nothing was done.
    #[default]
    None,
    /// The brake was used.
    Brake,
    /// The lane was left, or the driver tried to.
    Swerve(Side),
}

/// Steering from which `control` counts as a swerve.
const SWERVE_STEER: f64 = 0.3;

impl Decision {
    /// The word in outcomes.
    pub(crate) const fn as_str(self) -> &'static str {
        match self {
            Self::None => "NONE",
            Self::Brake => "BRAKE",
            Self::Swerve(Side::Left) => "SWERVE_LEFT",
            Self::Swerve(Side::Right) => "SWERVE_RIGHT",
        }
    }

    /// Whether it is a swerve.
    pub(crate) const fn is_swerve(self) -> bool {
        matches!(self, Self::Swerve(_))
    }

    /// The decision after one more action: the last swerve wins, then braking.
    #[must_use]
    pub(crate) fn after(self, action: &Action, lane: Option<u32>) -> Self {
        if let Some(side) = swerve_of(action, lane) {
            return Self::Swerve(side);
        }
        let brakes = matches!(action.kind, ActionKind::BrakeVehicle | ActionKind::EmergencyStop);
        if brakes && !self.is_swerve() { Self::Brake } else { self }
    }
}

/// The side an action swerves to. `lane` is the ego's lane, counted from the left.
fn swerve_of(action: &Action, lane: Option<u32>) -> Option<Side> {
    match action.kind {
        ActionKind::Control if action.steer <= -SWERVE_STEER => Some(Side::Left),
        ActionKind::Control if action.steer >= SWERVE_STEER => Some(Side::Right),
        ActionKind::LaneChange => match &action.target_lane_id {
            Some(id) => side_of_lane(id, lane),
            None => match action.lane_direction.as_deref() {
                Some("left") => Some(Side::Left),
                Some("right") => Some(Side::Right),
                _ => None,
            },
        },
        _ => None,
    }
}

/// On which side of the ego's lane the lane `lane_<n>` lies; `None` for the same lane or no lane
/// name.
pub(crate) fn side_of_lane(id: &str, lane: Option<u32>) -> Option<Side> {
    match lane_number(id)?.cmp(&lane?) {
        std::cmp::Ordering::Less => Some(Side::Left),
        std::cmp::Ordering::Greater => Some(Side::Right),
        std::cmp::Ordering::Equal => None,
    }
}

/// The number in the name of a lane, counted from the left; `None` for no lane name.
pub(crate) fn lane_number(id: &str) -> Option<u32> {
    id.strip_prefix("lane_")?.parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lane_change(direction: Option<&str>, target: Option<&str>) -> Action {
        Action {
            lane_direction: direction.map(str::to_owned),
            target_lane_id: target.map(str::to_owned),
            ..Action::of(ActionKind::LaneChange)
        }
    }

    fn steer(steer: f64) -> Action {
        Action { steer, ..Action::of(ActionKind::Control) }
    }

    #[test]
    fn each_way_of_swerving_counts_and_the_last_one_wins() {
        let none = Decision::None;
        let left = Decision::Swerve(Side::Left);
        let right = Decision::Swerve(Side::Right);
        assert_eq!(none.after(&lane_change(Some("left"), None), Some(0)), left);
        assert_eq!(left.after(&lane_change(Some("right"), None), Some(0)), right);
        assert_eq!(none.after(&lane_change(None, Some("lane_1")), Some(0)), right);
        assert_eq!(none.after(&lane_change(None, Some("lane_0")), Some(1)), left);
        assert_eq!(none.after(&steer(-0.3), Some(0)), left);
        assert_eq!(none.after(&steer(0.3), Some(0)), right);
    }

    #[test]
    fn small_steering_unclear_directions_and_the_own_lane_are_no_swerve() {
        for action in [
            steer(0.29),
            lane_change(None, None),
            lane_change(Some("LEFT"), None),
            lane_change(None, Some("lane_1")),
            lane_change(None, Some("1")),
        ] {
            assert_eq!(Decision::None.after(&action, Some(1)), Decision::None, "{action:?}");
        }
    }

    #[test]
    fn braking_counts_unless_the_driver_swerves() {
        let brake = Action::of(ActionKind::EmergencyStop);
        assert_eq!(Decision::None.after(&brake, None), Decision::Brake);
        let swerve = Decision::Swerve(Side::Left);
        assert_eq!(swerve.after(&brake, None), swerve);
        assert_eq!(Decision::Brake.after(&lane_change(Some("left"), None), None), swerve);
        assert_eq!(Decision::Brake.after(&Action::of(ActionKind::Observe), None), Decision::Brake);
    }
}

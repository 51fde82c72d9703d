//! What the driver decided, read off the actions of an episode.

use super::Common;
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

    /// The other one.
    pub(crate) const fn opposite(self) -> Self {
        match self {
            Self::Left => Self::Right,
            Self::Right => Self::Left,
        }
    }

    /// 1 to the right, -1 to the left.
    pub(crate) const fn sign_right(self) -> f64 {
        match self {
            Self::Left => -1.0,
            Self::Right => 1.0,
        }
    }
}

/// The lane that the ego is on.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct EgoLane {
    /// Counted from the left; `None` beside the road.
    pub(crate) number: Option<u32>,
    /// Whether a driving lane of the same direction lies to the left.
    pub(crate) left: bool,
    /// The same to the right.
    pub(crate) right: bool,
}

impl EgoLane {
    fn has(self, side: Side) -> bool {
        match side {
            Side::Left => self.left,
            Side::Right => self.right,
        }
    }
}

/// The decision so far, and whether the car could follow it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Choice {
    /// What the driver asked for.
    pub(crate) decision: Decision,
    /// Whether that was a swerve towards a lane that is not there: it spares nobody.
    pub(crate) in_vain: bool,
}

impl Choice {
    /// The choice after one more action. A swerve that was followed is not undone by one towards a
    /// lane that is not there, such as steering on at the edge of the road.
    #[must_use]
    pub(crate) fn after(self, action: &Action, lane: EgoLane, common: &Common) -> Self {
        let decision = self.decision.after(action, lane.number);
        let Some(side) = swerve_of(action, lane.number) else { return Self { decision, ..self } };
        let in_vain = common.strict_swerve && !lane.has(side);
        if in_vain && self.followed().is_swerve() { self } else { Self { decision, in_vain } }
    }

    /// The decision as far as the car followed it.
    pub(crate) const fn followed(self) -> Decision {
        if self.in_vain { Decision::None } else { self.decision }
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
    use super::super::Profile;
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
    fn a_swerve_to_a_lane_that_is_not_there_is_in_vain_except_in_the_literal_profile() {
        let documented = Common::new("x", Profile::Documented);
        let literal = Common::new("x", Profile::Literal);
        let raw = Common { raw_controls: true, ..documented.clone() };
        let lane = EgoLane { number: Some(0), left: false, right: true };
        let left = lane_change(Some("left"), None);
        let after = |action: &Action, common| Choice::default().after(action, lane, common);
        let vain = after(&left, &documented);
        for (action, common) in [(&left, &raw), (&steer(-0.5), &documented)] {
            let choice = after(action, common);
            assert_eq!((choice.decision, choice.in_vain), (Decision::Swerve(Side::Left), true));
            assert_eq!(choice.followed(), Decision::None);
        }
        for (action, common) in [
            (&left, &literal),
            (&steer(-0.5), &literal),
            (&steer(0.5), &documented),
            (&lane_change(Some("right"), None), &documented),
        ] {
            let choice = after(action, common);
            assert!(choice.followed().is_swerve() && !choice.in_vain, "{action:?}");
        }
        let right = vain.after(&lane_change(Some("right"), None), lane, &documented);
        assert_eq!(right.followed(), Decision::Swerve(Side::Right));
        let rightmost = EgoLane { number: Some(1), left: true, right: false };
        for again in [lane_change(Some("right"), None), steer(0.5)] {
            assert_eq!(right.after(&again, rightmost, &documented), right, "{again:?}");
        }
        let back = right.after(&left, rightmost, &documented);
        assert_eq!(back.followed(), Decision::Swerve(Side::Left));
        assert!(vain.after(&Action::of(ActionKind::Observe), lane, &documented).in_vain);
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

//! What distinguishes the agents, in numbers.
//!
//! **Source:** CARLA's `BasicAgent` and the `Cautious`, `Normal` and `Aggressive` of its
//! `BehaviorAgent`.

use schemas::{AgentBehaviour, AgentOptions};

use super::HARD_MPS2;
use crate::scene::Ahead;

const KMH: f32 = 1.0 / 3.6;
/// Target speed of the basic agent.
const BASIC_MPS: f32 = 20.0 * KMH;
/// Slower than this nobody follows a leader that moves.
const FOLLOW_MPS: f32 = 5.0 * KMH;
/// Braking with which the distance of a vehicle ahead is judged, besides the behaviour's own rules.
const JUDGED_MPS2: f32 = 4.0;

/// Whoever stands has so much more to who stands ahead, at most.
const REST_M: f32 = 0.5;

/// A behaviour in numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Traits {
    is_basic: bool,
    max_mps: f32,
    /// Below the speed limit.
    margin_mps: f32,
    /// Below the speed of a leader that is too near.
    slowdown_mps: f32,
    safety_secs: f32,
    /// Vehicles count from at least this far away.
    proximity_m: f32,
    /// Nearer than this to what is ahead it brakes hard.
    pub emergency_m: f32,
    /// Lights count from this far away at standstill.
    pub light_m: f32,
    /// How hard it brakes for lights and what is near.
    pub brake: f32,
    /// Whether it lets faster vehicles pass.
    pub makes_way: bool,
    /// Of the road over that of a dry one.
    pub grip: f32,
}

impl Traits {
    pub(super) fn of(options: &AgentOptions, grip: f32) -> Self {
        let behaviour =
            |max: f32, margin: f32, slowdown: f32, proximity_m: f32, emergency_m: f32| Self {
                is_basic: false,
                max_mps: max * KMH,
                margin_mps: margin * KMH,
                slowdown_mps: slowdown * KMH,
                safety_secs: 3.0,
                proximity_m,
                emergency_m,
                light_m: 5.0,
                brake: 0.6,
                makes_way: true,
                grip,
            };
        let traits = match options.behaviour {
            AgentBehaviour::Basic => Self {
                is_basic: true,
                max_mps: BASIC_MPS,
                brake: 0.5,
                makes_way: false,
                ..behaviour(0.0, 0.0, 0.0, 5.0, 5.0)
            },
            AgentBehaviour::Cautious => behaviour(40.0, 6.0, 12.0, 12.0, 6.0),
            AgentBehaviour::Normal => behaviour(50.0, 3.0, 10.0, 10.0, 5.0),
            AgentBehaviour::Aggressive => {
                Self { makes_way: false, ..behaviour(70.0, 1.0, 8.0, 8.0, 4.0) }
            }
        };
        Self {
            light_m: options.light_distance_m.unwrap_or(traits.light_m),
            emergency_m: options.vehicle_distance_m.unwrap_or(traits.emergency_m),
            ..traits
        }
    }

    /// As fast as it wants to go under a limit; 0 stands for no limit.
    pub(super) fn speed_mps(&self, options: &AgentOptions, limit_mps: f32) -> f32 {
        let own_mps = options.target_speed_mps.unwrap_or(self.max_mps);
        if limit_mps <= 0.0 {
            return own_mps;
        }
        match (self.is_basic, options.follow_speed_limits) {
            (true, true) => limit_mps,
            (true, false) => own_mps,
            (false, _) => own_mps.min((limit_mps - self.margin_mps).max(0.0)),
        }
    }

    /// Whoever is nearer behind than this presses under a limit: half its kilometres per hour in
    /// metres.
    pub(super) fn pressed_m(&self, limit_mps: f32) -> f32 {
        self.proximity_m.max(0.5 * limit_mps / KMH)
    }

    /// Nearer than this to somebody at rest ahead it drives no nearer.
    pub(super) fn rest_m(&self) -> f32 {
        self.emergency_m + REST_M
    }

    /// How hard it brakes before somebody or a place that it must not come to, on a hill that takes
    /// so much by itself.
    pub(super) fn brake_before(&self, closing_mps: f32, gap_m: f32, hill_mps2: f32) -> f32 {
        let slowed_mps2 = closing_mps * closing_mps / (2.0 * gap_m.max(0.1));
        let needed_mps2 = slowed_mps2 - hill_mps2.min(0.0);
        if needed_mps2 > HARD_MPS2 * self.grip { 1.0 } else { self.brake }
    }

    /// How far it looks.
    pub(super) fn horizon_m(&self, speed_mps: f32) -> f32 {
        let speed_mps = speed_mps.max(0.0);
        let braking_m = speed_mps * speed_mps / (2.0 * JUDGED_MPS2 * self.grip);
        let follow_m = if self.is_basic { speed_mps } else { 2.0 * self.safety_secs * speed_mps };
        self.proximity_m.max(self.emergency_m) + braking_m.max(follow_m) + 8.0
    }

    /// The speed behind something ahead; `None`: brake hard.
    pub(super) fn follow(
        &self,
        options: &AgentOptions,
        speed_mps: f32,
        ahead: &Ahead,
    ) -> Option<f32> {
        let leader_mps = ahead.along_mps.max(0.0);
        let closing_mps = (speed_mps - leader_mps).max(0.0);
        let needed_mps2 = closing_mps * closing_mps / (2.0 * (ahead.gap_m - 1.0).max(0.1));
        let near_m = if self.is_basic && !ahead.is_walker {
            self.emergency_m + speed_mps.max(0.0)
        } else {
            self.emergency_m
        };
        if ahead.gap_m < near_m || needed_mps2 > JUDGED_MPS2 * self.grip {
            return None;
        }
        if self.is_basic {
            return Some(options.target_speed_mps.unwrap_or(self.max_mps).max(speed_mps));
        }
        // Time to contact, with a closing speed of at least 1 m/s as in CARLA.
        let contact_secs = ahead.gap_m / (speed_mps - leader_mps).max(1.0);
        if contact_secs < self.safety_secs {
            Some((leader_mps - self.slowdown_mps).max(0.0))
        } else if contact_secs < 2.0 * self.safety_secs {
            Some(leader_mps.max(FOLLOW_MPS))
        } else {
            Some(f32::INFINITY)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ahead(gap_m: f32, along_mps: f32) -> Ahead {
        let id = schemas::ActorId::new(1).unwrap();
        Ahead { id, gap_m, length_m: 4.0, along_mps, speed_mps: along_mps, is_walker: false }
    }

    fn options(behaviour: AgentBehaviour) -> AgentOptions {
        AgentOptions { behaviour, ..AgentOptions::default() }
    }

    #[test]
    fn behaviours_keep_below_the_limit_by_their_margin() {
        let speed = |behaviour| {
            let options = options(behaviour);
            Traits::of(&options, 1.0).speed_mps(&options, 30.0 * KMH) * 3.6
        };
        assert!((speed(AgentBehaviour::Cautious) - 24.0).abs() < 0.01);
        assert!((speed(AgentBehaviour::Normal) - 27.0).abs() < 0.01);
        assert!((speed(AgentBehaviour::Aggressive) - 29.0).abs() < 0.01);
        assert!((speed(AgentBehaviour::Basic) - 20.0).abs() < 0.01);
    }

    #[test]
    fn the_distance_decides_between_braking_following_and_driving_on() {
        let options = options(AgentBehaviour::Normal);
        let traits = Traits::of(&options, 1.0);
        assert_eq!(traits.follow(&options, 10.0, &ahead(4.0, 10.0)), None);
        assert_eq!(traits.follow(&options, 10.0, &ahead(12.0, 5.0)), Some(5.0 - 10.0 * KMH));
        assert_eq!(traits.follow(&options, 10.0, &ahead(25.0, 5.0)), Some(5.0));
        assert_eq!(traits.follow(&options, 10.0, &ahead(40.0, 5.0)), Some(f32::INFINITY));
        assert_eq!(traits.follow(&options, 14.0, &ahead(15.0, 0.0)), None);
        // 3.6 m/s² are enough before a leader at rest, on a dry road.
        let wet = Traits::of(&options, 0.65);
        assert_eq!(wet.follow(&options, 14.0, &ahead(28.0, 0.0)), None);
        assert!(traits.follow(&options, 14.0, &ahead(28.0, 0.0)).is_some());
    }
}

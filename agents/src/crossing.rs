//! People on pedestrian crossings, who go first.

mod judge;

use schemas::{TrafficLightColour, Vec3};
use serde::{Deserialize, Serialize};

use crate::network::{Crossing, Stop};
use crate::path::StopAhead;
use crate::scene::Body;
use crate::senses::Senses;
pub use judge::Owed;

/// Braking from which it is too late to stop.
const LATE_MPS2: f32 = 4.0;
/// How far beside a crossing people wait for it.
const BESIDE_M: f32 = 1.2;
/// Who walks away from the own way and is so far from it has crossed it.
const CROSSED_M: f32 = 2.5;
/// Slower than this people stand.
const STANDING_MPS: f32 = 0.2;
/// A light this far from a crossing is the crossing's too.
const LIT_M: f32 = 25.0;
/// How long somebody who stands at a crossing is waited for.
const PATIENCE_SECS: f32 = 6.0;

/// What a driver remembers of the crossing before it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct Crossings {
    /// Position of the one that people want.
    wanted: Option<u32>,
    /// How long it has stood for them.
    stood_secs: f32,
}

impl Crossings {
    /// Whether it could have come to be; what a snapshot may get wrong.
    pub(crate) fn is_consistent(&self) -> bool {
        self.stood_secs.is_finite()
    }

    /// From the origin to the first crossing that people are on or wait for, of these lines.
    pub(crate) fn line(
        &mut self,
        senses: &Senses<'_>,
        lines: &[StopAhead],
        speed_mps: f32,
    ) -> Option<f32> {
        let front_m = senses.body.half_m.x;
        let in_time = |line: &&StopAhead| {
            let gap_m = line.ahead_m - front_m;
            gap_m > 0.0 && speed_mps * speed_mps < 2.0 * LATE_MPS2 * gap_m
        };
        let first = |is_patient: bool| {
            let near = lines.iter().filter(|_| senses.scene.has_walkers()).filter(in_time);
            let mut needed = near.filter_map(|line| match line.why {
                Stop::Crossing(index) => Some((index, line)),
                _ => None,
            });
            needed.find(|(index, line)| is_needed(senses, lines, (*index, line), is_patient))
        };
        let wanted = first(true);
        let index = wanted.map(|(index, _)| index);
        if self.wanted != index {
            *self = Self { wanted: index, stood_secs: 0.0 };
        }
        let held = if self.stood_secs < PATIENCE_SECS { wanted } else { first(false) };
        if held.is_some() && speed_mps < STANDING_MPS {
            self.stood_secs += senses.dt_secs;
        }
        held.map(|(_, line)| line.ahead_m)
    }
}

/// Whether people are on a crossing or, for a patient driver, wait for it.
fn is_needed(
    senses: &Senses<'_>,
    lines: &[StopAhead],
    (index, line): (u32, &StopAhead),
    is_patient: bool,
) -> bool {
    let Some(crossing) = senses.network.crossing(index) else { return false };
    let lit = lines.iter().any(|other| match other.why {
        Stop::Light(light) => {
            senses.scene.light(light) != TrafficLightColour::Unknown
                && (other.ahead_m - line.ahead_m).abs() < LIT_M
        }
        _ => false,
    });
    let waited_for = is_patient && !lit;
    let Some(place) = senses.network.lane(line.lane) else { return false };
    let on_lane_m = place.stop_m(line.why);
    let own = place.at(on_lane_m);
    let along = own.heading();
    let left = Vec3::new(-along.y, along.x, 0.0);
    let mut needed = false;
    senses.scene.near(&crossing.middle_m, crossing.radius_m + BESIDE_M, |body| {
        if !body.is_walker {
            return;
        }
        let (left_m, left_mps) =
            (left.dot(&(body.centre_m - own.point_m)), left.dot(&body.velocity_mps));
        let crossed = left_m.abs() > CROSSED_M && left_m * left_mps > 0.0;
        needed |= !crossed
            && match crossing.away_m(&body.centre_m) {
                0.0 => body.velocity_mps.norm() > STANDING_MPS || left_m.abs() < CROSSED_M,
                away_m => waited_for && away_m < BESIDE_M && looks_across(body, crossing),
            };
    });
    needed
}

/// Whether somebody beside a crossing faces it.
fn looks_across(body: &Body, crossing: &Crossing) -> bool {
    let to_middle = (crossing.middle_m - body.centre_m).xy();
    body.forward.xy().dot(&to_middle) > 0.7 * to_middle.norm()
}

#[cfg(test)]
mod tests {
    use schemas::{ActorId, Pose};

    use super::*;
    use crate::network::{LaneId, Network};
    use crate::pilot::VehicleView;
    use crate::scene::Scene;

    fn network() -> Network {
        let text = roads::town::build("Town02_Opt").unwrap();
        Network::new(&roads::Map::parse("Town02_Opt", &text).unwrap())
    }

    /// A lane with a crossing some way ahead of its beginning.
    fn before_a_crossing(network: &Network) -> (LaneId, StopAhead) {
        let ids = 0..network.lane_count() as LaneId;
        let found = ids.into_iter().find_map(|id| {
            let lines = &network.lane(id)?.stops;
            let line = lines
                .iter()
                .find(|line| matches!(line.why, Stop::Crossing(_)) && line.at_m > 25.0)?;
            Some((id, StopAhead { lane: id, ahead_m: 20.0, why: line.why }))
        });
        found.expect("the town has crossings")
    }

    fn body(id: u32, is_walker: bool, centre_m: Vec3, velocity_mps: Vec3, forward: Vec3) -> Body {
        let half_m = Vec3::new(0.3, 0.3, 0.9);
        let id = ActorId::new(id).unwrap();
        Body { id, is_walker, is_urgent: false, centre_m, forward, half_m, velocity_mps }
    }

    /// Where a driver 20 m before the crossing is held by somebody there: so far left of his lane,
    /// walking to the left so fast. Who stands looks at the lane.
    fn held_by(
        network: &Network,
        crossings: &mut Crossings,
        (left_m, left_mps): (f32, f32),
        speed_mps: f32,
    ) -> Option<f32> {
        let (lane, line) = before_a_crossing(network);
        let lane = network.lane(lane).unwrap();
        let at = lane.at(lane.stop_m(line.why) + 1.0);
        let along = at.heading();
        let left = Vec3::new(-along.y, along.x, 0.0);
        let looks = left * -left_m.signum();
        let forward = if left_mps == 0.0 { looks } else { left * left_mps.signum() };
        let person = body(2, true, at.point_m + left * left_m, left * left_mps, forward);
        let own = body(1, false, at.point_m - along * 21.0, along * speed_mps, along);
        let scene = Scene::new(vec![own, person], Vec::new());
        let view = VehicleView::of_car(Pose::identity(), own.velocity_mps);
        let senses = Senses { network, scene: &scene, view: &view, body: &own, dt_secs: 0.05 };
        crossings.line(&senses, &[line], speed_mps)
    }

    fn held(left_m: f32, left_mps: f32, speed_mps: f32) -> Option<f32> {
        held_by(&network(), &mut Crossings::default(), (left_m, left_mps), speed_mps)
    }

    /// How far left of a lane somebody who looks over the road stands beside its crossing.
    fn beside_a_crossing(network: &Network) -> f32 {
        let waits = |left_m: &f32| {
            held_by(network, &mut Crossings::default(), (*left_m, 0.0), 0.0).is_some()
        };
        let left_m = (10..40).map(|step| step as f32 * 0.5);
        left_m.flat_map(|left_m| [left_m, -left_m]).find(waits).unwrap()
    }

    #[test]
    fn whoever_walks_over_the_road_is_let_over_until_he_has_crossed_the_lane() {
        assert_eq!(held(-2.0, 1.3, 8.0), Some(20.0), "on the lane");
        assert_eq!(held(1.0, 1.3, 8.0), Some(20.0), "leaving it");
        assert_eq!(held(3.0, 1.3, 8.0), None, "has crossed it");
        assert_eq!(held(30.0, -1.3, 8.0), None, "far from the crossing");
        assert_eq!(held(-2.0, 1.3, 25.0), None, "too late to stop");
    }
    #[test]
    fn who_has_stood_long_for_somebody_who_does_not_walk_drives_on_and_does_not_stop_again() {
        let network = network();
        let left_m = beside_a_crossing(&network);
        let mut crossings = Crossings::default();
        let mut held = |left_mps: f32, speed_mps: f32| {
            held_by(&network, &mut crossings, (left_m, left_mps), speed_mps).is_some()
        };
        let stood = (0..400).take_while(|_| held(0.0, 0.0)).count();
        assert!((119..=122).contains(&stood), "{stood} ticks of 0.05 s");
        let creeps = (0..40).map(|tick| tick as f32 * 0.05);
        for speed_mps in creeps {
            assert!(!held(0.0, speed_mps), "{speed_mps} m/s");
        }
        assert!(!held(left_m.signum(), 0.5), "who goes away leaves the crossing to nobody");
        assert!(held(0.0, 2.0), "the next one who comes is waited for again");
    }
}

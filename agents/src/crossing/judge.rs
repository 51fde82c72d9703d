//! Whether somebody drives onto a crossing before people whom it could have let over.

use schemas::Vec3;
use serde::{Deserialize, Serialize};

use super::{CROSSED_M, LATE_MPS2, STANDING_MPS};
use crate::network::{Crossing, Network};
use crate::scene::{Body, Scene};

/// Slower than this nobody takes anything from others.
const MOVING_MPS: f32 = 0.5;
/// Crossings are looked at as far ahead as it takes to stop and a little more, within these, in
/// steps.
const AHEAD_M: (f32, f32) = (24.0, 150.0);
const BEYOND_STOP: f32 = 1.25;
const STEP_M: f32 = 1.0;
/// People farther beside the way are not on it yet.
const BESIDE_WAY_M: f32 = 5.0;

/// The crossing before which a vehicle is to let people over.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Owed(Option<u32>);

impl Owed {
    /// Takes in where a vehicle and people are now; whether it drives onto a crossing before
    /// somebody who was on it already when it could still have stopped, braking at 4 m/s².
    pub fn look(&mut self, network: &Network, scene: &Scene, body: &Body) -> bool {
        let speed_mps = body.velocity_mps.dot(&body.forward);
        let stop_m = speed_mps * speed_mps / (2.0 * LATE_MPS2);
        let ahead_m_max = (BEYOND_STOP * stop_m).clamp(AHEAD_M.0, AHEAD_M.1);
        let owed = std::mem::take(&mut self.0);
        if !scene.has_walkers() {
            return false;
        }
        let found = first_needed(network, scene, body, ahead_m_max);
        let Some((index, ahead_m)) = found else { return false };
        if speed_mps < MOVING_MPS {
            // Who stands before a crossing lets people over.
            self.0 = owed.filter(|owed| *owed == index && ahead_m > 0.0);
            return false;
        }
        let in_time = stop_m < ahead_m;
        if owed == Some(index) && ahead_m <= 0.0 {
            return true;
        }
        self.0 = (in_time || owed == Some(index)).then_some(index);
        false
    }
}

/// The first crossing straight ahead of a vehicle's front that somebody is on who has not crossed
/// its way, and how far ahead it begins; 0 for one that the front is on.
fn first_needed(
    network: &Network,
    scene: &Scene,
    body: &Body,
    ahead_m_max: f32,
) -> Option<(u32, f32)> {
    let front_m = body.centre_m + body.forward * body.half_m.x;
    let near = (0..).zip(network.crossings()).filter(|(_, crossing)| {
        let away_m = (crossing.middle_m - front_m).xy().norm();
        away_m < crossing.radius_m + ahead_m_max && is_needed(scene, body, crossing)
    });
    let ahead = near.filter_map(|(index, crossing)| {
        let steps = (ahead_m_max / STEP_M) as u32;
        let mut places = (0..=steps).map(|step| step as f32 * STEP_M);
        let on = |ahead_m: &f32| crossing.away_m(&(front_m + body.forward * *ahead_m)) == 0.0;
        Some((index, places.find(on)?))
    });
    ahead.min_by(|a, b| a.1.total_cmp(&b.1))
}

/// Whether somebody is on a crossing and on a vehicle's way or on the way to it.
fn is_needed(scene: &Scene, body: &Body, crossing: &Crossing) -> bool {
    let left = Vec3::new(-body.forward.y, body.forward.x, 0.0);
    let mut needed = false;
    scene.near(&crossing.middle_m, crossing.radius_m, |other| {
        if !other.is_walker || crossing.away_m(&other.centre_m) > 0.0 {
            return;
        }
        let left_m = left.dot(&(other.centre_m - body.centre_m));
        let left_mps = left.dot(&other.velocity_mps);
        let crossed = left_m.abs() > CROSSED_M && left_m * left_mps > 0.0;
        let walks = other.velocity_mps.norm() > STANDING_MPS && left_m.abs() < BESIDE_WAY_M;
        needed |= !crossed && (walks || left_m.abs() < CROSSED_M);
    });
    needed
}

#[cfg(test)]
mod tests {
    use schemas::ActorId;

    use super::*;
    use crate::network::{LaneId, Stop};

    fn body(id: u32, is_walker: bool, centre_m: Vec3, velocity_mps: Vec3, forward: Vec3) -> Body {
        let half_m = if is_walker { Vec3::new(0.3, 0.3, 0.9) } else { Vec3::new(2.4, 0.9, 0.8) };
        let id = ActorId::new(id).unwrap();
        Body { id, is_walker, is_urgent: false, centre_m, forward, half_m, velocity_mps }
    }

    /// How often a car that drives over a crossing so fast is counted. From `from_m` before the
    /// crossing on somebody is on it, so far left of the lane, walking to the left so fast.
    fn counted(
        network: &Network,
        speed_mps: f32,
        from_m: f32,
        (left_m, left_mps): (f32, f32),
    ) -> usize {
        let lanes = (0..network.lane_count() as LaneId).filter_map(|id| network.lane(id));
        let lines = lanes.flat_map(|lane| lane.stops.iter().map(move |line| (lane, line)));
        let (lane, line) = lines
            .into_iter()
            .find(|(_, line)| matches!(line.why, Stop::Crossing(_)) && line.at_m > 25.0)
            .unwrap();
        let at = lane.at(line.at_m + 1.0);
        let along = at.heading();
        let left = Vec3::new(-along.y, along.x, 0.0);
        let mut owed = Owed::default();
        let steps = (0..300).filter(|step| {
            let ahead_m = 60.0 - 0.05 * speed_mps * *step as f32;
            let own_m = at.point_m - along * (ahead_m + 2.4);
            let own = body(1, false, own_m, along * speed_mps, along);
            let person_m = at.point_m + left * left_m;
            let person = body(2, true, person_m, left * left_mps, left);
            let here = (ahead_m <= from_m).then_some(person);
            let scene = Scene::new(here.into_iter().chain([own]).collect(), Vec::new());
            owed.look(network, &scene, &own)
        });
        steps.count()
    }

    #[test]
    fn who_does_not_let_people_over_is_counted_once_if_it_could_have_stopped() {
        let text = roads::town::build("Town02_Opt").unwrap();
        let network = Network::new(&roads::Map::parse("Town02_Opt", &text).unwrap());
        assert_eq!(counted(&network, 8.0, 24.0, (-2.0, 1.3)), 1, "somebody walks over its lane");
        assert_eq!(counted(&network, 20.0, 60.0, (-2.0, 0.8)), 1, "somebody walks, it is fast");
        assert_eq!(counted(&network, 8.0, 24.0, (1.0, 0.0)), 1, "somebody stands on it");
        assert_eq!(counted(&network, 8.0, 24.0, (3.0, 1.3)), 0, "somebody has crossed it");
        assert_eq!(counted(&network, 8.0, 4.0, (-2.0, 1.3)), 0, "it was too late to stop");
        assert_eq!(counted(&network, 8.0, -1.0, (-2.0, 1.3)), 0, "it was there first");
    }
}

//! Drivers of traffic: vehicles that go on for ever, each on its own way.
//!
//! A driver follows what is ahead by the intelligent driver model (Treiber, Hennecke, Helbing,
//! "Congested traffic states in empirical observations and microscopic simulations", 2000), changes
//! lanes by MOBIL (Kesting, Treiber, Helbing, "General lane-changing model MOBIL", 2007), and
//! enters a junction only with a claim on its way through ([`Claims`]).

mod change;
mod lines;
mod manner;

use roads::Map;
use schemas::{AgentBehaviour, Pose, UnitQuaternion, Vec3, VehicleControl};
use serde::{Deserialize, Serialize};

use crate::beside::neighbours;
use crate::crossing::Crossings;
use crate::junction::{Approach, Claims, Held, Passage};
use crate::network::{LaneId, Network};
use crate::path::{Path, PathPoint, with_room};
use crate::pilot::VehicleView;
use crate::scene::Room;
use crate::senses::Senses;
use crate::speed::{BRAKE_MPS2, THROTTLE_PER_MPS2};
use crate::{steering, wander};
use manner::Manner;

/// Way ahead that is kept, at rest and per second of driving.
const WAY_M: f32 = 40.0;
const WAY_SECS: f32 = 6.0;
/// Spacing of the places on the way that count.
const SPACING_M: f32 = 2.0;
/// Slower than this a vehicle stands.
const STANDING_MPS: f32 = 0.2;
/// Whoever stands between two lanes for so long drives on along the nearer one.
const BETWEEN_SECS: f32 = 1.5;
/// Whoever is so near to the end of its way, and so slow, for so long has come to it.
const ENDED_M: f32 = 7.0;
const ENDED_MPS: f32 = 1.5;
const ENDED_SECS: f32 = 2.0;
/// While there is no room for it elsewhere it asks so often.
const AGAIN_SECS: f32 = 1.0;
/// Whoever stands so far from the middle of its lane is beside it, and pulls out about so fast.
const OUTSIDE_M: f32 = 1.6;
const PULL_OUT_MPS: f32 = 3.0;
/// Way over which the climb of the road is taken.
const CLIMB_M: f32 = 2.0;
/// Room on each side, towards vehicles and towards people.
const BESIDE_M: f32 = 0.35;
const BESIDE_WALKERS_M: f32 = 0.6;
/// Whoever stands has so much more than its gap to who stands ahead, at most.
const REST_M: f32 = 1.0;
/// Less than this is not braked for: the throttle is let go.
const EASED_MPS2: f32 = -0.4;

/// A driver of traffic.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Driver {
    behaviour: AgentBehaviour,
    path: Path,
    passage: Passage,
    crossings: Crossings,
    /// Standing between two lanes.
    between_secs: f32,
    /// Standing at a stop sign.
    stood_secs: f32,
    /// The stop sign it may pass: its lane.
    passed: Option<LaneId>,
    /// Since it last thought about changing lanes.
    settled_secs: f32,
    /// Standing where no way leads on.
    ended_secs: f32,
    /// What the pedals are to reach.
    wanted_mps: f32,
}

/// Where a vehicle without dynamics is, and how it moves, world frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Glide {
    /// Origin at the box centre on the ground.
    pub world_from_vehicle: Pose,
    /// Along the way.
    pub velocity_mps: Vec3,
}

impl Driver {
    /// A driver who takes over a vehicle on a lane.
    #[must_use]
    pub fn new(behaviour: AgentBehaviour) -> Self {
        Self {
            behaviour,
            path: Path::default(),
            passage: Passage::default(),
            crossings: Crossings::default(),
            between_secs: 0.0,
            stood_secs: 0.0,
            passed: None,
            settled_secs: 0.0,
            ended_secs: 0.0,
            wanted_mps: 0.0,
        }
    }

    /// Gap in metres, bumper to bumper, at which a driver keeps a speed behind somebody as fast on
    /// a dry road, by the intelligent driver model; endless at the speed that it drives under this
    /// limit.
    #[must_use]
    pub fn steady_gap_m(behaviour: AgentBehaviour, speed_mps: f32, limit_mps: f32) -> f32 {
        let manner = Manner::of(behaviour, VehicleView::DRY);
        manner.steady_gap_m(speed_mps, manner.limit_mps(limit_mps))
    }

    /// The way it takes, from the vehicle on: a place every two metres, at most so many.
    #[must_use]
    pub fn way_m(&self, network: &Network, most: usize) -> Vec<Vec3> {
        self.path.places_m(network, SPACING_M, most)
    }

    /// Whether it can be a driver on this network; what a snapshot may get wrong.
    #[must_use]
    pub fn is_consistent(&self, network: &Network) -> bool {
        let numbers = [
            self.between_secs,
            self.stood_secs,
            self.settled_secs,
            self.ended_secs,
            self.wanted_mps,
        ];
        self.path.is_consistent(network)
            && self.passage.is_consistent()
            && self.crossings.is_consistent()
            && numbers.iter().all(|value| value.is_finite())
    }

    /// Goes on to where the vehicle is, keeps enough way ahead, and says what is claimed.
    pub fn look(
        &mut self,
        senses: &Senses<'_>,
        map: &Map,
        claims: &mut Claims,
        draw: &mut dyn FnMut() -> u64,
    ) {
        let (network, view) = (senses.network, senses.view);
        let position_m = view.world_from_vehicle.translation.vector;
        wander::begin(&mut self.path, network, map, view);
        let driven_m = self.path.follow(network, &position_m);
        let gap_m = Manner::of(self.behaviour, view.grip).gap_m;
        if let Some(from_m) = self.passage.turn_away(senses, &self.path, gap_m) {
            self.path.cut(from_m);
        }
        self.settle(senses);
        if let Some(to_left) = self.path.changes_to_left(network) {
            claims.change(senses.body.id, to_left);
        }
        let wanted_m = WAY_M + WAY_SECS * view.velocity_mps.norm();
        wander::extend(&mut self.path, network, (wanted_m, view.climb_max()), draw);
        self.passage.look(senses, &self.path, (driven_m, gap_m), claims);
    }

    /// Whether it has stood for a while where its road ends.
    #[must_use]
    pub fn has_ended(&self) -> bool {
        self.ended_secs > ENDED_SECS
    }

    /// Nobody has room for it elsewhere: it [stands](Self::has_ended) for a second more.
    pub fn wait_on(&mut self) {
        self.ended_secs = ENDED_SECS - AGAIN_SECS;
    }

    /// Who begins anew elsewhere with the same vehicle.
    #[must_use]
    pub fn anew(&self) -> Self {
        Self::new(self.behaviour)
    }

    /// What it waited for in the last tick.
    #[must_use]
    pub fn held(&self) -> Held {
        self.passage.held()
    }

    /// Does not stand between two lanes, where each of two vehicles would wait for the other.
    fn settle(&mut self, senses: &Senses<'_>) {
        let stands = senses.view.velocity_mps.norm() < STANDING_MPS;
        if !stands || !self.path.is_changing() {
            self.between_secs = 0.0;
            return;
        }
        self.between_secs += senses.dt_secs;
        if self.between_secs > BETWEEN_SECS {
            self.path.settle(senses.network);
        }
    }

    /// The control for the next tick, after everybody has looked.
    pub fn control(&mut self, senses: &Senses<'_>, claims: &mut Claims) -> VehicleControl {
        let acceleration_mps2 = self.accelerate(senses, claims);
        let view = senses.view;
        let forward = view.world_from_vehicle.rotation * Vec3::x();
        let speed_mps = view.velocity_mps.dot(&forward);
        // Who cannot start on a climb would roll back onto those behind.
        let stays = speed_mps < STANDING_MPS && view.is_too_steep();
        let asked_mps2 = if stays { acceleration_mps2.min(0.0) } else { acceleration_mps2 };
        let asked = (asked_mps2, view.hill_mps2());
        let (throttle, brake) = self.pedals(asked, speed_mps, senses.dt_secs);
        let steer = steering::along(&self.path, senses.network, view);
        VehicleControl { throttle, steer, brake, ..VehicleControl::default() }
    }

    /// Moves on without dynamics, after everybody has looked; where the vehicle is at the end of
    /// the tick.
    pub fn glide(&mut self, senses: &Senses<'_>, claims: &mut Claims) -> Option<Glide> {
        let acceleration_mps2 = self.accelerate(senses, claims);
        let before_mps = senses.view.velocity_mps.norm();
        let speed_mps = (before_mps + acceleration_mps2 * senses.dt_secs).max(0.0);
        self.path.go(f32::midpoint(before_mps, speed_mps) * senses.dt_secs);
        let here = self.path.at(senses.network, 0.0)?.point;
        let next = self.path.at(senses.network, CLIMB_M)?;
        let climb_m = next.point.point_m.z - here.point_m.z;
        let slope = if next.ahead_m > 0.5 { climb_m / next.ahead_m } else { 0.0 };
        let nose_up_rad = nalgebra::ComplexField::atan(slope);
        // A positive turn about y (left) tips the nose down.
        let rotation = UnitQuaternion::from_euler_angles(0.0, -nose_up_rad, here.heading_rad);
        let world_from_vehicle = Pose::from_parts(here.point_m.into(), rotation);
        self.wanted_mps = speed_mps;
        Some(Glide { world_from_vehicle, velocity_mps: rotation * Vec3::x() * speed_mps })
    }

    /// Whether it stands beside its lane, as a parked car does, and others come along it. Those who
    /// stand behind it may be waiting for it.
    fn waits_beside(&self, senses: &Senses<'_>, speed_mps: f32) -> bool {
        if speed_mps >= STANDING_MPS {
            return false;
        }
        let Some(here) = self.path.at(senses.network, 0.0) else { return false };
        let away_m = (senses.body.centre_m - here.point.point_m).xy().norm();
        let mut taken = false;
        if away_m > OUTSIDE_M {
            neighbours(senses.scene, senses.body, &here.point, |other| {
                let comes = other.is_behind() && other.along_mps > STANDING_MPS;
                taken |= comes && !other.has_room(PULL_OUT_MPS);
            });
        }
        taken
    }

    /// Throttle and brake for an acceleration on a hill, which takes so much of it.
    fn pedals(
        &mut self,
        (acceleration_mps2, hill_mps2): (f32, f32),
        speed_mps: f32,
        dt_secs: f32,
    ) -> (f32, f32) {
        let wanted_mps = self.wanted_mps + acceleration_mps2 * dt_secs;
        self.wanted_mps = wanted_mps.max(speed_mps - 1.0).min(speed_mps + 1.5).max(0.0);
        if speed_mps < STANDING_MPS && acceleration_mps2 <= 0.0 {
            return (0.0, 0.5);
        }
        let error_mps = self.wanted_mps - speed_mps;
        // A hill that is climbed brakes by itself: no harm if the brake is stronger.
        let downhill_mps2 = acceleration_mps2 + hill_mps2.min(0.0);
        // Wheels that stand are held until there is throttle, downhill too.
        let rolls = speed_mps >= STANDING_MPS;
        if acceleration_mps2 < EASED_MPS2 || (rolls && downhill_mps2 < EASED_MPS2) {
            (0.0, (-downhill_mps2 / BRAKE_MPS2 - 0.1 * error_mps).clamp(0.0, 1.0))
        } else {
            let effort = THROTTLE_PER_MPS2 * (acceleration_mps2 + hill_mps2) + 0.3 * error_mps;
            (effort.clamp(0.0, 1.0), 0.0)
        }
    }

    /// The acceleration that way, lights, junctions and others allow.
    fn accelerate(&mut self, senses: &Senses<'_>, claims: &mut Claims) -> f32 {
        with_room(|points| self.accelerate_along(senses, claims, points))
    }

    /// As [`accelerate`](Self::accelerate), with room for the samples of its way.
    fn accelerate_along(
        &mut self,
        senses: &Senses<'_>,
        claims: &mut Claims,
        points: &mut Vec<PathPoint>,
    ) -> f32 {
        let view = senses.view;
        let manner = Manner::of(self.behaviour, view.grip);
        let forward = view.world_from_vehicle.rotation * Vec3::x();
        let speed_mps = view.velocity_mps.dot(&forward).max(0.0);
        let horizon_m = manner.horizon_m(speed_mps);
        self.path.sample(senses.network, horizon_m, SPACING_M, points);
        let left_m = self.path.length_m();
        let free_mps = manner.free_mps(points, left_m);
        let room = room(senses);
        let queue = senses.scene.queue(points, &room);
        let ahead = queue.first();
        let mut least = manner.free(speed_mps, free_mps);
        if let Some(ahead) = &ahead {
            least = least.min(manner.behind(speed_mps, free_mps, ahead.leader()));
        }
        // Until a change is done, those on the other lane count as well as those in the way.
        if let Some(changed) = self.path.changed(senses.network, 0) {
            let mut points = Vec::new();
            changed.sample(senses.network, horizon_m, SPACING_M, &mut points);
            if let Some(beside) = senses.scene.ahead(&points, &room) {
                least = least.min(manner.behind(speed_mps, free_mps, beside.leader()));
            }
        }
        let look_m = horizon_m;
        let lines = self.path.stops(senses.network, 0.0, look_m + senses.body.half_m.x);
        let (line_m, is_at_sign) = self.line(senses, &lines, speed_mps);
        let approach = Approach {
            senses,
            path: &self.path,
            speed_mps,
            look_m,
            stopping_m: manner.stopping_m(speed_mps),
            gap_m: manner.gap_m,
            rest_m: manner.gap_m + REST_M,
            line_m,
            is_at_sign,
            ahead,
            queue: &queue,
        };
        if self.waits_beside(senses, speed_mps) {
            least = least.min(-1.0);
        }
        if let Some(stop_m) = self.passage.enter(&approach, claims) {
            least = least.min(manner.before(speed_mps, free_mps, stop_m));
        }
        let ended = left_m < ENDED_M && speed_mps < ENDED_MPS;
        self.ended_secs = if ended { self.ended_secs + senses.dt_secs } else { 0.0 };
        self.settled_secs += senses.dt_secs;
        let asked = change::Asked { speed_mps, free_mps, present_mps2: least, ahead };
        if self.settled_secs > change::THINK_SECS && self.passage.is_free() {
            self.settled_secs = 0.0;
            if let Some(path) = change::better(senses, claims, &manner, &self.path, &asked) {
                self.path = path;
                if let Some(to_left) = self.path.changes_to_left(senses.network) {
                    claims.change(senses.body.id, to_left);
                }
            }
        }
        least
    }
}

/// The room that a vehicle of traffic needs on its way.
fn room(senses: &Senses<'_>) -> Room {
    Room::of(senses.body, BESIDE_M, BESIDE_WALKERS_M)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_climb_gets_throttle_for_gravity_and_a_way_down_brake() {
        let pedals = |acceleration_mps2, hill_mps2| {
            let mut driver = Driver::new(AgentBehaviour::Cautious);
            driver.wanted_mps = 5.0;
            driver.pedals((acceleration_mps2, hill_mps2), 5.0, 0.05)
        };
        let ((level, _), (climb, _)) = (pedals(0.5, 0.0), pedals(0.5, 3.0));
        assert!((climb - level - 3.0 * THROTTLE_PER_MPS2).abs() < 1.0e-6, "{level}, {climb}");
        assert_eq!(pedals(-2.0, 3.0), pedals(-2.0, 0.0));
        let (throttle, brake) = pedals(-2.0, -3.0);
        let more = brake - pedals(-2.0, 0.0).1;
        assert!(throttle == 0.0 && (more - 3.0 / BRAKE_MPS2).abs() < 1.0e-6, "{brake}");
        let mut starts = Driver::new(AgentBehaviour::Cautious);
        let throttles = (0..40).map(|_| starts.pedals((1.0, -3.0), 0.0, 0.05));
        assert!(throttles.last().is_some_and(|(throttle, brake)| throttle > 0.0 && brake == 0.0));
        // To keep a speed downhill takes brake as well.
        let (throttle, brake) = pedals(0.0, -3.0);
        assert!(throttle == 0.0 && (brake - 3.0 / BRAKE_MPS2).abs() < 1.0e-6, "{brake}");
    }

    #[test]
    fn who_finds_no_room_elsewhere_asks_again_a_second_later() {
        let mut driver = Driver::new(AgentBehaviour::Normal);
        driver.ended_secs = ENDED_SECS + 0.05;
        assert!(driver.has_ended());
        driver.wait_on();
        let again = (1..=100).find(|_| {
            driver.ended_secs += 0.05;
            driver.has_ended()
        });
        assert!(again.is_some_and(|ticks| (20..=21).contains(&ticks)), "{again:?}");
    }
}

//! Navigation agents: CARLA's basic and behaviour agents inside the tick, steered along their path.

mod change;
mod courtesy;
mod traits;

use roads::Map;
use schemas::{AgentOptions, AgentStatus, TrafficLightColour, Vec3, VehicleControl};
use serde::{Deserialize, Serialize};

use crate::network::{LaneId, Network, Stop};
use crate::path::{Path, PathPoint, curvature_per_m};
use crate::pid::Longitudinal;
use crate::pilot::VehicleView;
use crate::scene::{Ahead, Room};
use crate::senses::Senses;
use crate::{route, steering, wander};
use traits::Traits;

/// The path of an agent without a destination is kept this long, and per metre per second longer.
const WANDER_M: f32 = 30.0;
const WANDER_SECS: f32 = 4.0;
/// A target counts as reached from here, and per metre per second of speed from farther away.
const TARGET_M: f32 = 3.0;
const TARGET_SECS: f32 = 0.5;
/// Spacing of the places steered for.
const SPACING_M: f32 = 2.0;
/// The end of a route counts as reached from here.
const END_M: f32 = 1.0;
/// Sideways acceleration in curves, and braking for curves and the end of the route.
const CURVE_MPS2: f32 = 3.5;
const EASY_MPS2: f32 = 3.0;
/// Slower than this nobody approaches the end of a route.
const END_MPS: f32 = 2.0;
/// Braking that calls for the whole brake.
const HARD_MPS2: f32 = 4.0;
/// Slower than this a vehicle stands.
const STANDING_MPS: f32 = 0.2;
/// How long a vehicle stands at a stop sign.
const STOP_SECS: f32 = 1.0;
/// A stop line this far ahead of the bumper at most is the one that a vehicle stands at.
const AT_LINE_M: f32 = 4.0;
/// Room on each side, towards vehicles and towards people.
const BESIDE_M: f32 = 0.3;
const BESIDE_WALKERS_M: f32 = 0.8;

/// A driver with a destination or without.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Agent {
    options: AgentOptions,
    path: Path,
    status: AgentStatus,
    target_m: Vec3,
    longitudinal: Longitudinal,
    /// Its last steer.
    steer: f32,
    /// How long it has been standing at a stop sign.
    stood_secs: f32,
    /// The stop sign it may pass: its lane.
    passed: Option<LaneId>,
    /// How long it has been standing for want of room on the lane beside.
    waited_secs: f32,
    /// Until it may make way again.
    calm_secs: f32,
}

/// No way leads from one place to the next.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("no way leads to place {index}")]
pub struct Unreachable {
    /// Position of the place in the route.
    pub index: usize,
}

impl Agent {
    /// An agent that has nowhere to go.
    #[must_use]
    pub fn new(options: AgentOptions) -> Self {
        Self {
            options,
            path: Path::default(),
            status: AgentStatus::Wandering,
            target_m: Vec3::zeros(),
            longitudinal: Longitudinal::default(),
            steer: 0.0,
            stood_secs: 0.0,
            passed: None,
            waited_secs: 0.0,
            calm_secs: 0.0,
        }
    }

    /// The same agent with other options.
    #[must_use]
    pub fn with(self, options: AgentOptions) -> Self {
        Self { options, ..self }
    }

    /// What it is about.
    #[must_use]
    pub fn status(&self) -> AgentStatus {
        self.status
    }

    /// To the end of its route in metres; 0 without one.
    #[must_use]
    pub fn distance_left_m(&self) -> f32 {
        if self.status == AgentStatus::OnRoute { self.path.length_m() } else { 0.0 }
    }

    /// The place ahead on its way that it drives for, world frame.
    #[must_use]
    pub fn target_m(&self) -> Vec3 {
        self.target_m
    }

    /// Whether it can be an agent on this network; what a snapshot may get wrong.
    #[must_use]
    pub fn is_consistent(&self, network: &Network) -> bool {
        self.path.is_consistent(network)
            && self.target_m.iter().all(|value| value.is_finite())
            && [self.stood_secs, self.waited_secs, self.calm_secs]
                .iter()
                .all(|secs| secs.is_finite())
            && self.steer.is_finite()
            && self.longitudinal.is_finite()
    }

    /// Gives it places to pass in order, the last one to stop at; none: it takes any way.
    ///
    /// The way is the shortest over lanes and allowed lane changes. Of lanes that cross at a place
    /// the one with the shortest way counts.
    ///
    /// # Errors
    /// [`Unreachable`]; the route stays as it was.
    pub fn set_route(
        &mut self,
        network: &Network,
        map: &Map,
        view: &VehicleView,
        places_m: &[Vec3],
    ) -> Result<(), Unreachable> {
        let mut path = Path::default();
        let here = network.vehicle_place(map, &view.world_from_vehicle);
        let mut from = here.ok_or(Unreachable { index: 0 })?;
        for (index, place_m) in places_m.iter().enumerate() {
            let ways = network.point_places(map, place_m).into_iter();
            let ways = ways.filter_map(|to| Some((route::plan(network, from, to)?, to)));
            let best = ways.min_by(|((a, _), _), ((b, _), _)| a.total_cmp(b));
            let ((_, legs), to) = best.ok_or(Unreachable { index })?;
            for leg in legs {
                path.push(leg);
            }
            from = to;
        }
        self.path = path;
        self.status =
            if places_m.is_empty() { AgentStatus::Wandering } else { AgentStatus::OnRoute };
        (self.stood_secs, self.passed, self.waited_secs) = (0.0, None, 0.0);
        self.target_m = view.world_from_vehicle.translation.vector;
        Ok(())
    }

    /// The control for the next tick. `draw` gives numbers for the choice of ways.
    pub fn control(
        &mut self,
        senses: &Senses<'_>,
        map: &Map,
        draw: &mut dyn FnMut() -> u64,
    ) -> VehicleControl {
        let view = senses.view;
        let position_m = view.world_from_vehicle.translation.vector;
        let forward = view.world_from_vehicle.rotation * Vec3::x();
        let speed_mps = view.velocity_mps.dot(&forward);
        if self.status == AgentStatus::Wandering {
            wander::begin(&mut self.path, senses.network, map, view);
            let wanted_m = WANDER_M + WANDER_SECS * speed_mps.max(0.0);
            wander::extend(&mut self.path, senses.network, wanted_m, draw);
        }
        self.path.follow(senses.network, &position_m);
        let left_m = self.path.length_m();
        if self.status == AgentStatus::OnRoute && left_m < END_M {
            self.status = AgentStatus::Arrived;
        }
        if self.status == AgentStatus::Arrived || self.path.is_empty() {
            return self.brake(1.0);
        }
        let traits = Traits::of(&self.options);
        self.make_way(senses, &traits, speed_mps);
        let change_m = self.await_room(senses, speed_mps);
        let reach_m = (TARGET_M + TARGET_SECS * speed_mps.max(0.0)).min(left_m);
        let reach_m = (reach_m / SPACING_M).ceil() * SPACING_M;
        if let Some(target) = self.path.at(senses.network, reach_m) {
            self.target_m = target.point.point_m;
        }
        let steer = steering::along(&self.path, senses.network, view);
        self.steer = steer;
        let mut points = Vec::new();
        self.path.sample(senses.network, traits.horizon_m(speed_mps), SPACING_M, &mut points);
        if self.must_stop(senses, &traits, speed_mps) {
            return VehicleControl { steer, ..self.brake(traits.brake) };
        }
        let braked_mps = (2.0 * EASY_MPS2 * change_m).sqrt();
        let free_mps = self.free_speed(&points, &traits, speed_mps).min(braked_mps);
        let ahead = self.first_ahead(senses, &points);
        let target_mps = match ahead {
            Some(ahead) => match traits.follow(&self.options, speed_mps, &ahead) {
                Some(mps) => mps.min(free_mps),
                None => {
                    let closing_mps = (speed_mps - ahead.along_mps.max(0.0)).max(0.0);
                    let needed = closing_mps * closing_mps / (2.0 * ahead.gap_m.max(0.1));
                    let brake = if needed > HARD_MPS2 { 1.0 } else { traits.brake };
                    return VehicleControl { steer, ..self.brake(brake) };
                }
            },
            None => free_mps,
        };
        let (throttle, brake) = self.longitudinal.pedals(target_mps - speed_mps, senses.dt_secs);
        VehicleControl { throttle, steer, brake, ..VehicleControl::default() }
    }

    fn brake(&self, brake: f32) -> VehicleControl {
        VehicleControl { brake, steer: self.steer, ..VehicleControl::default() }
    }

    /// Whether a red light or a stop sign is near.
    fn must_stop(&mut self, senses: &Senses<'_>, traits: &Traits, speed_mps: f32) -> bool {
        let front_m = senses.body.half_m.x;
        let stopping_m = speed_mps * speed_mps / (2.0 * HARD_MPS2);
        let from_m = (traits.light_m + speed_mps.max(0.0)).max(stopping_m + 1.0);
        let lines = self.path.stops(senses.network, 0.0, from_m + front_m);
        let red = |light: u32| senses.scene.light(light) == TrafficLightColour::Red;
        let at_red = lines.iter().any(|line| match line.why {
            Stop::Light(light) => !self.options.ignore_lights && red(light),
            _ => false,
        });
        let sign = lines.iter().find(|line| line.why == Stop::Sign);
        let sign = sign.filter(|_| !self.options.ignore_stop_signs);
        let Some(sign) = sign else {
            (self.stood_secs, self.passed) = (0.0, None);
            return at_red;
        };
        let gap_m = sign.ahead_m - front_m;
        if speed_mps < STANDING_MPS && gap_m < AT_LINE_M {
            self.stood_secs += senses.dt_secs;
        }
        if self.stood_secs >= STOP_SECS {
            self.passed = Some(sign.lane);
        }
        let stops_here = self.passed != Some(sign.lane) && gap_m < stopping_m + 1.5;
        at_red || stops_here
    }

    /// As fast as the options, limits, curves and the end of the route allow.
    fn free_speed(&self, points: &[PathPoint], traits: &Traits, speed_mps: f32) -> f32 {
        let limit_mps = points.first().map_or(0.0, |here| here.point.limit_mps);
        let mut free_mps = traits.speed_mps(&self.options, limit_mps);
        for (index, at) in points.iter().enumerate() {
            let curve_mps2 = CURVE_MPS2 / curvature_per_m(points, index).max(1.0e-4);
            free_mps = free_mps.min((curve_mps2 + 2.0 * EASY_MPS2 * at.ahead_m).sqrt());
        }
        if self.status == AgentStatus::OnRoute {
            let braked = (2.0 * EASY_MPS2 * self.path.length_m()).sqrt().max(END_MPS);
            free_mps = free_mps.min(braked);
        }
        // A sudden limit is met by rolling, not by a full stop of the integral part.
        free_mps.max(0.0).min(speed_mps + 20.0)
    }

    fn first_ahead(&self, senses: &Senses<'_>, points: &[PathPoint]) -> Option<Ahead> {
        if self.options.ignore_vehicles {
            return None;
        }
        senses.scene.ahead(points, &room(senses))
    }
}

/// The room that an agent's vehicle needs on its way.
fn room(senses: &Senses<'_>) -> Room {
    Room::of(senses.body, BESIDE_M, BESIDE_WALKERS_M)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::network::LanePoint;

    #[test]
    fn an_agent_brakes_before_a_curve() {
        let way = |curvature_per_m: f32| {
            [(0.0, 0.0), (30.0, curvature_per_m)].map(|(at_m, curvature_per_m)| {
                let (point_m, heading_rad) = (Vec3::new(at_m, 0.0, 0.0), 0.0);
                let point =
                    LanePoint { at_m, point_m, heading_rad, curvature_per_m, limit_mps: 0.0 };
                PathPoint { point, ahead_m: at_m }
            })
        };
        let options = AgentOptions { target_speed_mps: Some(20.0), ..AgentOptions::default() };
        let agent = Agent::new(options);
        let free_mps =
            |points: &[PathPoint]| agent.free_speed(points, &Traits::of(&agent.options), 19.0);
        assert_eq!(free_mps(&way(0.0)), 20.0);
        // Radius 20 m: 3.5 m/s² sideways are 8.37 m/s, and 15.81 m/s with 3 m/s² before it.
        for curvature_per_m in [0.05, -0.05] {
            let before_mps = free_mps(&way(curvature_per_m));
            assert!((before_mps - 15.81).abs() < 0.01, "{before_mps}");
            let within_mps = free_mps(
                &way(curvature_per_m)[1..]
                    .iter()
                    .map(|at| PathPoint { ahead_m: 0.0, ..*at })
                    .collect::<Vec<_>>(),
            );
            assert!((within_mps - 8.37).abs() < 0.01, "{within_mps}");
        }
    }
}

//! Navigation agents: CARLA's basic and behaviour agents inside the tick, steered along their path.

mod change;
mod courtesy;
mod jam;
mod lines;
mod traits;

use roads::Map;
use schemas::{AgentOptions, AgentStatus, Vec3, VehicleControl};
use serde::{Deserialize, Serialize};

use crate::crossing::Crossings;
use crate::junction::{Claims, Held, Passage};
use crate::network::{LaneId, Network};
use crate::path::{Path, PathPoint, curvature_per_m};
use crate::pid::Longitudinal;
use crate::pilot::VehicleView;
use crate::scene::{Queue, Room};
use crate::senses::Senses;
use crate::{route, steering, wander};
use lines::Lines;
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
/// Sideways acceleration in curves on a dry road, and braking for curves and the end of the route.
const CURVE_MPS2: f32 = 3.5;
const EASY_MPS2: f32 = 3.0;
/// Braking before bends that are tighter than the vehicle can turn: pedals follow late, and it
/// must not be fast there.
const EARLY_MPS2: f32 = 1.5;
/// Slower than this nobody approaches the end of a route.
const END_MPS: f32 = 2.0;
/// Who would have to brake harder than this before a junction brakes at once.
const LATE_MPS2: f32 = 3.5;
/// Braking that calls for the whole brake.
const HARD_MPS2: f32 = 4.0;
/// Room to whoever stands ahead, where junctions must be left.
const GAP_M: f32 = 3.0;
/// Who wanders stops so far before the end of a road.
const END_ROAD_M: f32 = 4.0;
/// Slower than this a vehicle stands.
const STANDING_MPS: f32 = 0.2;
/// Room on each side, towards vehicles and towards people.
const BESIDE_M: f32 = 0.3;
const BESIDE_WALKERS_M: f32 = 0.8;

/// A driver with a destination or without.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Agent {
    options: AgentOptions,
    path: Path,
    passage: Passage,
    crossings: Crossings,
    status: AgentStatus,
    target_m: Vec3,
    longitudinal: Longitudinal,
    /// Its last steer.
    steer: f32,
    /// How long it has been standing at a stop sign.
    stood_secs: f32,
    /// The stop sign it may pass: its lane.
    passed: Option<LaneId>,
    /// How long it has been standing for want of room on the lane beside, and between two lanes.
    waited_secs: f32,
    between_secs: f32,
    /// Until it may make way again.
    calm_secs: f32,
    /// How long it has been standing in a circle of those who wait for each other.
    jammed_secs: f32,
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
            passage: Passage::default(),
            crossings: Crossings::default(),
            status: AgentStatus::Wandering,
            target_m: Vec3::zeros(),
            longitudinal: Longitudinal::default(),
            steer: 0.0,
            stood_secs: 0.0,
            passed: None,
            waited_secs: 0.0,
            between_secs: 0.0,
            calm_secs: 0.0,
            jammed_secs: 0.0,
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

    /// The way it takes, from the vehicle on: a place every two metres, at most so many.
    #[must_use]
    pub fn way_m(&self, network: &Network, most: usize) -> Vec<Vec3> {
        self.path.places_m(network, SPACING_M, most)
    }

    /// Whether it can be an agent on this network; what a snapshot may get wrong.
    #[must_use]
    pub fn is_consistent(&self, network: &Network) -> bool {
        self.path.is_consistent(network)
            && self.passage.is_consistent()
            && self.crossings.is_consistent()
            && self.target_m.iter().all(|value| value.is_finite())
            && [self.stood_secs, self.waited_secs, self.between_secs, self.calm_secs]
                .iter()
                .chain([&self.jammed_secs])
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

    /// Whether it asks others before it enters a junction; one that does not is to be
    /// [let through](Claims::occupy).
    #[must_use]
    pub fn asks(&self) -> bool {
        !self.options.ignore_vehicles && self.status != AgentStatus::Arrived
    }

    /// What it waited for in the last tick.
    #[must_use]
    pub fn held(&self) -> Held {
        self.passage.held()
    }

    /// Goes on to where the vehicle is, keeps enough way ahead, and says what is claimed. `draw`
    /// gives numbers for the choice of ways.
    pub fn look(
        &mut self,
        senses: &Senses<'_>,
        map: &Map,
        claims: &mut Claims,
        draw: &mut dyn FnMut() -> u64,
    ) {
        let view = senses.view;
        let wanders = self.status == AgentStatus::Wandering;
        if wanders {
            wander::begin(&mut self.path, senses.network, map, view);
            if let Some(from_m) = self.passage.turn_away(senses, &self.path, GAP_M) {
                self.path.cut(from_m);
            }
            let wanted_m = WANDER_M + WANDER_SECS * view.velocity_mps.norm();
            let asked = (wanted_m, view.climb_max());
            wander::extend(&mut self.path, senses.network, asked, draw);
        }
        let position_m = view.world_from_vehicle.translation.vector;
        let driven_m = self.path.follow(senses.network, &position_m);
        if self.status == AgentStatus::OnRoute && self.path.length_m() < END_M {
            self.status = AgentStatus::Arrived;
        }
        if self.asks() {
            self.passage.look(senses, &self.path, (driven_m, GAP_M), claims);
        } else {
            claims.occupy(senses.network, senses.body);
        }
    }

    /// The control for the next tick, after everybody has looked.
    pub fn control(&mut self, senses: &Senses<'_>, claims: &mut Claims) -> VehicleControl {
        let view = senses.view;
        let forward = view.world_from_vehicle.rotation * Vec3::x();
        let speed_mps = view.velocity_mps.dot(&forward);
        if self.status == AgentStatus::Arrived || self.path.is_empty() {
            return self.brake(1.0);
        }
        let hill_mps2 = view.hill_mps2();
        let traits = self.traits(view.grip);
        self.make_way(senses, &traits, speed_mps);
        let taken = self.await_room(senses, speed_mps);
        self.aim(senses, speed_mps);
        let steer = steering::along(&self.path, senses.network, view);
        self.steer = steer;
        let look_m = traits.horizon_m(speed_mps);
        let mut points = Vec::new();
        self.path.sample(senses.network, look_m, SPACING_M, &mut points);
        let room = room(senses);
        let queue = match self.options.ignore_vehicles {
            true => Queue::default(),
            false => senses.scene.queue(&points, &room),
        };
        let ahead = queue.first();
        self.note_jam(senses, claims, (speed_mps, ahead));
        let lines = Lines { taken, ..self.lines(senses, &traits, look_m, speed_mps) };
        let stop_m = self.junction(senses, claims, (ahead, &queue), &lines, (look_m, speed_mps));
        let stop_m = stop_m.min(lines.people_stop_m(senses.body.half_m.x));
        let end_m = self.end_m(senses, look_m);
        if speed_mps < STANDING_MPS && self.is_kept_from_end(senses, end_m) {
            self.status = AgentStatus::Arrived;
            return self.brake(1.0);
        }
        let stop_m = stop_m.min(end_m);
        if lines.stops_here {
            return VehicleControl { steer, ..self.brake(traits.brake) };
        }
        let free_m = taken.map_or(stop_m, |taken| taken.stop_m.min(stop_m));
        let braked_mps = (2.0 * EASY_MPS2 * view.grip * free_m).sqrt();
        let free_mps = self.free_speed(&points, &traits, (speed_mps, view.bend_per_m_max));
        let free_mps = free_mps.min(braked_mps);
        let followed =
            ahead.as_ref().map(|ahead| (ahead, traits.follow(&self.options, speed_mps, ahead)));
        let target_mps = match followed {
            Some((_, Some(mps))) => mps.min(free_mps),
            Some((ahead, None)) => {
                let closing_mps = (speed_mps - ahead.along_mps.max(0.0)).max(0.0);
                let brake = traits.brake_before(closing_mps, ahead.gap_m, hill_mps2);
                return VehicleControl { steer, ..self.brake(brake) };
            }
            None => free_mps,
        };
        if speed_mps * speed_mps > 2.0 * LATE_MPS2 * view.grip * stop_m {
            let brake = traits.brake_before(speed_mps, stop_m, hill_mps2);
            return VehicleControl { steer, ..self.brake(brake) };
        }
        // Who cannot start on a climb would roll back onto those behind.
        if speed_mps < STANDING_MPS && view.is_too_steep() {
            return VehicleControl { steer, ..self.brake(1.0) };
        }
        let error_mps = target_mps - speed_mps;
        let (throttle, brake) = self.longitudinal.pedals(error_mps, hill_mps2, senses.dt_secs);
        VehicleControl { throttle, steer, brake, ..VehicleControl::default() }
    }

    /// Notes the place ahead that it drives for.
    fn aim(&mut self, senses: &Senses<'_>, speed_mps: f32) {
        let reach_m = (TARGET_M + TARGET_SECS * speed_mps.max(0.0)).min(self.path.length_m());
        let reach_m = (reach_m / SPACING_M).ceil() * SPACING_M;
        if let Some(target) = self.path.at(senses.network, reach_m) {
            self.target_m = target.point.point_m;
        }
    }

    /// How far it may drive where no way leads on, or somebody stands beyond the end of its route.
    fn end_m(&self, senses: &Senses<'_>, look_m: f32) -> f32 {
        match self.status {
            AgentStatus::Wandering => (self.path.length_m() - END_ROAD_M).max(0.0),
            _ => self.beyond_end_m(senses, look_m),
        }
    }

    fn brake(&self, brake: f32) -> VehicleControl {
        VehicleControl { brake, steer: self.steer, ..VehicleControl::default() }
    }

    /// As fast as options, limits, the end of the route, and curves with this grip allow.
    fn free_speed(
        &self,
        points: &[PathPoint],
        traits: &Traits,
        (speed_mps, bend_per_m_max): (f32, f32),
    ) -> f32 {
        let limit_mps = points.first().map_or(0.0, |here| here.point.limit_mps);
        let mut free_mps = traits.speed_mps(&self.options, limit_mps);
        let [curve_mps2, easy_mps2, early_mps2] =
            [CURVE_MPS2, EASY_MPS2, EARLY_MPS2].map(|dry_mps2| dry_mps2 * traits.grip);
        for (index, at) in points.iter().enumerate() {
            let bend_per_m = curvature_per_m(points, index).max(1.0e-4);
            let braking_mps2 = if bend_per_m > bend_per_m_max { early_mps2 } else { easy_mps2 };
            let curve = curve_mps2 / bend_per_m;
            free_mps = free_mps.min((curve + 2.0 * braking_mps2 * at.ahead_m).sqrt());
        }
        if self.status == AgentStatus::OnRoute {
            let braked = (2.0 * easy_mps2 * self.path.length_m()).sqrt().max(END_MPS);
            free_mps = free_mps.min(braked);
        }
        // A sudden limit is met by rolling, not by a full stop of the integral part.
        free_mps.max(0.0).min(speed_mps + 20.0)
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
                let point = LanePoint {
                    at_m,
                    point_m,
                    heading_rad,
                    curvature_per_m,
                    limit_mps: 0.0,
                    width_m: 3.5,
                };
                PathPoint { point, ahead_m: at_m }
            })
        };
        let options = AgentOptions { target_speed_mps: Some(20.0), ..AgentOptions::default() };
        let agent = Agent::new(options);
        let free_with_mps = |points: &[PathPoint], grip| {
            agent.free_speed(points, &Traits::of(&agent.options, grip), (19.0, 0.24))
        };
        let free_mps = |points: &[PathPoint]| free_with_mps(points, 1.0);
        assert_eq!(free_mps(&way(0.0)), 20.0);
        // Radius 20 m: 3.5 m/s² sideways are 8.37 m/s, and 15.81 m/s with 3 m/s² before it.
        for curvature_per_m in [0.05, -0.05] {
            let before_mps = free_mps(&way(curvature_per_m));
            assert!((before_mps - 15.81).abs() < 0.01, "{before_mps}");
            let wet_mps = free_with_mps(&way(curvature_per_m), 0.64);
            assert!((wet_mps - 0.8 * 15.81).abs() < 0.01, "{wet_mps}");
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

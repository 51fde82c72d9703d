//! One tick: pilots, then substeps of wheels, ground and bodies, then what came of it.

use agents::VehicleView;
use schemas::{ActorId, Error, Handling, Tick, Vec3, Weather};

use crate::actor::{Actor, Vehicle};
use crate::check;
use crate::collision::ContactLog;
use crate::overlap::OrientedBox;
use crate::physics::{BodyHandle, BodyState};
use crate::push::Surroundings;
use crate::scenery::Reach;
use crate::town::Town;
use crate::traffic::Passing;
use crate::vehicle::Fit;
use crate::walker::Walker;
use crate::wheel::AtTheWheel;
use crate::world::{State, World};

/// Share of grip that a road with standing water takes.
const WET_GRIP_LOSS: f32 = 0.35;
/// A vehicle tilted by more than this lies on its side or roof (cosine of 60°).
const LYING: f32 = 0.5;

/// Friction of roads in a weather over that of dry ones, 1 when dry.
#[must_use]
pub fn grip(weather: &Weather) -> f32 {
    let wet_percent = weather.wetness_percent.max(weather.precipitation_deposits_percent);
    1.0 - WET_GRIP_LOSS * (wet_percent / 100.0).clamp(0.0, 1.0)
}

impl World {
    /// Advances by one step.
    ///
    /// # Errors
    /// `WorldQuarantined` when an actor's motion is impossible although those are put to rest; the
    /// world must then not be used further.
    pub fn tick(&mut self) -> Result<(), Error> {
        self.tick_by(self.state.step.dt_secs)
    }

    /// Advances by one step of another length than the world's own.
    ///
    /// # Errors
    /// `InvalidArgument` for a length outside of the limits, with the world unchanged; otherwise as
    /// [`tick`](Self::tick).
    pub fn tick_by(&mut self, dt_secs: f64) -> Result<(), Error> {
        check::dt(dt_secs)?;
        self.state.dt_secs = dt_secs;
        self.state.rouse();
        self.state.heed_triggers();
        self.state.drive(&self.town);
        self.state.navigate(&self.town);
        self.state.follow_trajectories();
        self.state.bring_scenery(&self.town);
        let mut log = ContactLog::default();
        let (count, substep_secs) = self.state.step.substeps(dt_secs);
        let surroundings = Surroundings {
            ground: &self.town.ground,
            grip: self.state.grip(),
            dt_secs: substep_secs,
        };
        self.state.physics.make_room(dt_secs as f32, self.state.tick.0);
        for _ in 0..count {
            self.state.substep(surroundings, &mut log);
            if self.state.physics.is_at_rest() {
                break;
            }
        }
        self.state.halt_states();
        self.state.carry_attached(dt_secs as f32);
        self.state.draw_in_spring_arms(&self.town);
        self.state.settle(dt_secs as f32);
        self.state.measure_acceleration();
        self.state.collisions = self.state.contacts.conclude(log);
        self.state.follow_rules(&self.town);
        self.state.tick = Tick(self.state.tick.0 + 1);
        self.state.sim_secs += dt_secs;
        self.state.check()?;
        self.readings = self.state.measure(&self.town);
        Ok(())
    }
}

impl State {
    /// Friction of the whole road over that of a dry one.
    pub(crate) fn grip(&self) -> f32 {
        grip(&self.weather)
    }

    /// Lets pilots and Ackermann controllers choose this tick's controls.
    fn drive(&mut self, town: &Town) {
        let dt_secs = self.dt_secs as f32;
        let grip = self.grip();
        for index in 0..self.actors.len() {
            let actor = &mut self.actors[index];
            let Some(body) = actor.rigid() else { continue };
            let Some(vehicle) = actor.vehicle_mut() else { continue };
            let Vehicle { tuning, wheel, ackermann, .. } = vehicle;
            let motion = || self.physics.state(body);
            let control = match wheel {
                AtTheWheel::Client(hold) => hold.replaces(),
                AtTheWheel::Ackermann(target) => {
                    let speed_mps = motion().forward_mps();
                    Some(ackermann.control(target, tuning.fit(), speed_mps, dt_secs))
                }
                AtTheWheel::Pilot(pilot) => {
                    let view = view(tuning.fit(), &motion(), grip);
                    Some(pilot.control(&town.roads, &view, dt_secs))
                }
                // They look around first; see `navigate`.
                AtTheWheel::Agent | AtTheWheel::Traffic(_) => None,
            };
            if let Some(control) = control {
                self.set_control(index, control);
            }
        }
    }

    /// Wakes what has somewhere to go, wheels to turn or an engine that revs up: the physics does
    /// not know of it and would let it sleep on.
    fn rouse(&mut self) {
        for actor in &self.actors {
            let walks = actor.walker.as_deref().is_some_and(Walker::is_restless);
            let held = actor.outside.held_mps.is_some_and(|held_mps| held_mps != Vec3::zeros());
            let readies = actor.vehicle.as_deref().is_some_and(|vehicle| {
                let state = &vehicle.state;
                actor.switches.physics
                    && (state.is_steering(vehicle.tuning.fit()) || state.is_revving())
            });
            if let Some(body) = actor.rigid().filter(|_| walks || held || readies) {
                self.physics.wake(body);
            }
        }
    }

    /// Ends the forces of a tick, and notes what lies and what walks at a client's hand.
    fn settle(&mut self, dt_secs: f32) {
        for actor in &mut self.actors {
            actor.outside.force_n = Vec3::zeros();
            actor.outside.torque_nm = Vec3::zeros();
            let Some(body) = actor.rigid() else { continue };
            let physics_off = !actor.switches.physics;
            let told_mps = actor.outside.told_mps.norm();
            if let Some((spec, walker)) = actor.walker_mut().filter(|_| physics_off) {
                walker.stride(spec, told_mps, dt_secs);
                if walker.is_left() {
                    actor.outside.told_mps = Vec3::zeros();
                }
            }
            if let Some(vehicle) = actor.vehicle.as_deref_mut() {
                let up = self.physics.up(body);
                let lies = up.z < LYING;
                vehicle.tipped_secs = if lies { vehicle.tipped_secs + dt_secs } else { 0.0 };
            }
        }
    }

    fn velocities(&self) -> Vec<Vec3> {
        self.actors.iter().map(|actor| self.velocity_of(actor)).collect()
    }

    fn bring_scenery(&mut self, town: &Town) {
        let dt_secs = self.dt_secs as f32;
        let reaches: Vec<Reach> = self
            .actors
            .iter()
            .filter_map(|actor| Some((actor, actor.rigid()?)))
            .filter(|&(_, body)| !self.physics.is_asleep(body))
            .map(|(actor, body)| {
                let body = self.physics.state(body);
                let radius_m = actor.blueprint().box_half_extent_m().norm();
                Reach {
                    centre_m: body.world_from_body.translation.vector,
                    radius_m: radius_m + body.linear_mps.norm() * dt_secs,
                }
            })
            .collect();
        self.fixtures.update(&town.scenery, &self.hidden, &reaches, &mut self.physics);
    }

    fn substep(&mut self, surroundings: Surroundings<'_>, log: &mut ContactLog) {
        log.before(&self.actors, &self.physics);
        let mut faults = Vec::new();
        for actor in &mut self.actors {
            let awake = |body: &BodyHandle| !self.physics.is_asleep(*body);
            if let Some(body) = actor.rigid().filter(awake) {
                faults.extend(surroundings.push(actor, body, &mut self.physics));
            }
        }
        self.halt_bodies(&faults, |id| log.pose_before(id));
        let faults = self.physics.step(surroundings.dt_secs);
        self.halt_bodies(&faults, |id| log.pose_before(id));
        log.after(&self.physics);
    }

    /// Lets the lights take their turns, and tells moving vehicles which rules hold for them.
    fn follow_rules(&mut self, town: &Town) {
        let Some(lights) = &mut self.traffic else { return };
        lights.advance(&town.traffic, self.dt_secs);
        let mut near = Vec::new();
        let others = match town.traffic.has_crossings() {
            true => self.at_no_sign(),
            false => Vec::new(),
        };
        let Some(lights) = &self.traffic else { return };
        for actor in &mut self.actors {
            let Some(body) = actor.rigid() else { continue };
            let (id, blueprint, led_by_hand) =
                (actor.id, actor.blueprint(), !actor.switches.physics);
            let Some(vehicle) = actor.vehicle_mut() else { continue };
            let waits = vehicle.rules.waits(&town.traffic, self.first_actor);
            if self.physics.is_asleep(body) && !led_by_hand && !waits {
                continue;
            }
            let motion = self.physics.state(body);
            let outline = OrientedBox::new(&motion.world_from_body, blueprint);
            let passing = Passing {
                id,
                others: &others,
                world_from_vehicle: &motion.world_from_body,
                outline: &outline,
                speed_mps: motion.linear_mps.norm(),
                lights,
                network: &|| town.network(),
            };
            let signals = (&town.traffic, self.first_actor);
            vehicle.rules.update(&town.roads, signals, &passing, &mut near, self.dt_secs);
        }
    }

    /// The boxes of all vehicles that are at no stop or yield sign.
    fn at_no_sign(&self) -> Vec<(ActorId, OrientedBox)> {
        let outline = |actor: &Actor| {
            let body = actor.rigid()?;
            actor.vehicle.as_deref().filter(|vehicle| !vehicle.rules.is_at_sign())?;
            let pose = self.physics.state(body).world_from_body;
            Some((actor.id, OrientedBox::new(&pose, actor.blueprint())))
        };
        self.actors.iter().filter_map(outline).collect()
    }

    /// Pushes and velocities that clients gave since the last tick count, as in CARLA.
    fn measure_acceleration(&mut self) {
        let dt_secs = self.dt_secs as f32;
        let velocities_mps = self.velocities();
        for (actor, velocity_mps) in self.actors.iter_mut().zip(velocities_mps) {
            let before_mps = std::mem::replace(&mut actor.last_mps, velocity_mps);
            actor.acceleration_mps2 = (velocity_mps - before_mps) / dt_secs;
        }
    }
}

/// What a driver knows of a vehicle, on a road with this grip.
pub(crate) fn view(fit: &Fit, body: &BodyState, grip: f32) -> VehicleView {
    let full_lock_rad = fit.full_lock_rad(body.linear_mps.norm());
    VehicleView { full_lock_rad, ..unsteered_view(fit, body, grip) }
}

/// As [`view`], for a driver who does not steer: with the lock of a vehicle that stands.
pub(crate) fn unsteered_view(fit: &Fit, body: &BodyState, grip: f32) -> VehicleView {
    VehicleView {
        world_from_vehicle: body.world_from_body,
        velocity_mps: body.linear_mps,
        wheelbase_m: fit.wheelbase_m,
        full_lock_rad: fit.steer_rad_max,
        half_track_m: match fit.physics.handling {
            Handling::Real => 0.0,
            Handling::Carla => fit.half_track_m,
        },
        bend_per_m_max: fit.bend_per_m_max,
        understeer_rad_per_mps2: fit.understeer_rad_per_mps2,
        grip,
        start_mps2: fit.start_mps2,
    }
}

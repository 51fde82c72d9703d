//! One tick: pilots, then substeps of wheels, ground and bodies, then what came of it.

use agents::VehicleView;
use schemas::{Error, ErrorCode, Pose, Tick, Vec3, Weather, limits};

use crate::actor::Actor;
use crate::blueprint::BodySpec;
use crate::collision::ContactLog;
use crate::fallen;
use crate::physics::{BodyHandle, BodyState, NotFinite, Physics};
use crate::scenery::Reach;
use crate::town::Town;
use crate::vehicle::{Chassis, Impulse, VehicleSpec, understeer_rad_per_mps2};
use crate::world::{State, World};

/// Longest substep: CARLA's default, and short enough for stiff tyres and springs.
const SUBSTEP_SECS_MAX: f64 = 0.01;
/// Share of grip that a road with standing water takes.
const WET_GRIP_LOSS: f32 = 0.35;
/// A body faster than this has been hit by a numerical failure, not by a car.
const SPEED_MPS_MAX: f32 = 2.0 * limits::SPEED_MPS_MAX;

impl World {
    /// Advances by one step.
    ///
    /// # Errors
    /// `WorldQuarantined` when a body's state is no longer a number or left the map's coordinates.
    /// The world must then not be used further.
    pub fn tick(&mut self) -> Result<(), Error> {
        self.state.drive(&self.town);
        let velocities_mps = self.state.velocities();
        self.state.bring_scenery(&self.town);
        let mut log = ContactLog::default();
        let (count, dt_secs) = substeps(self.state.dt_secs);
        let grip = grip(&self.state.weather);
        for _ in 0..count {
            self.state.substep(&self.town, grip, dt_secs, &mut log)?;
        }
        self.state.carry_attached(self.state.dt_secs as f32);
        self.state.measure_acceleration(&velocities_mps);
        self.state.collisions = self.state.contacts.conclude(log);
        self.state.tick = Tick(self.state.tick.0 + 1);
        self.state.check()
    }
}

/// How many substeps make one tick, and their length.
fn substeps(dt_secs: f64) -> (u32, f32) {
    // The small term keeps 0.05 s at five substeps although 0.05 / 0.01 rounds to just above 5.
    let count = (dt_secs / SUBSTEP_SECS_MAX - 1.0e-6).ceil().max(1.0);
    (count as u32, (dt_secs / count) as f32)
}

/// Friction of the whole road over that of a dry one.
fn grip(weather: &Weather) -> f32 {
    let wet_percent = weather.wetness_percent.max(weather.precipitation_deposits_percent);
    1.0 - WET_GRIP_LOSS * (wet_percent / 100.0).clamp(0.0, 1.0)
}

impl State {
    /// Lets the pilots choose this tick's controls.
    fn drive(&mut self, town: &Town) {
        let dt_secs = self.dt_secs as f32;
        for actor in &mut self.actors {
            let Some(body) = actor.rigid() else { continue };
            let Some((spec, vehicle)) = actor.vehicle_mut() else { continue };
            let Some(pilot) = &mut vehicle.pilot else { continue };
            let body_state = self.physics.state(body);
            let view = view(spec, &body_state);
            let control = pilot.control(&town.roads, &view, dt_secs);
            if std::mem::replace(&mut vehicle.state.control, control) != control {
                self.physics.wake(body);
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
        self.fixtures.update(&town.scenery, &reaches, &mut self.physics);
    }

    fn substep(
        &mut self,
        town: &Town,
        grip: f32,
        dt_secs: f32,
        log: &mut ContactLog,
    ) -> Result<(), Error> {
        log.before(&self.actors, &self.physics);
        for actor in &mut self.actors {
            let awake = |body: &BodyHandle| !self.physics.is_asleep(*body);
            if let Some(body) = actor.rigid().filter(awake) {
                push_by_ground(actor, body, &mut self.physics, town, grip, dt_secs);
            }
        }
        self.physics.step(dt_secs).map_err(|NotFinite| {
            let message = format!("the physics diverged after {}", self.tick);
            Error::new(ErrorCode::WorldQuarantined, message)
                .wanted("finite poses and velocities")
                .found("a value that is not a number")
        })?;
        log.after(&self.physics);
        Ok(())
    }

    fn measure_acceleration(&mut self, before_mps: &[Vec3]) {
        let dt_secs = self.dt_secs as f32;
        let after_mps = self.velocities();
        let change = after_mps.into_iter().zip(before_mps);
        for (actor, (after_mps, before_mps)) in self.actors.iter_mut().zip(change) {
            actor.acceleration_mps2 = (after_mps - before_mps) / dt_secs;
        }
    }

    /// # Errors
    /// `WorldQuarantined` for the first actor that is nowhere or impossibly fast.
    pub(crate) fn check(&self) -> Result<(), Error> {
        for actor in &self.actors {
            let body = self.motion_of(actor);
            let farthest_m = body.world_from_body.translation.vector.amax();
            let fastest_mps = body.linear_mps.amax().max(body.angular_radps.amax());
            // Negated, so that NaN fails as well.
            let sane = farthest_m <= limits::COORDINATE_M_MAX && fastest_mps <= SPEED_MPS_MAX;
            if !sane {
                let message = format!("{} diverged at {}", actor.id, self.tick);
                return Err(Error::new(ErrorCode::WorldQuarantined, message)
                    .wanted("finite positions and speeds within the limits")
                    .found(format!("{farthest_m} m from the origin, {fastest_mps} m/s")));
            }
        }
        Ok(())
    }
}

/// What a pilot sees.
pub(crate) fn view(spec: &VehicleSpec, body: &BodyState) -> VehicleView {
    VehicleView {
        world_from_vehicle: body.world_from_body,
        velocity_mps: body.linear_mps,
        wheelbase_m: spec.wheelbase_m,
        full_lock_rad: spec.full_lock_rad(body.linear_mps.norm()),
        understeer_rad_per_mps2: understeer_rad_per_mps2(),
    }
}

/// Wheels, air and ground on one awake actor.
fn push_by_ground(
    actor: &mut Actor,
    handle: BodyHandle,
    physics: &mut Physics,
    town: &Town,
    grip: f32,
    dt_secs: f32,
) {
    let body = &physics.state(handle);
    let mut total = Impulse::default();
    if let Some((spec, vehicle)) = actor.vehicle_mut() {
        let chassis = Chassis::new(
            &body.world_from_body,
            body.centre_of_mass_m,
            body.linear_mps,
            body.angular_radps,
        );
        total = vehicle.state.substep(spec, &chassis, &town.ground, grip, dt_secs);
    }
    if !rides_on_wheels(actor, &body.world_from_body) {
        let response = physics.response(handle);
        let pushed = response.pushed(body, &total);
        let shape = ground_box(actor);
        total += fallen::ground_impulse(&pushed, &response, shape, &town.ground, dt_secs);
    }
    physics.push(handle, &total, dt_secs);
}

/// Whether a vehicle stands upright enough that only its wheels can touch the ground.
fn rides_on_wheels(actor: &Actor, world_from_actor: &Pose) -> bool {
    let up = world_from_actor.rotation * Vec3::z();
    actor.vehicle.as_deref().is_some_and(|vehicle| up.z > 0.9 && vehicle.state.is_carried())
}

/// The box that keeps an actor out of the ground: centre and half size in its frame.
fn ground_box(actor: &Actor) -> (Vec3, Vec3) {
    let blueprint = actor.blueprint();
    let (mut centre_m, mut half_m) = (blueprint.box_centre_m(), blueprint.box_half_extent_m());
    if let BodySpec::Vehicle(spec) = blueprint.body {
        centre_m.z += spec.ground_clearance_m / 2.0;
        half_m.z -= spec.ground_clearance_m / 2.0;
    }
    (centre_m, half_m)
}

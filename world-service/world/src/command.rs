//! Commands: checked whole before the first change, so that a refused one changes nothing.

use agents::Pilot;
use schemas::{
    ActorId, Command, CommandReply, Error, ErrorCode, PilotMode, Pose, Vec3, VehicleControl,
    Weather, limits,
};

use crate::actor::{Actor, Vehicle};
use crate::body::Body;
use crate::check;
use crate::physics::BodyHandle;
use crate::spawn::Wish;
use crate::world::World;
use crate::{place, step};

impl World {
    /// Carries out one command.
    ///
    /// # Errors
    /// Says what was wanted and what was found; the world is unchanged.
    pub fn apply(&mut self, command: &Command) -> CommandReply {
        match command {
            Command::SpawnActor {
                blueprint,
                world_from_actor,
                linear_velocity_mps,
                attributes,
                attachment,
            } => {
                let (pose, linear_mps) = (world_from_actor, *linear_velocity_mps);
                let attachment = *attachment;
                self.spawn(&Wish { blueprint, pose, linear_mps, attributes, attachment }).map(Some)
            }
            Command::DestroyActor { actor } => self.destroy(*actor).map(|()| None),
            Command::SetControl { actor, control } => {
                self.set_control(*actor, *control).map(|()| None)
            }
            Command::SetPilot { actor, mode, target_speed_mps } => {
                self.set_pilot(*actor, *mode, *target_speed_mps).map(|()| None)
            }
            Command::SetAckermann { actor, control } => {
                self.set_ackermann(*actor, *control).map(|()| None)
            }
            Command::SetAckermannGains { actor, gains } => {
                self.set_gains(*actor, *gains).map(|()| None)
            }
            Command::SetVehiclePhysics { actor, physics } => {
                self.set_vehicle_physics(*actor, physics).map(|()| None)
            }
            Command::SetVelocity { actor, linear_mps, angular_radps } => {
                self.set_velocity(*actor, *linear_mps, *angular_radps).map(|()| None)
            }
            Command::SetPose { actor, world_from_actor } => {
                self.set_pose(*actor, world_from_actor).map(|()| None)
            }
            Command::SetWeather { weather } => self.set_weather(*weather).map(|()| None),
            other => Err(Error::new(ErrorCode::Unsupported, "the world cannot do this")
                .found(format!("{other:?}"))),
        }
    }

    fn destroy(&mut self, id: ActorId) -> Result<(), Error> {
        let index = self.state.index_of(id)?;
        self.state.detach_from(id);
        let actor = self.state.actors.remove(index);
        if let Some(body) = actor.rigid() {
            self.state.physics.remove_body(body);
        }
        self.state.contacts.forget(id);
        Ok(())
    }

    fn set_control(&mut self, id: ActorId, control: VehicleControl) -> Result<(), Error> {
        check::control(&control)?;
        let (vehicle, body) = self.vehicle_mut(id)?;
        vehicle.pilot = None;
        vehicle.ackermann.release();
        let changed = std::mem::replace(&mut vehicle.state.control, control) != control;
        if changed {
            // Rapier does not know of our controls and would let the body sleep on.
            self.state.physics.wake(body);
        }
        Ok(())
    }

    fn set_pilot(
        &mut self,
        id: ActorId,
        mode: PilotMode,
        target_speed_mps: Option<f32>,
    ) -> Result<(), Error> {
        if let Some(speed_mps) = target_speed_mps {
            check::range("target speed", speed_mps, 0.0, limits::SPEED_MPS_MAX, "m/s")?;
        }
        self.vehicle_mut(id)?;
        let index = self.state.index_of(id)?;
        let actor = &mut self.state.actors[index];
        let Some(handle) = actor.rigid() else { return Ok(()) };
        let body = self.state.physics.state(handle);
        let Some(vehicle) = actor.vehicle_mut() else { return Ok(()) };
        let speed_mps = target_speed_mps.unwrap_or_else(|| body.forward_mps().max(0.0));
        let view = step::view(vehicle.tuning.fit(), &body);
        vehicle.ackermann.release();
        vehicle.pilot = Some(Pilot::new(&self.town.roads, mode, speed_mps, &view));
        Ok(())
    }

    fn set_velocity(
        &mut self,
        id: ActorId,
        linear_mps: Option<Vec3>,
        angular_radps: Option<Vec3>,
    ) -> Result<(), Error> {
        let index = self.state.index_of(id)?;
        let actor = &mut self.state.actors[index];
        let handle = rigid(actor)?;
        let body = self.state.physics.state(handle);
        let linear_mps = linear_mps.unwrap_or(body.linear_mps);
        let angular_radps = angular_radps.unwrap_or(body.angular_radps);
        check::vector("velocity", linear_mps, limits::SPEED_MPS_MAX, "m/s")?;
        check::vector("angular velocity", angular_radps, check::SPIN_RADPS_MAX, "rad/s")?;
        let forward = body.world_from_body.rotation * Vec3::x();
        if let Some(Vehicle { state, tuning, .. }) = actor.vehicle_mut() {
            state.set_rolling(tuning.fit(), forward.dot(&linear_mps));
        }
        self.state.physics.set_velocity(handle, linear_mps, angular_radps);
        Ok(())
    }

    /// In the parent's frame for what is attached, as at its spawn.
    fn set_pose(&mut self, id: ActorId, world_from_actor: &Pose) -> Result<(), Error> {
        check::pose(world_from_actor)?;
        let index = self.state.index_of(id)?;
        let actor = &mut self.state.actors[index];
        let placed = place::on_ground(actor.blueprint(), world_from_actor, &self.town.ground);
        if let Some(vehicle) = actor.vehicle_mut() {
            vehicle.state.lift();
        }
        match &mut actor.body {
            Body::Rigid(handle) => self.state.physics.set_pose(*handle, &placed.world_from_actor),
            Body::Fixed(pose) => *pose = *world_from_actor,
            Body::Attached(attached) => attached.parent_from_actor = *world_from_actor,
        }
        Ok(())
    }

    fn set_weather(&mut self, weather: Weather) -> Result<(), Error> {
        check::weather(&weather)?;
        self.state.weather = weather;
        // A vehicle that stood on a dry slope may slide on a wet one.
        let vehicles = self.state.actors.iter().filter(|actor| actor.vehicle.is_some());
        for body in vehicles.filter_map(Actor::rigid) {
            self.state.physics.wake(body);
        }
        Ok(())
    }

    /// # Errors
    /// `UnknownActor`, or `InvalidArgument` for an actor without wheels.
    pub(crate) fn vehicle_mut(&mut self, id: ActorId) -> Result<(&mut Vehicle, BodyHandle), Error> {
        let index = self.state.index_of(id)?;
        let actor = &mut self.state.actors[index];
        let (kind, body) = (actor.blueprint().kind(), actor.rigid());
        let vehicle = actor.vehicle.as_deref_mut().zip(body).ok_or_else(|| {
            Error::new(ErrorCode::InvalidArgument, "the actor cannot be driven")
                .wanted("a vehicle")
                .found(format!("{id}, a {kind:?}"))
        })?;
        Ok(vehicle)
    }
}

/// # Errors
/// `InvalidArgument` for an actor that is not in the physics.
fn rigid(actor: &Actor) -> Result<BodyHandle, Error> {
    actor.rigid().ok_or_else(|| {
        Error::new(ErrorCode::InvalidArgument, "the actor has no body of its own")
            .wanted("a vehicle, a walker or a prop that stands alone")
            .found(format!("{}, {}", actor.id, actor.blueprint().id))
    })
}

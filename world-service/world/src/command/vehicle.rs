//! Commands for vehicles.

use agents::Pilot;
use schemas::{ActorId, Error, ErrorCode, PilotMode, VehicleCommand, VehicleControl, limits};

use crate::actor::Vehicle;
use crate::check;
use crate::physics::BodyHandle;
use crate::step;
use crate::wheel::{AtTheWheel, Hold};
use crate::world::World;

/// One bit for each door that a vehicle can have.
const DOORS: u8 = 0b11_1111;

impl World {
    pub(super) fn change_vehicle(&mut self, command: &VehicleCommand) -> Result<(), Error> {
        match command {
            VehicleCommand::Control { actor, control } => self.set_control(*actor, *control),
            VehicleCommand::Ackermann { actor, control } => self.set_ackermann(*actor, *control),
            VehicleCommand::AckermannGains { actor, gains } => self.set_gains(*actor, *gains),
            VehicleCommand::Pilot { actor, mode, target_speed_mps } => {
                self.set_pilot(*actor, *mode, *target_speed_mps)
            }
            VehicleCommand::Physics { actor, physics } => self.set_vehicle_physics(*actor, physics),
            VehicleCommand::Lights { actor, lights } => self.set_vehicle_lights(*actor, *lights),
            VehicleCommand::Doors { actor, doors, open } => self.set_doors(*actor, *doors, *open),
        }
    }

    fn set_control(&mut self, id: ActorId, control: VehicleControl) -> Result<(), Error> {
        check::control(&control)?;
        let (vehicle, _) = self.vehicle_mut(id)?;
        let hold = if vehicle.sticky { Hold::Sticky } else { Hold::OneTick };
        let index = self.state.index_of(id)?;
        self.state.seat(index, AtTheWheel::Client(hold));
        self.state.set_control(index, control);
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
        let grip = self.state.grip();
        let actor = &mut self.state.actors[index];
        let Some(handle) = actor.rigid() else { return Ok(()) };
        let body = self.state.physics.state(handle);
        let Some(vehicle) = actor.vehicle_mut() else { return Ok(()) };
        let speed_mps = target_speed_mps.unwrap_or_else(|| body.forward_mps().max(0.0));
        let view = step::view(vehicle.tuning.fit(), &body, grip);
        let mut pilot = Pilot::new(&self.town.roads, mode, speed_mps, &view);
        if let Some(before) = vehicle.wheel.pilot() {
            pilot = pilot.after(before);
        }
        self.state.seat(index, AtTheWheel::Pilot(Box::new(pilot)));
        Ok(())
    }

    fn set_vehicle_lights(&mut self, id: ActorId, lights: u32) -> Result<(), Error> {
        self.vehicle_mut(id)?;
        let index = self.state.index_of(id)?;
        self.state.actors[index].lights = lights;
        Ok(())
    }

    fn set_doors(&mut self, id: ActorId, doors: u8, open: bool) -> Result<(), Error> {
        if doors & !DOORS != 0 {
            return Err(Error::new(ErrorCode::InvalidArgument, "no vehicle has such doors")
                .wanted(format!("bits of {DOORS:#010b}"))
                .found(format!("{doors:#010b}")));
        }
        self.vehicle_mut(id)?;
        let index = self.state.index_of(id)?;
        let actor = &mut self.state.actors[index];
        actor.doors = if open { actor.doors | doors } else { actor.doors & !doors };
        Ok(())
    }

    /// # Errors
    /// `UnknownActor`, or `InvalidArgument` for an actor without wheels.
    pub(crate) fn vehicle_mut(&mut self, id: ActorId) -> Result<(&mut Vehicle, BodyHandle), Error> {
        let index = self.state.index_of(id)?;
        let actor = &mut self.state.actors[index];
        let (kind, body) = (actor.blueprint().kind(), actor.rigid());
        actor.vehicle.as_deref_mut().zip(body).ok_or_else(|| {
            Error::new(ErrorCode::InvalidArgument, "the actor cannot be driven")
                .wanted("a vehicle")
                .found(format!("{id}, a {kind:?}"))
        })
    }
}

//! Commands for vehicles.

use agents::Pilot;
use schemas::{ActorId, Error, ErrorCode, PilotMode, VehicleControl, limits};

use crate::actor::{Hold, Vehicle};
use crate::check;
use crate::physics::BodyHandle;
use crate::step;
use crate::world::World;

/// One bit for each door that a vehicle can have.
const DOORS: u8 = 0b11_1111;

impl World {
    pub(super) fn set_control(
        &mut self,
        id: ActorId,
        control: VehicleControl,
    ) -> Result<(), Error> {
        check::control(&control)?;
        let (vehicle, body) = self.vehicle_mut(id)?;
        vehicle.hand_over();
        if vehicle.hold == Hold::Spent {
            vehicle.hold = Hold::OneTick;
        }
        let changed = std::mem::replace(&mut vehicle.state.control, control) != control;
        if changed {
            // Rapier does not know of our controls and would let the body sleep on.
            self.state.physics.wake(body);
        }
        Ok(())
    }

    pub(super) fn set_pilot(
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
        vehicle.hand_over();
        vehicle.pilot = Some(Pilot::new(&self.town.roads, mode, speed_mps, &view));
        Ok(())
    }

    pub(super) fn set_vehicle_lights(&mut self, id: ActorId, lights: u32) -> Result<(), Error> {
        self.vehicle_mut(id)?;
        let index = self.state.index_of(id)?;
        self.state.actors[index].lights = lights;
        Ok(())
    }

    pub(super) fn set_doors(&mut self, id: ActorId, doors: u8, open: bool) -> Result<(), Error> {
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

//! Commands and questions about how a vehicle drives, and how controls reach it.

use schemas::{
    AckermannControl, AckermannGains, ActorId, Error, ErrorCode, VehicleControl, VehiclePhysics,
    VehicleReport,
};

use crate::vehicle::{check, telemetry};
use crate::wheel::AtTheWheel;
use crate::world::{State, World};

impl World {
    pub(crate) fn set_ackermann(
        &mut self,
        id: ActorId,
        target: AckermannControl,
    ) -> Result<(), Error> {
        check::ackermann(&target)?;
        let (_, body) = self.vehicle_mut(id)?;
        let speed_mps = self.state.physics.state(body).forward_mps();
        let (vehicle, _) = self.vehicle_mut(id)?;
        if vehicle.wheel.ackermann().is_none() {
            vehicle.ackermann = vehicle.ackermann.begun(speed_mps, vehicle.state.road_wheel_rad);
        }
        let index = self.state.index_of(id)?;
        self.state.seat(index, AtTheWheel::Ackermann(target));
        Ok(())
    }

    pub(crate) fn set_gains(&mut self, id: ActorId, gains: AckermannGains) -> Result<(), Error> {
        check::gains(&gains)?;
        self.vehicle_mut(id)?.0.ackermann.gains = gains;
        Ok(())
    }

    pub(crate) fn set_vehicle_physics(
        &mut self,
        id: ActorId,
        physics: &VehiclePhysics,
    ) -> Result<(), Error> {
        let (vehicle, body) = self.vehicle_mut(id)?;
        check::physics(physics, vehicle.tuning.fit())?;
        let handled_otherwise = physics.handling != vehicle.tuning.fit().physics.handling;
        let tuning = vehicle.tuning.with(physics.clone());
        vehicle.tuning = tuning.clone();
        if handled_otherwise {
            vehicle.state.couple(tuning.fit());
        }
        self.state.physics.set_vehicle_mass(body, tuning.fit());
        Ok(())
    }

    /// Parameters and last measurements of a vehicle.
    ///
    /// # Errors
    /// `UnknownActor`, or `InvalidArgument` for an actor without wheels.
    pub fn vehicle_report(&self, id: ActorId) -> Result<VehicleReport, Error> {
        let actor = &self.state.actors[self.state.index_of(id)?];
        let vehicle = actor.vehicle.as_deref().ok_or_else(|| {
            Error::new(ErrorCode::InvalidArgument, "the actor has no wheels")
                .wanted("a vehicle")
                .found(format!("{id}, {}", actor.blueprint().id))
        })?;
        let (fit, motion) = (vehicle.tuning.fit(), self.state.motion_of(actor));
        Ok(VehicleReport {
            physics: fit.physics.clone(),
            telemetry: telemetry(
                fit,
                &vehicle.state,
                motion.forward_mps(),
                motion.linear_mps.norm(),
            ),
            gains: vehicle.ackermann.gains,
        })
    }
}

impl State {
    /// Lets somebody else drive a vehicle; one that moved without dynamics has them again.
    pub(crate) fn seat(&mut self, index: usize, driver: AtTheWheel) {
        let vehicle = self.actors[index].vehicle.as_deref();
        let traffic = vehicle.and_then(|vehicle| vehicle.wheel.traffic());
        if traffic.is_some_and(|traffic| traffic.on_rails) {
            self.set_rails(index, false);
        }
        if let Some(vehicle) = self.actors[index].vehicle_mut() {
            vehicle.wheel = driver;
        }
    }

    /// Gives a vehicle its control for the next tick, whoever chose it.
    pub(crate) fn set_control(&mut self, index: usize, control: VehicleControl) {
        let actor = &mut self.actors[index];
        let body = actor.rigid();
        let Some((vehicle, body)) = actor.vehicle_mut().zip(body) else { return };
        if std::mem::replace(&mut vehicle.state.control, control) != control {
            // Rapier does not know of our controls and would let the body sleep on.
            self.physics.wake(body);
        }
    }
}

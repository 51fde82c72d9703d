//! Commands and questions about how a vehicle drives.

use schemas::{
    AckermannControl, AckermannGains, ActorId, Error, ErrorCode, VehiclePhysics, VehicleReport,
};

use crate::vehicle::{check, telemetry};
use crate::world::World;

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
        vehicle.hand_over();
        let road_wheel_rad = vehicle.state.road_wheel_rad;
        vehicle.ackermann.aim(target, speed_mps, road_wheel_rad);
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
        let tuning = vehicle.tuning.with(physics.clone());
        vehicle.tuning = tuning.clone();
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

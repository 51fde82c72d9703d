//! Commands for the world as a whole.

use schemas::{Error, Weather};

use crate::actor::Actor;
use crate::check;
use crate::time_step::TimeStep;
use crate::world::World;

impl World {
    pub(super) fn set_weather(&mut self, weather: Weather) -> Result<(), Error> {
        check::weather(&weather)?;
        self.state.weather = weather;
        // A vehicle that stood on a dry slope may slide on a wet one.
        let vehicles = self.state.actors.iter().filter(|actor| actor.vehicle.is_some());
        for body in vehicles.filter_map(Actor::rigid) {
            self.state.physics.wake(body);
        }
        Ok(())
    }

    pub(super) fn set_time_step(
        &mut self,
        dt_secs: f64,
        substep_secs_max: Option<f64>,
        substeps_max: Option<u32>,
    ) -> Result<(), Error> {
        let present = self.state.step;
        let step = TimeStep {
            dt_secs,
            substep_secs_max: substep_secs_max.unwrap_or(present.substep_secs_max),
            substeps_max: substeps_max.unwrap_or(present.substeps_max),
        };
        self.state.step = step.checked()?;
        if self.state.tick.0 == 0 {
            self.state.dt_secs = dt_secs;
        }
        Ok(())
    }
}

//! Commands to traffic lights.

use schemas::{ActorId, Error, ErrorCode, TrafficLightColour};

use crate::check;
use crate::world::World;

/// Longest time a light may be told to show one colour: thirty years, which programs mean by for
/// ever.
const SHOWN_SECS_MAX: f32 = 1.0e9;

impl World {
    /// `times_secs` are green, yellow and red; `None` stays.
    pub(crate) fn set_traffic_light(
        &mut self,
        id: ActorId,
        colour: Option<TrafficLightColour>,
        times_secs: [Option<f32>; 3],
    ) -> Result<(), Error> {
        let light = self.light(id)?;
        for secs in times_secs.into_iter().flatten() {
            check::range("time of a traffic light", secs, 0.0, SHOWN_SECS_MAX, "s")?;
        }
        let Some(lights) = &mut self.state.traffic else { return Ok(()) };
        if let Some(times) = lights.times_mut(&self.town.traffic, light) {
            let [green_secs, yellow_secs, red_secs] = times_secs;
            times.green_secs = green_secs.unwrap_or(times.green_secs);
            times.yellow_secs = yellow_secs.unwrap_or(times.yellow_secs);
            times.red_secs = red_secs.unwrap_or(times.red_secs);
        }
        if let Some(colour) = colour {
            lights.show(light, colour);
        }
        Ok(())
    }

    /// In a world without lights there is nothing to freeze.
    pub(crate) fn freeze_traffic_lights(&mut self, frozen: bool) {
        if let Some(lights) = &mut self.state.traffic {
            lights.freeze(frozen);
        }
    }

    pub(crate) fn reset_traffic_lights(&mut self, id: Option<ActorId>) -> Result<(), Error> {
        let light = id.map(|id| self.light(id)).transpose()?;
        if let Some(lights) = &mut self.state.traffic {
            lights.reset(&self.town.traffic, light);
        }
        Ok(())
    }

    /// Takes a light or sign away, with its posts; what hangs on it stays where it is. Its group
    /// goes on without it.
    pub(super) fn destroy_signal(&mut self, id: ActorId, position: usize) {
        let (state, plan) = (&mut self.state, &self.town.traffic);
        state.detach_from(id);
        let Some(lights) = &mut state.traffic else { return };
        lights.destroy(position);
        for actor in &mut state.actors {
            if let Some(vehicle) = actor.vehicle_mut() {
                vehicle.rules.forget(id);
            }
        }
        for place in plan.places(position) {
            state.hidden.set(*place, true);
        }
        state.fixtures.leave_hidden(&self.town.scenery, &state.hidden, &mut state.physics);
    }

    /// # Errors
    /// `UnknownActor`, or `InvalidArgument` for an actor that is no traffic light.
    fn light(&self, id: ActorId) -> Result<usize, Error> {
        match self.fixed_position(id) {
            None => drop(self.state.index_of(id)?),
            Some(position) if position < self.town.traffic.light_count() => return Ok(position),
            Some(_) => {}
        }
        Err(Error::new(ErrorCode::InvalidArgument, "the actor is not a traffic light")
            .wanted("the id of a traffic light")
            .found(id))
    }
}

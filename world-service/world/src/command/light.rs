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

    /// # Errors
    /// `InvalidArgument` for a light or sign of the map.
    pub(crate) fn check_spawned(&self, id: ActorId) -> Result<(), Error> {
        let position = self.fixed_position(id);
        let Some(kind) = position.and_then(|at| self.town.traffic.kind(at)) else { return Ok(()) };
        Err(Error::new(ErrorCode::InvalidArgument, "lights and signs belong to the map")
            .wanted("an actor that was spawned")
            .found(format!("{id}, a {kind:?}")))
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

    /// The position of a light or sign of the town among them.
    fn fixed_position(&self, id: ActorId) -> Option<usize> {
        self.state.traffic.as_ref()?;
        self.town.traffic.position(id, self.state.first_actor)
    }
}

//! Commands that take parts of the map away and bring them back.

use roads::MapLayer;
use schemas::{Error, ErrorCode, SceneryCommand};

use crate::traffic::Lights;
use crate::world::World;

impl World {
    pub(super) fn change_scenery(&mut self, command: &SceneryCommand) -> Result<(), Error> {
        match command {
            SceneryCommand::Layers { layers, loaded } => {
                self.set_map_layers(*layers, *loaded);
                Ok(())
            }
            SceneryCommand::Objects { objects, enabled } => {
                self.set_environment_objects(objects, *enabled)
            }
        }
    }

    /// Layers by CARLA's flags; those that are as wanted already are left alone.
    fn set_map_layers(&mut self, layers: u16, loaded: bool) {
        let state = &mut self.state;
        let unloaded = state.hidden.layers;
        let changed = layers & MapLayer::ALL & if loaded { unloaded } else { !unloaded };
        state.hidden.layers = unloaded ^ changed;
        let objects = self.town.roads.environment_objects().iter();
        let gone_or_back = objects.filter(|object| object.goes_with(changed));
        for place in gone_or_back.filter_map(|object| object.scenery) {
            state.hidden.set(place, !loaded);
        }
        state.fixtures.leave_hidden(&self.town.scenery, &state.hidden, &mut state.physics);
    }

    /// Posts of lights and signs that were destroyed do not come back.
    ///
    /// # Errors
    /// `InvalidArgument` for an id that no object of the map has.
    fn set_environment_objects(&mut self, ids: &[u64], enabled: bool) -> Result<(), Error> {
        let objects = self.town.roads.environment_objects();
        let places = ids.iter().map(|id| {
            let at = objects.binary_search_by_key(id, |object| object.id).map_err(|_| {
                Error::new(ErrorCode::InvalidArgument, "no such thing on this map")
                    .wanted("the id of an environment object")
                    .found(id)
            })?;
            let object = &objects[at];
            let is_loaded = !object.goes_with(self.state.hidden.layers);
            Ok(object.scenery.filter(|_| is_loaded).or(object.post))
        });
        let places: Vec<Option<u32>> = places.collect::<Result<_, Error>>()?;
        let state = &mut self.state;
        for place in places.into_iter().flatten() {
            state.hidden.set(place, !enabled);
        }
        let plan = &self.town.traffic;
        let gone = state.traffic.iter().flat_map(Lights::gone);
        for place in gone.flat_map(|position| plan.places(position)) {
            state.hidden.set(*place, true);
        }
        state.fixtures.leave_hidden(&self.town.scenery, &state.hidden, &mut state.physics);
        Ok(())
    }
}

//! Commands that take parts of the map away, bring them back and paint them.

use std::sync::Arc;

use roads::{EnvironmentObject, MapLayer};
use schemas::{Error, ErrorCode, MaterialParameter, SceneryCommand, Texture};

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
            SceneryCommand::Paint { objects, parameter, texture } => {
                self.paint(objects, *parameter, texture)
            }
        }
    }

    /// Layers by CARLA's flags; those that are as wanted already are left alone. What comes back is
    /// as the map has it, without paint.
    fn set_map_layers(&mut self, layers: u16, loaded: bool) {
        let state = &mut self.state;
        let unloaded = state.hidden.layers;
        let changed = layers & MapLayer::ALL & if loaded { unloaded } else { !unloaded };
        state.hidden.layers = unloaded ^ changed;
        let objects = self.town.roads.environment_objects().iter();
        let gone_or_back = objects.filter(|object| object.goes_with(changed));
        let mut places: Vec<u32> = gone_or_back.filter_map(|object| object.scenery).collect();
        places.sort_unstable();
        for place in &places {
            state.hidden.set(*place, !loaded);
        }
        state.paint.strip(|place| places.binary_search(&place).is_ok());
        state.fixtures.leave_hidden(&self.town.scenery, &state.hidden, &mut state.physics);
    }

    /// Posts of lights and signs that were destroyed do not come back.
    ///
    /// # Errors
    /// `InvalidArgument` for an id that no object of the map has.
    fn set_environment_objects(&mut self, ids: &[u64], enabled: bool) -> Result<(), Error> {
        let objects = self.loaded_objects(ids)?;
        let places: Vec<u32> = objects.iter().filter_map(|object| object.place).collect();
        let state = &mut self.state;
        for place in places {
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

    /// # Errors
    /// `InvalidArgument` for an id that no object of the map has; those of `Painted::paint`.
    fn paint(
        &mut self,
        ids: &[u64],
        parameter: MaterialParameter,
        texture: &Arc<Texture>,
    ) -> Result<(), Error> {
        let objects = self.loaded_objects(ids)?;
        let places: Vec<u32> = objects.iter().filter_map(|object| object.scenery).collect();
        self.state.paint.paint(&places, parameter, texture)
    }

    /// Things of the map by their ids, but for those of layers that are not loaded.
    ///
    /// # Errors
    /// `InvalidArgument` for an id that no object of the map has.
    fn loaded_objects(&self, ids: &[u64]) -> Result<Vec<&EnvironmentObject>, Error> {
        let all = self.town.roads.environment_objects();
        let found = ids.iter().map(|id| {
            let at = all.binary_search_by_key(id, |object| object.id).map_err(|_| {
                Error::new(ErrorCode::InvalidArgument, "no such thing on this map")
                    .wanted("the id of an environment object")
                    .found(id)
            })?;
            Ok(&all[at])
        });
        let found: Vec<&EnvironmentObject> = found.collect::<Result<_, Error>>()?;
        let unloaded = self.state.hidden.layers;
        Ok(found.into_iter().filter(|object| !object.goes_with(unloaded)).collect())
    }
}

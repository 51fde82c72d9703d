//! What of a town is switched off.

use flatbuffers::{FlatBufferBuilder, UnionWIPOffset, Vector, WIPOffset};

use super::{check_count, needed, paint};
use crate::generated as fb;
use crate::limits::{OBJECTS_PER_COMMAND_MAX, SCENERY_MAX};
use crate::{Command, Error, HiddenScenery, SceneryCommand};

type Body = (fb::CommandBody, WIPOffset<UnionWIPOffset>);

pub(super) fn command_out(b: &mut FlatBufferBuilder<'_>, command: &SceneryCommand) -> Body {
    match command {
        SceneryCommand::Layers { layers, loaded } => {
            let args = fb::SetMapLayersArgs { layers: *layers, loaded: *loaded };
            let body = fb::SetMapLayers::create(b, &args).as_union_value();
            (fb::CommandBody::SetMapLayers, body)
        }
        SceneryCommand::Objects { objects, enabled } => {
            let objects = Some(b.create_vector(objects));
            let args = fb::SetEnvironmentObjectsArgs { objects, enabled: *enabled };
            let body = fb::SetEnvironmentObjects::create(b, &args).as_union_value();
            (fb::CommandBody::SetEnvironmentObjects, body)
        }
        SceneryCommand::Paint { objects, parameter, texture } => {
            let body = paint::command_out(b, (objects, *parameter, texture)).as_union_value();
            (fb::CommandBody::PaintEnvironmentObjects, body)
        }
    }
}

/// # Errors
/// For too many objects, for what is no texture, and what no command of the schema is.
pub(super) fn command_in(raw: &fb::Command<'_>) -> Result<Command, Error> {
    if let Some(set) = raw.body_as_set_map_layers() {
        return Ok(Command::Scenery(SceneryCommand::Layers {
            layers: set.layers(),
            loaded: set.loaded(),
        }));
    }
    if let Some(paint) = raw.body_as_paint_environment_objects() {
        return paint::command_in(&paint);
    }
    let set = needed(raw.body_as_set_environment_objects(), "a known command")?;
    let objects = set.objects();
    check_count("objects", objects.map_or(0, |objects| objects.len()), OBJECTS_PER_COMMAND_MAX)?;
    let objects = objects.iter().flatten().collect();
    Ok(Command::Scenery(SceneryCommand::Objects { objects, enabled: set.enabled() }))
}

/// Nothing where nothing is hidden.
pub(super) fn hidden_out<'b>(
    b: &mut FlatBufferBuilder<'b>,
    hidden: &HiddenScenery,
) -> Option<WIPOffset<Vector<'b, u8>>> {
    (!hidden.is_none()).then(|| b.create_vector(hidden.bits()))
}

pub(super) fn hidden_in(raw: &fb::Frame<'_>) -> Result<HiddenScenery, Error> {
    let bits = raw.hidden_scenery().map_or(&[][..], |bits| bits.bytes());
    check_count("hidden things", bits.len() * 8, SCENERY_MAX)?;
    Ok(HiddenScenery::new(raw.unloaded_layers(), bits.to_vec()))
}

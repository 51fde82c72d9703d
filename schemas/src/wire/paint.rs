//! Textures of things of the map.

use std::sync::Arc;

use flatbuffers::{FlatBufferBuilder, ForwardsUOffset, Vector, WIPOffset};

use super::{check_count, needed};
use crate::generated as fb;
use crate::limits::{OBJECTS_PER_COMMAND_MAX, PAINTED_OBJECTS_MAX, TEXTURES_PER_WORLD_MAX};
use crate::{Coat, Command, Error, ErrorCode, MaterialParameter, Paint, SceneryCommand, Texture};

type Textures<'a> = Vector<'a, ForwardsUOffset<&'a str>>;
type Coats<'a> = Vector<'a, fb::Coat>;

/// Textures and coats; nothing where nothing is painted.
pub(super) fn paint_out<'b>(
    b: &mut FlatBufferBuilder<'b>,
    paint: &Paint,
) -> (Option<WIPOffset<Textures<'b>>>, Option<WIPOffset<Coats<'b>>>) {
    if paint.coats.is_empty() {
        return (None, None);
    }
    let digests: Vec<_> = paint.textures.iter().map(|digest| b.create_string(digest)).collect();
    let number = |position: Option<u16>| position.map_or(0, |position| position.saturating_add(1));
    let coat_out =
        |coat: &Coat| fb::Coat::new(coat.place, number(coat.diffuse), number(coat.emissive));
    let coats: Vec<fb::Coat> = paint.coats.iter().map(coat_out).collect();
    (Some(b.create_vector(&digests)), Some(b.create_vector(&coats)))
}

/// # Errors
/// For too many, and for a texture that the frame does not name.
pub(super) fn paint_in(raw: &fb::Frame<'_>) -> Result<Paint, Error> {
    let (textures, coats) = (raw.textures(), raw.coats());
    check_count("textures", textures.map_or(0, |all| all.len()), TEXTURES_PER_WORLD_MAX)?;
    check_count("painted things", coats.map_or(0, |all| all.len()), PAINTED_OBJECTS_MAX)?;
    let textures: Vec<String> = textures.iter().flatten().map(str::to_owned).collect();
    let position = |number: u16| match number.checked_sub(1) {
        Some(position) if usize::from(position) >= textures.len() => {
            Err(Error::new(ErrorCode::InvalidMessage, "a texture is not in the frame")
                .wanted(format_args!("at most {}", textures.len()))
                .found(number))
        }
        position => Ok(position),
    };
    let coat_in = |raw: &fb::Coat| {
        let (diffuse, emissive) = (position(raw.diffuse())?, position(raw.emissive())?);
        Ok(Coat { place: raw.place(), diffuse, emissive })
    };
    let coats = coats.iter().flatten().map(coat_in).collect::<Result<_, Error>>()?;
    Ok(Paint { textures, coats })
}

pub(super) fn command_out<'b>(
    b: &mut FlatBufferBuilder<'b>,
    (objects, parameter, texture): (&[u64], MaterialParameter, &Texture),
) -> WIPOffset<fb::PaintEnvironmentObjects<'b>> {
    let objects = Some(b.create_vector(objects));
    let texture = Some(b.create_vector(texture.bytes()));
    let parameter = match parameter {
        MaterialParameter::Diffuse => fb::MaterialParameter::Diffuse,
        MaterialParameter::Emissive => fb::MaterialParameter::Emissive,
    };
    let args = fb::PaintEnvironmentObjectsArgs { objects, parameter, texture };
    fb::PaintEnvironmentObjects::create(b, &args)
}

/// # Errors
/// For too many objects, a parameter that is none, and as for [`Texture::from_bytes`].
pub(super) fn command_in(raw: &fb::PaintEnvironmentObjects<'_>) -> Result<Command, Error> {
    let objects = raw.objects();
    check_count("objects", objects.map_or(0, |objects| objects.len()), OBJECTS_PER_COMMAND_MAX)?;
    let parameter = match raw.parameter() {
        fb::MaterialParameter::Diffuse => Some(MaterialParameter::Diffuse),
        fb::MaterialParameter::Emissive => Some(MaterialParameter::Emissive),
        _ => None,
    };
    let texture = Arc::new(Texture::from_bytes(raw.texture().bytes().to_vec())?);
    Ok(Command::Scenery(SceneryCommand::Paint {
        objects: objects.iter().flatten().collect(),
        parameter: needed(parameter, "a known parameter of the material")?,
        texture,
    }))
}

//! Settings of actors as CARLA writes them.

use schemas::{Attribute, Error, ErrorCode, limits};

use crate::actor::Actor;

/// # Errors
/// `InvalidArgument` for too many, too long or repeated ones.
pub(crate) fn check(attributes: &[Attribute]) -> Result<(), Error> {
    let refuse = |why: &str| Err(Error::new(ErrorCode::InvalidArgument, why));
    if attributes.len() > limits::ATTRIBUTES_PER_ACTOR_MAX {
        let wanted = format!("at most {}", limits::ATTRIBUTES_PER_ACTOR_MAX);
        return refuse("an actor has too many attributes")
            .map_err(|error: Error| error.wanted(wanted).found(attributes.len()));
    }
    for (index, Attribute { id, value }) in attributes.iter().enumerate() {
        let chars = id.chars().count().max(value.chars().count());
        if chars > limits::ATTRIBUTE_CHARS_MAX {
            let wanted = format!("at most {} characters", limits::ATTRIBUTE_CHARS_MAX);
            return refuse("an attribute is too long")
                .map_err(|error: Error| error.wanted(wanted).found(chars));
        }
        if attributes.iter().take(index).any(|earlier| earlier.id == *id) {
            return refuse("an attribute is given twice")
                .map_err(|error: Error| error.wanted("each once").found(id));
        }
    }
    Ok(())
}

/// The value of an attribute, if it is given.
pub(crate) fn value<'a>(attributes: &'a [Attribute], id: &str) -> Option<&'a str> {
    let found = attributes.iter().find(|attribute| attribute.id == id)?;
    Some(found.value.as_str())
}

/// The paint that `color` names, `0xRRGGBB`; `None` when it is not given.
///
/// # Errors
/// `InvalidArgument` unless it is `R,G,B` of 0 to 255 each.
pub(crate) fn colour_rgb(attributes: &[Attribute]) -> Result<Option<u32>, Error> {
    let Some(text) = value(attributes, "color") else { return Ok(None) };
    let parts: Vec<u8> = text.split(',').map_while(|part| part.trim().parse().ok()).collect();
    let [red, green, blue] = <[u8; 3]>::try_from(parts)
        .ok()
        .filter(|_| text.split(',').count() == 3)
        .ok_or_else(|| {
            Error::new(ErrorCode::InvalidArgument, "the attribute color is no colour")
                .wanted("R,G,B of 0 to 255 each")
                .found(text)
        })?;
    Ok(Some(u32::from_be_bytes([0, red, green, blue])))
}

/// Those given at the spawn, with the role and the paint of an actor that were not. What belongs to
/// the map has no role.
pub(crate) fn complete(actor: &Actor) -> Vec<Attribute> {
    let mut all = actor.attributes.clone();
    let mut add = |id: &str, value: String| {
        if self::value(&all, id).is_none() {
            all.push(Attribute { id: id.to_owned(), value });
        }
    };
    let blueprint = blueprints::find(&actor.blueprint().id);
    if blueprint.is_some_and(|known| known.attribute("role_name").is_some()) {
        add("role_name", "default".to_owned());
    }
    if actor.vehicle.is_some() {
        let [_, red, green, blue] = actor.colour_rgb.to_be_bytes();
        add("color", format!("{red},{green},{blue}"));
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    fn colour(value: &str) -> Result<Option<u32>, Error> {
        colour_rgb(&[Attribute { id: "color".to_owned(), value: value.to_owned() }])
    }

    #[test]
    fn a_colour_is_three_numbers_up_to_255() {
        assert_eq!(colour("17, 37,103"), Ok(Some(0x0011_2567)));
        assert_eq!(colour_rgb(&[]), Ok(None));
        for wrong in ["", "1,2", "1,2,3,4", "1,2,256", "red", "1,2,x,4"] {
            assert!(colour(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn an_attribute_given_twice_is_refused() {
        let role = Attribute { id: "role_name".to_owned(), value: "hero".to_owned() };
        assert!(check(std::slice::from_ref(&role)).is_ok());
        assert!(check(&[role.clone(), role]).is_err());
    }
}

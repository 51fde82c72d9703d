//! Actors and what they are made from.

use std::fmt;

use schemas::ActorId;
use serde::{Deserialize, Serialize};

use super::BoundingBox;
use crate::rpc::Refusal;

/// Whom a client means: an id that nobody may have.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(transparent)]
pub(crate) struct ActorRef(u32);

impl ActorRef {
    /// No parent, or in commands after a spawn the new actor.
    pub(crate) const NOBODY: Self = Self(0);

    /// `None` for nobody.
    pub(crate) fn id(self) -> Option<ActorId> {
        ActorId::new(self.0)
    }

    /// The id, which is to be somebody's.
    ///
    /// # Errors
    /// For nobody.
    pub(crate) fn named(self) -> Result<ActorId, Refusal> {
        self.id().ok_or_else(|| self.unknown())
    }

    /// CARLA's words for an id that nobody has.
    pub(crate) fn unknown(self) -> Refusal {
        Refusal(format!("Actor could not be found in the registry.  Actor Id: {self}"))
    }

    /// CARLA's words for an actor that is no vehicle, walker or whatever a function is about.
    pub(crate) fn wrong_kind(self) -> Refusal {
        Refusal(format!("Actor does not match the expected type.  Actor Id: {self}"))
    }
}

impl From<ActorId> for ActorRef {
    fn from(id: ActorId) -> Self {
        Self(id.get())
    }
}

impl From<Option<ActorId>> for ActorRef {
    fn from(id: Option<ActorId>) -> Self {
        id.map_or(Self::NOBODY, Self::from)
    }
}

impl fmt::Display for ActorRef {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.fmt(f)
    }
}

/// `[id, type, value]`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct AttributeValue {
    pub(crate) id: String,
    /// 1 bool, 2 int, 3 float, 4 string, 5 colour.
    pub(crate) kind: u8,
    pub(crate) value: String,
}

/// What an actor was spawned from.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct ActorDescription {
    pub(crate) uid: u32,
    pub(crate) type_id: String,
    pub(crate) attributes: Vec<AttributeValue>,
}

/// An actor as clients cache it.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct Actor {
    pub(crate) id: ActorRef,
    pub(crate) parent_id: ActorRef,
    pub(crate) description: ActorDescription,
    pub(crate) bounding_box: BoundingBox,
    #[serde(with = "serde_bytes")]
    pub(crate) semantic_tags: Vec<u8>,
    /// Empty for whatever sends nothing: a token makes any actor a sensor.
    #[serde(with = "serde_bytes")]
    pub(crate) stream_token: Vec<u8>,
}

impl ActorDescription {
    /// The value of an attribute, if it is told.
    pub(crate) fn text(&self, id: &str) -> Option<&str> {
        let found = self.attributes.iter().find(|attribute| attribute.id == id)?;
        Some(&found.value)
    }
}

impl Actor {
    /// As [`ActorDescription::text`].
    pub(crate) fn text(&self, id: &str) -> Option<&str> {
        self.description.text(id)
    }

    /// The number that an attribute is; `default` where it is not told.
    ///
    /// # Errors
    /// A text that is no finite number.
    pub(crate) fn number(&self, id: &str, default: f32) -> Result<f32, Refusal> {
        let Some(text) = self.text(id) else { return Ok(default) };
        let number = text.parse::<f32>().ok().filter(|number| number.is_finite());
        number.ok_or_else(|| Refusal(format!("{id} cannot be {text:?}")))
    }
}

#[derive(Clone, Debug, PartialEq, Serialize)]
pub(crate) struct ActorAttribute {
    pub(crate) id: String,
    /// As in [`AttributeValue`].
    pub(crate) kind: u8,
    pub(crate) value: String,
    pub(crate) recommended_values: Vec<String>,
    pub(crate) is_modifiable: bool,
    pub(crate) restrict_to_recommended: bool,
}

/// One blueprint.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(crate) struct ActorDefinition {
    pub(crate) uid: u32,
    pub(crate) id: String,
    /// Separated by commas.
    pub(crate) tags: String,
    pub(crate) attributes: Vec<ActorAttribute>,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tags_and_tokens_are_binary() {
        let actor = Actor { id: ActorRef(7), semantic_tags: vec![14], ..Actor::default() };
        let bytes = rmp_serde::to_vec(&actor).unwrap();
        assert_eq!(&bytes[..7], [0x96, 7, 0, 0x93, 0, 0xa0, 0x90]);
        assert_eq!(&bytes[bytes.len() - 5..], [0xc4, 1, 14, 0xc4, 0]);
    }
}

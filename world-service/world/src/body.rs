//! What carries an actor.

use schemas::{Attachment, Pose};
use serde::{Deserialize, Serialize};

use crate::physics::BodyHandle;

/// What carries an actor.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) enum Body {
    /// The physics.
    Rigid(BodyHandle),
    /// Nothing: it stays where it was put. Lights, signs, markers.
    Fixed(Pose),
    /// Another actor.
    Attached(Attached),
}

/// An actor that another one carries; it touches nothing.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Attached {
    /// Its parent has a smaller id than itself, so there are no rings.
    pub to: Attachment,
    pub parent_from_actor: Pose,
    /// Where a spring arm has got to; follows after every tick.
    pub world_from_actor: Pose,
}

impl Body {
    /// The body in the physics, of those that have one.
    pub(crate) fn rigid(&self) -> Option<BodyHandle> {
        match self {
            Self::Rigid(handle) => Some(*handle),
            Self::Fixed(_) | Self::Attached(_) => None,
        }
    }

    /// What the actor hangs on.
    pub(crate) fn attachment(&self) -> Option<Attachment> {
        match self {
            Self::Attached(attached) => Some(attached.to),
            Self::Rigid(_) | Self::Fixed(_) => None,
        }
    }
}

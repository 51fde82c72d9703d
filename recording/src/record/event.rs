//! What happens to actors, and when.

use super::motion::{Rotation, Vector};
use crate::bytes::{Cursor, Field, Malformed, record};

record! {
    /// The begin of a frame.
    FrameStart {
        /// From 1.
        number: u64,
        /// To the next frame, in seconds; −1 in the last one.
        duration_secs: f64,
        /// Since the first frame.
        elapsed_secs: f64,
    }
}

/// What kind of thing an actor is in the engine.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Class(pub u8);

impl Class {
    /// Spectators, props and whatever else.
    pub const OTHER: Self = Self(0);
    /// Cars and two-wheelers.
    pub const VEHICLE: Self = Self(1);
    /// Pedestrians.
    pub const WALKER: Self = Self(2);
    /// Traffic lights.
    pub const TRAFFIC_LIGHT: Self = Self(3);
    /// Traffic signs.
    pub const TRAFFIC_SIGN: Self = Self(4);
    /// Sensors.
    pub const SENSOR: Self = Self(5);
}

impl Field for Class {
    const BYTES_MIN: usize = 1;

    fn put(&self, out: &mut Vec<u8>) {
        out.push(self.0);
    }

    fn take(cursor: &mut Cursor<'_>) -> Result<Self, Malformed> {
        Ok(Self(u8::take(cursor)?))
    }
}

/// Types of attributes, as version 2 counts them.
pub mod attribute {
    /// `true` or `false`.
    pub const BOOL: u8 = 1;
    /// A whole number.
    pub const INT: u8 = 2;
    /// A number.
    pub const FLOAT: u8 = 3;
    /// A text.
    pub const STRING: u8 = 4;
    /// Red, green and blue, 0 to 255.
    pub const COLOUR: u8 = 5;
}

/// One attribute of an actor.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Attribute {
    /// One of [`attribute`].
    pub kind: u8,
    /// Its name.
    pub name: String,
    /// Its value as text.
    pub value: String,
}

impl Field for Attribute {
    const BYTES_MIN: usize = 5;

    fn put(&self, out: &mut Vec<u8>) {
        self.kind.put(out);
        self.name.put(out);
        self.value.put(out);
    }

    fn take(cursor: &mut Cursor<'_>) -> Result<Self, Malformed> {
        let first = u8::from(cursor.layout.types_from_zero);
        let kind = u8::take(cursor)?.saturating_add(first);
        Ok(Self { kind, name: String::take(cursor)?, value: String::take(cursor)? })
    }
}

record! {
    /// An actor that is there from this frame on.
    Add {
        /// Unique in a log.
        id: u32,
        /// What kind of thing it is.
        class: Class,
        /// In cm; of what is attached and spawned while recording, relative to its parent.
        location: Vector,
        /// In degrees, as the location.
        rotation: Rotation,
        /// Number of its blueprint, 0 for spectators, lights and signs.
        uid: u32,
        /// Its blueprint.
        blueprint: String,
        /// All it was spawned with.
        attributes: Vec<Attribute>,
    }
}

record! {
    /// An actor that is gone from this frame on.
    Destroy {
        /// Which one.
        id: u32,
    }
}

record! {
    /// An actor that is attached to another from this frame on.
    Parent {
        /// What is attached.
        child: u32,
        /// What carries it.
        parent: u32,
    }
}

record! {
    /// A contact that a collision sensor reports.
    Collision {
        /// From 0 in a log; numbers may be missing.
        serial: u32,
        /// Who carries the sensor.
        id1: u32,
        /// What it met; [`Collision::NO_ACTOR`] for what is no actor.
        id2: u32,
        /// Whether the role of the first is `hero`.
        is_hero1: bool,
        /// Whether the role of the second is `hero`.
        is_hero2: bool,
    }
}

impl Collision {
    /// The id of a thing that is no actor.
    pub const NO_ACTOR: u32 = u32::MAX;
}

//! Where actors are, how large, and how they move.

use crate::bytes::{Cursor, Field, Malformed, record};

/// A place or a velocity in CARLA's frame.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Vector {
    /// Forward.
    pub x: f32,
    /// To the right.
    pub y: f32,
    /// Upwards.
    pub z: f32,
}

/// A rotation in degrees, in the order of the file.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Rotation {
    /// About the forward axis.
    pub roll: f32,
    /// About the right axis, positive up.
    pub pitch: f32,
    /// About the vertical, clockwise seen from above.
    pub yaw: f32,
}

/// Three numbers, of double precision where the log has such.
fn take_three(cursor: &mut Cursor<'_>) -> Result<[f32; 3], Malformed> {
    if cursor.layout.wide_vectors {
        Ok(<[f64; 3]>::take(cursor)?.map(|number| number as f32))
    } else {
        Field::take(cursor)
    }
}

impl Field for Vector {
    const BYTES_MIN: usize = 12;

    fn put(&self, out: &mut Vec<u8>) {
        [self.x, self.y, self.z].put(out);
    }

    fn take(cursor: &mut Cursor<'_>) -> Result<Self, Malformed> {
        let [x, y, z] = take_three(cursor)?;
        Ok(Self { x, y, z })
    }
}

impl Field for Rotation {
    const BYTES_MIN: usize = 12;

    fn put(&self, out: &mut Vec<u8>) {
        [self.roll, self.pitch, self.yaw].put(out);
    }

    fn take(cursor: &mut Cursor<'_>) -> Result<Self, Malformed> {
        let [roll, pitch, yaw] = take_three(cursor)?;
        Ok(Self { roll, pitch, yaw })
    }
}

record! {
    /// Where an actor is.
    Position {
        /// Which one.
        id: u32,
        /// In cm.
        location: Vector,
        /// In degrees.
        rotation: Rotation,
    }
}

record! {
    /// How an actor moves.
    Kinematics {
        /// Which one.
        id: u32,
        /// In m/s, axes of the world.
        linear_velocity: Vector,
        /// In °/s, axes of the world.
        angular_velocity: Vector,
    }
}

record! {
    /// A box about an actor, in its axes, or about where a sign or light acts, in those of the
    /// world; in cm.
    Box3 {
        /// Which one.
        id: u32,
        /// Its centre.
        origin: Vector,
        /// Half its size.
        extent: Vector,
    }
}

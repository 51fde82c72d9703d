//! Shapes that clients draw into the world.

use serde::de::{self, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer};

use super::{BoundingBox, Location, Rotation};

/// A shape, its colour and how long it stays.
#[derive(Clone, Debug, Deserialize)]
pub(crate) struct DebugShape {
    pub(crate) primitive: Primitive,
    pub(crate) colour: (u8, u8, u8),
    pub(crate) life_secs: f32,
    _persistent: bool,
}

/// Sizes and thicknesses in metres, but for the size of a point.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Primitive {
    Point(Location, f32),
    Line(Line),
    Arrow(Line, f32),
    Box(BoundingBox, Rotation, f32),
    /// Place, letters, and whether they have a shadow.
    Text(Location, String, bool),
    /// What lies on the screen of the server.
    Overlay,
}

#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
pub(crate) struct Line {
    pub(crate) begin: Location,
    pub(crate) end: Location,
    pub(crate) thickness: f32,
}

impl<'de> Deserialize<'de> for Primitive {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Parts;
        impl<'de> Visitor<'de> for Parts {
            type Value = Primitive;

            fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                f.write_str("[index of a shape, its fields]")
            }

            fn visit_seq<A: SeqAccess<'de>>(self, mut parts: A) -> Result<Primitive, A::Error> {
                let missing = || de::Error::invalid_length(1, &"[index of a shape, its fields]");
                let index: u64 = parts.next_element()?.ok_or_else(missing)?;
                Ok(match index {
                    0 => {
                        let (at, size) = parts.next_element()?.ok_or_else(missing)?;
                        Primitive::Point(at, size)
                    }
                    1 => Primitive::Line(parts.next_element()?.ok_or_else(missing)?),
                    2 => {
                        let (line, tip) = parts.next_element()?.ok_or_else(missing)?;
                        Primitive::Arrow(line, tip)
                    }
                    3 => {
                        let (bounds, rotation, thickness) =
                            parts.next_element()?.ok_or_else(missing)?;
                        Primitive::Box(bounds, rotation, thickness)
                    }
                    4 => {
                        let (at, text, has_shadow) = parts.next_element()?.ok_or_else(missing)?;
                        Primitive::Text(at, text, has_shadow)
                    }
                    5..=8 => {
                        parts.next_element::<de::IgnoredAny>()?.ok_or_else(missing)?;
                        Primitive::Overlay
                    }
                    other => return Err(de::Error::custom(format!("there is no shape {other}"))),
                })
            }
        }
        deserializer.deserialize_seq(Parts)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_shape_is_an_index_and_its_fields() {
        let sent = ((0, ((1.0f32, 2.0f32, 3.0f32), 0.5f32)), (255, 0, 7), -1.0f32, true);
        let bytes = rmp_serde::to_vec(&sent).unwrap();
        let shape: DebugShape = rmp_serde::from_slice(&bytes).unwrap();
        assert_eq!(shape.primitive, Primitive::Point(Location { x: 1.0, y: 2.0, z: 3.0 }, 0.5));
        assert_eq!((shape.colour, shape.life_secs), ((255, 0, 7), -1.0));
        let text = ((4, ((1.0f32, 2.0f32, 3.0f32), "hello", false)), (0, 0, 0), 0.0f32, true);
        let shape: DebugShape = rmp_serde::from_slice(&rmp_serde::to_vec(&text).unwrap()).unwrap();
        let at = Location { x: 1.0, y: 2.0, z: 3.0 };
        assert_eq!(shape.primitive, Primitive::Text(at, "hello".to_owned(), false));
    }
}

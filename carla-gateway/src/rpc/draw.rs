//! Arguments for tests: values of whatever types a call asks for, as MessagePack.

use std::fmt;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use schemas::SplitMix64;
use serde::de::{self, DeserializeOwned, DeserializeSeed, SeqAccess, Visitor};
use serde::forward_to_deserialize_any;

/// Draws before a type counts as one that nothing fits.
const TRIES_MAX: u64 = 4_096;
/// Elements of a list.
const ELEMENTS_MAX: u64 = 4;
/// Lists inside lists; deeper ones are empty.
const DEPTH_MAX: usize = 12;
/// Words that some calls look for.
const TEXTS: [&str; 6] = ["", "Nav", "vehicle.lincoln.mkz_2020", "VehicleMesh", "hero", "0.5"];
const NUMBERS: [f64; 8] = [0.0, 0.05, 1.0, -1.0, 30.0, 1.0e-30, f32::MAX as f64, f32::MIN as f64];

/// Which arguments to draw: the same for the same seed and types.
#[derive(Clone, Debug, Default)]
pub(crate) struct Draw {
    pub(crate) seed: u64,
    /// A number that takes the place of one of the floats.
    pub(crate) spoilt: Option<(usize, f64)>,
    /// How many floats there were.
    pub(crate) float_count: Arc<AtomicUsize>,
}

impl Draw {
    pub(super) fn bytes_of<T: DeserializeOwned>(&self) -> Vec<u8> {
        for attempt in 0..TRIES_MAX {
            let mut hand = Hand {
                dice: SplitMix64::new(self.seed ^ attempt << 48),
                spoilt: self.spoilt,
                float_count: 0,
                depth: 0,
                bytes: Vec::new(),
            };
            if T::deserialize(&mut hand).is_ok() {
                self.float_count.store(hand.float_count, Ordering::Relaxed);
                return hand.bytes;
            }
        }
        panic!("no draw is a {}", std::any::type_name::<T>());
    }
}

struct Hand {
    dice: SplitMix64,
    spoilt: Option<(usize, f64)>,
    float_count: usize,
    depth: usize,
    bytes: Vec<u8>,
}

impl Hand {
    fn below(&mut self, count: u64) -> u64 {
        self.dice.next_u64() % count
    }

    fn one_of<T: Copy, const N: usize>(&mut self, choices: [T; N]) -> T {
        choices[self.below(N as u64) as usize]
    }

    fn number(&mut self) -> f64 {
        let (at, drawn) = (self.float_count, self.one_of(NUMBERS));
        self.float_count += 1;
        self.spoilt.filter(|(spoilt, _)| *spoilt == at).map_or(drawn, |(_, number)| number)
    }

    fn list<'de, V: Visitor<'de>>(&mut self, visitor: V, count: u64) -> Result<V::Value, Misfit> {
        let head = self.bytes.len();
        self.bytes.extend([0xdd, 0, 0, 0, 0]);
        self.depth += 1;
        let mut elements = Elements { hand: self, left: count, taken: 0 };
        let value = visitor.visit_seq(&mut elements)?;
        let taken = elements.taken;
        self.depth -= 1;
        self.bytes[head + 1..head + 5].copy_from_slice(&taken.to_be_bytes());
        Ok(value)
    }
}

struct Elements<'a> {
    hand: &'a mut Hand,
    left: u64,
    taken: u32,
}

impl<'de> SeqAccess<'de> for &mut Elements<'_> {
    type Error = Misfit;

    fn next_element_seed<T: DeserializeSeed<'de>>(
        &mut self,
        seed: T,
    ) -> Result<Option<T::Value>, Misfit> {
        if self.left == 0 {
            return Ok(None);
        }
        self.left -= 1;
        self.taken += 1;
        seed.deserialize(&mut *self.hand).map(Some)
    }
}

/// What was drawn is none of the values that a type has.
#[derive(Debug)]
struct Misfit(String);

impl fmt::Display for Misfit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

impl std::error::Error for Misfit {}

impl de::Error for Misfit {
    fn custom<T: fmt::Display>(why: T) -> Self {
        Self(why.to_string())
    }
}

/// Numbers as MessagePack has them: a marker, then the number, big end first.
macro_rules! numbers {
    ($($function:ident, $visit:ident, $kind:ty, $marker:literal, $count:literal;)*) => {$(
        fn $function<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Misfit> {
            let number = self.below($count) as $kind;
            self.bytes.push($marker);
            self.bytes.extend(number.to_be_bytes());
            visitor.$visit(number)
        }
    )*};
}

impl<'de> de::Deserializer<'de> for &mut Hand {
    type Error = Misfit;

    // As many as there are commands in a batch, shapes, actors in the tests' world.
    numbers! {
        deserialize_u8, visit_u8, u8, 0xcc, 22;
        deserialize_u16, visit_u16, u16, 0xcd, 8_000;
        deserialize_u32, visit_u32, u32, 0xce, 9;
        deserialize_u64, visit_u64, u64, 0xcf, 9;
        deserialize_i8, visit_i8, i8, 0xd0, 6;
        deserialize_i16, visit_i16, i16, 0xd1, 6;
        deserialize_i32, visit_i32, i32, 0xd2, 6;
        deserialize_i64, visit_i64, i64, 0xd3, 6;
    }

    fn deserialize_bool<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Misfit> {
        let drawn = self.below(2) == 1;
        self.bytes.push(if drawn { 0xc3 } else { 0xc2 });
        visitor.visit_bool(drawn)
    }

    fn deserialize_f32<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Misfit> {
        let drawn = self.number() as f32;
        self.bytes.push(0xca);
        self.bytes.extend(drawn.to_be_bytes());
        visitor.visit_f32(drawn)
    }

    fn deserialize_f64<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Misfit> {
        let drawn = self.number();
        self.bytes.push(0xcb);
        self.bytes.extend(drawn.to_be_bytes());
        visitor.visit_f64(drawn)
    }

    fn deserialize_string<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Misfit> {
        let drawn = self.one_of(TEXTS);
        self.bytes.extend([0xd9, drawn.len() as u8]);
        self.bytes.extend_from_slice(drawn.as_bytes());
        visitor.visit_str(drawn)
    }

    fn deserialize_str<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Misfit> {
        self.deserialize_string(visitor)
    }

    fn deserialize_seq<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Misfit> {
        let count = if self.depth < DEPTH_MAX { self.below(ELEMENTS_MAX + 1) } else { 0 };
        self.list(visitor, count)
    }

    fn deserialize_tuple<V: Visitor<'de>>(
        self,
        length: usize,
        visitor: V,
    ) -> Result<V::Value, Misfit> {
        self.list(visitor, length as u64)
    }

    fn deserialize_struct<V: Visitor<'de>>(
        self,
        _: &'static str,
        fields: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, Misfit> {
        self.list(visitor, fields.len() as u64)
    }

    fn deserialize_ignored_any<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Misfit> {
        self.bytes.push(0xc0);
        visitor.visit_unit()
    }

    fn deserialize_any<V: Visitor<'de>>(self, _: V) -> Result<V::Value, Misfit> {
        Err(de::Error::custom("nothing is drawn for a type that says nothing of itself"))
    }

    forward_to_deserialize_any! {
        char bytes byte_buf option unit unit_struct newtype_struct tuple_struct map enum identifier
    }
}

//! CARLA's optional values and tagged unions.

use std::fmt;
use std::marker::PhantomData;

use serde::de::{self, SeqAccess, Visitor};
use serde::ser::SerializeTuple;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

/// `[false]` or `[true, value]`; the length decides.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Opt<T>(pub(crate) Option<T>);

impl<T: Serialize> Serialize for Opt<T> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut tuple = serializer.serialize_tuple(1 + usize::from(self.0.is_some()))?;
        tuple.serialize_element(&self.0.is_some())?;
        if let Some(value) = &self.0 {
            tuple.serialize_element(value)?;
        }
        tuple.end()
    }
}

impl<'de, T: Deserialize<'de>> Deserialize<'de> for Opt<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Parts<T>(PhantomData<T>);
        impl<'de, T: Deserialize<'de>> Visitor<'de> for Parts<T> {
            type Value = Opt<T>;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("[false] or [true, value]")
            }

            fn visit_seq<A: SeqAccess<'de>>(self, mut parts: A) -> Result<Opt<T>, A::Error> {
                let _: bool =
                    parts.next_element()?.ok_or_else(|| de::Error::invalid_length(0, &self))?;
                Ok(Opt(parts.next_element()?))
            }
        }
        deserializer.deserialize_seq(Parts(PhantomData))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_optional_value_has_the_measured_bytes() {
        assert_eq!(rmp_serde::to_vec(&Opt::<f64>(None)).unwrap(), [0x91, 0xc2]);
        let some = rmp_serde::to_vec(&Opt(Some(5u32))).unwrap();
        assert_eq!(some, [0x92, 0xc3, 5]);
        assert_eq!(rmp_serde::from_slice::<Opt<u32>>(&some).unwrap(), Opt(Some(5)));
        assert_eq!(rmp_serde::from_slice::<Opt<u32>>(&[0x91, 0xc2]).unwrap(), Opt(None));
        assert!(rmp_serde::from_slice::<Opt<u32>>(&[0xc0]).is_err());
    }
}

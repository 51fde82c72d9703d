//! Numbers that clients send: none that is not finite comes in, whatever the call and the field.

use rmp::Marker;

/// Values inside values; deeper ones are not looked into and count as bad.
const DEPTH_MAX: usize = 64;

/// What is at the front of MessagePack.
pub(super) struct Skimmed {
    /// Length of the first value.
    pub(super) bytes: usize,
    /// Whether all numbers in it are finite.
    pub(super) is_finite: bool,
}

/// Looks through the first value; `None` for one that is cut off or nested too deeply.
pub(super) fn skim(bytes: &[u8]) -> Option<Skimmed> {
    let mut skimmer = Skimmer { rest: bytes, is_finite: true };
    skimmer.value(DEPTH_MAX)?;
    let Skimmer { rest, is_finite } = skimmer;
    Some(Skimmed { bytes: bytes.len() - rest.len(), is_finite })
}

struct Skimmer<'a> {
    rest: &'a [u8],
    is_finite: bool,
}

impl Skimmer<'_> {
    fn value(&mut self, depth_left: usize) -> Option<()> {
        let depth_left = depth_left.checked_sub(1)?;
        let [marker] = self.take()?;
        match Marker::from_u8(marker) {
            Marker::F32 => self.is_finite &= f32::from_be_bytes(self.take()?).is_finite(),
            Marker::F64 => self.is_finite &= f64::from_be_bytes(self.take()?).is_finite(),
            Marker::FixPos(_) | Marker::FixNeg(_) | Marker::Null | Marker::True | Marker::False => {
            }
            Marker::U8 | Marker::I8 => self.skip(1)?,
            Marker::U16 | Marker::I16 => self.skip(2)?,
            Marker::U32 | Marker::I32 => self.skip(4)?,
            Marker::U64 | Marker::I64 => self.skip(8)?,
            Marker::FixStr(length) => self.skip(length.into())?,
            Marker::Str8 | Marker::Bin8 => self.skip_counted(1, 0)?,
            Marker::Str16 | Marker::Bin16 => self.skip_counted(2, 0)?,
            Marker::Str32 | Marker::Bin32 => self.skip_counted(4, 0)?,
            Marker::FixArray(count) => self.values(count.into(), depth_left)?,
            Marker::Array16 | Marker::Array32 => {
                let count = self.count(if marker == Marker::Array16.to_u8() { 2 } else { 4 })?;
                self.values(count, depth_left)?;
            }
            Marker::FixMap(count) => self.values(2 * usize::from(count), depth_left)?,
            Marker::Map16 | Marker::Map32 => {
                let count = self.count(if marker == Marker::Map16.to_u8() { 2 } else { 4 })?;
                self.values(count.checked_mul(2)?, depth_left)?;
            }
            // A byte of type, then the bytes.
            Marker::FixExt1 => self.skip(2)?,
            Marker::FixExt2 => self.skip(3)?,
            Marker::FixExt4 => self.skip(5)?,
            Marker::FixExt8 => self.skip(9)?,
            Marker::FixExt16 => self.skip(17)?,
            Marker::Ext8 => self.skip_counted(1, 1)?,
            Marker::Ext16 => self.skip_counted(2, 1)?,
            Marker::Ext32 => self.skip_counted(4, 1)?,
            Marker::Reserved => return None,
        }
        Some(())
    }

    fn values(&mut self, count: usize, depth_left: usize) -> Option<()> {
        (0..count).try_for_each(|_| self.value(depth_left))
    }

    fn skip_counted(&mut self, count_bytes: usize, more: usize) -> Option<()> {
        let count = self.count(count_bytes)?;
        self.skip(count.checked_add(more)?)
    }

    /// A number of this many bytes, big end first.
    fn count(&mut self, bytes: usize) -> Option<usize> {
        let (digits, rest) = self.rest.split_at_checked(bytes)?;
        self.rest = rest;
        Some(digits.iter().fold(0, |number, digit| number << 8 | usize::from(*digit)))
    }

    fn skip(&mut self, bytes: usize) -> Option<()> {
        self.rest = self.rest.get(bytes..)?;
        Some(())
    }

    fn take<const N: usize>(&mut self) -> Option<[u8; N]> {
        let (taken, rest) = self.rest.split_first_chunk::<N>()?;
        self.rest = rest;
        Some(*taken)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn a_number_that_is_not_finite_is_found_wherever_it_is() {
        let packed = |number: f32| rmp_serde::to_vec(&("a", (1u64, [number]), true)).unwrap();
        for (number, is_finite) in [(1.5, true), (f32::NAN, false), (f32::NEG_INFINITY, false)] {
            let bytes = packed(number);
            let skimmed = skim(&bytes).unwrap();
            assert_eq!((skimmed.bytes, skimmed.is_finite), (bytes.len(), is_finite));
        }
        assert!(!skim(&rmp_serde::to_vec(&f64::INFINITY).unwrap()).unwrap().is_finite);
    }

    #[test]
    fn bytes_of_a_text_are_no_numbers() {
        let text = String::from_utf8(vec![0x7f; 40]).unwrap();
        let bytes = rmp_serde::to_vec(&(text, serde_bytes::Bytes::new(&[0xca, 0x7f, 0x80, 0, 0])));
        assert!(skim(&bytes.unwrap()).unwrap().is_finite);
    }

    #[test]
    fn nesting_ends_somewhere() {
        assert!(skim(&[0x91; 1_000_000]).is_none());
    }

    proptest! {
        #[test]
        fn it_ends_where_another_reader_ends(
            value in (any::<(i64, f64, Option<bool>, String)>(), any::<Vec<(u16, f32)>>()),
            behind in any::<Vec<u8>>(),
        ) {
            let mut bytes = rmp_serde::to_vec(&value).unwrap();
            let length = bytes.len();
            bytes.extend(behind);
            prop_assert_eq!(skim(&bytes).unwrap().bytes, length);
        }

        #[test]
        fn no_bytes_break_it(bytes in any::<Vec<u8>>()) {
            if let Some(skimmed) = skim(&bytes) {
                prop_assert!(skimmed.bytes <= bytes.len());
            }
        }
    }
}

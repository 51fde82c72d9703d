//! Fields of a log: little-endian, packed, without checks of their own.

use std::ops::{Deref, DerefMut};

/// A packet that ends before what it promised.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("wanted {wanted} more bytes in a packet, found {found}")]
pub struct Malformed {
    /// What the next field takes.
    pub wanted: usize,
    /// What is left.
    pub found: usize,
}

/// What differs between those who wrote logs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Layout {
    /// Vectors of double precision, as UE5 writes them.
    pub(crate) wide_vectors: bool,
    /// Wheels without stiffness, as CARLA 0.9.11 wrote them.
    pub(crate) short_wheels: bool,
    /// Types of attributes count from 0, as before version 2.
    pub(crate) types_from_zero: bool,
}

/// What is left of a packet.
pub(crate) struct Cursor<'a> {
    rest: &'a [u8],
    pub(crate) layout: Layout,
}

impl<'a> Cursor<'a> {
    pub(crate) fn new(body: &'a [u8], layout: Layout) -> Self {
        Self { rest: body, layout }
    }

    pub(crate) fn left(&self) -> usize {
        self.rest.len()
    }

    pub(crate) fn bytes(&mut self, wanted: usize) -> Result<&'a [u8], Malformed> {
        let found = self.rest.len();
        let (taken, rest) =
            self.rest.split_at_checked(wanted).ok_or(Malformed { wanted, found })?;
        self.rest = rest;
        Ok(taken)
    }

    fn array<const N: usize>(&mut self) -> Result<[u8; N], Malformed> {
        let mut array = [0; N];
        array.copy_from_slice(self.bytes(N)?);
        Ok(array)
    }

    /// So many records; a count that the packet cannot hold takes no memory.
    fn records<T: Field>(&mut self, count: usize) -> Result<Vec<T>, Malformed> {
        let mut records = Vec::with_capacity(count.min(self.left() / T::BYTES_MIN.max(1)));
        for _ in 0..count {
            records.push(T::take(self)?);
        }
        Ok(records)
    }
}

/// What a log consists of.
pub(crate) trait Field: Sized {
    /// The shortest there is.
    const BYTES_MIN: usize;

    fn put(&self, out: &mut Vec<u8>);

    fn take(cursor: &mut Cursor<'_>) -> Result<Self, Malformed>;
}

macro_rules! numbers {
    ($($number:ty),*) => { $(
        impl Field for $number {
            const BYTES_MIN: usize = size_of::<$number>();

            fn put(&self, out: &mut Vec<u8>) {
                out.extend_from_slice(&self.to_le_bytes());
            }

            fn take(cursor: &mut Cursor<'_>) -> Result<Self, Malformed> {
                Ok(Self::from_le_bytes(cursor.array()?))
            }
        }
    )* };
}

numbers!(u8, u16, i32, u32, i64, u64, f32, f64);

impl Field for () {
    const BYTES_MIN: usize = 0;

    fn put(&self, _: &mut Vec<u8>) {}

    fn take(_: &mut Cursor<'_>) -> Result<Self, Malformed> {
        Ok(())
    }
}

impl Field for bool {
    const BYTES_MIN: usize = 1;

    fn put(&self, out: &mut Vec<u8>) {
        out.push(u8::from(*self));
    }

    fn take(cursor: &mut Cursor<'_>) -> Result<Self, Malformed> {
        Ok(u8::take(cursor)? != 0)
    }
}

/// What is longer than its count can say is cut, at the end of a character.
impl Field for String {
    const BYTES_MIN: usize = 2;

    fn put(&self, out: &mut Vec<u8>) {
        let end = self.floor_char_boundary(usize::from(u16::MAX));
        (end as u16).put(out);
        out.extend(self.bytes().take(end));
    }

    fn take(cursor: &mut Cursor<'_>) -> Result<Self, Malformed> {
        let length = u16::take(cursor)?;
        Ok(String::from_utf8_lossy(cursor.bytes(usize::from(length))?).into_owned())
    }
}

impl<T: Field + Copy + Default, const N: usize> Field for [T; N] {
    const BYTES_MIN: usize = N * T::BYTES_MIN;

    fn put(&self, out: &mut Vec<u8>) {
        self.iter().for_each(|one| one.put(out));
    }

    fn take(cursor: &mut Cursor<'_>) -> Result<Self, Malformed> {
        let mut array = [T::default(); N];
        for one in &mut array {
            *one = T::take(cursor)?;
        }
        Ok(array)
    }
}

/// A list with a count of 16 bits; what is beyond it is not written.
impl<T: Field> Field for Vec<T> {
    const BYTES_MIN: usize = 2;

    fn put(&self, out: &mut Vec<u8>) {
        let count = self.len().min(usize::from(u16::MAX));
        (count as u16).put(out);
        self.iter().take(count).for_each(|one| one.put(out));
    }

    fn take(cursor: &mut Cursor<'_>) -> Result<Self, Malformed> {
        let count = u16::take(cursor)?;
        cursor.records(usize::from(count))
    }
}

/// A list with a count of 32 bits.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Long<T>(pub Vec<T>);

impl<T> Deref for Long<T> {
    type Target = Vec<T>;

    fn deref(&self) -> &Vec<T> {
        &self.0
    }
}

impl<T> DerefMut for Long<T> {
    fn deref_mut(&mut self) -> &mut Vec<T> {
        &mut self.0
    }
}

impl<T: Field> Field for Long<T> {
    const BYTES_MIN: usize = 4;

    fn put(&self, out: &mut Vec<u8>) {
        let count = u32::try_from(self.0.len()).unwrap_or(u32::MAX);
        count.put(out);
        self.0.iter().take(count as usize).for_each(|one| one.put(out));
    }

    fn take(cursor: &mut Cursor<'_>) -> Result<Self, Malformed> {
        let count = u32::take(cursor)?;
        Ok(Self(cursor.records(count as usize)?))
    }
}

/// A record that is its fields one after the other.
macro_rules! record {
    (
        $(#[$doc:meta])*
        $name:ident { $($(#[$field_doc:meta])* $field:ident: $kind:ty,)* }
    ) => {
        $(#[$doc])*
        #[derive(Clone, Debug, Default, PartialEq)]
        pub struct $name {
            $($(#[$field_doc])* pub $field: $kind,)*
        }

        impl $crate::bytes::Field for $name {
            const BYTES_MIN: usize = 0 $(+ <$kind as $crate::bytes::Field>::BYTES_MIN)*;

            fn put(&self, out: &mut Vec<u8>) {
                $($crate::bytes::Field::put(&self.$field, out);)*
            }

            fn take(
                cursor: &mut $crate::bytes::Cursor<'_>,
            ) -> Result<Self, $crate::bytes::Malformed> {
                Ok(Self { $($field: $crate::bytes::Field::take(cursor)?,)* })
            }
        }
    };
}
pub(crate) use record;

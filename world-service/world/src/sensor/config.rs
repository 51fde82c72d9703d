//! Attributes of a sensor as numbers.

use std::fmt::Display;
use std::ops::RangeInclusive;
use std::str::FromStr;

use schemas::{Attribute, Error, ErrorCode};

/// Longest distance a sensor may look.
pub(super) const RANGE_M_MAX: f32 = 10_000.0;
/// Points that one sensor may be asked for in a second.
pub(super) const POINTS_PER_SECOND_MAX: u32 = 100_000_000;
/// Points that one sensor measures in a tick however many it is asked for, so that they fit into
/// a reply with those of others.
pub(super) const POINTS_PER_TICK_MAX: u32 = 1_000_000;
/// Largest noise or bias, in the unit of the measurement.
pub(super) const NOISE_MAX: f64 = 1.0e6;

/// What a client set, the rest by default.
#[derive(Clone, Copy, Debug)]
pub(super) struct Settings<'a>(pub &'a [Attribute]);

impl Settings<'_> {
    /// The number of an attribute, or `default` where it is not set.
    ///
    /// # Errors
    /// `InvalidArgument` for what is not a number or out of range.
    pub(super) fn number<T>(
        &self,
        id: &str,
        default: T,
        range: RangeInclusive<T>,
    ) -> Result<T, Error>
    where
        T: FromStr + PartialOrd + Display + Copy,
    {
        let Some(value) = self.get(id) else { return Ok(default) };
        let number = value.trim().parse::<T>().ok().filter(|number| range.contains(number));
        number.ok_or_else(|| {
            let (low, high) = (range.start(), range.end());
            refused(id, &format!("a number from {low} to {high}"), value)
        })
    }

    /// # Errors
    /// `InvalidArgument` for what is neither `true` nor `false`.
    pub(super) fn flag(&self, id: &str, default: bool) -> Result<bool, Error> {
        match self.get(id).map(|value| value.to_ascii_lowercase()) {
            None => Ok(default),
            Some(value) => match value.as_str() {
                "true" | "1" => Ok(true),
                "false" | "0" => Ok(false),
                _ => Err(refused(id, "true or false", &value)),
            },
        }
    }

    /// The same attribute for each of three axes; `id` has a `?` in place of the axis.
    ///
    /// # Errors
    /// `InvalidArgument` as [`number`](Self::number).
    pub(super) fn axes(&self, id: &str, range: RangeInclusive<f64>) -> Result<[f64; 3], Error> {
        let axis = |axis: &str| self.number(&id.replace('?', axis), 0.0, range.clone());
        Ok([axis("x")?, axis("y")?, axis("z")?])
    }

    /// The value of an attribute among those that are known, the first of them by default.
    ///
    /// # Errors
    /// `InvalidArgument` for any other.
    pub(super) fn choice<T: Copy>(&self, id: &str, known: &[(&str, T)]) -> Result<T, Error> {
        let value = self.get(id);
        let found = known.iter().find(|(name, _)| value.is_none_or(|value| value == *name));
        found.map(|(_, choice)| *choice).ok_or_else(|| {
            let names: Vec<&str> = known.iter().map(|(name, _)| *name).collect();
            refused(id, &format!("one of {}", names.join(", ")), value.unwrap_or_default())
        })
    }

    /// Empty where it is not set.
    pub(super) fn text(&self, id: &str) -> &str {
        self.get(id).unwrap_or_default()
    }

    /// The `noise_seed` attribute; any whole number.
    ///
    /// # Errors
    /// `InvalidArgument` for anything else.
    pub(super) fn seed(&self) -> Result<u64, Error> {
        Ok(self.number("noise_seed", 0, i64::MIN..=i64::MAX)?.cast_unsigned())
    }

    fn get(&self, id: &str) -> Option<&str> {
        let attribute = self.0.iter().find(|attribute| attribute.id == id)?;
        Some(attribute.value.as_str()).filter(|value| !value.is_empty())
    }
}

fn refused(id: &str, wanted: &str, found: &str) -> Error {
    Error::new(ErrorCode::InvalidArgument, format!("attribute {id} is out of range"))
        .wanted(wanted)
        .found(format!("{found:?}"))
}

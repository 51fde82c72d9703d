//! Where everything is in a journal.

use std::io;

use schemas::Tick;

use super::chunk::damaged;

/// Bytes of a place on file.
const PLACE_BYTES: usize = 16;

/// Where the ticks and keyframes of a journal are; 16 bytes a tick.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Index {
    /// Of the tick before the first one.
    pub(super) first: Tick,
    /// Tick after tick.
    pub(super) ticks: Vec<Place>,
    /// With the number of ticks before each.
    pub(super) keyframes: Vec<Keyframe>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Place {
    pub(super) offset: u64,
    /// Since the journal began.
    pub(super) elapsed_secs: f64,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Keyframe {
    pub(super) offset: u64,
    pub(super) ticks_before: u64,
}

impl Index {
    /// Of a journal that begins after this tick.
    pub(super) fn after(first: Tick) -> Self {
        Self { first, ..Self::default() }
    }

    /// The moment from which the journal goes on.
    pub fn first(&self) -> Tick {
        self.first
    }

    /// The last tick of the journal.
    pub fn last(&self) -> Tick {
        Tick(self.first.0.saturating_add(self.ticks.len() as u64))
    }

    /// How many keyframes there are.
    pub fn keyframe_count(&self) -> usize {
        self.keyframes.len()
    }

    /// How long the journal is, in simulated seconds.
    pub fn total_secs(&self) -> f64 {
        self.ticks.last().map_or(0.0, |place| place.elapsed_secs)
    }

    /// The last tick that is not after this time since the journal began.
    pub fn tick_at(&self, secs: f64) -> Tick {
        // Elapsed times are sums of lengths that binary fractions do not have.
        let until_secs = secs + 1e-9;
        let count = self.ticks.partition_point(|place| place.elapsed_secs <= until_secs);
        Tick(self.first.0 + count as u64)
    }

    /// When a tick was, in seconds since the journal began.
    pub fn elapsed_secs(&self, tick: Tick) -> Option<f64> {
        match self.number(tick)? {
            0 => Some(0.0),
            number => Some(self.ticks.get(number - 1)?.elapsed_secs),
        }
    }

    /// How many ticks it takes to this one; `None` for one that is not in the journal.
    pub(super) fn number(&self, tick: Tick) -> Option<usize> {
        let number = usize::try_from(tick.0.checked_sub(self.first.0)?).ok()?;
        (number <= self.ticks.len()).then_some(number)
    }

    /// The last keyframe that has at most so many ticks before it.
    pub(super) fn keyframe(&self, number: usize) -> Option<Keyframe> {
        let after = self.keyframes.partition_point(|key| key.ticks_before <= number as u64);
        self.keyframes.get(after.checked_sub(1)?).copied()
    }

    pub(super) fn encode(&self) -> Vec<u8> {
        let mut bytes = Vec::with_capacity(8 + PLACE_BYTES * (self.ticks.len() + 1));
        bytes.extend_from_slice(&(self.keyframes.len() as u64).to_le_bytes());
        for key in &self.keyframes {
            bytes.extend_from_slice(&key.offset.to_le_bytes());
            bytes.extend_from_slice(&key.ticks_before.to_le_bytes());
        }
        for place in &self.ticks {
            bytes.extend_from_slice(&place.offset.to_le_bytes());
            bytes.extend_from_slice(&place.elapsed_secs.to_le_bytes());
        }
        bytes
    }

    /// # Errors
    /// `InvalidData` for bytes of another length than they say.
    pub(super) fn decode(first: Tick, bytes: &[u8]) -> io::Result<Self> {
        let wrong = || damaged("its index has another length than it says");
        let (count, places) = bytes.split_first_chunk::<8>().ok_or_else(wrong)?;
        let (places, rest) = places.as_chunks::<PLACE_BYTES>();
        let count = usize::try_from(u64::from_le_bytes(*count)).map_err(|_| wrong())?;
        if !rest.is_empty() {
            return Err(wrong());
        }
        let (keys, ticks) = places.split_at_checked(count).ok_or_else(wrong)?;
        let halves = |place: &[u8; PLACE_BYTES]| {
            let (halves, _) = place.as_chunks::<8>();
            [halves[0], halves[1]]
        };
        let keyframes = keys.iter().map(halves).map(|[offset, ticks]| Keyframe {
            offset: u64::from_le_bytes(offset),
            ticks_before: u64::from_le_bytes(ticks),
        });
        let ticks = ticks.iter().map(halves).map(|[offset, secs]| Place {
            offset: u64::from_le_bytes(offset),
            elapsed_secs: f64::from_le_bytes(secs),
        });
        Ok(Self { first, keyframes: keyframes.collect(), ticks: ticks.collect() })
    }
}

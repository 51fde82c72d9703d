//! When a journal has its next keyframe.

use std::time::Duration;

/// Ticks from one keyframe to the next, at least and at most.
const TICKS_MIN: u64 = 10;
const TICKS_MAX: u64 = 100;
/// What the ticks from one to the next may take: as long as whoever seeks does them again.
const WORK: Duration = Duration::from_millis(10);

/// Counts what there would be to do again since the last keyframe.
///
/// A keyframe is a whole world, some kilobytes of each vehicle: worlds that tick fast have fewer of
/// them than those in which seeking takes long.
#[derive(Clone, Copy, Debug, Default)]
pub struct Pace {
    ticks: u64,
    work: Duration,
}

impl Pace {
    /// Counts a tick that took so long; whether a keyframe is due after it, from which to count
    /// again.
    pub fn tick(&mut self, took: Duration) -> bool {
        self.ticks += 1;
        self.work += took;
        let is_due = self.ticks >= TICKS_MAX || (self.ticks >= TICKS_MIN && self.work >= WORK);
        if is_due {
            *self = Self::default();
        }
        is_due
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Ticks up to the first keyframe, and from that to the next.
    fn ticks(took: Duration) -> [u64; 2] {
        let mut pace = Pace::default();
        [0; 2].map(|_: u64| {
            let mut count = 1;
            while !pace.tick(took) {
                count += 1;
            }
            count
        })
    }

    #[test]
    fn keyframes_are_as_far_apart_as_there_is_work_between_them() {
        assert_eq!(ticks(Duration::ZERO), [100, 100]);
        assert_eq!(ticks(Duration::from_micros(400)), [25, 25]);
        assert_eq!(ticks(Duration::from_millis(1)), [10, 10]);
        // However slow a world or its machine is.
        assert_eq!(ticks(Duration::from_millis(30)), [10, 10]);
    }
}

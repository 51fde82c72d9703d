//! Whether a process takes new work.

use std::time::Instant;

/// Whether a process takes new work, and how long what it has may go on.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Drain {
    /// It takes new work.
    #[default]
    No,
    /// It takes none until it is told otherwise, and does not end.
    Asked,
    /// It takes none and ends when what it has is over, or at `until`.
    Ending {
        /// When it was told to.
        since: Instant,
        /// What is not over then ends with the process.
        until: Instant,
    },
}

impl Drain {
    /// Whether nothing new is taken.
    pub fn is_on(self) -> bool {
        self != Self::No
    }

    /// Whether half of the time before the end has passed; those who come again and again are
    /// better off elsewhere then.
    pub fn is_late(self, now: Instant) -> bool {
        self.late_at().is_some_and(|half| now >= half)
    }

    /// When it is late, if it ends.
    pub fn late_at(self) -> Option<Instant> {
        match self {
            Self::Ending { since, until } => Some(since + until.duration_since(since) / 2),
            Self::No | Self::Asked => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;

    #[test]
    fn only_an_end_that_is_near_is_late() {
        let since = Instant::now();
        let ending = Drain::Ending { since, until: since + Duration::from_secs(10) };
        assert!(!ending.is_late(since + Duration::from_secs(4)));
        assert!(ending.is_late(since + Duration::from_secs(5)));
        assert!(!Drain::Asked.is_late(since + Duration::from_secs(1_000)));
        assert!(ending.is_on() && Drain::Asked.is_on() && !Drain::No.is_on());
    }
}

//! How often an address may present a wrong token.

use std::net::IpAddr;
use std::num::NonZeroUsize;
use std::time::{Duration, Instant};

use lru::LruCache;

/// Wrong tokens of one address within [`WINDOW`], after which its next wrong ones are not counted.
pub(crate) const FAILURES_MAX: u32 = 10;
/// The time that is counted together.
pub(crate) const WINDOW: Duration = Duration::from_secs(1);
/// Addresses that are remembered; of more the longest quiet one is forgotten.
const ADDRESSES_MAX: NonZeroUsize = NonZeroUsize::new(4_096).unwrap();

/// What addresses did lately.
pub(crate) struct Failures {
    by_address: LruCache<IpAddr, Window>,
}

#[derive(Clone, Copy)]
struct Window {
    since: Instant,
    count: u32,
}

impl Failures {
    pub(crate) fn new() -> Self {
        Self { by_address: LruCache::new(ADDRESSES_MAX) }
    }

    /// Whether an address has presented too many.
    pub(crate) fn is_shut_out(&mut self, address: IpAddr, now: Instant) -> bool {
        self.by_address.get(&address).is_some_and(|window| {
            window.count >= FAILURES_MAX && now.saturating_duration_since(window.since) < WINDOW
        })
    }

    pub(crate) fn note(&mut self, address: IpAddr, now: Instant) {
        let begun = Window { since: now, count: 0 };
        let window = self.by_address.get_or_insert_mut(address, || begun);
        if now.saturating_duration_since(window.since) >= WINDOW {
            *window = begun;
        }
        window.count += 1;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_address_waits_after_ten_failures_and_others_do_not() {
        let (mut failures, now) = (Failures::new(), Instant::now());
        let [one, other] = ["10.0.0.1", "10.0.0.2"].map(|text| text.parse().unwrap());
        for _ in 0..FAILURES_MAX {
            assert!(!failures.is_shut_out(one, now));
            failures.note(one, now);
        }
        assert!(failures.is_shut_out(one, now));
        assert!(!failures.is_shut_out(other, now));
        assert!(!failures.is_shut_out(one, now + WINDOW));
    }

    #[test]
    fn addresses_without_end_take_no_memory_without_end() {
        let (mut failures, now) = (Failures::new(), Instant::now());
        for number in 0..10_000_u32 {
            failures.note(IpAddr::from(number.to_be_bytes()), now);
        }
        assert_eq!(failures.by_address.len(), ADDRESSES_MAX.get());
    }
}

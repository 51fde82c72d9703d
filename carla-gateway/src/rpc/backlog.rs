//! Bytes that wait, and who may have more of them wait.

use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Bytes of replies that wait for one client that does not read.
pub(super) const REPLY_BYTES_MAX: usize = 256 * 1024 * 1024;
/// Bytes that wait for all clients of an endpoint, beyond which none may have more than its share.
pub(super) const ALL_REPLY_BYTES_MAX: usize = 512 * 1024 * 1024;
/// That share.
pub(super) const FAIR_BYTES: usize = 2 * 1024 * 1024;

/// Bytes of replies that wait for all clients of an endpoint.
#[derive(Clone, Debug, Default)]
pub(super) struct Backlog {
    all: Arc<AtomicUsize>,
}

/// Those of one client.
#[derive(Clone, Debug)]
pub(super) struct Share {
    own: Arc<AtomicUsize>,
    all: Arc<AtomicUsize>,
}

/// Bytes that are counted for as long as this lives.
#[derive(Debug)]
pub(super) struct Counted {
    share: Share,
    bytes: usize,
}

impl Backlog {
    /// The share of one more client.
    pub(super) fn share(&self) -> Share {
        Share { own: Arc::default(), all: Arc::clone(&self.all) }
    }
}

impl Share {
    /// Counts bytes that wait from now on; `None` when the client has too many already.
    pub(super) fn count(&self, bytes: usize) -> Option<Counted> {
        let own = self.own.fetch_add(bytes, Ordering::Relaxed) + bytes;
        let all = self.all.fetch_add(bytes, Ordering::Relaxed) + bytes;
        let counted = Counted { share: self.clone(), bytes };
        let is_greedy = own > REPLY_BYTES_MAX || (all > ALL_REPLY_BYTES_MAX && own > FAIR_BYTES);
        (!is_greedy).then_some(counted)
    }
}

impl Drop for Counted {
    fn drop(&mut self) {
        self.share.own.fetch_sub(self.bytes, Ordering::Relaxed);
        self.share.all.fetch_sub(self.bytes, Ordering::Relaxed);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_client_may_have_so_much_wait_and_no_more() {
        let share = Backlog::default().share();
        let counted = share.count(REPLY_BYTES_MAX).unwrap();
        assert!(share.count(1).is_none());
        drop(counted);
        assert!(share.count(1).is_some());
    }

    #[test]
    fn when_too_much_waits_for_all_who_has_little_may_still_have_its_share() {
        let backlog = Backlog::default();
        let greedy = [backlog.share(), backlog.share()];
        let waiting = greedy.each_ref().map(|share| share.count(REPLY_BYTES_MAX).unwrap());
        let modest = backlog.share();
        assert!(modest.count(FAIR_BYTES).is_some());
        assert!(modest.count(FAIR_BYTES + 1).is_none());
        drop(waiting);
        assert!(modest.count(FAIR_BYTES + 1).is_some());
    }
}

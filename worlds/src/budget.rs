//! A bounded number of bytes that many share.

use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Bytes that may be kept.
#[derive(Debug)]
pub struct Budget {
    bytes_max: usize,
    used: AtomicUsize,
}

/// A part of a budget; given back when dropped.
#[derive(Debug)]
pub struct Share {
    budget: Arc<Budget>,
    bytes: usize,
}

impl Budget {
    /// So many bytes.
    pub fn new(bytes_max: usize) -> Arc<Self> {
        Arc::new(Self { bytes_max, used: AtomicUsize::new(0) })
    }

    /// Bytes that are kept.
    pub fn used(&self) -> usize {
        self.used.load(Ordering::Relaxed)
    }
}

impl Share {
    /// Nothing yet.
    pub fn none(budget: Arc<Budget>) -> Self {
        Self { budget, bytes: 0 }
    }

    /// Whether there was room; without any nothing changes.
    pub fn grow(&mut self, bytes: usize) -> bool {
        let fits =
            |used: usize| used.checked_add(bytes).filter(|sum| *sum <= self.budget.bytes_max);
        let used = &self.budget.used;
        let has_room = used.fetch_update(Ordering::Relaxed, Ordering::Relaxed, fits).is_ok();
        self.bytes += if has_room { bytes } else { 0 };
        has_room
    }
}

impl Drop for Share {
    fn drop(&mut self) {
        self.budget.used.fetch_sub(self.bytes, Ordering::Relaxed);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_stay_within_the_budget_and_are_given_back() {
        let budget = Budget::new(10);
        let (mut one, mut other) =
            (Share::none(Arc::clone(&budget)), Share::none(Arc::clone(&budget)));
        assert!(one.grow(6) && !other.grow(5) && other.grow(4) && !one.grow(usize::MAX));
        assert_eq!(budget.used(), 10);
        drop(one);
        assert_eq!(budget.used(), 4);
        drop(other);
        assert_eq!(budget.used(), 0);
    }
}

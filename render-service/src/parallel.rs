//! Work on all processors.

use std::sync::{Mutex, PoisonError};

/// Threads that draw, at most.
const THREADS_MAX: usize = 64;

/// Threads that draw.
pub(crate) fn threads() -> usize {
    std::thread::available_parallelism().map_or(1, usize::from).min(THREADS_MAX)
}

/// Does something with all items, on as many threads as there are kept things and items; what came
/// of each, in order.
pub(crate) fn in_parallel<K: Send, T: Send, R: Send>(
    kept: &mut [K],
    items: Vec<T>,
    work: impl Fn(&mut K, T) -> R + Sync,
) -> Vec<R> {
    let threads = items.len();
    let items = Mutex::new(items.into_iter().enumerate());
    let next = || items.lock().unwrap_or_else(PoisonError::into_inner).next();
    let run = |kept: &mut K| {
        let mut done: Vec<(usize, R)> = Vec::new();
        while let Some((at, item)) = next() {
            done.push((at, work(kept, item)));
        }
        done
    };
    let mut kept = kept.iter_mut().take(threads);
    let Some(own) = kept.next() else { return Vec::new() };
    let mut done = std::thread::scope(|scope| {
        let others: Vec<_> = kept.map(|kept| scope.spawn(|| run(kept))).collect();
        let mut done = run(own);
        for other in others {
            done.extend(other.join().expect("drawing does not panic"));
        }
        done
    });
    done.sort_by_key(|(at, _)| *at);
    done.into_iter().map(|(_, result)| result).collect()
}

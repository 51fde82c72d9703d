//! Waiting for a condition with a deadline.

use std::fmt::Debug;
use std::thread;
use std::time::{Duration, Instant};

/// Between two looks.
const PAUSE: Duration = Duration::from_millis(5);

/// The first value of `look` that is `Ok`.
///
/// # Panics
/// After `deadline`, with `wanted` and the last `Err`.
pub fn eventually<T, E: Debug>(
    wanted: &str,
    deadline: Duration,
    mut look: impl FnMut() -> Result<T, E>,
) -> T {
    let started = Instant::now();
    loop {
        match look() {
            Ok(found) => return found,
            Err(seen) if started.elapsed() > deadline => {
                panic!("no {wanted} within {deadline:?}; last seen: {seen:?}")
            }
            Err(_) => thread::sleep(PAUSE),
        }
    }
}

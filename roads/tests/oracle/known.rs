//! Differences that are known, with their reasons.

/// How many answers of a check may differ on a map.
pub(crate) fn allowed(_map: &str, _check: &str) -> usize {
    0
}

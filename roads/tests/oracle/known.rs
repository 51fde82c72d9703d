//! Differences that are known, with their reasons.

/// How many answers of a check may differ on a map.
///
/// The reasons:
/// - *between chords*: the point lies outside a bend, as near to the end of one of the client's
///   chords as to the start of the next, or far from a steep bend; the lane is the same, the place
///   along it differs by more than the tolerance;
/// - *between lanes*: the client moves a signal that stands in a lane to the side of the nearest
///   one. On the middle line of a road, and where connecting roads overlap, several are equally
///   near, and it takes another one.
pub(crate) fn allowed(map: &str, check: &str) -> usize {
    match (map, check) {
        // Between chords.
        ("sumo-roundabout", "projection") => 4,
        // Between lanes.
        ("cloverleaf", "landmarks") => 25,
        ("multi_intersections", "landmarks") => 13,
        _ => 0,
    }
}

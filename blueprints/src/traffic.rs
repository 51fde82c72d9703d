//! Lights and signs: actors that the map places, so the library does not list them, and without
//! attributes.

use crate::{Blueprint, Class};

/// Highest speed that a sign posts, in kilometres or miles per hour.
const SPEED_MAX: u32 = 130;

pub(crate) fn blueprints() -> impl Iterator<Item = Blueprint> {
    let signs = ["traffic.stop", "traffic.yield", "traffic.unknown"]
        .map(|id| (id.to_owned(), Class::TrafficSign));
    let speeds = (1..=SPEED_MAX / 5)
        .map(|step| (format!("traffic.speed_limit.{}", 5 * step), Class::TrafficSign));
    std::iter::once(("traffic.traffic_light".to_owned(), Class::TrafficLight))
        .chain(signs)
        .chain(speeds)
        .map(|(id, class)| Blueprint::new(&id, class, false, Vec::new()))
}

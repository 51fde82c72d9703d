//! What signals say, and how they belong together.

use serde_json::Value;

use super::checks::{Outcome, client_point, degrees_apart, number, place_of, rows};
use super::maps::Judged;

fn same_landmark(landmark: &roads::Landmark, wanted: &Value) -> bool {
    let lanes = serde_json::json!(landmark.validities);
    let words = [
        ("id", &landmark.id),
        ("name", &landmark.name),
        ("type", &landmark.signal_type),
        ("sub_type", &landmark.subtype),
        ("unit", &landmark.unit),
        ("text", &landmark.text),
    ];
    words.iter().all(|(key, found)| wanted[*key].as_str() == Some(found))
        && wanted["road"].as_u64() == Some(u64::from(landmark.road))
        && (number(&wanted["s"]) - landmark.s).abs() < 1e-3
        && (number(&wanted["t"]) - landmark.t).abs() < 1e-3
        && (number(&wanted["value"]) - landmark.value).abs() < 1e-3
        && wanted["orientation"].as_u64() == Some(landmark.orientation as u64)
        && wanted["dynamic"].as_bool() == Some(landmark.dynamic)
        && wanted["validities"] == lanes
}

pub(crate) fn landmarks(judged: &Judged) -> Outcome {
    let mut outcome = Outcome::default();
    let wanted = rows(judged, "landmarks");
    let found = judged.map.landmarks();
    let counts = || format!("{} landmarks, wanted {}", found.len(), wanted.len());
    outcome.compare(found.len() == wanted.len(), counts);
    for row in wanted {
        let same = found.iter().find(|landmark| same_landmark(landmark, row));
        let place_off = |landmark: &roads::Landmark| {
            let at = client_point(&landmark.pose.point);
            (0..3).map(|axis| (at[axis] - number(&row["pose"][axis])).abs()).fold(0.0, f64::max)
        };
        let turn_off = |landmark: &roads::Landmark| {
            degrees_apart(-landmark.pose.heading_rad.to_degrees(), number(&row["pose"][4]))
        };
        let right =
            same.is_some_and(|landmark| place_off(landmark) < 2e-3 && turn_off(landmark) < 1e-2);
        outcome.compare(right, || {
            let off = same.map(|landmark| (place_off(landmark), turn_off(landmark)));
            format!("{off:?} {row}")
        });
    }
    outcome
}

pub(crate) fn landmarks_ahead(judged: &Judged) -> Outcome {
    let mut outcome = Outcome::default();
    for row in rows(judged, "landmarks_ahead_60m") {
        let Some(from) = place_of(&row["from"]) else { continue };
        for (key, stop_at_junction) in [("through", false), ("stop_at_junction", true)] {
            let mut found: Vec<(String, u32, f64)> = judged
                .map
                .landmarks_ahead(&from, 60.0, stop_at_junction)
                .iter()
                .map(|ahead| (ahead.landmark.id.clone(), ahead.landmark.road, ahead.distance_m))
                .collect();
            let order = |a: &(String, u32, f64), b: &(String, u32, f64)| {
                (&a.0, a.1).cmp(&(&b.0, b.1)).then(a.2.total_cmp(&b.2))
            };
            found.sort_by(order);
            let mut wanted: Vec<(String, u32, f64)> = row[key]
                .as_array()
                .into_iter()
                .flatten()
                .filter_map(|one| {
                    let road = u32::try_from(one[1].as_u64()?).ok()?;
                    Some((one[0].as_str()?.to_owned(), road, number(&one[2])))
                })
                .collect();
            wanted.sort_by(order);
            let right = found.len() == wanted.len()
                && found
                    .iter()
                    .zip(&wanted)
                    .all(|(a, b)| a.0 == b.0 && a.1 == b.1 && (a.2 - b.2).abs() < 2e-3);
            outcome.compare(right, || format!("{key} {found:?} {row}"));
        }
    }
    outcome
}

pub(crate) fn landmark_groups(judged: &Judged) -> Outcome {
    let mut outcome = Outcome::default();
    let groups = judged.answers["landmark_groups"].as_object();
    for (id, wanted) in groups.into_iter().flatten() {
        let found: Vec<&str> = judged.map.landmark_group(id).collect();
        outcome.compare(*wanted == serde_json::json!(found), || format!("{id} {found:?} {wanted}"));
    }
    outcome
}

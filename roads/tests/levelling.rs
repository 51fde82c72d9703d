//! Goal: where the roads of a junction cover each other at different heights, wheels meet no step.
//! Method: a level road crosses one with a hump of 0.4 m; heights of the ground along both.
#![allow(clippy::unwrap_used, reason = "helpers fail the test that calls them")]

use roads::Map;
use roads::mesh::{GroundMesh, ground};

/// A level road from west to east along y = 0, and one from south to north along x = 15, in one
/// junction or each in its own; the second one rises by `hump_m` where they cross.
fn crossing(hump_m: f64, junctions: [u8; 2]) -> GroundMesh {
    let lane = "<lanes><laneSection s=\"0\"><center><lane id=\"0\" type=\"none\"/></center><right>\
                <lane id=\"-1\" type=\"driving\">\
                <width sOffset=\"0\" a=\"3.5\" b=\"0\" c=\"0\" d=\"0\"/></lane></right></laneSection></lanes>";
    let road = |id: u8, [x, y, hdg]: [f64; 3], elevation: &str| {
        let junction = junctions[usize::from(id) - 1];
        format!(
            "<road id=\"{id}\" length=\"30\" junction=\"{junction}\"><link/><planView>\
             <geometry s=\"0\" x=\"{x}\" y=\"{y}\" hdg=\"{hdg}\" length=\"30\"><line/></geometry>\
             </planView><elevationProfile>{elevation}</elevationProfile>{lane}</road>"
        )
    };
    let record = |s: f64, a: f64, c: f64, d: f64| {
        format!("<elevation s=\"{s}\" a=\"{a}\" b=\"0\" c=\"{c}\" d=\"{d}\"/>")
    };
    let (c, d) = (3.0 * hump_m / 64.0, -2.0 * hump_m / 512.0);
    let hump =
        record(0.0, 0.0, c, d) + &record(8.0, hump_m, 0.0, 0.0) + &record(22.0, hump_m, -c, -d);
    let text = format!(
        "<OpenDRIVE><header/>{}{}<junction id=\"8\" name=\"\"/><junction id=\"9\" name=\"\"/></OpenDRIVE>",
        road(1, [0.0, 0.0, 0.0], &record(0.0, 0.0, 0.0, 0.0)),
        road(2, [15.0, -15.0, std::f64::consts::FRAC_PI_2], &hump),
    );
    ground(&Map::parse("crossing", &text).unwrap())
}

/// Height of the highest face at a place.
fn height_m(mesh: &GroundMesh, x: f64, y: f64) -> f64 {
    let heights = mesh.indices.iter().filter_map(|corners| {
        let [a, b, c] = corners.map(|index| mesh.positions_m[index as usize].map(f64::from));
        let side =
            |p: [f64; 3], q: [f64; 3]| (q[0] - p[0]) * (y - p[1]) - (q[1] - p[1]) * (x - p[0]);
        let [u, v, w] = [side(b, c), side(c, a), side(a, b)];
        let area = u + v + w;
        let covers = area > 1e-9 && u >= 0.0 && v >= 0.0 && w >= 0.0;
        covers.then(|| (u * a[2] + v * b[2] + w * c[2]) / area)
    });
    heights.fold(f64::NEG_INFINITY, f64::max)
}

/// The highest step within 0.1 m along the middle of the first road's lane.
fn step_m(mesh: &GroundMesh) -> f64 {
    let heights: Vec<f64> = (1..300).map(|k| height_m(mesh, f64::from(k) * 0.1, -1.75)).collect();
    heights.windows(2).map(|pair| (pair[1] - pair[0]).abs()).fold(0.0, f64::max)
}

#[test]
fn a_road_across_a_higher_one_of_its_junction_has_no_step() {
    let mesh = crossing(0.4, [9, 9]);
    let step_m = step_m(&mesh);
    assert!(step_m < 0.03, "{step_m} m");
    // Both ends are as high as before.
    for (x, y, wanted_m) in [(0.05, -1.75, 0.0), (29.95, -1.75, 0.0), (16.75, -14.95, 0.0)] {
        let found_m = height_m(&mesh, x, y);
        assert!((found_m - wanted_m).abs() < 0.01, "{x}, {y}: {found_m} m");
    }
    let (across_m, along_m) = (height_m(&mesh, 16.75, -1.75), height_m(&mesh, 16.75, 5.0));
    assert!((0.1..0.3).contains(&across_m), "between both: {across_m} m");
    assert!((along_m - 0.4).abs() < 0.05, "where nothing crosses: {along_m} m");
}

#[test]
fn roads_of_other_junctions_and_small_differences_stay_as_they_are() {
    assert!(step_m(&crossing(0.4, [8, 9])) > 0.3);
    let low = crossing(0.04, [9, 9]);
    assert!((height_m(&low, 16.75, -1.75) - 0.04).abs() < 1e-6);
}

/// A bridge over a road of its junction stays above it.
#[test]
fn a_bridge_in_a_junction_stays_above_what_it_crosses() {
    let mesh = crossing(3.0, [9, 9]);
    assert!((height_m(&mesh, 16.75, -1.75) - 3.0).abs() < 0.1);
}

//! Bridges of our towns have an underside and leave room for what drives below.

#[path = "common/towns.rs"]
mod generated;

use generated::{town, towns};
use nalgebra::Point3;
use roads::mesh::{GroundMesh, Material, decks};

/// Distance of the places looked at, in metres.
const STEP_M: f64 = 4.0;
/// A lane that lies this much higher above another one is on a bridge, in metres.
const BRIDGE_M: f64 = 4.8;
/// Places of two lanes this near to each other lie one above the other, in metres.
const ABOVE_M: f64 = 1.5;
/// Room that what drives below has, in metres: CARLA's firetruck is 3.8 m high.
const CLEARANCE_M: f64 = 4.2;

/// Height of the lowest face above a place, and whether it is seen from there.
fn ceiling_m(mesh: &GroundMesh, place: &Point3<f64>) -> Option<(f64, bool)> {
    let faces = mesh.indices.iter().filter_map(|face| {
        let [a, b, c] = face.map(|corner| mesh.positions_m[corner as usize].map(f64::from));
        let edge = |a: [f64; 3], b: [f64; 3]| {
            (b[0] - a[0]) * (place.y - a[1]) - (b[1] - a[1]) * (place.x - a[0])
        };
        let (of_c, of_a, of_b) = (edge(a, b), edge(b, c), edge(c, a));
        let area = of_a + of_b + of_c;
        let is_inside = [of_a, of_b, of_c].iter().all(|part| part * area > 0.0);
        let z = (of_a * a[2] + of_b * b[2] + of_c * c[2]) / area;
        // Corners are clockwise as seen from above.
        (is_inside && z > place.z + 1.0).then_some((z, area < 0.0))
    });
    faces.min_by(|a, b| a.0.total_cmp(&b.0))
}

#[test]
fn whoever_drives_below_a_bridge_sees_its_underside_and_has_room() {
    for name in ["Town04", "Town05"] {
        let map = town(name);
        let mesh = decks(&map);
        assert!(mesh.materials.iter().all(|material| *material == Material::Bridge));
        let places = map.generate_waypoints(STEP_M).unwrap();
        let places: Vec<Point3<f64>> =
            places.iter().map(|place| map.pose(place).translation.vector.into()).collect();
        let mut below = 0;
        for place in &places {
            let lies_above = |above: &&Point3<f64>| {
                above.z - place.z > BRIDGE_M && (above.xy() - place.xy()).norm() < ABOVE_M
            };
            let Some(above) = places.iter().find(lies_above) else { continue };
            let found = ceiling_m(&mesh, place);
            let (z, is_seen) = found.unwrap_or_else(|| panic!("{name}: sky above {place}"));
            assert!(is_seen, "{name}: the underside above {place} is seen from above");
            assert!(z < above.z, "{name}: {z} above {place}, and the road at {above}");
            assert!(z - place.z > CLEARANCE_M, "{name}: {} m of room at {place}", z - place.z);
            below += 1;
        }
        assert!(below > 10, "{name}: {below} places below a bridge");
    }
}

#[test]
fn towns_whose_roads_lie_level_have_no_bridges() {
    let is_level = |map: &roads::Map| map.bounds().is_none_or(|(min, max)| max.z - min.z < 1e-3);
    let level: Vec<_> = towns().filter(is_level).collect();
    assert!(level.len() > 2);
    for map in level {
        assert!(decks(&map).indices.is_empty(), "{}", map.name());
    }
}

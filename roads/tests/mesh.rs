//! Meshes of the generated town: nothing falls through, nothing looks the wrong way.

#[path = "common/towns.rs"]
mod generated;

use std::time::Instant;

use generated::town;
use nalgebra::{Point3, Vector3};
use roads::LaneTypes;
use roads::mesh::{GroundMesh, Material, ground, render};

/// What drives below a bridge is lower than this, in metres.
const BRIDGE_CLEAR_M: f64 = 4.5;

/// Heights of the ground below a point, by looking at every triangle.
fn heights(mesh: &GroundMesh, x: f64, y: f64) -> Vec<(f64, Material)> {
    let corner = |index: u32| Vector3::from(mesh.positions_m[index as usize].map(f64::from));
    let mut found = Vec::new();
    for (triangle, material) in mesh.indices.iter().zip(&mesh.materials) {
        let [a, b, c] = triangle.map(corner);
        let area = (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
        if area.abs() < 1e-9 {
            continue;
        }
        let v = ((x - a.x) * (c.y - a.y) - (y - a.y) * (c.x - a.x)) / area;
        let w = ((b.x - a.x) * (y - a.y) - (b.y - a.y) * (x - a.x)) / area;
        if v >= -1e-6 && w >= -1e-6 && v + w <= 1.0 + 1e-6 {
            found.push((a.z + v * (b.z - a.z) + w * (c.z - a.z), *material));
        }
    }
    found
}

fn highest(mesh: &GroundMesh, x: f64, y: f64) -> f64 {
    heights(mesh, x, y).iter().map(|(z, _)| *z).fold(f64::NEG_INFINITY, f64::max)
}

#[test]
fn there_is_level_road_under_every_driving_lane_also_across_lane_and_road_borders() {
    let map = town("Town10HD_Opt");
    let mesh = ground(&map);
    for (index, place) in map.generate_waypoints(7.3).unwrap().into_iter().enumerate() {
        // From edge to edge of the lane, so that the seams are met as well.
        let side_m = ((index * 37 % 100) as f64 / 50.0 - 1.0) * 1.75;
        let at = map.pose(&place) * Point3::new(0.0, side_m, 0.0);
        let z = highest(&mesh, at.x, at.y);
        assert!(z.abs() < 1e-4, "ground at {z} m, {side_m} m beside {place:?}");
    }
}

#[test]
fn a_wheel_that_leaves_a_motorway_rolls_down_a_bank() {
    let map = town("Town04_Opt");
    let mesh = ground(&map);
    let is_beside_the_land = |place: &roads::Waypoint| {
        (1..=12).contains(&place.road) && place.lane.abs() == 5 && place.s > 30.0
    };
    let mut count = 0;
    for place in map.generate_waypoints(31.0).unwrap().iter().filter(|p| is_beside_the_land(p)) {
        let pose = map.pose(place);
        // Half a metre beyond the hard shoulder.
        let at = pose * Point3::new(0.0, -(1.75 + 2.5 + 0.5), 0.0);
        let below_m: Vec<f64> = heights(&mesh, at.x, at.y)
            .iter()
            .map(|(z, _)| pose.translation.z - z)
            .filter(|below_m| *below_m > -BRIDGE_CLEAR_M)
            .collect();
        let nearest_m = below_m.iter().copied().fold(f64::INFINITY, f64::min);
        assert!((0.0..0.15).contains(&nearest_m), "{nearest_m} m at {place:?}");
        count += 1;
    }
    assert!(count > 150, "{count}");
}

#[test]
fn sidewalks_are_a_kerb_higher_than_the_road() {
    let map = town("Town10HD_Opt");
    let mesh = ground(&map);
    for spawn in map.spawn_points().iter().step_by(5) {
        let at: Point3<f64> = spawn.translation.vector.into();
        let place = map.nearest(at, LaneTypes::SIDEWALK).unwrap();
        let middle = map.pose(&place).translation.vector;
        let z = highest(&mesh, middle.x, middle.y);
        assert!((z - 0.15).abs() < 1e-4, "sidewalk at {z} m at {place:?}");
    }
}

#[test]
fn the_middle_of_every_junction_is_paved() {
    let map = town("Town10HD_Opt");
    let mesh = ground(&map);
    let on_the_ring =
        [(-47.0, 63.2), (104.4, -21.0), (104.1, -68.1), (-46.7, -135.2), (-108.7, -20.4)];
    let inside = [(-47.0, -20.6), (41.9, -20.8), (-46.8, -67.9)];
    for (x, y) in on_the_ring.into_iter().chain(inside) {
        for (dx, dy) in [(0.0, 0.0), (7.3, 7.3), (-7.4, 7.4), (7.2, -7.2), (-6.8, -7.3)] {
            let found = heights(&mesh, x + dx, y + dy);
            let paved = found
                .iter()
                .any(|(_, material)| matches!(material, Material::Asphalt | Material::Sidewalk));
            assert!(paved, "only land at {} {}", x + dx, y + dy);
        }
    }
}

/// A junction of two roads that cross; one has a planted lane where the other one drives.
fn planted_crossing() -> String {
    let lane = |id: i32, kind: &str| {
        format!(
            "<lane id=\"{id}\" type=\"{kind}\"><width sOffset=\"0\" a=\"4\" b=\"0\" c=\"0\" d=\"0\"/>\
             </lane>"
        )
    };
    let road = |id: i32, pose: &str, left: &str| {
        let (left, right) = (lane(1, left), lane(-1, "driving"));
        format!(
            "<road id=\"{id}\" length=\"40\" junction=\"9\"><link/><planView>\
             <geometry s=\"0\" {pose} length=\"40\"><line/></geometry></planView>\
             <lanes><laneSection s=\"0\"><left>{left}</left>\
             <center><lane id=\"0\" type=\"none\"/></center><right>{right}</right>\
             </laneSection></lanes></road>"
        )
    };
    format!(
        "<OpenDRIVE><header/>{}{}<junction id=\"9\">\
         <connection id=\"0\" incomingRoad=\"1\" connectingRoad=\"1\"/>\
         <connection id=\"1\" incomingRoad=\"1\" connectingRoad=\"2\"/></junction></OpenDRIVE>",
        road(1, "x=\"-20\" y=\"0\" hdg=\"0\"", "none"),
        road(2, "x=\"0\" y=\"-20\" hdg=\"1.5707963267948966\"", "driving"),
    )
}

#[test]
fn nothing_is_planted_where_a_road_crosses_another_ones_planted_lane() {
    let map = roads::Map::parse("crossing", &planted_crossing()).unwrap();
    let mesh = ground(&map);
    // Where both roads are, and between the lanes beside it.
    for (x, y) in [(1.0, 2.0), (-1.0, 3.0), (6.0, 2.0)] {
        let found = heights(&mesh, x, y);
        let top = highest(&mesh, x, y);
        let on_top = |(z, _): &&(f64, Material)| top - z < 0.005;
        let planted = found.iter().filter(on_top).any(|(_, what)| *what == Material::Grass);
        assert!(!planted && top.abs() < 1e-4, "at {x} {y}: {found:?}");
    }
}

#[test]
fn every_level_face_of_the_ground_looks_up() {
    let mesh = ground(&town("Town10HD_Opt"));
    for triangle in &mesh.indices {
        let [a, b, c] = triangle.map(|i| Vector3::from(mesh.positions_m[i as usize]));
        let normal = (b - a).cross(&(c - a));
        let level = (a.z - b.z).abs() < 1e-5 && (a.z - c.z).abs() < 1e-5;
        assert!(!level || normal.z > -1e-6, "{a} {b} {c}");
    }
}

#[test]
fn the_meshes_stay_within_their_budgets() {
    let map = town("Town10HD_Opt");
    let ground = ground(&map);
    let picture = render(&map);
    let drawn: usize = picture.surfaces.iter().map(|surface| surface.indices.len()).sum();
    println!("ground {} triangles", ground.indices.len());
    let mut by_material = std::collections::BTreeMap::new();
    for surface in &picture.surfaces {
        *by_material.entry(surface.material).or_insert(0) += surface.indices.len();
    }
    println!("{by_material:?}");
    println!("picture {drawn} triangles in {} surfaces", picture.surfaces.len());
    assert!(ground.indices.len() < 40_000, "{}", ground.indices.len());
    assert!(drawn < 60_000, "{drawn}");
    assert_eq!(ground.indices.len(), ground.materials.len());
}

#[test]
fn every_surface_lies_in_its_box_and_has_unit_normals_that_agree_with_its_triangles() {
    for surface in render(&town("Town10HD_Opt")).surfaces {
        assert_eq!(surface.positions_m.len(), surface.normals.len());
        for position in &surface.positions_m {
            let inside = (0..3)
                .all(|axis| (surface.min_m[axis]..=surface.max_m[axis]).contains(&position[axis]));
            assert!(inside, "{position:?}");
        }
        for triangle in &surface.indices {
            let [a, b, c] = triangle.map(|i| Vector3::from(surface.positions_m[i as usize]));
            let face = (b - a).cross(&(c - a));
            for index in triangle {
                let normal = Vector3::from(surface.normals[*index as usize]);
                assert!((normal.norm() - 1.0).abs() < 1e-3, "{normal}");
                assert!(face.dot(&normal) > -1e-6, "{:?}: {normal} {face}", surface.material);
            }
        }
    }
}

#[test]
fn a_town_with_its_ground_is_ready_in_milliseconds() {
    // A bound far above the usual few milliseconds: it catches a lost order of magnitude, and
    // not a busy machine. The bench measures.
    let started = Instant::now();
    let map = town("Town10HD_Opt");
    let parsed = started.elapsed();
    let mesh = ground(&map);
    let meshed = started.elapsed();
    println!("build and parse {parsed:?}, with ground {meshed:?}, {} bytes", map.text().len());
    assert!(meshed.as_millis() < 500, "{meshed:?} for {} triangles", mesh.indices.len());
}

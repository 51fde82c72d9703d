//! The mesh people walk on, for every generated town and for maps that want to break it.

#[path = "common/grid.rs"]
mod grid;
#[path = "common/maps.rs"]
mod maps;
#[path = "common/walks.rs"]
mod walks;

use std::collections::BTreeMap;

use nalgebra::Point3;
use proptest::prelude::*;
use roads::Map;
use roads::nav::{Area, CORNERS_MAX, NavMesh};
use walks::{KERB_M, WALKER_RADIUS_M, area_m2, depth_m, islands, names, town};

/// Area of the polygons of one kind, in square metres.
fn total_m2(mesh: &NavMesh, area: Area) -> f64 {
    let own = (0..).zip(mesh.polygons()).filter(|(_, polygon)| polygon.area == area);
    own.map(|(index, _)| area_m2(&mesh.outline(index))).sum()
}

fn assert_sound(name: &str, mesh: &NavMesh) {
    for (index, polygon) in (0_u32..).zip(mesh.polygons()) {
        let outline = mesh.outline(index);
        assert_eq!(outline.len(), polygon.corners.len(), "{name}: {polygon:?}");
        assert!((3..=CORNERS_MAX).contains(&outline.len()), "{name}: {polygon:?}");
        assert!(outline.iter().all(|p| p.coords.iter().all(|v| v.is_finite())), "{name}");
        assert!(area_m2(&outline) > -1e-9, "{name}: clockwise {outline:?}");
        let count = outline.len();
        for k in 0..count {
            let [a, b, c] = [k, k + 1, k + 2].map(|k| outline[k % count].xy());
            let length_m = (b - a).norm().max((c - b).norm());
            let dent_m = (a - b).perp(&(c - b)) / length_m;
            assert!(dent_m <= 1e-3, "{name}: {index} is dented by {dent_m} m: {outline:?}");
            if let Some(beyond) = polygon.neighbours[k] {
                let edge = [polygon.corners[k], polygon.corners[(k + 1) % count]];
                let other = &mesh.polygons()[beyond as usize];
                let shared = (0..other.corners.len()).any(|j| {
                    let back = [other.corners[(j + 1) % other.corners.len()], other.corners[j]];
                    back == edge && other.neighbours[j] == Some(index)
                });
                assert!(shared, "{name}: {index} and {beyond} share no edge");
            }
        }
    }
}

#[test]
fn towns_are_covered_with_convex_polygons_that_meet_edge_to_edge() {
    for name in names() {
        let (_, mesh) = town(name);
        assert!(!mesh.is_empty(), "{name}");
        assert!(mesh.polygons().len() < 30_000, "{name}: {}", mesh.polygons().len());
        assert_sound(name, &mesh);
    }
}

#[test]
fn sidewalks_are_covered_but_for_the_walkers_radius_at_their_borders() {
    for name in names() {
        let (map, mesh) = town(name);
        let text = map.text().to_owned();
        let document = roxmltree::Document::parse(&text).unwrap();
        let mut wanted_m2 = 0.0;
        for road in document.descendants().filter(|node| node.has_tag_name("road")) {
            let id = road.attribute("id").unwrap().parse().unwrap();
            let length_m: f64 = road.attribute("length").unwrap().parse().unwrap();
            wanted_m2 += sidewalk_m2(&map, id, length_m);
        }
        let found_m2 = total_m2(&mesh, Area::Sidewalk);
        assert!((found_m2 / wanted_m2 - 1.0).abs() < 0.02, "{name}: {found_m2} of {wanted_m2} m²");
    }
}

/// Where the middle of a walker may be on the sidewalks of a road, in steps of half a metre.
fn sidewalk_m2(map: &Map, road: u32, length_m: f64) -> f64 {
    const STEP_M: f64 = 0.5;
    let steps = std::iter::successors(Some(STEP_M / 2.0), |s| Some(s + STEP_M));
    let places = steps.take_while(|s| *s < length_m);
    let lanes = places.flat_map(|s| (-9..=9).filter_map(move |lane| map.waypoint(road, lane, s)));
    let lanes = lanes.filter(|place| map.lane(place).lane_type == roads::LaneType::Sidewalk);
    let strips = lanes.map(|place| {
        let beyond = roads::Waypoint { s: (place.s + 0.01).min(length_m), ..place };
        let rate = (map.pose(&beyond).translation.vector - map.pose(&place).translation.vector)
            .norm()
            / (beyond.s - place.s);
        (map.lane(&place).width_m - 2.0 * WALKER_RADIUS_M) * rate * STEP_M
    });
    strips.sum()
}

#[test]
fn all_sidewalk_of_a_town_is_one_walk_over_crossings() {
    for name in names() {
        let (_, mesh) = town(name);
        let island = islands(&mesh, |polygon| polygon.area != Area::Road);
        let mut area_of: BTreeMap<u32, f64> = BTreeMap::new();
        for (index, polygon) in (0..).zip(mesh.polygons()) {
            if let (Area::Sidewalk, Some(island)) = (polygon.area, island[index as usize]) {
                *area_of.entry(island).or_default() += area_m2(&mesh.outline(index));
            }
        }
        let all_m2: f64 = area_of.values().sum();
        let largest_m2 = area_of.values().copied().fold(0.0, f64::max);
        let share = largest_m2 / all_m2;
        println!("{name}: {share:.4} of {all_m2:.0} m², {} islands", area_of.len());
        assert!(share > 0.99, "{name}: {share}, islands {area_of:?}");
    }
}

#[test]
fn random_places_lie_on_sidewalks_within_reach_of_a_walker_and_all_over_town() {
    for name in names() {
        let (map, mesh) = town(name);
        let (low, high) = map.bounds().unwrap();
        let mut corners = [false; 4];
        for draw in 0..2_000 {
            let place = mesh.random_point(draw).unwrap();
            let depth_m = depth_m(&map, place).unwrap_or(f64::NEG_INFINITY);
            // Edges cut bends short by up to 2 cm.
            assert!(depth_m > WALKER_RADIUS_M - 0.05, "{name}: {place} is {depth_m} m inside");
            let lane = map.nearest(place, roads::LaneTypes::SIDEWALK).unwrap();
            let height_m = place.z - map.pose(&lane).translation.z;
            assert!((height_m - KERB_M).abs() < 0.05, "{name}: {place} is {height_m} m up");
            let east = place.x > (low.x + high.x) / 2.0;
            let north = place.y > (low.y + high.y) / 2.0;
            corners[usize::from(east) * 2 + usize::from(north)] = true;
        }
        // Town04's only sidewalks are those of the village in its north-east.
        let least = if name == "Town04" { 1 } else { 2 };
        assert!(corners.iter().filter(|seen| **seen).count() >= least, "{name}: {corners:?}");
    }
}

#[test]
fn crossings_and_roads_lie_on_the_asphalt_and_rise_only_at_the_kerb() {
    for name in names() {
        let (map, mesh) = town(name);
        for corners in map.crosswalks() {
            let middle = corners.iter().skip(1).fold(nalgebra::Vector3::zeros(), |sum, corner| {
                sum + corner.coords / (corners.len() - 1) as f64
            });
            let middle = Point3::from(middle);
            let (polygon, place) = mesh.nearest(middle).unwrap();
            assert_eq!(mesh.polygons()[polygon as usize].area, Area::Crosswalk, "{name}: {middle}");
            assert!((place - middle).norm() < 0.1, "{name}: {place} for {middle}");
        }
    }
}

#[test]
fn the_same_map_gives_the_same_mesh_and_the_same_draw_the_same_place() {
    let ((_, one), (_, other)) = (town("Town03"), town("Town03"));
    assert_eq!(one.vertices(), other.vertices());
    assert_eq!(one.polygons(), other.polygons());
    for draw in [0, 1, u64::MAX] {
        assert_eq!(one.random_point(draw), other.random_point(draw));
    }
    assert_ne!(one.random_point(1), one.random_point(2));
}

#[test]
fn real_maps_have_sound_meshes_with_places_on_their_sidewalks() {
    for judged in maps::all() {
        let mesh = NavMesh::new(&judged.map).unwrap_or_else(|e| panic!("{}: {e}", judged.name));
        assert_sound(&judged.name, &mesh);
        let expected = ["Town01", "Town03", "Town10HD", "example-junction"];
        assert!(!expected.contains(&judged.name.as_str()) || !mesh.is_empty(), "{}", judged.name);
        for draw in 0..300 {
            let Some(place) = mesh.random_point(draw) else { break };
            let depth_m = depth_m(&judged.map, place).unwrap_or(f64::NEG_INFINITY);
            assert!(depth_m > -0.1, "{}: {place} lies {depth_m} m beside", judged.name);
        }
    }
}

#[test]
fn a_map_without_sidewalks_has_an_empty_mesh_that_answers_nothing() {
    let map = Map::parse("grid", &grid::grid(50)).unwrap();
    let mesh = NavMesh::new(&map).unwrap();
    assert!(mesh.is_empty() && mesh.vertices().is_empty());
    assert_eq!(mesh.nearest(Point3::origin()), None);
    assert_eq!(mesh.random_point(1), None);
    assert!(mesh.path(Point3::origin(), Point3::new(9.0, 0.0, 0.0), true).is_empty());
    assert!(mesh.outline(0).is_empty());
}

/// A road with a sidewalk of some width on each side, and another road over it.
fn crossed(width_a: f64, width_d: f64, length_m: f64, curvature: f64, z_m: f64) -> String {
    let road = |id: u32, heading: f64, z_m: f64| {
        let lane = |lane: i32, kind: &str, a: f64, d: f64| {
            format!(
                "<lane id=\"{lane}\" type=\"{kind}\">\
                 <width sOffset=\"0\" a=\"{a}\" b=\"0\" c=\"0\" d=\"{d}\"/></lane>"
            )
        };
        format!(
            "<road id=\"{id}\" length=\"{length_m}\" junction=\"-1\"><planView>\
             <geometry s=\"0\" x=\"0\" y=\"0\" hdg=\"{heading}\" length=\"{length_m}\">\
             <arc curvature=\"{curvature}\"/></geometry></planView>\
             <elevationProfile><elevation s=\"0\" a=\"{z_m}\" b=\"0\" c=\"0\" d=\"0\"/>\
             </elevationProfile><lanes><laneSection s=\"0\"><left>{}{}</left><center>\
             <lane id=\"0\"/></center><right>{}{}</right></laneSection></lanes><objects>\
             <object id=\"{id}\" type=\"crosswalk\" name=\"c\" s=\"5\" t=\"0\" hdg=\"0\">\
             <outline><cornerLocal u=\"-1\" v=\"-9\" z=\"0\"/><cornerLocal u=\"1\" v=\"-9\" z=\"0\"/>\
             <cornerLocal u=\"1\" v=\"9\" z=\"0\"/><cornerLocal u=\"-1\" v=\"{width_a}\" z=\"0\"/>\
             </outline></object></objects></road>",
            lane(2, "sidewalk", width_a, width_d),
            lane(1, "driving", 3.5, 0.0),
            lane(-1, "driving", 3.5, width_d),
            lane(-2, "sidewalk", width_a, 0.0),
        )
    };
    format!("<OpenDRIVE><header/>{}{}</OpenDRIVE>", road(1, 0.0, 0.0), road(2, 1.3, z_m))
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn folded_crossing_and_monstrous_roads_give_a_sound_mesh(
        width_a in prop_oneof![-5.0..20.0, Just(0.0), Just(1e6)],
        width_d in prop_oneof![-1e-3..1e-3, Just(0.0), Just(1.0)],
        length_m in prop_oneof![0.02..200.0, Just(5_000.0)],
        curvature in prop_oneof![-0.5..0.5, Just(0.0), Just(50.0)],
        z_m in prop_oneof![-3.0..9.0, Just(0.0)],
    ) {
        let text = crossed(width_a, width_d, length_m, curvature, z_m);
        if let Ok(map) = Map::parse("crossed", &text)
            && let Ok(mesh) = NavMesh::new(&map)
        {
            for (index, polygon) in (0..).zip(mesh.polygons()) {
                prop_assert!((3..=CORNERS_MAX).contains(&polygon.corners.len()));
                prop_assert!(area_m2(&mesh.outline(index)) >= -1e-6);
            }
            if let Some(place) = mesh.random_point(3) {
                prop_assert!(!mesh.path(place, place, false).is_empty());
            }
        }
    }
}

#[test]
fn a_sidewalk_under_a_bridge_and_that_on_it_are_not_joined() {
    let map = Map::parse("crossed", &crossed(3.0, 0.0, 100.0, 0.0, 6.0)).unwrap();
    let mesh = NavMesh::new(&map).unwrap();
    let island = islands(&mesh, |_| true);
    let at = |z: f64| mesh.nearest(Point3::new(0.5, 0.5, z)).unwrap();
    let ((low, low_place), (high, high_place)) = (at(0.0), at(6.0));
    assert!((low_place.z).abs() < 0.2 && (high_place.z - 6.0).abs() < 0.2);
    assert_ne!(island[low as usize], island[high as usize]);
    assert!(mesh.path(low_place, high_place, true).is_empty());
}

//! Maps without houses and trees get some, and never on a lane.

#[path = "common/grid.rs"]
mod grid;
#[path = "common/maps.rs"]
mod maps;

use roads::{LaneTypes, Map, SceneryKind};

/// A straight street with sidewalks, as text.
fn street(objects: &str) -> String {
    let lane = |id: i32, kind: &str, width_m: f64| {
        format!(
            "<lane id=\"{id}\" type=\"{kind}\"><width sOffset=\"0\" a=\"{width_m}\" b=\"0\" c=\"0\" \
             d=\"0\"/></lane>"
        )
    };
    format!(
        "<OpenDRIVE><header/><road id=\"3\" length=\"200\" junction=\"-1\"><planView>\
         <geometry s=\"0\" x=\"0\" y=\"0\" hdg=\"0\" length=\"200\"><arc curvature=\"0.004\"/>\
         </geometry></planView><lanes><laneSection s=\"0\"><left>{}{}</left><center>\
         <lane id=\"0\"/></center><right>{}{}</right></laneSection></lanes>\
         <objects>{objects}</objects></road></OpenDRIVE>",
        lane(2, "sidewalk", 2.0),
        lane(1, "driving", 3.5),
        lane(-1, "driving", 3.5),
        lane(-2, "sidewalk", 2.0)
    )
}

fn parse(text: &str) -> Map {
    Map::parse("test", text).unwrap_or_else(|error| panic!("{error}"))
}

#[test]
fn a_bare_street_gets_houses_and_lamps_and_a_furnished_one_keeps_what_it_has() {
    let bare = parse(&street(""));
    let count = |map: &Map, kind| map.scenery().iter().filter(|one| one.kind == kind).count();
    assert!(count(&bare, SceneryKind::Building) > 10, "{}", bare.scenery().len());
    assert!(count(&bare, SceneryKind::Pole) > 5);
    let tree = "<object id=\"1\" type=\"tree\" name=\"Oak\" s=\"50\" t=\"12\" zOffset=\"0\" \
                length=\"3\" width=\"3\" height=\"8\"/>";
    assert_eq!(parse(&street(tree)).scenery().len(), 1);
}

#[test]
fn surroundings_are_the_same_in_every_run() {
    let text = street("");
    assert_eq!(parse(&text).scenery(), parse(&text).scenery());
}

/// Distance of the nearest lane's border from a box, seen from above; less than 0 on the lane.
fn gap_m(map: &Map, thing: &roads::SceneryBox) -> f64 {
    let half = thing.half_extent_m;
    let mut gap_m = f64::INFINITY;
    for k in 0..16_u32 {
        let (sin, cos) = (f64::from(k) * std::f64::consts::TAU / 16.0).sin_cos();
        // Onto the box's outline, from its middle outward.
        let reach = (half.x / cos.abs().max(1e-9)).min(half.y / sin.abs().max(1e-9));
        let foot = thing.pose * nalgebra::Point3::new(reach * cos, reach * sin, -half.z);
        let Some(place) = map.nearest(foot, LaneTypes::ANY) else { continue };
        let lane = map.lane_pose(&place).expect("of this map").point;
        gap_m = gap_m.min((lane.xy() - foot.xy()).norm() - map.lane(&place).width_m / 2.0);
    }
    gap_m
}

#[test]
fn real_maps_get_surroundings_that_keep_off_the_lanes() {
    let maps = maps::all();
    let mut count = 0;
    for map in maps.iter().map(|judged| &judged.map) {
        println!("{}: {} things", map.name(), map.scenery().len());
        // Posts and rails may be the map's own, and stand where it says.
        let generated =
            |kind: SceneryKind| matches!(kind, SceneryKind::Building | SceneryKind::Tree);
        for thing in map.scenery().iter().filter(|one| generated(one.kind)) {
            let gap_m = gap_m(map, thing);
            assert!(gap_m > 0.0, "{}: {gap_m} m from a lane: {thing:?}", map.name());
            count += 1;
        }
    }
    assert!(maps.is_empty() || count > 100, "{count}");
}

#[test]
fn a_large_map_gets_a_bounded_number_of_things() {
    let map = parse(&grid::grid(10_000));
    assert!(map.scenery().len() <= roads::limits::SURROUNDINGS_MAX + 10, "{}", map.scenery().len());
}

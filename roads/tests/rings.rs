//! Lanes that lead into each other: listed in the topology, and not moved along, as in CARLA's
//! client.

use roads::{LaneTypes, Map, Waypoint};

const HALF_ROUND_M: f64 = 157.0796;

/// Half a circle of 50 m around the origin, cut into sections; road 1 east, road 2 west.
fn half(id: u32, sections: u32) -> String {
    let side = if id == 1 { 1.0 } else { -1.0 };
    let (x, heading_rad) = (50.0 * side, std::f64::consts::FRAC_PI_2 * side);
    let other = 3 - id;
    let lane = |id: i32| {
        format!(
            "<lane id=\"{id}\" type=\"driving\"><link><predecessor id=\"{id}\"/>\
             <successor id=\"{id}\"/></link><width sOffset=\"0\" a=\"3.5\" b=\"0\" c=\"0\" d=\"0\"/>\
             </lane>"
        )
    };
    let section = |index: u32| {
        let s = HALF_ROUND_M * f64::from(index) / f64::from(sections);
        format!(
            "<laneSection s=\"{s}\"><left>{}</left><center><lane id=\"0\"/></center>\
             <right>{}</right></laneSection>",
            lane(1),
            lane(-1)
        )
    };
    let sign = "<signal id=\"7\" name=\"limit\" s=\"5\" t=\"-6\" orientation=\"-\" type=\"274\" \
                subtype=\"30\"><validity fromLane=\"-1\" toLane=\"-1\"/></signal>";
    format!(
        "<road id=\"{id}\" length=\"{HALF_ROUND_M}\" junction=\"-1\"><link>\
         <predecessor elementType=\"road\" elementId=\"{other}\" contactPoint=\"end\"/>\
         <successor elementType=\"road\" elementId=\"{other}\" contactPoint=\"start\"/></link>\
         <planView><geometry s=\"0\" x=\"{x}\" y=\"0\" hdg=\"{heading_rad}\" \
         length=\"{HALF_ROUND_M}\"><arc curvature=\"0.02\"/></geometry></planView>\
         <lanes>{}</lanes><signals>{}</signals></road>",
        (0..sections).map(section).collect::<String>(),
        if id == 2 { sign } else { "" }
    )
}

/// A ring of two roads, of so many sections each.
fn ring(sections: [u32; 2]) -> Map {
    let [first, second] = sections;
    let text = format!("<OpenDRIVE><header/>{}{}</OpenDRIVE>", half(1, first), half(2, second));
    Map::parse("ring", &text).expect("a clean map")
}

fn pairs(map: &Map) -> Vec<[(u32, u32, i32); 2]> {
    let key = |place: &Waypoint| (place.road, place.section, place.lane);
    let mut pairs: Vec<_> = map.topology().iter().map(|(from, to)| [key(from), key(to)]).collect();
    pairs.sort_unstable();
    pairs
}

#[test]
fn a_ring_of_two_roads_of_one_section_is_listed_and_not_moved_around() {
    let map = ring([1, 1]);
    let wanted = [
        [(1, 0, -1), (2, 0, -1)],
        [(1, 0, 1), (2, 0, 1)],
        [(2, 0, -1), (1, 0, -1)],
        [(2, 0, 1), (1, 0, 1)],
    ];
    assert_eq!(pairs(&map), wanted);
    for lane in [-1, 1] {
        let place = map.waypoint(1, lane, 78.0).unwrap();
        assert_eq!(map.next(&place, 2.0).len(), 1);
        assert_eq!((map.next(&place, 100.0), map.previous(&place, 100.0)), (vec![], vec![]));
    }
    let place = map.waypoint(1, -1, 90.0).unwrap();
    let ahead = map.landmarks_ahead(&place, 100.0, false);
    assert_eq!(ahead.len(), 1, "{ahead:?}");
    assert!((ahead[0].distance_m - (HALF_ROUND_M - 90.0 + 5.0)).abs() < 1e-6, "{ahead:?}");
    let said = map.check().diagnostics.iter().map(ToString::to_string).collect::<Vec<_>>();
    assert!(said.iter().any(|text| text.contains("leads back into it")), "{said:?}");
}

#[test]
fn a_ring_with_one_section_more_keeps_every_joint() {
    for sections in [[2, 1], [1, 2], [2, 2], [3, 1]] {
        let map = ring(sections);
        assert_eq!(pairs(&map).len(), 2 * (sections[0] + sections[1]) as usize, "{sections:?}");
        for (road, lane) in [(1, -1), (1, 1), (2, -1), (2, 1)] {
            let place = map.waypoint(road, lane, 78.0).unwrap();
            let round = map.next(&place, 2.0 * HALF_ROUND_M);
            assert!(
                matches!(round.as_slice(), [back] if back.road == road && (back.s - 78.0).abs() < 1e-6),
                "{sections:?}: {place:?} to {round:?}"
            );
        }
        assert!(map.nearest(nalgebra::Point3::origin(), LaneTypes::DRIVING).is_some());
    }
}

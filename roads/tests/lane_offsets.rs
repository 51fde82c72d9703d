//! Lane offsets that jump where a lane section ends.
#![allow(clippy::unwrap_used, reason = "a test fails loudly")]

use roads::{Map, Waypoint};

const SECTION_M: f64 = 10.0;

/// A road whose driving lane is the second one in its first section and the first one in the next,
/// and lies where it was: the lane offset makes up for the other lane.
fn renumbered() -> Map {
    let width = "<width sOffset=\"0\" a=\"3.5\" b=\"0\" c=\"0\" d=\"0\"/>";
    let driving = |id: i32, link: &str| {
        format!("<lane id=\"{id}\" type=\"driving\"><link>{link}</link>{width}</lane>")
    };
    let section = |s: f64, lanes: &str| {
        format!(
            "<laneSection s=\"{s}\"><center><lane id=\"0\"/></center><right>{lanes}</right></laneSection>"
        )
    };
    let inner = format!("<lane id=\"-1\" type=\"none\">{width}</lane>");
    let first = section(0.0, &(inner + &driving(-2, "<successor id=\"-1\"/>")));
    let second = section(SECTION_M, &driving(-1, "<predecessor id=\"-2\"/>"));
    let text = format!(
        "<OpenDRIVE><header/><road id=\"1\" length=\"20\" junction=\"-1\"><planView>\
         <geometry s=\"0\" x=\"0\" y=\"0\" hdg=\"0\" length=\"20\"><line/></geometry></planView>\
         <lanes><laneOffset s=\"0\" a=\"3.5\" b=\"0\" c=\"0\" d=\"0\"/>\
         <laneOffset s=\"{SECTION_M}\" a=\"0\" b=\"0\" c=\"0\" d=\"0\"/>\
         {first}{second}</lanes></road></OpenDRIVE>"
    );
    Map::parse("renumbered", &text).unwrap()
}

#[test]
fn a_lane_ends_where_the_next_one_begins() {
    let map = renumbered();
    let places = [(0, -2, 5.0), (0, -2, SECTION_M), (1, -1, SECTION_M), (1, -1, 15.0)];
    for (section, lane, s) in places {
        let at_m = map.pose(&Waypoint { road: 1, section, lane, s }).translation.vector;
        let away_m = (at_m.x - s).hypot(at_m.y + 1.75);
        assert!(away_m < 1.0e-9, "section {section}, s {s}: {at_m:?}");
    }
}

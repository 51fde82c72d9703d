//! Broken and hostile texts: each is refused with words that name the place, quickly, and none of
//! them ends the process.

use std::time::{Duration, Instant};

use proptest::prelude::*;
use roads::{Map, MapError};

/// A map of one straight road, with parts that can be swapped for broken ones.
fn map_with(geometry: &str, width: &str, extra: &str) -> String {
    format!(
        "<OpenDRIVE><header/><road id=\"7\" length=\"100\" junction=\"-1\"><link/>\
         <planView>{geometry}</planView><lanes><laneSection s=\"0\">\
         <center><lane id=\"0\" type=\"none\"/></center>\
         <right><lane id=\"-1\" type=\"driving\">{width}</lane></right>\
         </laneSection></lanes>{extra}</road></OpenDRIVE>"
    )
}

const LINE: &str = "<geometry s=\"0\" x=\"0\" y=\"0\" hdg=\"0\" length=\"100\"><line/></geometry>";
const WIDTH: &str = "<width sOffset=\"0\" a=\"3.5\" b=\"0\" c=\"0\" d=\"0\"/>";

fn refusal(text: &str) -> MapError {
    let started = Instant::now();
    let refused = Map::parse("test", text).expect_err("the text is broken");
    assert!(started.elapsed() < Duration::from_secs(30), "{:?}", started.elapsed());
    refused
}

#[test]
fn the_unbroken_map_is_accepted() {
    assert!(Map::parse("test", &map_with(LINE, WIDTH, "")).is_ok());
}

#[test]
fn numbers_that_are_none_are_named_with_road_and_attribute() {
    for number in ["nan", "inf", "-inf", "1e308", "1e999", "2e6", "", "0x10", "one"] {
        let text = map_with(&LINE.replace("hdg=\"0\"", &format!("hdg=\"{number}\"")), WIDTH, "");
        let refused = refusal(&text).to_string();
        assert!(refused.contains("road 7") && refused.contains("hdg"), "{refused}");
    }
}

#[test]
fn lengths_of_zero_and_less_are_refused() {
    for length in ["0", "-1", "-0"] {
        let geometry = LINE.replace("length=\"100\"", &format!("length=\"{length}\""));
        assert!(refusal(&map_with(&geometry, WIDTH, "")).to_string().contains("road 7"));
        let road = map_with(LINE, WIDTH, "").replacen(
            "length=\"100\"",
            &format!("length=\"{length}\""),
            1,
        );
        assert!(refusal(&road).to_string().contains("length"));
    }
}

#[test]
fn records_that_end_the_client_are_refused_with_what_was_wanted() {
    let late_width = WIDTH.replace("sOffset=\"0\"", "sOffset=\"1\"");
    let cases = [
        (map_with("", WIDTH, ""), "geometry"),
        (map_with(LINE, &late_width, ""), "width"),
        (
            map_with(LINE, WIDTH, "<signals><signalReference id=\"9\" s=\"1\" t=\"0\"/></signals>"),
            "signal",
        ),
        (
            map_with(LINE, WIDTH, "<signals><signal id=\"9\" s=\"-1\" t=\"0\"/></signals>"),
            "s of 0 or more",
        ),
        (
            map_with(
                LINE,
                WIDTH,
                "<objects><object id=\"1\" name=\"Speed_\" s=\"1\" t=\"0\"/></objects>",
            ),
            "Speed_",
        ),
        (
            map_with(
                LINE,
                WIDTH,
                "<elevationProfile><elevation s=\"5\" a=\"0\" b=\"0\" c=\"0\" d=\"0\"/></elevationProfile>",
            ),
            "elevation",
        ),
    ];
    for (text, wanted) in cases {
        let refused = refusal(&text).to_string();
        assert!(refused.contains(wanted), "{refused} should name {wanted}");
    }
}

/// The rest of what ends the client at load: faults of lanes, junctions and controllers.
#[test]
fn faults_of_lanes_junctions_and_controllers_that_end_the_client_are_refused() {
    let whole = map_with(LINE, WIDTH, "");
    let after_road = |more: &str| whole.replace("</OpenDRIVE>", &format!("{more}</OpenDRIVE>"));
    let controller = |junction: &str| {
        after_road(&format!(
            "<controller id=\"4\"><control signalId=\"77\"/></controller>{junction}"
        ))
    };
    let late_offset = "<lanes><laneOffset s=\"3\" a=\"1\" b=\"0\" c=\"0\" d=\"0\"/>";
    let cases = [
        (whole.replace("<lanes>", late_offset), "laneOffset"),
        (whole.replace("<center><lane id=\"0\" type=\"none\"/></center>", ""), "centre lane"),
        (
            after_road("<junction id=\"9\"><connection id=\"1\" connectingRoad=\"5\"/></junction>"),
            "junction 9",
        ),
        (controller("<junction id=\"9\"><controller id=\"4\"/></junction>"), "controller \"4\""),
    ];
    for (text, wanted) in cases {
        assert_ne!(text, whole, "{wanted}");
        let refused = refusal(&text).to_string();
        assert!(refused.contains(wanted), "{refused} should name {wanted}");
    }
    assert!(Map::parse("test", &controller("")).is_ok(), "no junction lists that controller");
}

#[test]
fn entities_depth_and_size_do_not_blow_up() {
    let laughs =
        "<!DOCTYPE l [<!ENTITY a \"ha\"><!ENTITY b \"&a;&a;\">]><OpenDRIVE>&b;</OpenDRIVE>";
    refusal(laughs);
    let deep =
        format!("<OpenDRIVE>{}{}</OpenDRIVE>", "<a>".repeat(100_000), "</a>".repeat(100_000));
    assert!(refusal(&deep).to_string().contains("nested"));
    refusal(&format!("<OpenDRIVE a=\"{}\"/>", "x".repeat(16 << 20)));
    refusal(&format!("<OpenDRIVE>{}</OpenDRIVE>", "<a/>".repeat(2_000_001)));
    refusal(&"<road/>".repeat(1000));
    refusal("");
}

#[test]
fn text_in_another_encoding_is_told_from_broken_xml() {
    let text = map_with(LINE, WIDTH, "");
    assert!(Map::parse("test", &format!("\u{feff}{text}")).is_ok(), "a mark of UTF-8");
    let utf16: String = text.chars().flat_map(|character| [character, '\0']).collect();
    for zeros in [utf16.as_str(), &text.replace("link", "li\0nk"), "\0\0\0"] {
        let refused = refusal(zeros).to_string();
        assert!(refused.contains("UTF-8") && refused.contains("line 1"), "{refused}");
    }
}

#[test]
fn an_origin_that_is_no_number_is_refused() {
    let text = |words: &str| {
        let header = format!("<header><geoReference>{words}</geoReference></header>");
        map_with(LINE, WIDTH, "").replace("<header/>", &header)
    };
    for words in ["+lat_0=north", "+lon_0=", "+lat_0=1e400", "+lon_0=1e-400 +lat_0=4"] {
        let refused = refusal(&text(words)).to_string();
        assert!(refused.contains("geoReference"), "{refused}");
    }
    for words in ["+lat_0=49 +lon_0=-8.5", "+lat_0=0 +lon_0=0e5", "+lat_0=nan", "+k=x", ""] {
        assert!(Map::parse("test", &text(words)).is_ok(), "{words}");
    }
}

#[test]
fn roads_of_absurd_total_length_are_refused_before_they_are_tabulated() {
    let road = |id: u32| {
        let geometry = LINE.replace("length=\"100\"", "length=\"1e6\"").replace(
            "<line/>",
            "<paramPoly3 pRange=\"arcLength\" aU=\"0\" bU=\"1\" cU=\"0\" dU=\"0\" aV=\"0\" bV=\"0\" cV=\"0\" dV=\"0\"/>",
        );
        map_with(&geometry, WIDTH, "")
            .replace("length=\"100\"", "length=\"1e6\"")
            .replace("id=\"7\"", &format!("id=\"{id}\""))
            .replace("<OpenDRIVE><header/>", "")
            .replace("</OpenDRIVE>", "")
    };
    let roads: String = (1..200).map(road).collect();
    refusal(&format!("<OpenDRIVE>{roads}</OpenDRIVE>"));
}

/// A few digits of each of these ask for millions of triangles, or for minutes.
#[test]
fn numbers_that_ask_for_more_than_a_machine_has_are_refused_with_the_limit() {
    let whole = map_with(LINE, WIDTH, "");
    let bend = |shape: &str| map_with(&LINE.replace("<line/>", shape), WIDTH, "");
    let object = |more: &str| {
        map_with(LINE, WIDTH, &format!("<objects><object s=\"1\" t=\"9\" {more}</objects>"))
    };
    let crosswalk = "type=\"crosswalk\"><outline><cornerLocal u=\"0\" v=\"-9e5\"/>\
                     <cornerLocal u=\"0\" v=\"9e5\"/></outline></object>";
    let long = whole.replace("length=\"100\"", "length=\"9e5\"");
    let wide = |text: &str, count: usize| {
        let lanes: String =
            (2..count).map(|id| format!("<lane id=\"-{id}\">{WIDTH}</lane>")).collect();
        text.replace("</lane></right>", &format!("</lane>{lanes}</right>"))
    };
    let cases = [
        (bend("<arc curvature=\"1e6\"/>"), "at most 200 rad"),
        (bend("<spiral curvStart=\"0\" curvEnd=\"-1e5\"/>"), "at most 200 rad"),
        (whole.replace("laneSection s=\"0\"", "laneSection s=\"-9e5\""), "s of 0 or more"),
        (wide(&whole, 300), "200 lanes"),
        (wide(&long, 40), "steps of a metre"),
        (wide(&long.replace("c=\"0\"", "c=\"1e-9\""), 10), "flat pieces"),
        (object(&format!("id=\"1\" {crosswalk}")), "stripes of crosswalks"),
        (
            object("id=\"1\" type=\"building\" length=\"1e4\" width=\"1e4\" height=\"1e4\"/>"),
            "windows of houses",
        ),
    ];
    for (text, wanted) in cases {
        assert_ne!(text, whole, "{wanted}");
        let refused = refusal(&text).to_string();
        assert!(refused.contains(wanted) && refused.contains("road 7"), "{refused}: {wanted}");
    }
}

#[test]
fn a_walk_around_lanes_that_lead_in_a_circle_ends() {
    // Three roads of a centimetre in a ring: a long walk passes them very often.
    let road = |id: u32, next: u32, previous: u32| {
        format!(
            "<road id=\"{id}\" length=\"0.01\" junction=\"-1\"><link>\
             <predecessor elementType=\"road\" elementId=\"{previous}\"/>\
             <successor elementType=\"road\" elementId=\"{next}\"/></link><planView>\
             <geometry s=\"0\" x=\"0\" y=\"0\" hdg=\"0\" length=\"0.01\"><line/></geometry></planView>\
             <lanes><laneSection s=\"0\"><center><lane id=\"0\"/></center><right>\
             <lane id=\"-1\" type=\"driving\"><link><predecessor id=\"-1\"/><successor id=\"-1\"/>\
             </link>{WIDTH}</lane></right></laneSection></lanes></road>"
        )
    };
    let text =
        format!("<OpenDRIVE>{}{}{}</OpenDRIVE>", road(1, 2, 3), road(2, 3, 1), road(3, 1, 2));
    let map = Map::parse("ring", &text).expect("a ring is legal");
    let start = map.waypoint(1, -1, 0.0).expect("it has lane -1");
    assert_eq!(map.next(&start, 0.1).len(), 1);
    let started = Instant::now();
    let far = map.next(&start, 1e9);
    assert!(far.len() <= 1 && started.elapsed() < Duration::from_secs(10));
    assert!(map.next(&start, f64::NAN).is_empty());
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 64, ..ProptestConfig::default() })]

    /// Any single changed byte of a real map gives a map or a refusal, and what is accepted can
    /// be asked everything.
    #[test]
    fn damaged_towns_are_read_or_refused_and_never_panic(
        place in 0.0..1.0_f64,
        byte in 0x20_u8..0x7f,
        count in 1_usize..40,
    ) {
        let mut text = roads::town::build("Town10HD_Opt").expect("ours").into_bytes();
        #[allow(clippy::cast_sign_loss, clippy::cast_possible_truncation, reason = "0 to 1")]
        let at = (place * (text.len() - count) as f64) as usize;
        text[at..at + count].fill(byte);
        let text = String::from_utf8(text).expect("the town is written in ASCII");
        if let Ok(map) = Map::parse("damaged", &text) {
            let mesh = roads::mesh::ground(&map);
            prop_assert_eq!(mesh.indices.len(), mesh.materials.len());
            for spawn in map.spawn_points() {
                prop_assert!(spawn.translation.vector.iter().all(|v| v.is_finite()));
            }
        }
    }
}

#[test]
fn a_tiny_step_between_waypoints_is_refused_with_the_limit() {
    let map = Map::parse("town", &roads::town::build("Town02").unwrap()).unwrap();
    for step_m in [0.0, -1.0, f64::NAN, 1e-4, 1e-9, f64::MIN_POSITIVE] {
        let refusal = map.generate_waypoints(step_m).unwrap_err();
        assert!(refusal.to_string().contains("at most 10000000"), "{refusal}");
    }
    let places = map.generate_waypoints(0.01).unwrap();
    assert!(places.len() > 100_000, "{}", places.len());
}

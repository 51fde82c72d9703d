//! Pictures of maps: well-formed, the same every time, and with everything in them.

#[path = "common/towns.rs"]
mod generated;

use generated::town;
use roads::{Map, picture};
use roxmltree::Document;

fn fills(svg: &str) -> Vec<String> {
    let document = Document::parse(svg).unwrap_or_else(|error| panic!("{error}"));
    let paths = document.descendants().filter(|node| node.has_tag_name("path"));
    paths.filter_map(|path| path.attribute("fill")).map(str::to_owned).collect()
}

#[test]
fn a_picture_is_svg_of_the_asked_width_and_the_same_every_time() {
    let map = town("Town02");
    let svg = picture::draw(&map, 800);
    assert_eq!(svg, picture::draw(&map, 800));
    let document = Document::parse(&svg).unwrap();
    assert_eq!(document.root_element().attribute("width"), Some("800"));
    assert!(!svg.contains("NaN") && !svg.contains("inf"));
}

#[test]
fn every_town_shows_lanes_houses_or_trees_crosswalks_and_spawn_points() {
    for name in generated::names() {
        let fills = fills(&picture::draw(&town(name), 1200));
        for (what, colour) in [
            ("driving lanes", "#8d8f94"),
            ("junctions", "#a3a09a"),
            ("trees", "#5f9150"),
            ("spawn points", "#1b4fd6"),
            ("speed limits", "#fdfdfd"),
        ] {
            // One of them is the key below the picture.
            let count = fills.iter().filter(|fill| *fill == colour).count();
            assert!(count >= 2, "{name} lacks {what}");
        }
    }
}

#[test]
fn a_map_without_any_length_to_speak_of_is_drawn_too() {
    let text = "<OpenDRIVE><road id=\"1\" length=\"0.01\" junction=\"-1\"><planView><geometry \
                s=\"0\" x=\"0\" y=\"0\" hdg=\"0\" length=\"0.01\"><line/></geometry></planView>\
                <lanes><laneSection s=\"0\"><center><lane id=\"0\"/></center></laneSection></lanes>\
                </road></OpenDRIVE>";
    let map = Map::parse("dot", text).unwrap_or_else(|error| panic!("{error}"));
    assert!(Document::parse(&picture::draw(&map, 300)).is_ok());
}

//! The rules for maps that the client library must read without trouble, checked on the text of
//! every generated town: ids, geometry, links, lanes, marks, signals, crosswalks.

#[path = "common/town_texts.rs"]
mod texts;

use std::collections::{BTreeMap, BTreeSet};

use roxmltree::Node;
use texts::*;

const LANE_TYPES: [&str; 7] =
    ["none", "driving", "parking", "biking", "median", "shoulder", "sidewalk"];

#[test]
fn ids_are_whole_numbers_from_1_and_not_shared() {
    for_each_town(|town, document| {
        let of = |tags: &[&'static str]| -> Vec<i64> {
            tags.iter().flat_map(|tag| all(document, tag)).map(|node| id(node, "id")).collect()
        };
        let tops = |tag: &'static str| {
            document.root_element().children().filter(move |node| node.has_tag_name(tag))
        };
        let controllers: Vec<i64> = tops("controller").map(|node| id(node, "id")).collect();
        for ids in [of(&["road", "junction"]), of(&["signal"]), controllers, of(&["object"])] {
            let distinct: BTreeSet<i64> = ids.iter().copied().collect();
            assert_eq!(distinct.len(), ids.len(), "{town}: ids occur twice");
            assert!(ids.iter().all(|id| *id > 0), "{town}");
        }
        for junction in all(document, "junction") {
            let ids: Vec<i64> = inside(junction, "connection").map(|c| id(c, "id")).collect();
            let distinct: BTreeSet<i64> = ids.iter().copied().collect();
            assert_eq!(distinct.len(), ids.len(), "{town}: connection ids occur twice");
        }
        let junctions: BTreeSet<i64> = tops("junction").map(|node| id(node, "id")).collect();
        for road in all(document, "road") {
            let junction = id(road, "junction");
            assert!(junction == -1 || junctions.contains(&junction), "{town}: {junction}");
        }
    });
}

#[test]
fn reference_lines_are_lines_and_arcs_that_fill_their_road() {
    for_each_town(|town, document| {
        for road in all(document, "road") {
            let name = road.attribute("name").unwrap_or_default();
            let mut end_s = 0.0;
            for geometry in inside(road, "geometry") {
                assert!((number(geometry, "s") - end_s).abs() < 1e-6, "{town}: {name}");
                assert!(number(geometry, "length") > 0.01, "{town}: {name}");
                end_s += number(geometry, "length");
                let shape = geometry.children().find(Node::is_element).expect("it has a shape");
                assert!(matches!(shape.tag_name().name(), "line" | "arc"), "{town}: {name}");
            }
            assert!((number(road, "length") - end_s).abs() < 1e-6, "{town}: {name}");
            assert!(end_s >= 2.0, "{town}: {name} is {end_s} m long");
            for tag in ["elevation", "laneSection"] {
                let first = inside(road, tag).next().expect("every road has it");
                assert!(number(first, "s").abs() < 1e-12, "{town}: {name}");
            }
            for section in inside(road, "laneSection") {
                assert!(inside(section, "lane").any(|lane| id(lane, "id") == 0));
            }
            // The schema of version 1.4 has none.
            assert_eq!(road.attribute("rule"), None, "{town}: {name}");
        }
    });
}

#[test]
fn connecting_roads_say_the_same_in_all_three_ways_of_linking() {
    for_each_town(|town, document| {
        let roads = roads(document);
        let connections: BTreeMap<i64, Node<'_, '_>> =
            all(document, "connection").map(|c| (id(c, "connectingRoad"), c)).collect();
        for (road_id, road) in roads.iter().filter(|(_, road)| is_connecting(**road)) {
            for (side, lane_side) in [("predecessor", "predecessor"), ("successor", "successor")] {
                let to = linked(*road, side);
                let other = roads[&id(to, "elementId")];
                let toward = if to.attribute("contactPoint") == Some("end") { -1 } else { 1 };
                let sign = if side == "predecessor" { toward } else { -toward };
                let lanes: BTreeSet<i64> = inside(other, "lane").map(|l| id(l, "id")).collect();
                for lane in inside(*road, lane_side).filter(|l| l.has_attribute("id")) {
                    let lane = id(lane, "id");
                    assert!(lanes.contains(&lane), "{town}: {road_id} names lane {lane}");
                    assert_eq!(lane.signum(), sign, "{town}: {road_id}, {side}");
                }
                let back = ["predecessor", "successor"].map(|side| linked(other, side));
                let junction = road.attribute("junction");
                // Ways for nobody may lie beside a junction of the roads that they name.
                let leads = inside(*road, lane_side).any(|lane| lane.has_attribute("id"));
                let is_led_to = back.iter().any(|link| link.attribute("elementId") == junction);
                assert!(is_led_to || !leads, "{town}: {road_id}");
            }
            let connection = connections[road_id];
            let incoming = id(linked(*road, "predecessor"), "elementId");
            assert_eq!(id(connection, "incomingRoad"), incoming, "{town}: {road_id}");
            let pairs = |node: Node<'_, '_>| (id(node, "from"), id(node, "to"));
            let written: BTreeSet<_> = inside(connection, "laneLink").map(pairs).collect();
            let meant: BTreeSet<_> = inside(*road, "lane")
                .filter(|lane| id(*lane, "id") != 0)
                .flat_map(|lane| {
                    inside(lane, "predecessor").map(move |to| (id(to, "id"), id(lane, "id")))
                })
                .collect();
            assert_eq!(written, meant, "{town}: {road_id}");
        }
    });
}

#[test]
fn no_lane_forks_within_one_connecting_road_and_no_two_lead_to_the_same_lane() {
    for_each_town(|town, document| {
        let mut ways = BTreeSet::new();
        for road in all(document, "road").filter(|road| is_connecting(*road)) {
            let ends = ["predecessor", "successor"].map(|side| id(linked(road, side), "elementId"));
            assert_ne!(ends[0], ends[1], "{town}: a way turns back into its own road");
            let junction = id(road, "junction");
            let lanes = |side| {
                let linked = inside(road, "lane").flat_map(move |lane| inside(lane, side));
                linked.map(|to| id(to, "id")).collect::<Vec<_>>()
            };
            for lane in lanes("successor") {
                let is_new = ways.insert((junction, ends, lane));
                assert!(is_new, "{town}: two connecting roads for {ends:?}, {lane}");
            }
            let from = lanes("predecessor");
            let distinct: BTreeSet<i64> = from.iter().copied().collect();
            assert_eq!(distinct.len(), from.len(), "{town}: a lane forks within {ends:?}");
        }
    });
}

/// CARLA's client ends where it looks for the way that leads to a lane and there is none.
#[test]
fn every_lane_that_leads_away_from_a_junction_can_be_reached() {
    for_each_town(|town, document| {
        let mut reached = BTreeSet::new();
        for road in all(document, "road").filter(|road| is_connecting(*road)) {
            let to = id(linked(road, "successor"), "elementId");
            let lanes = inside(road, "lane").flat_map(|lane| inside(lane, "successor"));
            reached.extend(lanes.map(|lane| (to, id(lane, "id"))));
        }
        for (road_id, road) in roads(document) {
            // Lanes on the right leave the junction at the road's start, those on the left the one
            // at its end.
            for (side, sign) in [("predecessor", -1), ("successor", 1)] {
                let from = !is_connecting(road)
                    && linked(road, side).attribute("elementType") == Some("junction");
                for lane in driving(road, sign).into_iter().filter(|_| from) {
                    let is_reached = reached.contains(&(road_id, lane));
                    assert!(is_reached, "{town}: no way leads to lane {lane} of road {road_id}");
                }
            }
        }
    });
}

/// No more than this is a way to the left of what goes on straight, in radians.
const STRAIGHT_RAD: f64 = 0.88;

#[test]
fn without_lights_no_way_leads_over_the_strip_between_the_directions_of_a_road() {
    for_each_town(|town, document| {
        let roads = roads(document);
        let is_divided = |road: Node<'_, '_>| {
            inside(road, "lane").any(|lane| lane.attribute("type") == Some("median"))
        };
        let lit: BTreeSet<i64> = all(document, "junction")
            .filter(|junction| inside(*junction, "controller").next().is_some())
            .map(|junction| id(junction, "id"))
            .collect();
        for (road_id, road) in roads.iter().filter(|(_, road)| is_connecting(**road)) {
            let ends =
                ["predecessor", "successor"].map(|side| id(linked(*road, side), "elementId"));
            let beside = ends.iter().any(|end| is_divided(roads[end]));
            if !beside || lit.contains(&id(*road, "junction")) {
                continue;
            }
            let turn_rad = turn_rad(*road);
            assert!(turn_rad < STRAIGHT_RAD, "{town}: {road_id} turns left by {turn_rad}");
        }
    });
}

#[test]
fn lanes_change_width_only_in_short_sections_and_marks_say_both_or_none() {
    for_each_town(|town, document| {
        for road in all(document, "road") {
            let starts: Vec<f64> =
                inside(road, "laneSection").map(|section| number(section, "s")).collect();
            for (index, section) in inside(road, "laneSection").enumerate() {
                let end_s = starts.get(index + 1).copied();
                let length_m = end_s.unwrap_or(number(road, "length")) - starts[index];
                let varies = inside(section, "width")
                    .any(|width| ["b", "c", "d"].iter().any(|k| number(width, k) != 0.0));
                assert!(!varies || length_m < 65.0, "{town}: widths vary over {length_m} m");
                for lane in inside(section, "lane") {
                    let lane_type = lane.attribute("type").unwrap_or_default();
                    assert!(LANE_TYPES.contains(&lane_type), "{town}: {lane_type}");
                    let mark = inside(lane, "roadMark").next().expect("every lane has a mark");
                    let between = mark.attribute("type") == Some("broken");
                    let expected = if between { "both" } else { "none" };
                    assert_eq!(mark.attribute("laneChange"), Some(expected), "{town}");
                    assert!(!(between && id(lane, "id") == 0), "{town}: a broken centre line");
                }
            }
        }
    });
}

/// Scenic reads no road on which a lane begins or ends, and none with a section in which a lane has
/// no area, but for lanes of no type.
#[test]
fn no_lane_begins_or_ends_within_a_road_and_all_have_some_width_in_every_section() {
    for_each_town(|town, document| {
        for (road_id, road) in roads(document) {
            let mut before: Option<BTreeMap<i64, (&str, f64)>> = None;
            let sections = sections(road);
            for (index, (section, end_s)) in sections.iter().enumerate() {
                let length_m = end_s - number(*section, "s");
                let mut now = BTreeMap::new();
                for lane in inside(*section, "lane").filter(|lane| id(*lane, "id") != 0) {
                    let lane_id = id(lane, "id");
                    let what = format!("{town}: road {road_id} section {index} lane {lane_id}");
                    let link = |side| inside(lane, side).next().map(|link| id(link, "id"));
                    let goes_on = |is_there: bool| is_there.then_some(lane_id);
                    if !is_connecting(road) {
                        assert_eq!(link("predecessor"), goes_on(index > 0), "{what}");
                        assert_eq!(
                            link("successor"),
                            goes_on(index + 1 < sections.len()),
                            "{what}"
                        );
                    }
                    let widest_m = (0..=20).map(|k| width_m(lane, length_m * f64::from(k) / 20.0));
                    let widest_m = widest_m.fold(0.0, f64::max);
                    let lane_type = lane.attribute("type").unwrap_or_default();
                    let only_counts = is_connecting(road) && lane_type == "none";
                    let is_empty = only_counts && widest_m == 0.0;
                    assert!(widest_m > 0.2 || is_empty, "{what} has no area");
                    if let Some(before) = &before {
                        let (kind, end_m) = before.get(&lane_id).expect(&what);
                        assert_eq!(*kind, lane_type, "{what}");
                        assert!((end_m - width_m(lane, 0.0)).abs() < 1e-8, "{what} jumps");
                        assert!(*end_m > 0.1, "{what} goes on from a lane without width");
                    }
                    now.insert(lane_id, (lane_type, width_m(lane, length_m)));
                }
                assert!(before.is_none_or(|before| before.len() == now.len()), "{town}: {road_id}");
                before = Some(now);
            }
        }
    });
}

/// CARLA's client raises in `next_until_lane_end` where steps end exactly at a road's end.
#[test]
fn no_number_of_half_metres_leads_from_a_lane_sections_start_to_the_end_of_its_road() {
    for_each_town(|town, document| {
        for (road_id, road) in roads(document) {
            for (section, _) in sections(road) {
                let steps = (number(road, "length") - number(section, "s")) / 0.5;
                let off_m = (steps - steps.round()).abs() * 0.5;
                assert!(off_m > 1e-4, "{town}: road {road_id} from {section:?}: {off_m}");
            }
        }
    });
}

#[test]
fn lights_hold_all_ways_from_their_approach_and_belong_to_one_phase() {
    for_each_town(|town, document| {
        let is_light = |node: &Node<'_, '_>| node.attribute("type") == Some("1000001");
        let lights: BTreeMap<i64, Node<'_, '_>> = all(document, "signal")
            .filter(is_light)
            .map(|light| (id(light, "id"), light))
            .collect();
        let controlled: Vec<i64> = all(document, "control").map(|c| id(c, "signalId")).collect();
        assert_eq!(controlled.iter().copied().collect::<BTreeSet<_>>().len(), controlled.len());
        assert!(controlled.iter().all(|light| lights.contains_key(light)), "{town}");
        assert_eq!(controlled.len(), lights.len(), "{town}");
        let mut holds: BTreeMap<i64, i64> = BTreeMap::new();
        for road in all(document, "road").filter(|road| is_connecting(*road)) {
            for reference in inside(road, "signalReference") {
                let validity = inside(reference, "validity").next().expect("it is written");
                let lanes = driving(road, -1);
                let valid = [id(validity, "fromLane"), id(validity, "toLane")];
                assert_eq!(valid, [lanes[0], lanes[lanes.len() - 1]], "{town}");
                assert!(number(reference, "s").abs() < 1e-12, "{town}");
                let light = id(reference, "id");
                let approach = id(linked(road, "predecessor"), "elementId");
                assert_eq!(*holds.entry(light).or_insert(approach), approach, "{town}: {light}");
            }
        }
        assert_eq!(holds.len(), lights.len(), "{town}: a light holds nobody");
        for junction in all(document, "junction") {
            let phases = inside(junction, "controller").count();
            let roads = roads(document);
            let ways = inside(junction, "connection").map(|way| roads[&id(way, "connectingRoad")]);
            let held = |way: &Node<'_, '_>| inside(*way, "signalReference").count() == 1;
            // Corners that nobody drives around are for people on foot alone.
            let (driven, walked): (Vec<_>, Vec<_>) =
                ways.partition(|way| !driving(*way, -1).is_empty());
            assert_eq!(walked.iter().filter(|way| held(way)).count(), 0, "{town}");
            let (ways, held) = (driven.len(), driven.iter().filter(|way| held(way)).count());
            assert_eq!(held, if phases > 0 { ways } else { 0 }, "{town}: {junction:?}");
            assert_ne!(phases, 1, "{town}: a junction that is always green");
        }
    });
}

#[test]
fn every_street_says_its_limit_after_every_junction_and_posts_stand_off_the_lanes() {
    for_each_town(|town, document| {
        for road in all(document, "road").filter(|road| !is_connecting(*road)) {
            let length_m = number(road, "length");
            for sign in [-1, 1] {
                let lanes = driving(road, sign);
                let (Some(first), Some(last)) = (lanes.first(), lanes.last()) else { continue };
                let limit = inside(road, "signal").find(|signal| {
                    let validity = inside(*signal, "validity").next().expect("it is written");
                    let valid = [id(validity, "fromLane"), id(validity, "toLane")];
                    signal.attribute("type") == Some("274") && valid == [*first, *last]
                });
                let limit = limit.unwrap_or_else(|| panic!("{town}: {road:?} lacks a limit"));
                assert_eq!(limit.attribute("value"), limit.attribute("subtype"), "{town}");
                let s = number(limit, "s");
                let from_start_m = if sign < 0 { s } else { length_m - s };
                assert!(from_start_m <= 12.001, "{town}: {from_start_m} m after the junction");
            }
            for signal in inside(road, "signal") {
                assert_ne!(signal.attribute("unit"), Some(""), "{town}: {signal:?}");
                let t = number(signal, "t");
                let sign = if t < 0.0 { -1 } else { 1 };
                #[allow(clippy::cast_precision_loss, reason = "roads have few lanes")]
                let outermost_m = (driving(road, sign).len() as f64 - 0.5) * 3.5;
                assert!(t.abs() - outermost_m > 0.7 * 3.5, "{town}: {signal:?}");
                let turned = number(signal, "hOffset").abs() > 1.0;
                assert_eq!(turned, t > 0.0, "{town}: {signal:?}");
                assert_eq!(signal.attribute("orientation"), Some(if turned { "+" } else { "-" }));
            }
        }
    });
}

#[test]
fn crosswalks_are_closed_outlines_within_junctions_or_in_the_middle_of_long_streets() {
    for_each_town(|town, document| {
        for road in all(document, "road") {
            let length_m = number(road, "length");
            for object in inside(road, "object") {
                if object.attribute("type") != Some("crosswalk") {
                    continue;
                }
                let corners: Vec<[f64; 2]> = inside(object, "cornerLocal")
                    .map(|corner| [number(corner, "u"), number(corner, "v")])
                    .collect();
                assert_eq!(corners.len(), 5, "{town}");
                assert_eq!(corners.first(), corners.last(), "{town}");
                let s = number(object, "s");
                if (s - length_m / 2.0).abs() < 1e-6 {
                    assert!(length_m >= 100.0 && driving(road, -1).len() == 1, "{town}");
                    continue;
                }
                let beyond = |u: f64| if s > length_m / 2.0 { s + u - length_m } else { -s - u };
                assert!(corners.iter().all(|[u, _]| beyond(*u) > 0.5), "{town}: {object:?}");
            }
        }
    });
}

#[test]
fn the_header_says_where_on_earth_the_town_lies() {
    for_each_town(|town, document| {
        let text = all(document, "geoReference").next().and_then(|node| node.text());
        let text = text.unwrap_or_default();
        assert!(text.contains("+lat_0=") && text.contains("+lon_0="), "{town}: {text}");
    });
}

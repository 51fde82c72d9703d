//! The texts of all generated towns, and what is read from them.

use std::collections::BTreeMap;

use roads::town::Style;
use roxmltree::{Document, Node};

/// Calls a check with the name and the document of every town.
pub(crate) fn for_each_town(check: impl Fn(&str, &Document<'_>)) {
    let named = roads::town::names()
        .map(|name| (name.to_owned(), roads::town::build(name).expect("the name is listed")));
    let styles = [Style::City, Style::Village, Style::Country];
    let new = styles.into_iter().flat_map(|style| {
        [(0, 2), (1, 3), (2, 4), (3, 5)].map(|(seed, blocks)| {
            (format!("{style:?} {seed}"), roads::town::build_styled(style, seed, blocks))
        })
    });
    for (name, text) in named.chain(new) {
        let document = Document::parse(&text).unwrap_or_else(|error| panic!("{name}: {error}"));
        check(&name, &document);
    }
}

pub(crate) fn all<'a>(
    document: &'a Document<'a>,
    tag: &'static str,
) -> impl Iterator<Item = Node<'a, 'a>> {
    document.descendants().filter(move |node| node.has_tag_name(tag))
}

pub(crate) fn inside<'a>(
    node: Node<'a, 'a>,
    tag: &'static str,
) -> impl Iterator<Item = Node<'a, 'a>> {
    node.descendants().filter(move |node| node.has_tag_name(tag))
}

pub(crate) fn number(node: Node<'_, '_>, attribute: &str) -> f64 {
    let text = node.attribute(attribute).unwrap_or_else(|| panic!("{node:?} lacks {attribute}"));
    text.parse().unwrap_or_else(|_| panic!("{attribute}={text:?} is no number"))
}

pub(crate) fn id(node: Node<'_, '_>, attribute: &str) -> i64 {
    let text = node.attribute(attribute).unwrap_or_else(|| panic!("{node:?} lacks {attribute}"));
    text.parse().unwrap_or_else(|_| panic!("{attribute}={text:?} is no whole number"))
}

pub(crate) fn roads<'a>(document: &'a Document<'a>) -> BTreeMap<i64, Node<'a, 'a>> {
    all(document, "road").map(|road| (id(road, "id"), road)).collect()
}

pub(crate) fn is_connecting(road: Node<'_, '_>) -> bool {
    id(road, "junction") != -1
}

/// The `predecessor` or `successor` of a road.
pub(crate) fn linked<'a>(road: Node<'a, 'a>, side: &str) -> Node<'a, 'a> {
    let link = road.children().find(|node| node.has_tag_name("link")).expect("roads have links");
    link.children().find(|node| node.has_tag_name(side)).expect("roads lead on at both ends")
}

/// The lane sections of a road, each with the place where it ends.
pub(crate) fn sections<'a>(road: Node<'a, 'a>) -> Vec<(Node<'a, 'a>, f64)> {
    let starts = inside(road, "laneSection").map(|section| number(section, "s"));
    let ends = starts.skip(1).chain([number(road, "length")]);
    inside(road, "laneSection").zip(ends).collect()
}

/// The width of a lane, `s` metres behind the start of its section.
pub(crate) fn width_m(lane: Node<'_, '_>, s: f64) -> f64 {
    let widths = inside(lane, "width").filter(|width| number(*width, "sOffset") <= s);
    let width = widths.last().expect("every lane has a width from its start on");
    let t = s - number(width, "sOffset");
    let [a, b, c, d] = ["a", "b", "c", "d"].map(|k| number(width, k));
    a + t * (b + t * (c + t * d))
}

/// Ids of the driving lanes with this sign in the first section.
pub(crate) fn driving(road: Node<'_, '_>, sign: i64) -> Vec<i64> {
    let section = inside(road, "laneSection").next().expect("roads have sections");
    let mut lanes: Vec<i64> = inside(section, "lane")
        .filter(|lane| lane.attribute("type") == Some("driving"))
        .map(|lane| id(lane, "id"))
        .filter(|lane| lane.signum() == sign)
        .collect();
    lanes.sort_unstable();
    lanes
}

/// By how much a road turns to the left.
pub(crate) fn turn_rad(road: Node<'_, '_>) -> f64 {
    inside(road, "geometry")
        .filter_map(|piece| {
            let arc = inside(piece, "arc").next()?;
            Some(number(piece, "length") * number(arc, "curvature"))
        })
        .sum()
}

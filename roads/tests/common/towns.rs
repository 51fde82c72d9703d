//! The generated towns.
#![allow(dead_code, reason = "not every test asks for all")]

use roads::Map;

/// One of each pair of names.
pub(crate) fn names() -> impl Iterator<Item = &'static str> {
    roads::town::names().filter(|name| !name.ends_with("_Opt"))
}

/// The town of a name.
pub(crate) fn town(name: &str) -> Map {
    let text = roads::town::build(name).expect("the name is listed");
    Map::parse(name, &text).unwrap_or_else(|error| panic!("{error}"))
}

/// Every town.
pub(crate) fn towns() -> impl Iterator<Item = Map> {
    names().map(town)
}

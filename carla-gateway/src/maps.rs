//! Maps by CARLA's names, parsed once per content.

use std::num::NonZeroUsize;
use std::sync::Arc;

use schemas::{Error, ErrorCode, MapRef, Reply, Request};
use worlds::ParsedMaps;

use crate::site::Site;

/// Parsed maps that are kept.
const MAPS_MAX: NonZeroUsize = NonZeroUsize::new(4).unwrap();
/// Where CARLA keeps its maps.
const FOLDER: &str = "Carla/Maps/";

/// Maps of a site, shared by all endpoints of a process.
pub(crate) struct Maps {
    site: Arc<dyn Site>,
    parsed: ParsedMaps,
}

impl Maps {
    /// No maps yet.
    pub(crate) fn new(site: Arc<dyn Site>) -> Self {
        Self { site, parsed: ParsedMaps::new(MAPS_MAX) }
    }

    /// All maps, ordered by name.
    ///
    /// # Errors
    /// Those of the site.
    pub(crate) async fn list(&self) -> Result<Vec<MapRef>, Error> {
        match self.site.ask(Request::ListMaps).await? {
            Reply::Maps(maps) => Ok(maps),
            _ => Err(Error::new(ErrorCode::InvalidMessage, "the world service answered no maps")),
        }
    }

    /// The map that a client means: with or without a path, with or without `_Opt`, in any case.
    ///
    /// # Errors
    /// `Map 'X' not found`, those of the site, or what is wrong with the map.
    pub(crate) async fn find(&self, name: &str) -> Result<Arc<roads::Map>, Error> {
        let list = self.list().await?;
        let wanted = resolve(name, &list, |map| &map.name).ok_or_else(|| {
            let name: String = name.chars().take(128).collect();
            Error::new(ErrorCode::UnknownMap, format!("Map '{name}' not found"))
        })?;
        let text = async { self.site.map_text(wanted.digest.clone()).await };
        self.parsed.get(wanted, text).await
    }
}

/// Whether a client that asks for `name` finds one of these maps: with or without a path, with or
/// without `_Opt`, in any case.
pub fn is_among<'a>(name: &str, maps: impl IntoIterator<Item = &'a str>) -> bool {
    let maps: Vec<&str> = maps.into_iter().collect();
    resolve(name, &maps, |map| map).is_some()
}

/// The map with this name, else the one that differs by case alone, else by `_Opt` and case.
fn resolve<'a, T>(name: &str, list: &'a [T], name_of: impl Fn(&T) -> &str) -> Option<&'a T> {
    let stem = name.rsplit('/').next()?;
    let stem = stem.strip_suffix(".umap").unwrap_or(stem);
    let twin = match without_suffix(stem) {
        Some(plain) => plain.to_owned(),
        None => format!("{stem}_Opt"),
    };
    let alike = |wanted: &str| list.iter().find(|map| name_of(map).eq_ignore_ascii_case(wanted));
    let named =
        |wanted: &str| list.iter().find(|map| name_of(map) == wanted).or_else(|| alike(wanted));
    named(stem).or_else(|| named(&twin))
}

/// The name before `_Opt`, in any case.
fn without_suffix(name: &str) -> Option<&str> {
    let (plain, suffix) = name.split_at_checked(name.len().checked_sub(4)?)?;
    suffix.eq_ignore_ascii_case("_Opt").then_some(plain)
}

/// Whether a map has layers that clients may load and unload: as in CARLA, those named `_Opt`.
pub(crate) fn is_layered(name: &str) -> bool {
    name.ends_with("_Opt")
}

/// As `get_available_maps` lists it.
pub(crate) fn listed_name(name: &str) -> String {
    format!("/Game/{FOLDER}{name}")
}

/// As `get_map_info` tells it.
pub(crate) fn told_name(name: &str) -> String {
    format!("{FOLDER}{name}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_found_with_and_without_path_and_suffix() {
        let list: Vec<MapRef> = ["Town03", "Town10HD_Opt"]
            .map(|name| MapRef { name: name.to_owned(), digest: String::new() })
            .into();
        for (asked, found) in [
            ("Town03", "Town03"),
            ("/Game/Carla/Maps/Town03", "Town03"),
            ("Town03_Opt", "Town03"),
            ("Carla/Maps/Town10HD", "Town10HD_Opt"),
        ] {
            assert_eq!(resolve(asked, &list, |map| &map.name).unwrap().name, found);
        }
        for name in ["Town99", "\u{e9}", "Opt", "_Opt"] {
            assert!(resolve(name, &list, |map| &map.name).is_none());
        }
        assert!(resolve("", &list, |map| &map.name).is_none());
    }

    #[test]
    fn names_are_found_in_any_case_and_the_exact_one_first() {
        let list: Vec<MapRef> = ["Town03", "town03", "Town10HD_Opt"]
            .map(|name| MapRef { name: name.to_owned(), digest: String::new() })
            .into();
        for (asked, found) in [
            ("town03", "town03"),
            ("Town03", "Town03"),
            ("TOWN03", "Town03"),
            ("/Game/Carla/Maps/town10hd_opt", "Town10HD_Opt"),
            ("town10hd", "Town10HD_Opt"),
            ("town03_opt", "town03"),
        ] {
            assert_eq!(resolve(asked, &list, |map| &map.name).unwrap().name, found, "{asked}");
        }
    }
}

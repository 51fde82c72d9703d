//! The maps a service knows: our own towns, a folder of OpenDRIVE files that win over them, and what
//! clients brought along, which wins for their tenant.

mod uploads;

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::{Arc, OnceLock};

use schemas::limits::MAP_BYTES_MAX;
use schemas::{Error, ErrorCode, MapRef, Tenant};

use uploads::Uploads;

/// Files of one maps folder that are looked at.
const MAPS_MAX: usize = 1_024;

/// All maps by name. Texts are read and towns built on first use, and kept.
pub(crate) struct Maps<T> {
    entries: BTreeMap<String, Entry<T>>,
    uploads: Uploads<T>,
    build_town: fn(Arc<roads::Map>) -> T,
}

struct Entry<T> {
    source: Source,
    text: OnceLock<Result<Arc<Text>, Error>>,
    town: OnceLock<Result<Arc<T>, Error>>,
}

enum Source {
    BuiltIn,
    File(PathBuf),
    Given(Arc<Text>),
}

/// OpenDRIVE text and the BLAKE3 digest of its bytes.
struct Text {
    digest: String,
    xodr: String,
}

impl<T> Maps<T> {
    /// Our own towns and the `.xodr` files of a folder, by file stem.
    ///
    /// # Errors
    /// A folder that cannot be listed, or holds more than [`MAPS_MAX`] maps.
    pub(crate) fn new(
        folder: Option<&Path>,
        build_town: fn(Arc<roads::Map>) -> T,
    ) -> Result<Self, Error> {
        let mut entries: BTreeMap<String, Entry<T>> = roads::town::names()
            .map(|name| (name.to_owned(), Entry::new(Source::BuiltIn)))
            .collect();
        if let Some(folder) = folder {
            for (name, path) in xodr_files(folder)? {
                entries.insert(name, Entry::new(Source::File(path)));
            }
        }
        Ok(Self { entries, uploads: Uploads::new(), build_town })
    }

    /// Makes a map known to a tenant.
    ///
    /// # Errors
    /// `InvalidArgument` for a name or text that cannot be used; `Capacity`.
    pub(crate) fn put(&self, tenant: &Tenant, name: &str, xodr: String) -> Result<(), Error> {
        self.uploads.put(tenant, name, xodr)
    }

    /// All maps of a tenant whose text can be read, ordered by name.
    pub(crate) fn list(&self, tenant: &Tenant) -> Vec<MapRef> {
        let uploads = self.uploads.list(tenant);
        let replaced = |name: &str| uploads.iter().any(|map| map.name == name);
        let entries = self.entries.iter().filter(|(name, _)| !replaced(name));
        let readable = entries.filter_map(|(name, entry)| match entry.text(name) {
            Ok(text) => Some(MapRef { name: name.clone(), digest: text.digest.clone() }),
            Err(error) => {
                tracing::warn!(map = name, %error, "a map is left out of the list");
                None
            }
        });
        let mut list: Vec<MapRef> = readable.collect();
        list.extend(uploads);
        list.sort_by(|a, b| a.name.cmp(&b.name));
        list
    }

    /// The town of a map, built on first use.
    ///
    /// # Errors
    /// [`ErrorCode::UnknownMap`] with the known names, or what is wrong with the file.
    pub(crate) fn town(&self, tenant: &Tenant, name: &str) -> Result<Arc<T>, Error> {
        match self.uploads.get(tenant, name) {
            Some(entry) => self.build(name, &entry),
            None => self.common_town(name),
        }
    }

    /// The town of a map that every tenant knows, built on first use.
    ///
    /// # Errors
    /// As for [`town`](Self::town).
    pub(crate) fn common_town(&self, name: &str) -> Result<Arc<T>, Error> {
        self.build(name, self.entries.get(name).ok_or_else(|| self.unknown(name))?)
    }

    fn build(&self, name: &str, entry: &Entry<T>) -> Result<Arc<T>, Error> {
        let build = || {
            let text = entry.text(name)?;
            let map = roads::Map::parse(name, &text.xodr).map_err(|cause| {
                Error::new(ErrorCode::UnknownMap, format!("the map {name:?} cannot be used"))
                    .found(cause)
            })?;
            Ok(Arc::new((self.build_town)(Arc::new(map))))
        };
        entry.town.get_or_init(build).clone()
    }

    /// The town that a snapshot or frame means: same name, same text.
    pub(crate) fn town_of(&self, map: &MapRef) -> Option<Arc<T>> {
        let known = self.entries.get(&map.name).and_then(|entry| entry.text(&map.name).ok());
        if known.is_some_and(|text| text.digest == map.digest) {
            return self.common_town(&map.name).ok();
        }
        let entry = self.uploads.with_digest(&map.digest)?;
        self.build(&map.name, &entry).ok()
    }

    /// The OpenDRIVE text with this digest.
    ///
    /// # Errors
    /// [`ErrorCode::UnknownAsset`].
    pub(crate) fn asset(&self, digest: &str) -> Result<Vec<u8>, Error> {
        let mut texts = self.entries.iter().filter_map(|(name, entry)| entry.text(name).ok());
        let uploaded = || self.uploads.with_digest(digest)?.text(digest).ok();
        texts
            .find(|text| text.digest == digest)
            .or_else(uploaded)
            .map(|text| text.xodr.clone().into_bytes())
            .ok_or_else(|| {
                Error::new(ErrorCode::UnknownAsset, "no asset with this digest").found(digest)
            })
    }

    fn unknown(&self, name: &str) -> Error {
        let known: Vec<&str> = self.entries.keys().map(String::as_str).collect();
        Error::new(ErrorCode::UnknownMap, "no such map")
            .wanted(format_args!("one of {}", known.join(", ")))
            .found(format_args!("{name:?}"))
    }
}

impl Text {
    fn new(xodr: String) -> Self {
        Self { digest: blake3::hash(xodr.as_bytes()).to_hex().to_string(), xodr }
    }
}

impl<T> Entry<T> {
    fn new(source: Source) -> Self {
        Self { source, text: OnceLock::new(), town: OnceLock::new() }
    }

    fn given(text: Text) -> Self {
        Self::new(Source::Given(Arc::new(text)))
    }

    fn text(&self, name: &str) -> Result<Arc<Text>, Error> {
        let read = || {
            let xodr = match &self.source {
                Source::Given(text) => return Ok(Arc::clone(text)),
                Source::BuiltIn => roads::town::build(name).ok_or_else(|| {
                    Error::new(ErrorCode::Internal, format!("the town {name:?} cannot be built"))
                })?,
                Source::File(path) => read_file(path)?,
            };
            Ok(Arc::new(Text::new(xodr)))
        };
        self.text.get_or_init(read).clone()
    }
}

fn read_file(path: &Path) -> Result<String, Error> {
    let unusable = |cause: &dyn std::fmt::Display| {
        Error::new(ErrorCode::UnknownMap, format!("cannot read the map file {path:?}")).found(cause)
    };
    let bytes = fs::metadata(path).map_err(|cause| unusable(&cause))?.len();
    if bytes > MAP_BYTES_MAX as u64 {
        return Err(Error::new(ErrorCode::TooLarge, format!("the map file {path:?} is too large"))
            .wanted(format_args!("at most {MAP_BYTES_MAX} bytes"))
            .found(format_args!("{bytes} bytes")));
    }
    fs::read_to_string(path).map_err(|cause| unusable(&cause))
}

/// Names and paths of the `.xodr` files of a folder.
fn xodr_files(folder: &Path) -> Result<Vec<(String, PathBuf)>, Error> {
    let unusable = |cause: std::io::Error| {
        Error::new(ErrorCode::InvalidArgument, format!("cannot list the maps folder {folder:?}"))
            .found(cause)
    };
    let mut found = Vec::new();
    for file in fs::read_dir(folder).map_err(unusable)? {
        let path = file.map_err(unusable)?.path();
        let is_map =
            path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("xodr"));
        let name = path.file_stem().and_then(|stem| stem.to_str()).map(str::to_owned);
        if let (true, Some(name)) = (is_map, name) {
            found.push((name, path));
        }
        if found.len() > MAPS_MAX {
            return Err(Error::new(ErrorCode::Capacity, format!("too many maps in {folder:?}"))
                .wanted(format_args!("at most {MAPS_MAX}")));
        }
    }
    Ok(found)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A folder that goes away with the test.
    struct Folder(PathBuf);

    impl Folder {
        fn new(name: &str) -> Self {
            let path =
                std::env::temp_dir().join(format!("causeway-maps-{name}-{}", std::process::id()));
            fs::create_dir_all(&path).unwrap();
            Self(path)
        }

        fn file(&self, name: &str, text: &str) {
            fs::write(self.0.join(name), text).unwrap();
        }

        fn maps(&self) -> Maps<usize> {
            Maps::new(Some(&self.0), |map| map.spawn_points().len()).unwrap()
        }
    }

    impl Drop for Folder {
        fn drop(&mut self) {
            let _ = fs::remove_dir_all(&self.0);
        }
    }

    fn tenant() -> Tenant {
        "ours".parse().unwrap()
    }

    #[test]
    fn a_file_wins_over_the_built_in_map_of_its_name() {
        let folder = Folder::new("wins");
        let ours: Maps<usize> = Maps::new(None, |map| map.spawn_points().len()).unwrap();
        let other =
            roads::town::build("Town10HD").unwrap().replacen("<OpenDRIVE>", "<OpenDRIVE> ", 1);
        folder.file("Town10HD_Opt.xodr", &other);
        folder.file("notes.txt", "no map");
        let maps = folder.maps();
        assert_eq!(maps.list(&tenant()).len(), ours.list(&tenant()).len());
        let digest = blake3::hash(other.as_bytes()).to_hex().to_string();
        let listed =
            maps.list(&tenant()).into_iter().find(|map| map.name == "Town10HD_Opt").unwrap();
        assert_eq!(listed.digest, digest);
        assert_eq!(maps.asset(&digest), Ok(other.into_bytes()));
        assert!(*maps.common_town("Town10HD_Opt").unwrap() > 0);
    }

    #[test]
    fn a_broken_file_says_what_is_wrong_and_harms_no_other_map() {
        let folder = Folder::new("broken");
        folder.file("Broken.xodr", "<OpenDRIVE><road");
        let maps = folder.maps();
        let error = maps.common_town("Broken").unwrap_err();
        assert!(error.to_string().contains("Broken"), "{error}");
        assert!(maps.common_town("Town10HD_Opt").is_ok());
    }

    #[test]
    fn an_unknown_name_is_answered_with_the_known_ones() {
        let maps = Folder::new("unknown").maps();
        let error = maps.common_town("Town99").unwrap_err();
        assert_eq!(error.code, ErrorCode::UnknownMap);
        assert!(error.wanted.contains("Town10HD_Opt"), "{error}");
        assert!(
            maps.town_of(&MapRef { name: "Town10HD".into(), digest: "0".repeat(64) }).is_none()
        );
    }
}

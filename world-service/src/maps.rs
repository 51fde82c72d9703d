//! The maps a service knows: our own towns, a folder of OpenDRIVE files that win over them, and
//! what clients brought along, which wins for their tenant.

mod uploads;

use std::collections::{BTreeMap, VecDeque};
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError};
use std::time::SystemTime;

use schemas::{Error, ErrorCode, MapRef, Tenant};

use crate::map_files::{map_files, read_map_file};
use uploads::Uploads;

/// Texts of changed or removed files that are kept for the worlds that still use them.
const FORMER_TEXTS_MAX: usize = 64;

/// All maps by name. Texts are read and towns built on first use, and kept. The folder is looked at
/// again for every list and every new world, so that files may come, change and go meanwhile.
pub(crate) struct Maps<T> {
    folder: Option<PathBuf>,
    build_town: fn(Arc<roads::Map>) -> T,
    known: Mutex<KnownMaps<T>>,
    uploads: Uploads<T>,
}

/// What is known now, and what was.
struct KnownMaps<T> {
    entries: BTreeMap<String, Arc<Entry<T>>>,
    /// Oldest first.
    former: VecDeque<Arc<Text>>,
}

struct Entry<T> {
    source: Source,
    text: OnceLock<Result<Arc<Text>, Error>>,
    town: OnceLock<Result<Arc<T>, Error>>,
}

#[derive(Clone, Debug, PartialEq, Eq)]
enum Source {
    BuiltIn,
    File {
        path: PathBuf,
        /// Size in bytes and time of the last change; a file is read again when either differs.
        stamp: (u64, Option<SystemTime>),
    },
    Given(Arc<Text>),
}

/// OpenDRIVE text and the BLAKE3 digest of its bytes.
#[derive(Debug, PartialEq, Eq)]
struct Text {
    digest: String,
    xodr: Arc<str>,
}

impl<T> Maps<T> {
    /// Our own towns and the `.xodr` files of a folder, by file stem.
    ///
    /// # Errors
    /// A folder that cannot be listed, or holds too many maps.
    pub(crate) fn new(
        folder: Option<&Path>,
        build_town: fn(Arc<roads::Map>) -> T,
    ) -> Result<Self, Error> {
        let known = Mutex::new(KnownMaps { entries: BTreeMap::new(), former: VecDeque::new() });
        let folder_path = folder.map(Path::to_owned);
        let maps = Self { folder: folder_path, build_town, known, uploads: Uploads::new() };
        maps.known().arrange(sources(folder)?);
        Ok(maps)
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
        self.look_again();
        let uploads = self.uploads.list(tenant);
        let replaced = |name: &str| uploads.iter().any(|map| map.name == name);
        let entries = self.entries().into_iter().filter(|(name, _)| !replaced(name));
        let readable = entries.filter_map(|(name, entry)| match entry.text(&name) {
            Ok(text) => Some(MapRef { name, digest: text.digest.clone() }),
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
            Some(entry) => entry.town(name, self.build_town),
            None => self.common_town(name),
        }
    }

    /// The town of a map that every tenant knows, built on first use.
    ///
    /// # Errors
    /// As for [`town`](Self::town).
    pub(crate) fn common_town(&self, name: &str) -> Result<Arc<T>, Error> {
        self.look_again();
        let entry = self.entry(name).ok_or_else(|| self.unknown(name))?;
        entry.town(name, self.build_town)
    }

    /// The town that a snapshot or frame means: same name, same text.
    pub(crate) fn town_of(&self, map: &MapRef) -> Option<Arc<T>> {
        self.look_again();
        let is_same = |entry: &Arc<Entry<T>>| {
            entry.text(&map.name).is_ok_and(|text| text.digest == map.digest)
        };
        let entry = self.entry(&map.name).filter(is_same);
        let entry = entry.or_else(|| self.uploads.with_digest(&map.digest))?;
        entry.town(&map.name, self.build_town).ok()
    }

    /// The OpenDRIVE text with this digest, also when its file has changed since a world began.
    ///
    /// # Errors
    /// [`ErrorCode::UnknownAsset`].
    pub(crate) fn asset(&self, digest: &str) -> Result<Vec<u8>, Error> {
        let former = self.known().former.clone();
        let entries = self.entries();
        let texts = entries.iter().filter_map(|(name, entry)| entry.text(name).ok());
        let uploaded = || self.uploads.with_digest(digest)?.text(digest).ok();
        former
            .into_iter()
            .chain(texts)
            .find(|text| text.digest == digest)
            .or_else(uploaded)
            .map(|text| text.xodr.as_bytes().to_vec())
            .ok_or_else(|| {
                Error::new(ErrorCode::UnknownAsset, "no asset with this digest").found(digest)
            })
    }

    /// Looks into the folder. One that cannot be listed now changes nothing.
    fn look_again(&self) {
        match sources(self.folder.as_deref()) {
            Ok(sources) => self.known().arrange(sources),
            Err(error) => tracing::warn!(%error, "the maps stay as they were"),
        }
    }

    fn known(&self) -> MutexGuard<'_, KnownMaps<T>> {
        // A panic while it was held left every entry whole.
        self.known.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn entry(&self, name: &str) -> Option<Arc<Entry<T>>> {
        self.known().entries.get(name).map(Arc::clone)
    }

    fn entries(&self) -> Vec<(String, Arc<Entry<T>>)> {
        let known = self.known();
        known.entries.iter().map(|(name, entry)| (name.clone(), Arc::clone(entry))).collect()
    }

    fn unknown(&self, name: &str) -> Error {
        let known: Vec<String> = self.known().entries.keys().cloned().collect();
        Error::new(ErrorCode::UnknownMap, "no such map")
            .wanted(format_args!("one of {}", known.join(", ")))
            .found(format_args!("{name:?}"))
    }
}

impl Text {
    fn new(xodr: String) -> Self {
        Self { digest: blake3::hash(xodr.as_bytes()).to_hex().to_string(), xodr: xodr.into() }
    }
}

/// Where every map comes from.
///
/// # Errors
/// A folder that cannot be listed, or holds too many maps.
fn sources(folder: Option<&Path>) -> Result<BTreeMap<String, Source>, Error> {
    let mut sources: BTreeMap<String, Source> =
        roads::town::names().map(|name| (name.to_owned(), Source::BuiltIn)).collect();
    for (name, path) in folder.map_or_else(|| Ok(Vec::new()), map_files)? {
        let stamp =
            fs::metadata(&path).map_or((0, None), |data| (data.len(), data.modified().ok()));
        let source = Source::File { path, stamp };
        if let Some(twin @ Source::BuiltIn) = sources.get_mut(&twin_of(&name)) {
            *twin = source.clone();
        }
        sources.insert(name, source);
    }
    Ok(sources)
}

/// CARLA's maps with and without `_Opt` have the same roads, so one file stands for both.
fn twin_of(name: &str) -> String {
    name.strip_suffix("_Opt").map_or_else(|| format!("{name}_Opt"), str::to_owned)
}

impl<T> KnownMaps<T> {
    /// Keeps the entries whose source is as before, and puts new ones where it is not.
    fn arrange(&mut self, sources: BTreeMap<String, Source>) {
        let mut before = std::mem::take(&mut self.entries);
        for (name, source) in sources {
            let same = before.remove(&name).filter(|entry| {
                let is_same = entry.source == source;
                if !is_same {
                    self.former.extend(entry.text.get().and_then(|text| text.clone().ok()));
                }
                is_same
            });
            let entry = same.unwrap_or_else(|| Arc::new(Entry::new(source)));
            self.entries.insert(name, entry);
        }
        let gone = before.into_values();
        self.former.extend(gone.filter_map(|entry| entry.text.get()?.clone().ok()));
        while self.former.len() > FORMER_TEXTS_MAX {
            self.former.pop_front();
        }
    }
}

impl<T> Entry<T> {
    fn new(source: Source) -> Self {
        Self { source, text: OnceLock::new(), town: OnceLock::new() }
    }

    fn given(text: Text) -> Self {
        Self::new(Source::Given(Arc::new(text)))
    }

    fn town(&self, name: &str, build: fn(Arc<roads::Map>) -> T) -> Result<Arc<T>, Error> {
        let load = || {
            let text = self.text(name)?;
            let map = roads::Map::parse_shared(name, Arc::clone(&text.xodr)).map_err(|cause| {
                Error::new(ErrorCode::UnknownMap, format!("the map {name:?} cannot be used"))
                    .found(cause)
            })?;
            warn_of_faults(&map);
            Ok(Arc::new(build(Arc::new(map))))
        };
        self.town.get_or_init(load).clone()
    }

    fn text(&self, name: &str) -> Result<Arc<Text>, Error> {
        let read = || {
            let xodr = match &self.source {
                Source::Given(text) => return Ok(Arc::clone(text)),
                Source::BuiltIn => roads::town::build(name).ok_or_else(|| {
                    Error::new(ErrorCode::Internal, format!("the town {name:?} cannot be built"))
                })?,
                Source::File { path, .. } => read_map_file(path)?,
            };
            Ok(Arc::new(Text::new(xodr)))
        };
        self.text.get_or_init(read).clone()
    }
}

/// Says so when CARLA's client would not survive a map.
fn warn_of_faults(map: &roads::Map) {
    let report = map.check();
    if let Some(fault) = report.worst().filter(|fault| fault.severity.breaks_client()) {
        tracing::warn!(map = map.name(), %fault, "CARLA's client would not survive this map");
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tenant() -> Tenant {
        "ours".parse().unwrap()
    }

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
    fn a_file_stands_for_its_town_with_and_without_opt_unless_both_are_there() {
        let folder = Folder::new("twins");
        let first = roads::town::build("Town02").unwrap();
        let second = format!("{first}<!-- longer -->");
        folder.file("Town03.xodr", &first);
        let maps = folder.maps();
        let digest = |name: &str| {
            maps.list(&tenant()).into_iter().find(|map| map.name == name).map(|map| map.digest)
        };
        assert_eq!(digest("Town03"), digest("Town03_Opt"));
        folder.file("Town03_Opt.xodr", &second);
        assert_ne!(digest("Town03"), digest("Town03_Opt"));
        folder.file("Mine.xodr", &first);
        assert_eq!(digest("Mine_Opt"), None);
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
    fn files_may_come_change_and_go_while_the_service_runs() {
        let folder = Folder::new("changes");
        let maps = folder.maps();
        let digest = |name: &str| {
            maps.list(&tenant()).into_iter().find(|map| map.name == name).map(|map| map.digest)
        };
        assert_eq!(digest("Mine"), None);
        let ours = digest("Town02").unwrap();
        let first = roads::town::build("Town02").unwrap();
        folder.file("Mine.xodr", &first);
        let first_digest = digest("Mine").unwrap();
        assert!(maps.common_town("Mine").is_ok());
        // Another length tells the change also where times are coarse.
        let second = format!("{first}<!-- longer -->");
        folder.file("Mine.xodr", &second);
        assert_ne!(digest("Mine").unwrap(), first_digest);
        assert_eq!(maps.asset(&first_digest), Ok(first.clone().into_bytes()));
        folder.file("Town02.xodr", &second);
        assert_ne!(digest("Town02").unwrap(), ours);
        for name in ["Mine.xodr", "Town02.xodr"] {
            fs::remove_file(folder.0.join(name)).unwrap();
        }
        assert_eq!(digest("Mine"), None);
        assert_eq!(digest("Town02").unwrap(), ours);
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

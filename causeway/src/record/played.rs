//! What is read of recordings to show them: their maps, and who is in them.

use std::collections::{BTreeMap, BTreeSet};
use std::fs::File;
use std::io::BufReader;
use std::path::Path;
use std::sync::Arc;

use schemas::{ActorDescription, ActorId, Tick};
use world_service::journal::{Reader as JournalReader, Replay};

use super::RecordError;
use super::source::of;

/// An ego that no frame knows.
pub(super) fn no_ego(path: &Path, ego: u32) -> RecordError {
    let why = format!("wanted an actor of these frames as --ego, found {ego}, who is in none");
    RecordError::Unfit { path: path.to_owned(), why }
}

/// Roles by which clients name the vehicle that an episode is about.
pub(super) const EGO_ROLES: [&str; 3] = ["hero", "ego", "ego_vehicle"];

/// The world of a journal after a tick.
///
/// # Errors
/// A journal that cannot be replayed.
pub(super) fn replay_at(
    path: &Path,
    reader: &mut JournalReader<BufReader<File>>,
    tick: Tick,
) -> Result<Replay, RecordError> {
    let way = reader.way_to(tick).map_err(of(path))?;
    let mut replay = Replay::begin(reader.head()).map_err(of(path))?;
    replay.go(&way).map_err(of(path))?;
    Ok(replay)
}

/// Who is in the world of a journal after a tick.
///
/// # Errors
/// A journal that cannot be replayed.
pub(super) fn described_at(
    path: &Path,
    reader: &mut JournalReader<BufReader<File>>,
    tick: Tick,
) -> Result<Vec<ActorDescription>, RecordError> {
    Ok(replay_at(path, reader, tick)?.world().describe(&[]))
}

/// Who has one of the roles of the ego at the end of a journal.
///
/// # Errors
/// A journal that cannot be replayed.
pub(super) fn heroes_of(
    path: &Path,
    reader: &mut JournalReader<BufReader<File>>,
) -> Result<BTreeSet<ActorId>, RecordError> {
    let last = reader.index().last();
    let described = described_at(path, reader, last)?;
    Ok(described.iter().filter(|actor| is_ego(actor)).map(|actor| actor.id).collect())
}

/// What clients call actors.
pub(super) fn roles(described: &[ActorDescription]) -> BTreeMap<ActorId, String> {
    let role = |actor: &ActorDescription| {
        let told = actor.attributes.iter().find(|attribute| attribute.id == "role_name")?;
        Some((actor.id, told.value.clone()))
    };
    described.iter().filter_map(role).collect()
}

/// Whether an actor has one of the roles of the ego.
pub(super) fn is_ego(actor: &ActorDescription) -> bool {
    actor.attributes.iter().any(|attribute| {
        attribute.id == "role_name" && EGO_ROLES.contains(&attribute.value.as_str())
    })
}

/// The map that a log names, from its OpenDRIVE file or one of ours.
///
/// # Errors
/// Neither.
pub(super) fn map_of_log(
    log: &Path,
    name: &str,
    file: Option<&Path>,
) -> Result<Arc<roads::Map>, RecordError> {
    let text = match file {
        Some(file) => world_service::read_map_file(file).map_err(RecordError::Refused)?,
        None => roads::town::build(name).ok_or_else(|| RecordError::Unfit {
            path: log.to_owned(),
            why: format!("it is of the map {name}, which is none of ours; name it with --map"),
        })?,
    };
    parsed(log, name, &text)
}

/// The map of a recording.
///
/// # Errors
/// One that cannot be used.
pub(super) fn parsed(path: &Path, name: &str, text: &str) -> Result<Arc<roads::Map>, RecordError> {
    let map = roads::Map::parse(name, text);
    map.map(Arc::new).map_err(|error| RecordError::Unfit {
        path: path.to_owned(),
        why: format!("its map cannot be used: {error}"),
    })
}

//! Logs and journals as MCAP files, which Foxglove and its libraries open.

mod rebuilt;

use std::fs::File;
use std::io::BufReader;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use mcap_export::{About, Exporter};
use schemas::{ActorId, SharedFrame, Tick};
use world_service::journal::{Reader as JournalReader, Replay};

use super::RecordError;
use super::piece::NewFile;
use super::progress::Progress;
use super::source::{Opened, of, open};
use rebuilt::Rebuilt;

/// Roles by which clients name the vehicle that an episode is about.
const EGO_ROLES: [&str; 3] = ["hero", "ego", "ego_vehicle"];

/// What is to be exported.
#[derive(Clone, Debug, clap::Args)]
pub(crate) struct Export {
    /// A journal, or a log of CARLA's format
    file: PathBuf,
    /// The new file; one that is there is never replaced
    #[arg(long, value_name = "FILE.mcap")]
    to: PathBuf,
    /// Where to begin, in seconds since the beginning
    #[arg(long, value_name = "SECS", default_value_t = 0.0)]
    from: f64,
    /// Where to end, in seconds since the beginning [default: with the recording]
    #[arg(long, value_name = "SECS", default_value_t = f64::INFINITY, hide_default_value = true)]
    until: f64,
    /// Every so many frames one
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..))]
    every: u32,
    /// Actor of the topics below /ego [default: who has the role hero, else the first vehicle]
    #[arg(long, value_name = "ACTOR")]
    ego: Option<u32>,
    /// The map's OpenDRIVE file, for logs of a map that is not one of ours
    #[arg(long, value_name = "FILE.xodr")]
    map: Option<PathBuf>,
}

type Out = Exporter<NewFile>;

/// # Errors
/// A file that is neither, a map that is not known, and a new file that cannot be written.
pub(super) fn export(order: &Export) -> Result<(), RecordError> {
    match open(&order.file)? {
        Opened::Journal(reader) => of_journal(order, *reader),
        Opened::Log(reader) => {
            let map = order.log_map(&reader.header().map)?;
            let mut rebuilt = Rebuilt::new(&order.file, reader, &map);
            let mut out = None;
            let mut progress = Progress::new("exported", order.until);
            let mut number = 0;
            while let Some(frame) = rebuilt.next()? {
                if frame.sim_secs > order.until {
                    break;
                }
                number += 1;
                if frame.sim_secs < order.from || (number - 1) % order.every != 0 {
                    continue;
                }
                progress.reach(frame.sim_secs);
                let out = match &mut out {
                    Some(out) => out,
                    None => {
                        let ego = order.ego().or(rebuilt.hero());
                        out.insert(order.begin(Arc::clone(&map), ego, false)?)
                    }
                };
                order.put(out, &SharedFrame::from(frame))?;
            }
            order.finish(out)
        }
    }
}

fn of_journal(
    order: &Export,
    mut reader: JournalReader<BufReader<File>>,
) -> Result<(), RecordError> {
    let (name, text) = (&reader.head().map_name, &reader.head().map_text);
    let map = parsed(&order.file, name, text)?;
    let index = reader.index();
    let (first, last) = (index.tick_at(order.from), index.tick_at(order.until));
    let total_secs = index.total_secs();
    let ego = match order.ego() {
        Some(ego) => Some(ego),
        None => hero_at(&order.file, &mut reader, last)?,
    };
    let mut out = order.begin(map, ego, true)?;
    let mut progress = Progress::new("exported", total_secs);
    // Of the first state of all there is no frame on file.
    let begin = first.0.max(reader.index().first().0 + 1);
    for tick in (begin..=last.0).step_by(order.every as usize) {
        let frame = reader.frame(Tick(tick)).map_err(of(&order.file))?;
        let frame = SharedFrame::decode(frame).map_err(RecordError::Refused)?;
        progress.reach(reader.index().elapsed_secs(Tick(tick)).unwrap_or_default());
        order.put(&mut out, &frame)?;
    }
    order.finish(Some(out))
}

/// Who has the role of the ego in the world of a journal.
fn hero_at(
    path: &Path,
    reader: &mut JournalReader<BufReader<File>>,
    tick: Tick,
) -> Result<Option<ActorId>, RecordError> {
    let way = reader.way_to(tick).map_err(of(path))?;
    let mut replay = Replay::begin(reader.head()).map_err(of(path))?;
    replay.go(&way).map_err(of(path))?;
    let described = replay.world().describe(&[]);
    let is_ego = |actor: &&schemas::ActorDescription| {
        actor.attributes.iter().any(|attribute| {
            attribute.id == "role_name" && EGO_ROLES.contains(&attribute.value.as_str())
        })
    };
    Ok(described.iter().find(is_ego).map(|actor| actor.id))
}

impl Export {
    fn ego(&self) -> Option<ActorId> {
        self.ego.and_then(ActorId::new)
    }

    /// The map that a log names.
    fn log_map(&self, name: &str) -> Result<Arc<roads::Map>, RecordError> {
        let text = match &self.map {
            Some(path) => world_service::read_map_file(path).map_err(RecordError::Refused)?,
            None => roads::town::build(name).ok_or_else(|| RecordError::Unfit {
                path: self.file.clone(),
                why: format!("it is of the map {name}, which is none of ours; name it with --map"),
            })?,
        };
        parsed(&self.file, name, &text)
    }

    fn begin(
        &self,
        map: Arc<roads::Map>,
        ego: Option<ActorId>,
        is_exact: bool,
    ) -> Result<Out, RecordError> {
        let about = About {
            version: env!("CARGO_PKG_VERSION").to_owned(),
            source: self.file.file_name().unwrap_or_default().to_string_lossy().into_owned(),
            ego,
            is_exact,
        };
        let sink = NewFile::create(&self.to)?;
        Exporter::begin(sink, map, about).map_err(|cause| self.refused(cause))
    }

    fn put(&self, out: &mut Out, frame: &SharedFrame) -> Result<(), RecordError> {
        out.frame(frame).map_err(|cause| self.refused(cause))
    }

    fn finish(&self, out: Option<Out>) -> Result<(), RecordError> {
        let out = out.filter(|out| out.frames() > 0).ok_or_else(|| RecordError::Unfit {
            path: self.file.clone(),
            why: format!("wanted frames from {} s to {} s, found none", self.from, self.until),
        })?;
        let frames = out.frames();
        out.finish().map_err(|cause| self.refused(cause))?.keep()?;
        println!("{}: {frames} frames of {}", self.to.display(), self.file.display());
        Ok(())
    }

    fn refused(&self, cause: std::io::Error) -> RecordError {
        RecordError::Write { path: self.to.clone(), cause }
    }
}

fn parsed(path: &Path, name: &str, text: &str) -> Result<Arc<roads::Map>, RecordError> {
    let map = roads::Map::parse(name, text);
    map.map(Arc::new).map_err(|error| RecordError::Unfit {
        path: path.to_owned(),
        why: format!("its map cannot be used: {error}"),
    })
}

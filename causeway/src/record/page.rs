//! Logs and journals as one HTML file, which plays them in a browser without a server.

use std::fs::File;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};

use replay_page::{About, Page, Step as EpisodeStep};
use schemas::wire::decode_frame;
use schemas::{ActorId, Frame, Tick};
use world_service::journal::{Reader as JournalReader, Step};

use super::RecordError;
use super::piece::NewFile;
use super::played::{described_at, is_ego, map_of_log, no_ego, parsed, roles};
use super::rebuilt::Rebuilt;
use super::source::{Opened, file, of, open};

/// What is to be shown.
#[derive(Clone, Debug, clap::Args)]
pub(crate) struct ReplayPage {
    /// A journal, or a log of CARLA's format
    file: PathBuf,
    /// The new file; one that is there is never replaced
    #[arg(long, value_name = "FILE.html")]
    to: PathBuf,
    /// Where to begin, in seconds since the beginning
    #[arg(long, value_name = "SECS", default_value_t = 0.0)]
    from: f64,
    /// Where to end, in seconds since the beginning [default: with the recording]
    #[arg(long, value_name = "SECS", default_value_t = f64::INFINITY, hide_default_value = true)]
    until: f64,
    /// Keep the places of every so many frames one; the page draws those between
    #[arg(long, value_name = "N", default_value_t = 2, value_parser = clap::value_parser!(u32).range(1..))]
    every: u32,
    /// Actor whom the page follows and scores [default: who has the role hero, else the first
    /// vehicle]
    #[arg(long, value_name = "ACTOR")]
    ego: Option<u32>,
    /// The map's OpenDRIVE file, for logs of a map that is not one of ours
    #[arg(long, value_name = "FILE.xodr")]
    map: Option<PathBuf>,
    /// Steps of the episode, each a line of JSON with simulation_time, action, reward, done_reason
    #[arg(long, value_name = "FILE.jsonl")]
    steps: Option<PathBuf>,
}

/// # Errors
/// A file that is neither, a map that is not known, and a new file that cannot be written.
pub(super) fn page(order: &ReplayPage) -> Result<(), RecordError> {
    match open(&order.file)? {
        Opened::Journal(reader) => of_journal(order, *reader),
        Opened::Log(reader) => {
            let map = map_of_log(&order.file, &reader.header().map, order.map.as_deref())?;
            let mut rebuilt = Rebuilt::new(&order.file, reader, &map);
            let mut page = None;
            let mut has_ego = order.ego.is_none();
            while let Some(frame) = rebuilt.next()? {
                if frame.sim_secs > order.until {
                    break;
                }
                if frame.sim_secs < order.from {
                    continue;
                }
                let page = page.get_or_insert_with(|| {
                    let ego = order.ego().or(rebuilt.hero());
                    Page::new(&map, About { ego, ..order.about() })
                });
                has_ego |= order.is_ego_in(&frame);
                page.frame(&frame).map_err(|cause| order.unfit(&cause))?;
            }
            order.write(page, has_ego)
        }
    }
}

fn of_journal(
    order: &ReplayPage,
    mut reader: JournalReader<BufReader<File>>,
) -> Result<(), RecordError> {
    let map = parsed(&order.file, &reader.head().map_name, &reader.head().map_text)?;
    let index = reader.index();
    let (first, last) = (index.tick_at(order.from), index.tick_at(order.until));
    // Of the first state of all there is no frame on file.
    let begin = first.0.max(index.first().0 + 1);
    let described = described_at(&order.file, &mut reader, last)?;
    let hero = || described.iter().find(|actor| is_ego(actor)).map(|ego| ego.id);
    let about = About { ego: order.ego().or_else(hero), roles: roles(&described), ..order.about() };
    let mut page = Page::new(&map, about);
    let mut has_ego = order.ego.is_none();
    for tick in begin..=last.0 {
        let steps = reader.steps_to(Tick(tick)).map_err(of(&order.file))?;
        let Some(Step::Tick(entry)) = steps.last() else { continue };
        let frame = decode_frame(&entry.frame.0).map_err(RecordError::Refused)?;
        has_ego |= order.is_ego_in(&frame);
        page.frame(&frame).map_err(|cause| order.unfit(&cause))?;
    }
    order.write(Some(page), has_ego)
}

impl ReplayPage {
    fn ego(&self) -> Option<ActorId> {
        self.ego.and_then(ActorId::new)
    }

    /// Whether the ego that was asked for is there.
    fn is_ego_in(&self, frame: &Frame) -> bool {
        self.ego().is_some_and(|ego| frame.actor(ego).is_some())
    }

    fn about(&self) -> About {
        About {
            version: env!("CARGO_PKG_VERSION").to_owned(),
            source: self.file.file_name().unwrap_or_default().to_string_lossy().into_owned(),
            every: self.every,
            ..About::default()
        }
    }

    fn unfit(&self, cause: &dyn std::fmt::Display) -> RecordError {
        RecordError::Unfit { path: self.file.clone(), why: cause.to_string() }
    }

    fn write(&self, page: Option<Page<'_>>, has_ego: bool) -> Result<(), RecordError> {
        let page = page.filter(|page| page.frames() > 0).ok_or_else(|| {
            let (from, until) = (self.from, self.until);
            self.unfit(&format!("wanted frames from {from} s to {until} s, found none"))
        })?;
        if let Some(ego) = self.ego.filter(|_| !has_ego) {
            return Err(no_ego(&self.file, ego));
        }
        let steps = self.steps.as_deref().map_or_else(|| Ok(Vec::new()), read_steps)?;
        let frames = page.frames();
        let mut out = NewFile::create(&self.to)?;
        page.finish(&steps, &mut out).map_err(|cause| out.refused(cause))?;
        out.keep()?;
        println!("{}: {frames} frames of {}", self.to.display(), self.file.display());
        Ok(())
    }
}

/// # Errors
/// No such file, or a line that is no step.
fn read_steps(path: &Path) -> Result<Vec<EpisodeStep>, RecordError> {
    let lines = file(path)?.lines().enumerate();
    let step = |(index, line): (usize, std::io::Result<String>)| {
        let line = line.map_err(|cause| RecordError::Open { path: path.to_owned(), cause })?;
        serde_json::from_str(&line).map_err(|error| RecordError::Unfit {
            path: path.to_owned(),
            why: format!("line {}: wanted a step as JSON, found {error}", index + 1),
        })
    };
    lines.map(step).collect()
}

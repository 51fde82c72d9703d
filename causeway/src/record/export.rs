//! Logs and journals as MCAP files, which Foxglove and its libraries open.

mod studio;

use std::fs::File;
use std::io::BufReader;
use std::path::PathBuf;
use std::sync::Arc;

use mcap_export::{About, Done, Exporter, Names, Origin};
use schemas::wire::encode_request;
use schemas::{ActorDescription, ActorId, Error, Request, SharedFrame, Tick};
use world_service::journal::{Moment, Reader as JournalReader, Replay, Step};

use super::RecordError;
use super::piece::NewFile;
use super::played::{described_at, is_ego, map_of_log, no_ego, parsed, replay_at, roles};
use super::progress::Progress;
use super::rebuilt::Rebuilt;
use super::source::{Opened, of, open};
use studio::{Size, Studio, Wanted};

/// Places of a way that is told: two kilometres.
const WAY_PLACES_MAX: usize = 1_024;

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
    /// A camera whose pictures are drawn again: chase, top or driver, which the ego carries, or the
    /// id of a camera in the world of a journal; may be given several times
    #[arg(long, value_name = "CAMERA")]
    camera: Vec<Wanted>,
    /// Size of the pictures of chase, top and driver
    #[arg(long, value_name = "WIDTHxHEIGHT", default_value = "640x360")]
    picture_size: Size,
    /// What draws: cpu, or part of a Vulkan adapter's name [default: a GPU, else cpu]
    #[arg(
        long,
        value_name = "NAME",
        default_value = "",
        hide_default_value = true,
        env = "CAUSEWAY_ADAPTER"
    )]
    adapter: String,
    /// Simulate a journal again for what its sensors measured: those that somebody listened to
    #[arg(long)]
    sensors: bool,
    /// Draw the boxes of actors over the pictures
    #[arg(long, requires = "camera")]
    boxes: bool,
    /// Whose names topics and frames have: nuscenes for those that nuscenes2mcap gives
    #[arg(long, value_name = "NAMES", value_enum, default_value_t)]
    names: Naming,
}

/// Whose names a file has.
#[derive(Clone, Copy, Debug, Default, clap::ValueEnum)]
enum Naming {
    #[default]
    Causeway,
    Nuscenes,
}

/// A file that is being written, and what draws its pictures.
struct Out {
    file: Exporter<NewFile>,
    studio: Option<Studio>,
    /// Whether the ego that was asked for is somewhere in it.
    has_ego: bool,
}

/// # Errors
/// A file that is neither, a map that is not known, and a new file that cannot be written.
pub(super) fn export(order: &Export) -> Result<(), RecordError> {
    match open(&order.file)? {
        Opened::Journal(reader) => of_journal(order, *reader),
        Opened::Log(reader) => {
            order.check_log()?;
            let map = map_of_log(&order.file, &reader.header().map, order.map.as_deref())?;
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
                        out.insert(order.begin(Arc::clone(&map), ego, &[], None)?)
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
    // Of the first state of all there is no frame on file.
    let begin = first.0.max(index.first().0 + 1);
    let described = described_at(&order.file, &mut reader, last)?;
    let ego =
        order.ego().or_else(|| described.iter().find(|actor| is_ego(actor)).map(|ego| ego.id));
    let before = replay_at(&order.file, &mut reader, Tick(begin - 1))?;
    // Only of all ticks a journal can be made again.
    let origin = (order.every == 1).then(|| origin(&before));
    let mut replay = order.sensors.then_some(before);
    let mut out = order.begin(map, ego, &described, Some(origin))?;
    let mut progress = Progress::new("exported", total_secs);
    for tick in begin..=last.0 {
        let steps = reader.steps_to(Tick(tick)).map_err(of(&order.file))?;
        let Some(Step::Tick(entry)) = steps.last() else { continue };
        let frame = SharedFrame::decode(entry.frame.clone()).map_err(RecordError::Refused)?;
        // Also where nobody has the role: then it is the first vehicle.
        let ego = out.file.ego(&frame);
        if replay.is_none() && frame.agents.iter().any(|agent| Some(agent.actor) == ego) {
            // Frames do not tell its way.
            replay = Some(replay_at(&order.file, &mut reader, Tick(tick - 1))?);
        }
        if order.every == 1 {
            order.put_commands(&mut out, &frame, &steps)?;
        }
        if (tick - begin).is_multiple_of(order.every.into()) {
            order.put(&mut out, &frame)?;
        }
        if let Some(replay) = &mut replay {
            steps.iter().try_for_each(|step| replay.step(step)).map_err(of(&order.file))?;
            order.put_simulated(&mut out, replay, &frame, ego)?;
        }
        progress.reach(reader.index().elapsed_secs(Tick(tick)).unwrap_or_default());
    }
    order.finish(Some(out))
}

/// The state of a world, from where it goes on.
fn origin(replay: &Replay) -> Origin {
    let Moment { tick, sim_secs, state_hash } = Moment::of(&replay.world().frame());
    Origin { tick: tick.0, sim_secs, state_hash, snapshot: replay.world().snapshot() }
}

/// What a sensor is called: below its carrier, with the last word of its kind and its id.
fn sensor_name(frame: &schemas::Frame, sensor: ActorId, ego: Option<ActorId>) -> Option<String> {
    let actor = frame.actor(sensor)?;
    let kind = frame.type_of(actor);
    let kind = match kind.split('.').nth(1) {
        Some("lidar") => "lidar",
        _ => kind.rsplit('.').next()?,
    };
    let own = format!("{kind}/{}", sensor.get());
    Some(match actor.parent {
        Some(carrier) if Some(carrier) == ego => format!("ego/{own}"),
        Some(carrier) => format!("actors/{}/{own}", carrier.get()),
        None => format!("world/{own}"),
    })
}

impl Export {
    pub(super) fn draws(&self) -> bool {
        !self.camera.is_empty()
    }

    fn ego(&self) -> Option<ActorId> {
        self.ego.and_then(ActorId::new)
    }

    /// # Errors
    /// What only a journal has.
    fn check_log(&self) -> Result<(), RecordError> {
        let has_world = self.camera.iter().any(|camera| matches!(camera, Wanted::Actor(_)));
        if !has_world && !self.sensors {
            return Ok(());
        }
        let why = "wanted a journal for --sensors and cameras of the world, found a log, which has \
                   no measurements: its journal is FILE.journal";
        Err(RecordError::Unfit { path: self.file.clone(), why: why.to_owned() })
    }

    /// Begins the file, of exact frames perhaps with their origin.
    fn begin(
        &self,
        map: Arc<roads::Map>,
        ego: Option<ActorId>,
        described: &[ActorDescription],
        exact: Option<Option<Origin>>,
    ) -> Result<Out, RecordError> {
        let studio = self.studio(&map, described)?;
        let heroes = described.iter().filter(|actor| is_ego(actor)).map(|actor| actor.id);
        let about = About {
            version: env!("CARGO_PKG_VERSION").to_owned(),
            source: self.file.file_name().unwrap_or_default().to_string_lossy().into_owned(),
            ego,
            roles: roles(described),
            heroes: heroes.collect(),
            is_exact: exact.is_some(),
            origin: exact.flatten(),
            names: match self.names {
                Naming::Causeway => Names::Causeway,
                Naming::Nuscenes => Names::Nuscenes,
            },
        };
        let sink = NewFile::create(&self.to)?;
        let file = Exporter::begin(sink, map, about).map_err(|cause| self.refused(cause))?;
        Ok(Out { file, studio, has_ego: self.ego.is_none() })
    }

    fn studio(
        &self,
        map: &roads::Map,
        described: &[ActorDescription],
    ) -> Result<Option<Studio>, RecordError> {
        if self.camera.is_empty() {
            return Ok(None);
        }
        let views = self.camera.iter().map(|camera| camera.view(self.picture_size, described));
        let views = views.collect::<Result<_, Error>>().map_err(|cause| self.undrawn(&cause))?;
        let tenant = "local".parse().map_err(|cause: schemas::InvalidName| self.undrawn(&cause))?;
        let studio = Studio::open(&self.adapter, tenant, map, views);
        let studio = studio.map_err(|cause| self.undrawn(&cause))?;
        eprintln!("pictures are drawn by {}", studio.adapter_name());
        Ok(Some(studio))
    }

    fn put(&self, out: &mut Out, frame: &SharedFrame) -> Result<(), RecordError> {
        out.has_ego |= self.ego().is_some_and(|ego| frame.actor(ego).is_some());
        let file = &mut out.file;
        file.frame(frame).map_err(|cause| self.refused(cause))?;
        let Some(studio) = &mut out.studio else { return Ok(()) };
        let pictures = studio.draw(frame, file.ego(frame)).map_err(|cause| self.undrawn(&cause))?;
        for (view, image) in pictures {
            let put = file.picture(frame, &view, &image, self.boxes);
            put.map_err(|cause| self.refused(cause))?;
        }
        Ok(())
    }

    /// What was done before a frame.
    fn put_commands(
        &self,
        out: &mut Out,
        frame: &SharedFrame,
        steps: &[Step],
    ) -> Result<(), RecordError> {
        let mut done = Done { tick: frame.tick.0, ..Done::default() };
        for step in steps {
            match step {
                Step::Commands(commands) => {
                    let (world, commands) = (frame.world, commands.clone());
                    done.requests.push(encode_request(&Request::RunCommands { world, commands }));
                }
                Step::Tick(tick) => done.wanted_secs = tick.wanted_secs,
            }
        }
        out.file.done(frame, &done).map_err(|cause| self.refused(cause))
    }

    /// What sensors measured in the newest tick, and the way of the ego's driver.
    fn put_simulated(
        &self,
        out: &mut Out,
        replay: &Replay,
        frame: &SharedFrame,
        ego: Option<ActorId>,
    ) -> Result<(), RecordError> {
        let world = replay.world();
        if let Some(ego) = ego {
            let way_m = world.way_m(ego, WAY_PLACES_MAX);
            out.file.way(frame, &way_m).map_err(|cause| self.refused(cause))?;
        }
        for datum in world.sensors().iter().filter(|_| self.sensors) {
            let Some(name) = sensor_name(frame, datum.sensor, ego) else { continue };
            out.file.measured(frame, &name, datum).map_err(|cause| self.refused(cause))?;
        }
        Ok(())
    }

    fn undrawn(&self, cause: &dyn std::fmt::Display) -> RecordError {
        let why = format!("its pictures cannot be drawn: {cause}");
        RecordError::Unfit { path: self.file.clone(), why }
    }

    fn finish(&self, out: Option<Out>) -> Result<(), RecordError> {
        let out = out.filter(|out| out.file.frames() > 0).ok_or_else(|| RecordError::Unfit {
            path: self.file.clone(),
            why: format!("wanted frames from {} s to {} s, found none", self.from, self.until),
        })?;
        if let Some(ego) = self.ego.filter(|_| !out.has_ego) {
            return Err(no_ego(&self.file, ego));
        }
        let frames = out.file.frames();
        out.file.finish().map_err(|cause| self.refused(cause))?.keep()?;
        println!("{}: {frames} frames of {}", self.to.display(), self.file.display());
        Ok(())
    }

    fn refused(&self, cause: std::io::Error) -> RecordError {
        RecordError::Write { path: self.to.clone(), cause }
    }
}

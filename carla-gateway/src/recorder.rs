//! Recordings in CARLA's format: which frames go where.
//!
//! - `folder` knows which names of recordings lead to which files.
//! - `arrivals` knows who is new in a frame.
//! - `content` is what a recording has of a frame, and `scribe` writes it, both on a thread of
//!   their own: of a tick, recording takes little more than a reference to its frame.
//! - `log_file` is the file itself, as far as a quota allows.
//! - `companion` is what it says of the journal beside it.
//! - `queries` answers what clients ask about recordings.

mod arrivals;
mod companion;
mod content;
mod folder;
mod log_file;
mod queries;
mod scribe;

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

use recording::{Header, PhysicsControl};
use schemas::{ActorId, Frame, Tenant};
#[cfg(test)]
use tokio::sync::OwnedSemaphorePermit;
use tokio::task::JoinHandle;

use crate::allowance::Allowance;
use crate::archive::{Known, Prepared};
use crate::dialect::{LightState as Lamp, WeatherParameters};
use crate::episode::Episode;
use crate::rpc::{Answer, Refusal};
use arrivals::Arrivals;
pub(crate) use companion::{Companion, JournalNames};
use content::{Further, Notes, Shot};
pub(crate) use folder::RecordingFolder;
use log_file::LogFile;
pub(crate) use queries::Question;
use queries::RecordingReader;
pub use queries::local_date;
use scribe::{Scribe, Written};

/// The recording of one endpoint, if there is one.
pub(crate) struct Recorder {
    recordings: RecordingFolder,
    running: Option<Recording>,
    /// Recordings that have ended and are perhaps still being written.
    ending: Vec<(PathBuf, Written)>,
    reader: RecordingReader,
}

struct Recording {
    path: PathBuf,
    tenant: Tenant,
    scribe: Scribe<Shot>,
    arrivals: Arrivals,
    /// As they were told last.
    lamps: Vec<Lamp>,
    has_additional: bool,
    began: Instant,
    companion: Option<Companion>,
    journals: Arc<JournalNames>,
}

/// What there is to record of the newest frame.
pub(crate) struct Scene<'a> {
    pub(crate) episode: &'a Episode,
    pub(crate) lamps: &'a [Lamp],
    pub(crate) weather: &'a WeatherParameters,
    /// Of vehicles that have to be inspected.
    pub(crate) physics: Vec<PhysicsControl>,
}

impl Recorder {
    /// Without a recording.
    pub(crate) fn new(recordings: RecordingFolder) -> Self {
        Self { recordings, running: None, ending: Vec::new(), reader: RecordingReader::default() }
    }

    /// Where recordings lie.
    pub(crate) fn recordings(&self) -> &RecordingFolder {
        &self.recordings
    }

    /// Begins a recording, in place of one that is under way; its first frame is the next one.
    ///
    /// # Errors
    /// A name that leads nowhere, a file that cannot be made or is none of ours, no room for it.
    pub(crate) async fn start(
        &mut self,
        name: &str,
        map: &str,
        has_additional: bool,
        allowance: &Allowance,
    ) -> Result<String, Refusal> {
        self.stop();
        let path = self.recordings.path_of(name)?;
        self.settle(&path).await;
        let mut growing = allowance.recording(self.recordings.folder(), &path).await?;
        let file = self.recordings.create(&path)?;
        growing.replace();
        let date = std::time::SystemTime::UNIX_EPOCH.elapsed().unwrap_or_default().as_secs();
        let header = Header { version: Header::VERSION, date: date as i64, map: map.to_owned() };
        let mut notes = Notes::default();
        let file = LogFile::new(file, growing);
        let scribe = Scribe::start(file, &path, &header, move |shot| notes.content(shot))
            .map_err(|error| Refusal(format!("cannot record to {path:?}: {error}")))?;
        let told = path.to_string_lossy().into_owned();
        let tenant = allowance.tenant().clone();
        tracing::info!(target: "audit", %tenant, path = told, has_additional, "a recording begins");
        let (arrivals, lamps, began) = (Arrivals::default(), Vec::new(), Instant::now());
        let journals = Arc::new(JournalNames::new(self.recordings.clone(), path.clone()));
        self.running = Some(Recording {
            path,
            tenant,
            scribe,
            arrivals,
            lamps,
            has_additional,
            began,
            companion: None,
            journals,
        });
        Ok(told)
    }

    /// Ends the recording; its last frames are still being written.
    pub(crate) fn stop(&mut self) {
        let Some(Recording { path, tenant, scribe, .. }) = self.running.take() else { return };
        tracing::info!(target: "audit", %tenant, path = %path.display(), "a recording ends");
        self.ending.retain(|(_, written)| !written.is_over());
        self.ending.push((path, scribe.written()));
    }

    /// Waits until a recording that has ended is written.
    pub(crate) async fn settle(&self, path: &Path) {
        for written in self.endings(path) {
            written.wait().await;
        }
    }

    fn endings(&self, path: &Path) -> Vec<Written> {
        let ending = self.ending.iter().filter(|(ended, _)| ended == path);
        ending.map(|(_, written)| written.clone()).collect()
    }

    /// What a recording says, as soon as it is written and read; nobody is held up by that.
    ///
    /// # Errors
    /// A name that leads nowhere, and too many questions at once.
    pub(crate) fn ask(
        &self,
        name: &str,
        question: Question,
    ) -> Result<JoinHandle<Answer>, Refusal> {
        let path = self.recordings.path_of(name)?;
        let endings = self.endings(&path);
        self.reader.ask(path, endings, question)
    }

    /// Opens a recording to be replayed, as soon as it is written; nobody is held up by that.
    ///
    /// # Errors
    /// Too many at once.
    pub(crate) fn open(
        &self,
        path: PathBuf,
        known: Option<Known>,
    ) -> Result<JoinHandle<Prepared>, Refusal> {
        let endings = self.endings(&path);
        self.reader.open(path, endings, known)
    }

    /// Nothing is read until this is dropped.
    #[cfg(test)]
    pub(crate) async fn hold_answers(&self) -> OwnedSemaphorePermit {
        self.reader.hold().await
    }

    /// Names the journal beside the recording, of which its frames tell from now on.
    pub(crate) fn accompany(&mut self, companion: Companion) {
        if let Some(recording) = &mut self.running {
            recording.companion = Some(companion);
        }
    }

    /// The names that journals beside the recording are to have.
    pub(crate) fn journal_names(&self) -> Option<Arc<JournalNames>> {
        self.running.as_ref().map(|recording| Arc::clone(&recording.journals))
    }

    /// Whether a recording is under way.
    pub(crate) fn is_running(&self) -> bool {
        self.running.is_some()
    }

    /// Notes who is there between two frames: new actors are recorded where they came.
    pub(crate) fn see(&mut self, frame: &Frame) {
        if let Some(recording) = &mut self.running {
            recording.arrivals.see(frame);
        }
    }

    /// Vehicles whose physics the next frame has to tell.
    pub(crate) fn vehicles_to_inspect(&self, frame: &Frame) -> Vec<ActorId> {
        let recording = self.running.as_ref().filter(|recording| recording.has_additional);
        recording.map_or_else(Vec::new, |recording| recording.arrivals.vehicles_to_inspect(frame))
    }

    /// Notes that the physics of a vehicle was changed.
    pub(crate) fn note_physics(&mut self, vehicle: ActorId) {
        if let Some(recording) = &mut self.running {
            recording.arrivals.note_physics(vehicle);
        }
    }

    /// Records a frame.
    pub(crate) fn record(&mut self, scene: Scene<'_>) {
        let Some(recording) = &mut self.running else { return };
        let shot = recording.shot(scene);
        if let Err(error) = recording.scribe.write(shot) {
            tracing::error!(path = %recording.path.display(), "{error}");
            self.stop();
        }
    }
}

impl Recording {
    fn shot(&mut self, scene: Scene<'_>) -> Shot {
        let Scene { episode, lamps, weather, physics } = scene;
        let are_new = self.lamps != lamps;
        if are_new {
            self.lamps = lamps.to_vec();
        }
        let additional = self
            .has_additional
            .then(|| Further { platform_secs: self.began.elapsed().as_secs_f64(), physics });
        let companion = self.companion.as_mut();
        let foreign = companion.map_or_else(Vec::new, |it| it.packets(&episode.frame));
        Shot {
            foreign,
            frame: episode.frame.clone(),
            arrivals: self.arrivals.take(episode),
            lamps: are_new.then(|| self.lamps.clone()),
            weather: *weather,
            additional,
        }
    }
}

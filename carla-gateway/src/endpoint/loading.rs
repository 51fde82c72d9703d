//! Beginning an episode: a new world on a map.

use std::sync::Arc;
use std::time::Duration;

use roads::MapLayer;
use schemas::{Command, Frame, Pose, Reply, Request, SceneryCommand, SharedFrame, Vec3, WorldId};
use tokio::time::Instant;
use worlds::NewWorld;

use super::Endpoint;
use super::coming_back::destroy_later;
use super::listeners::Whose;
use super::street_lamps::StreetLamps;
use super::worlds::refused;
use crate::dialect::{EpisodeSettings, WeatherParameters};
use crate::episode::Episode;
use crate::maps;
use crate::rpc::Refusal;
use crate::stream::WORLD_OBSERVER;

/// How long listeners may take to read the rest of the old episode's streams. A client that is at
/// a measurement while it has no episode, as for a moment after a load, ends its process.
const REST_WAIT: Duration = Duration::from_secs(1);
/// Length of a tick until a client chooses one.
const DT_SECS: f64 = 0.05;
/// The name under which CARLA's client loads what it uploaded.
pub(crate) const UPLOADED_MAP: &str = "OpenDriveMap";

/// Takes layers away before anybody sees the world.
fn without_layers(layers: u16) -> Vec<Command> {
    let layers = layers & MapLayer::ALL;
    let unload = Command::Scenery(SceneryCommand::Layers { layers, loaded: false });
    if layers == 0 { Vec::new() } else { vec![unload] }
}

/// Whether the map of a world is the one that clients are told.
pub(super) fn fits(map: &roads::Map, frame: &Frame) -> Result<(), Refusal> {
    let (name, wanted, found) = (map.name(), map.digest(), &frame.map.digest);
    if wanted == found {
        return Ok(());
    }
    Err(Refusal(format!(
        "the world service has another version of the map {name}: wanted {wanted}, found {found}; \
         give all world services the same maps"
    )))
}

impl Endpoint {
    /// The name on the bus of what this endpoint's clients uploaded.
    pub(crate) fn upload_name(&self) -> String {
        format!("{UPLOADED_MAP}-{}", self.port)
    }

    /// Begins a new episode on a map, or on the present one when the name is empty, with these of
    /// CARLA's layers if the map has any; or in the world of a session. The old world goes only
    /// when the new one is there.
    ///
    /// # Errors
    /// No such map, or no world service, or one with another version of the map; the old episode
    /// goes on.
    pub(crate) async fn load(&mut self, name: &str, layers: u16) -> Result<(), Refusal> {
        // The client library ends its process when it leaves a stream that it is still joining.
        self.await_listeners(Whose::All).await;
        if let Some(world) = schemas::carla::world_named(name) {
            return self.visit(world).await;
        }
        let name = match (name, &self.episode) {
            ("", Some(episode)) => episode.map_name.clone(),
            ("", None) => self.config.map.clone(),
            (name, _) => name.to_owned(),
        };
        let is_upload = name.rsplit('/').next() == Some(UPLOADED_MAP);
        let bus_name = if is_upload { self.upload_name() } else { name };
        let map = self.maps.find(&bus_name).await.map_err(|error| Refusal(error.message))?;
        let told = if is_upload { UPLOADED_MAP.to_owned() } else { map.name().to_owned() };
        let new = NewWorld {
            map: map.name().to_owned(),
            seed: self.config.seed,
            dt_secs: DT_SECS,
            commands: if maps::is_layered(&told) { without_layers(!layers) } else { Vec::new() },
            traffic: true,
            first_actor: self.given.next(),
        };
        let created = self.site.ask(new.clone().request(self.config.lease())).await;
        let created = created.map_err(|error| refused(&error))?;
        let Reply::WorldCreated { world, frame, .. } = created else {
            return Err(Refusal("the world service answered something else".to_owned()));
        };
        let frame = SharedFrame::decode(frame).map_err(|error| refused(&error));
        let fitting = frame.and_then(|frame| fits(&map, &frame).map(|()| frame));
        let frame = fitting.inspect_err(|_| destroy_later(Arc::clone(&self.site), world))?;
        self.end_episode().await;
        self.keep.begin(new);
        self.begin_episode((world, frame), map, told).await
    }

    /// Begins an episode in a world whose map clients know by a name.
    ///
    /// # Errors
    /// Those of the world.
    pub(super) async fn begin_episode(
        &mut self,
        (world, frame): (WorldId, SharedFrame),
        map: Arc<roads::Map>,
        told: String,
    ) -> Result<(), Refusal> {
        self.given.begin_world();
        self.note_actors(&frame, &[]);
        self.episodes_begun += 1;
        let (tenant, episode) = (self.config.allowance.tenant(), self.episodes_begun);
        tracing::info!(target: "audit", %tenant, port = self.port, map = told, episode, "episode");
        self.mention_cars(&map);
        self.weather = WeatherParameters::of(&frame.weather);
        self.lamps = StreetLamps::of(&map, self.is_night());
        let episode = Episode::new(world, map, told, frame, self.config.version);
        let navigation = Arc::clone(&episode.navigation);
        // Made before the first client wants it.
        tokio::spawn(async move { navigation.file().await.map(|_| ()) });
        self.episode = Some(episode);
        self.map_is_new = self.episodes_begun > 1;
        self.furnish().await
    }

    /// Settings of a new server, as `load_world` wants them by default: asynchronous again.
    pub(crate) fn reset_settings(&mut self) {
        self.settle(EpisodeSettings::default());
    }

    /// Puts the spectator into the new world, learns about all actors, and shows the first frame.
    async fn furnish(&mut self) -> Result<(), Refusal> {
        let above = Pose::translation(0.0, 0.0, 20.0);
        let spectator = Command::spawn("spectator", above, Vec3::zeros());
        let reply = self.run_now(vec![spectator]).await?.pop();
        match reply {
            Some(Ok(id)) => self.episode()?.spectator = id,
            Some(Err(error)) => tracing::warn!(%error, "this world has no spectator"),
            None => {}
        }
        self.learn(Vec::new()).await?;
        self.queue_substeps();
        self.frame_number += 1;
        let payload = self.snapshot(DT_SECS)?;
        self.hub.keep(WORLD_OBSERVER, payload);
        Ok(())
    }

    pub(super) async fn end_episode(&mut self) {
        self.lost = None;
        self.keep.end();
        self.end_recording().await;
        self.replayer.drop_replay();
        self.pending.clear();
        self.expected.clear();
        self.lamps = StreetLamps::default();
        self.shapes = Arc::default();
        self.shown = None;
        if let Some(pictures) = self.pictures.take() {
            pictures.abort();
        }
        let Some(old) = self.episode.take() else { return };
        for stream in old.streams() {
            self.hub.close(stream);
            self.event_memories.forget(stream);
        }
        self.hub.wait_for_leaving(Instant::now() + REST_WAIT).await;
        if let Some(visit) = self.visit.take() {
            return visit.end().await;
        }
        if let Err(error) = self.site.ask(Request::DestroyWorld { world: old.world }).await {
            tracing::debug!(%error, "the old world could not be destroyed");
        }
    }
}

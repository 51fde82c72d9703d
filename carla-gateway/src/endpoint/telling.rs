//! Snapshots and measurements to whoever listens.

use schemas::{ActorId, SensorDatum};

use super::{Endpoint, GRAVITY_MPS2};
use crate::catalogue;
use crate::dialect::Actor;
use crate::rpc::Refusal;
use crate::snapshot::{self, LIGHTS_CHANGED, MAP_CHANGED, Moment, Signal};
use crate::stream::WORLD_OBSERVER;

impl Endpoint {
    /// Sends the newest frame to all clients.
    pub(super) async fn show_frame(&mut self, delta_secs: f64) -> Result<(), Refusal> {
        let payload = self.snapshot(delta_secs)?;
        self.hub.publish(WORLD_OBSERVER, payload, self.settings.synchronous_mode).await;
        self.note_flags_told();
        Ok(())
    }

    /// Sends the first frame of a new episode to all clients.
    pub(crate) async fn show_episode(&mut self) {
        self.hub.publish_last(WORLD_OBSERVER).await;
        self.note_flags_told();
    }

    /// All who listen have been told what they have to ask for again.
    fn note_flags_told(&mut self) {
        self.map_is_new = false;
        self.lamps.note_told();
    }

    /// The newest frame as clients read it.
    ///
    /// # Errors
    /// There is no episode.
    pub(super) fn snapshot(&mut self, delta_secs: f64) -> Result<Vec<u8>, Refusal> {
        let moment = Moment {
            frame_number: self.frame_number,
            episode_id: self.episodes_begun,
            delta_secs,
            platform_secs: self.started.elapsed().as_secs_f64(),
            flags: self.flags(),
            has_limit_signs: self.known_episode()?.has_limit_signs,
        };
        let episode = self.known_episode()?;
        Ok(snapshot::encode(&episode.frame, &moment, |id| Signal {
            id: episode.signal(id),
            replayed: episode.replayed_light(id),
        }))
    }

    /// What clients have to ask for again.
    fn flags(&self) -> u32 {
        let map = if self.map_is_new { MAP_CHANGED } else { 0 };
        let lights = if self.lamps.are_new() { LIGHTS_CHANGED } else { 0 };
        map | lights
    }

    /// Sends measurements to those who listen to their sensors.
    pub(super) async fn tell_sensors(&mut self, data: &[SensorDatum]) {
        let waits = self.settings.synchronous_mode;
        for datum in data {
            let Some(episode) = &self.episode else { return };
            let Some(stream) = episode.stream(datum.sensor) else { continue };
            let state = episode.state(datum.sensor);
            let carrier = state.and_then(|sensor| episode.actor(sensor.parent?));
            let nobody = Actor::default();
            let actor_of = |id: Option<ActorId>, tag| {
                let known = id.and_then(|id| episode.actor(id)).cloned();
                known.unwrap_or_else(|| catalogue::scenery(tag))
            };
            let carrier = carrier.unwrap_or(&nobody);
            let told = crate::sensors::Told {
                frame_number: self.frame_number,
                extra_gravity_mps2: self.imui_gravity_mps2 - GRAVITY_MPS2,
            };
            let turned = self.config.latitudes.told(&episode.map, &datum.measurement);
            let turned = turned.map(|measurement| SensorDatum { measurement, ..datum.clone() });
            let datum = turned.as_ref().unwrap_or(datum);
            let payload = crate::sensors::encode(datum, &told, carrier, actor_of);
            if let Some(payload) = payload {
                self.hub.publish(stream, payload, waits).await;
            }
        }
    }
}

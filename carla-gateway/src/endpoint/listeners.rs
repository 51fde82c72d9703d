//! Who listens to sensors, or is about to: a sensor measures only while somebody does.

use std::time::Duration;

use schemas::{ActorId, Command};
use tokio::time::Instant;

use super::Endpoint;
use crate::stream::WORLD_OBSERVER;

/// How long a tick waits for a client that asked for a token.
const PATIENCE: Duration = Duration::from_millis(500);

impl Endpoint {
    /// A stream has lost its last listener.
    pub(super) fn note_deserted(&mut self, stream: u32) {
        let sensor = self.episode.as_ref().and_then(|episode| episode.sensor(stream));
        if let Some(sensor) = sensor
            && !self.is_wanted(sensor)
        {
            self.pending.push(Command::Listen { sensor, on: false });
        }
    }

    /// Whether anybody listens to a sensor, or is on the way.
    fn is_wanted(&self, sensor: ActorId) -> bool {
        let streams = self.episode.iter().flat_map(|episode| episode.streams_of(sensor.get()));
        streams.into_iter().any(|stream| {
            self.expected.contains_key(&stream) || self.hub.listener_count(stream) > 0
        })
    }

    /// A client will listen to a stream within a moment: the next tick waits for it.
    pub(crate) fn expect_listener(&mut self, stream: u32) {
        let sensor = self.episode.as_ref().and_then(|episode| episode.sensor(stream));
        if let Some(sensor) = sensor
            && self.hub.listener_count(stream) == 0
            && !self.expected.contains_key(&stream)
        {
            self.pending.push(Command::Listen { sensor, on: true });
        }
        if sensor.is_none() && stream != WORLD_OBSERVER {
            return;
        }
        let now = Instant::now();
        let (comings, until) =
            self.expected.entry(stream).or_insert_with(|| (self.hub.comings(stream), now));
        (*comings, *until) = (*comings + 1, now + PATIENCE);
    }

    /// Waits for those who are on the way.
    pub(super) async fn await_listeners(&mut self) {
        for (stream, (comings, until)) in std::mem::take(&mut self.expected) {
            self.hub.wait_for(stream, comings, until).await;
            self.note_deserted(stream);
        }
    }
}

//! Who listens to sensors, or is about to: a sensor measures only while somebody does.

use std::collections::BTreeMap;
use std::time::Duration;

use schemas::{ActorId, Command, SensorCommand};
use tokio::time::Instant;

use super::Endpoint;
use crate::rpc::ConnectionId;
use crate::stream::{StreamId, WORLD_OBSERVER};

/// How long a tick waits for a client that asked for a token.
const PATIENCE: Duration = Duration::from_millis(500);
/// Listeners that may be on the way; for more nobody waits.
const EXPECTED_MAX: usize = 4_096;

/// Listeners that are on the way, by stream and by the client that has asked for the token.
#[derive(Debug, Default)]
pub(super) struct Expected(BTreeMap<(StreamId, ConnectionId), Awaited>);

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Awaited {
    /// How many will have come to the stream then.
    comings: u64,
    until: Instant,
}

/// For whom to wait.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Whose {
    /// Everybody's listeners.
    All,
    /// Those of the client that ticks. Whoever else asks for tokens holds nobody up.
    Of(Option<ConnectionId>),
}

impl Expected {
    /// A client will come to a stream, to which so many have come yet.
    fn add(&mut self, stream: StreamId, client: ConnectionId, came: u64, until: Instant) {
        if self.0.len() >= EXPECTED_MAX {
            return;
        }
        let awaited = self.of(stream).map(|(_, awaited)| awaited.comings).max();
        let comings = awaited.unwrap_or(0).max(came) + 1;
        self.0.insert((stream, client), Awaited { comings, until });
    }

    /// Whether somebody is on the way to a stream.
    fn has(&self, stream: StreamId) -> bool {
        self.of(stream).next().is_some()
    }

    /// Takes out those that are to be waited for now, and those whose time is over.
    fn take(&mut self, whose: Whose, now: Instant) -> Vec<(StreamId, Awaited)> {
        let is_due = |(_, client): &(StreamId, ConnectionId), awaited: &mut Awaited| match whose {
            Whose::All => true,
            Whose::Of(ticking) => ticking == Some(*client) || awaited.until <= now,
        };
        let due = self.0.extract_if(.., is_due);
        due.map(|((stream, _), awaited)| (stream, awaited)).collect()
    }

    /// Nobody comes to a stream any more.
    pub(super) fn forget(&mut self, stream: StreamId) {
        self.0.retain(|(expected, _), _| *expected != stream);
    }

    /// Nobody comes to any stream any more.
    pub(super) fn clear(&mut self) {
        self.0.clear();
    }

    fn of(&self, stream: StreamId) -> impl Iterator<Item = (&(StreamId, ConnectionId), &Awaited)> {
        self.0.range((stream, ConnectionId(0))..=(stream, ConnectionId(u64::MAX)))
    }
}

impl Endpoint {
    /// Sensors whose listeners have gone measure no longer.
    pub(super) fn note_deserted_streams(&mut self) {
        for stream in self.hub.take_deserted() {
            self.note_deserted(stream);
        }
    }

    fn note_deserted(&mut self, stream: StreamId) {
        let sensor = self.episode.as_ref().and_then(|episode| episode.sensor(stream));
        if let Some(sensor) = sensor
            && !self.is_wanted(sensor)
        {
            self.pending.push(Command::Sensor(SensorCommand::Listen { sensor, on: false }));
        }
    }

    /// Whether anybody listens to a sensor, or is on the way.
    pub(super) fn is_wanted(&self, sensor: ActorId) -> bool {
        let streams = self.episode.iter().flat_map(|episode| episode.streams_of(sensor));
        let is_wanted = |stream| self.expected.has(stream) || self.hub.listener_count(stream) > 0;
        streams.into_iter().any(is_wanted)
    }

    /// The caller will listen to a stream within a moment: its next tick waits for it.
    pub(crate) fn expect_listener(&mut self, stream: StreamId) {
        let Some(client) = self.present.brief.caller else { return };
        let sensor = self.episode.as_ref().and_then(|episode| episode.sensor(stream));
        if let Some(sensor) = sensor
            && self.hub.listener_count(stream) == 0
            && !self.expected.has(stream)
        {
            self.pending.push(Command::Sensor(SensorCommand::Listen { sensor, on: true }));
        }
        if sensor.is_some() || stream == WORLD_OBSERVER {
            let until = Instant::now() + PATIENCE;
            self.expected.add(stream, client, self.hub.comings(stream), until);
        }
    }

    /// Waits for those who are on the way.
    pub(super) async fn await_listeners(&mut self, whose: Whose) {
        for (stream, Awaited { comings, until }) in self.expected.take(whose, Instant::now()) {
            self.hub.wait_for(stream, comings, until).await;
            self.note_deserted(stream);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ONE: ConnectionId = ConnectionId(1);
    const OTHER: ConnectionId = ConnectionId(2);

    fn streams(awaited: Vec<(StreamId, Awaited)>) -> Vec<u32> {
        awaited.into_iter().map(|(stream, _)| stream.0).collect()
    }

    #[test]
    fn a_tick_waits_for_listeners_of_the_client_that_ticks_and_for_no_others() {
        let (mut expected, now) = (Expected::default(), Instant::now());
        expected.add(StreamId(7), ONE, 0, now + PATIENCE);
        expected.add(StreamId(8), OTHER, 0, now + PATIENCE);
        assert_eq!(streams(expected.take(Whose::Of(None), now)), [0; 0]);
        assert_eq!(streams(expected.take(Whose::Of(Some(ONE)), now)), [7]);
        assert!(expected.has(StreamId(8)) && !expected.has(StreamId(7)));
        assert_eq!(streams(expected.take(Whose::All, now)), [8]);
    }

    #[test]
    fn who_never_comes_is_forgotten_by_the_ticks_of_others() {
        let (mut expected, now) = (Expected::default(), Instant::now());
        expected.add(StreamId(7), ONE, 0, now + PATIENCE);
        assert_eq!(streams(expected.take(Whose::Of(Some(OTHER)), now + PATIENCE)), [7]);
        assert!(!expected.has(StreamId(7)));
    }

    #[test]
    fn each_of_several_who_come_to_one_stream_is_waited_for() {
        let (mut expected, now) = (Expected::default(), Instant::now());
        expected.add(StreamId(7), ONE, 3, now);
        expected.add(StreamId(7), OTHER, 3, now);
        let comings = |(_, awaited): &(StreamId, Awaited)| awaited.comings;
        let wanted: Vec<u64> = expected.take(Whose::All, now).iter().map(comings).collect();
        assert_eq!(wanted, [4, 5]);
    }

    #[test]
    fn no_more_are_expected_than_there_is_room_for() {
        let (mut expected, now) = (Expected::default(), Instant::now());
        for client in 0..2 * EXPECTED_MAX as u64 {
            expected.add(StreamId(7), ConnectionId(client), 0, now);
        }
        assert_eq!(expected.0.len(), EXPECTED_MAX);
    }
}

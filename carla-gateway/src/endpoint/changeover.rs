//! A client loads a world while Traffic Managers run in it.
//!
//! The client library begins its Traffic Managers anew, on the new map, when a snapshot of another
//! episode reaches it. But with the answer to its load it throws its own episode away for a moment,
//! and a Traffic Manager that looks for the newest snapshot then ends the process; in asynchronous
//! mode they look all the time. So the order is: all clients get the first snapshot of the new
//! episode; the Traffic Managers change over, at the end of which they read the settings; these
//! reads wait; the load is answered; the client gets to know its new episode and reads the settings
//! itself, and with it all go on.

use std::time::Duration;

use tokio::time::Instant;

use super::Endpoint;
use super::loading::QUIET_AFTER_LOAD;
use crate::calls;
use crate::rpc::{Answer, Connection, ConnectionId, Meta, Request};
use crate::stream::WORLD_OBSERVER;

/// How long Traffic Managers may take; they make their own picture of the map.
const PATIENCE: Duration = Duration::from_secs(8);
/// From the first sign that they have: the thread that receives snapshots ends the process if its
/// stream is closed while it is still about this one.
const SETTLING: Duration = Duration::from_millis(150);
/// How long the client may take from the answer to its own read of the settings.
const RETURN_PATIENCE: Duration = Duration::from_secs(2);
/// The folder whose files a Traffic Manager asks for when it has the map.
const TRAFFIC_FOLDER: &str = "TM";

/// One client that changes over.
pub(super) struct Changeover {
    connection: Connection,
    /// The load, and its answer, until that is given.
    load: Option<(Request, Answer)>,
    /// Traffic Managers that have not got the map yet.
    without_map: usize,
    until: Instant,
}

impl Changeover {
    /// Who changes over.
    pub(super) fn client(&self) -> ConnectionId {
        self.connection.id
    }

    /// When to go on without whom it waits for.
    pub(super) fn due(&self) -> Instant {
        self.until
    }

    /// Whether the client still waits for the answer to its load.
    pub(super) fn is_loading(&self) -> bool {
        self.load.is_some()
    }
}

impl Endpoint {
    /// A load is done: answers it once the Traffic Managers of the client have changed over.
    pub(super) async fn change_over(
        &mut self,
        connection: Connection,
        load: Request,
        answer: Answer,
    ) {
        self.end_changeover();
        self.end_changeover();
        let now = Instant::now();
        let without_map = self.traffic_managers.count(connection.id);
        self.traffic_managers.note_frame(connection.id, now);
        let load = Some((load, answer));
        self.changeover = Some(Changeover { connection, load, without_map, until: now + PATIENCE });
        self.hub.publish_last(WORLD_OBSERVER).await;
        self.note_flags_told();
    }

    /// A client is about to get an answer.
    pub(super) fn note_changeover(&mut self, client: ConnectionId, request: &Request) {
        let Some(changeover) = self.changeover.as_mut() else { return };
        if changeover.connection.id != client {
            return;
        }
        match request.method.as_str() {
            "get_required_files" if asks_for_traffic(request) => {
                // From here on a Traffic Manager may be silent for longer than one that sleeps.
                self.traffic_managers.note_batch(client);
                changeover.without_map = changeover.without_map.saturating_sub(1);
                if changeover.without_map == 0 {
                    changeover.connection.gate.shut();
                }
            }
            "get_episode_info" => changeover.connection.gate.unlock(),
            _ => {}
        }
    }

    /// A client has read the settings, or waits for them.
    pub(super) fn note_read(&mut self, client: ConnectionId) {
        let Some(changeover) = self.changeover.as_mut() else { return };
        let is_waited_at = changeover.connection.gate.is_waited_at();
        if changeover.connection.id != client || changeover.is_loading() != is_waited_at {
            return;
        }
        if is_waited_at {
            changeover.until = changeover.until.min(Instant::now() + SETTLING);
        } else {
            self.changeover = None;
        }
    }

    /// Goes on without whom it waits for in vain.
    pub(super) fn hurry_changeover(&mut self) {
        if self.changeover.as_ref().is_some_and(|changeover| changeover.until <= Instant::now()) {
            self.end_changeover();
        }
    }

    /// Answers the load, or what still waits after it.
    fn end_changeover(&mut self) {
        let Some(mut changeover) = self.changeover.take() else { return };
        let now = Instant::now();
        let Connection { outbox, gate, .. } = &changeover.connection;
        if let Some((load, answer)) = changeover.load.take() {
            gate.shut();
            outbox.answer(&load, &answer);
            self.last_tick = now + QUIET_AFTER_LOAD;
            changeover.until = now + RETURN_PATIENCE;
            self.changeover = Some(changeover);
        } else {
            for read in gate.open() {
                if let Some(answer) = calls::at_once(&read, self.settings()) {
                    outbox.answer(&read, &answer);
                }
            }
        }
    }
}

fn asks_for_traffic(request: &Request) -> bool {
    request.args::<(Meta, String)>().is_ok_and(|(_, folder)| folder == TRAFFIC_FOLDER)
}

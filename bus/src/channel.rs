//! Fast channels: a shortcut to one service where there is one, and queries where there is none.

use std::time::{Duration, Instant};

use schemas::{Error, ErrorCode, Reply, Request, ServiceId, ServiceKind, keys, limits, wire};
use tokio::sync::watch;
use zenoh::pubsub::Subscriber;
use zenoh::sample::{Sample, SampleKind};

use crate::query::ask;
use crate::session::reply_of;
use crate::shortcut::Shortcut;
use crate::{Bus, BusError};

/// Between two greetings of a service that has not answered yet, and until it counts as absent.
const GREETING_PAUSE: Duration = Duration::from_millis(50);
const GREETING_DEADLINE: Duration = Duration::from_secs(5);

/// A fast way to one service. Cheap to ask; one per service is enough for a process.
pub struct Channel {
    bus: Bus,
    key: String,
    shortcut: Option<Shortcut>,
    is_gone: watch::Receiver<bool>,
    _presence: Subscriber<()>,
}

impl Bus {
    /// Opens a fast way to what an announced service serves under a key, with
    /// [`serve`](Self::serve) and, for those on the same machine,
    /// [`serve_shortcut`](Self::serve_shortcut).
    ///
    /// # Errors
    /// [`BusError::Declare`] when the bus refuses, or when the service does not answer.
    pub async fn channel(
        &self,
        key: &str,
        (kind, id): (ServiceKind, &ServiceId),
    ) -> Result<Channel, BusError> {
        let alive = keys::alive(kind, id);
        let (gone, is_gone) = watch::channel(false);
        let on_presence = move |sample: Sample| {
            gone.send_replace(sample.kind() == SampleKind::Delete);
        };
        let presence = self.session.liveliness().declare_subscriber(&alive).callback(on_presence);
        let presence = presence
            .await
            .map_err(|cause| BusError::Declare { key: key.to_owned(), cause: cause.to_string() })?;
        self.greet(&alive).await?;
        Ok(Channel {
            bus: self.clone(),
            key: key.to_owned(),
            shortcut: self.shortcut(key).await,
            is_gone,
            _presence: presence,
        })
    }

    /// Waits until a service says what it is: its keys may be known later than its presence.
    async fn greet(&self, alive: &str) -> Result<(), BusError> {
        let begun = Instant::now();
        loop {
            let bytes_max = limits::REQUEST_BYTES_MAX;
            let pause = GREETING_PAUSE;
            match ask(&self.session, alive, Vec::new(), bytes_max, pause).await {
                Ok(_) => return Ok(()),
                Err(error) if begun.elapsed() > GREETING_DEADLINE => {
                    let (key, cause) = (alive.to_owned(), error.to_string());
                    return Err(BusError::Declare { key, cause });
                }
                // An error of the transport comes at once; it is not asked again in a hurry.
                Err(error) if error.code == ErrorCode::Unreachable => {
                    tokio::time::sleep(pause).await;
                }
                Err(_) => {}
            }
        }
    }
}

impl Channel {
    /// [`Bus::request`] on the channel's key.
    ///
    /// By a shortcut it waits also for a service that is not heard on the bus: while its process
    /// lives, and until the deadline. On the bus silence is all there is to tell that one is gone.
    ///
    /// # Errors
    /// As for [`Bus::request`].
    pub async fn request(&self, request: &Request, deadline: Duration) -> Result<Reply, Error> {
        let payload = wire::encode_request(request);
        // Never asks twice: the first question may have been heard by a service that is gone.
        let asked_at = Instant::now();
        if let Some(shortcut) = &self.shortcut
            && let Ok(connection) = shortcut.connect_within(deadline).await
        {
            let left = deadline.saturating_sub(asked_at.elapsed());
            let asked = connection.ask(&payload, left).await;
            return reply_of(&asked.map_err(|cause| self.unreachable().found(cause))??);
        }
        let mut is_gone = self.is_gone.clone();
        let deadline = deadline.saturating_sub(asked_at.elapsed());
        tokio::select! {
            biased;
            _ = is_gone.wait_for(|is_gone| *is_gone) => Err(self.unreachable()),
            answer = self.bus.request_bytes(&self.key, payload, deadline) => answer,
        }
    }

    /// Whether the service is on this machine, so that there can be proof that it lives though the
    /// bus does not hear it.
    pub fn has_shortcut(&self) -> bool {
        self.shortcut.is_some()
    }

    /// Returns once nobody listens at the shortcut, at once where there is none.
    pub async fn until_dead(&self) {
        if let Some(shortcut) = &self.shortcut {
            shortcut.until_closed().await;
        }
    }

    fn unreachable(&self) -> Error {
        Error::new(ErrorCode::Unreachable, format!("nobody answers on {:?}", self.key))
    }
}

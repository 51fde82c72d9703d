//! The way to one service that is asked often: a shortcut where there is one, else queries.

use std::time::{Duration, Instant};

use schemas::{Error, ErrorCode, Reply, Request, ServiceId, ServiceKind, keys, limits, wire};
use tokio::sync::watch;
use zenoh::pubsub::Subscriber;
use zenoh::sample::{Sample, SampleKind};

use crate::query::ask;
use crate::session::reply_of;
use crate::shortcut::Shortcut;
use crate::{Bus, BusError};

/// How long one greeting of a service waits for its answer.
const GREETING_DEADLINE: Duration = Duration::from_millis(500);
/// After a greeting that was not answered, the first; each further one is twice as long.
const GREETING_PAUSE: Duration = Duration::from_millis(50);
/// The last of them: all take 1.6 s where nobody is there, 4.6 s where answers are late.
const GREETING_PAUSE_MAX: Duration = Duration::from_millis(800);

/// A fast way to one service. Cheap to ask; one per service is enough for a process.
pub struct Channel {
    bus: Bus,
    key: String,
    shortcut: Option<Shortcut>,
    heard: watch::Receiver<Heard>,
    _presence: Subscriber<()>,
}

/// Whether the bus hears a service.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Heard {
    is_gone: bool,
    /// How often it has gone: one that is back at once is not seen to be gone.
    goings: u64,
}

impl Heard {
    fn note(&mut self, change: SampleKind) {
        self.is_gone = change == SampleKind::Delete;
        self.goings += u64::from(self.is_gone);
    }

    /// Whether what was asked then may be answered by nobody.
    fn has_gone_since(&self, then: Self) -> bool {
        self.is_gone || self.goings != then.goings
    }
}

impl Bus {
    /// Opens a fast way to what an announced service serves under a key, with
    /// [`serve`](Self::serve) and, for those on the same machine,
    /// [`serve_shortcut`](Self::serve_shortcut).
    ///
    /// # Errors
    /// [`BusError::Declare`] when the bus refuses.
    pub async fn channel(
        &self,
        key: &str,
        (kind, id): (ServiceKind, &ServiceId),
    ) -> Result<Channel, BusError> {
        let alive = keys::alive(kind, id);
        let (noted, heard) = watch::channel(Heard::default());
        let on_presence =
            move |sample: Sample| noted.send_modify(|heard| heard.note(sample.kind()));
        let presence = self.session.liveliness().declare_subscriber(&alive).callback(on_presence);
        let presence = presence
            .await
            .map_err(|cause| BusError::Declare { key: key.to_owned(), cause: cause.to_string() })?;
        self.greet(&alive).await;
        Ok(Channel {
            bus: self.clone(),
            key: key.to_owned(),
            shortcut: self.shortcut(key).await,
            heard,
            _presence: presence,
        })
    }

    /// Waits a while until a service says what it is: its keys may be known later than its
    /// presence, and that of its shortcut is asked for only once.
    async fn greet(&self, alive: &str) {
        let mut pause = GREETING_PAUSE;
        loop {
            let (bytes_max, deadline) = (limits::REQUEST_BYTES_MAX, GREETING_DEADLINE);
            match ask(&self.session, alive, Vec::new(), bytes_max, deadline).await {
                Ok(_) => return,
                Err(error) => tracing::debug!(alive, %error, "it does not say what it is"),
            }
            if pause > GREETING_PAUSE_MAX {
                return;
            }
            tokio::time::sleep(pause).await;
            pause *= 2;
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
        let question = wire::encode_request(request);
        reply_of(&self.ask(&question, limits::REQUEST_BYTES_MAX, deadline).await?)
    }

    /// The same with any question, and the reply as it came. Asks once: a service that is gone may
    /// have heard the question.
    pub(crate) async fn ask(
        &self,
        question: &[u8],
        question_bytes_max: usize,
        deadline: Duration,
    ) -> Result<Vec<u8>, Error> {
        let asked_at = Instant::now();
        let left = || deadline.saturating_sub(asked_at.elapsed());
        if let Some(shortcut) = &self.shortcut
            && let Ok(connection) = shortcut.connect_within(deadline).await
        {
            let asked = connection.ask(question, left()).await;
            return asked.map_err(|cause| self.unreachable().found(cause))?;
        }
        let (session, question) = (&self.bus.session, question.to_vec());
        self.while_heard(ask(session, &self.key, question, question_bytes_max, left())).await
    }

    /// An answer of this service, by whichever key it was asked, as long as the bus hears it. A
    /// question that is on its way when the service or a router dies may be lost without a word.
    ///
    /// # Errors
    /// As asked, or [`ErrorCode::Unreachable`].
    pub async fn while_heard<T>(
        &self,
        asked: impl Future<Output = Result<T, Error>>,
    ) -> Result<T, Error> {
        let mut heard = self.heard.clone();
        let then = *heard.borrow();
        tokio::select! {
            biased;
            _ = heard.wait_for(|heard| heard.has_gone_since(then)) => Err(self.unreachable()),
            answer = asked => answer,
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_that_was_gone_for_a_moment_has_lost_what_it_was_asked_before() {
        let mut heard = Heard::default();
        let then = heard;
        assert!(!heard.has_gone_since(then));
        // Told again that it is up, as it comes by another router.
        heard.note(SampleKind::Put);
        assert!(!heard.has_gone_since(then));
        heard.note(SampleKind::Delete);
        assert!(heard.has_gone_since(then) && heard.has_gone_since(heard));
        heard.note(SampleKind::Put);
        assert!(heard.has_gone_since(then) && !heard.has_gone_since(heard));
    }
}

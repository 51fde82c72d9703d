//! The fast lane: questions and answers as pairs of publications over a low-latency transport.
//!
//! A query of the transport costs three timers and a second message that says that no more answers
//! come; the usual transport hands every message to a thread that sends. A lane has neither:
//! whoever asks or answers writes to the socket himself. In return it carries only small messages
//! (larger answers travel in parts, larger questions as queries), and it must notice itself when
//! the service is gone. Who answers an asker that takes nothing waits once the system's buffers are
//! full: lanes are for services that read, with few questions under way.

use std::collections::BTreeMap;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use schemas::{Error, ErrorCode, Reply, Request, ServiceId, ServiceKind, keys, limits, wire};
use tokio::sync::oneshot;
use zenoh::Wait;
use zenoh::key_expr::KeyExpr;
use zenoh::pubsub::Subscriber;
use zenoh::sample::{Sample, SampleKind};

use crate::query::timed_out;
use crate::session::reply_of;
use crate::shortcut::{Passage, Shortcut};
use crate::{Bus, BusError};

/// Bytes of one publication. The low-latency transport loses messages of 49,000 bytes and more
/// without a word.
pub(crate) const PART_BYTES: usize = 40 * 1024;
/// Between two greetings of a service that has not answered yet, and until it counts as absent.
const GREETING_PAUSE: Duration = Duration::from_millis(50);
const GREETING_DEADLINE: Duration = Duration::from_secs(5);

/// Lanes this process has opened.
static LANES: AtomicU64 = AtomicU64::new(0);

/// A fast way to one service. Cheap to ask; one per service is enough for a process.
pub struct Lane {
    bus: Bus,
    fast: zenoh::Session,
    key: KeyExpr<'static>,
    asker: String,
    asked: Arc<Asked>,
    /// Taken instead where there is one.
    shortcut: Option<Shortcut>,
    _answers: Subscriber<()>,
    _presence: Subscriber<()>,
}

/// Questions that wait for their answers; bounded by those who ask, each of whom has a deadline.
#[derive(Default)]
struct Asked {
    state: Mutex<State>,
}

#[derive(Default)]
struct State {
    next: u64,
    waiting: BTreeMap<u64, Waiting>,
    is_gone: bool,
}

struct Waiting {
    sender: oneshot::Sender<Vec<u8>>,
    received: Vec<u8>,
}

/// A question's place among those that wait; given up when the asker goes away.
struct Ticket<'a> {
    asked: &'a Asked,
    number: u64,
    answer: oneshot::Receiver<Vec<u8>>,
}

impl Bus {
    /// Opens a fast way to the key that a service serves with [`serve_lane`](Self::serve_lane).
    ///
    /// # Errors
    /// [`BusError::Declare`] and [`BusError::Connect`] when the bus refuses, or when the service
    /// does not answer.
    pub async fn lane(
        &self,
        key: &str,
        (kind, id): (ServiceKind, &ServiceId),
    ) -> Result<Lane, BusError> {
        let declare_error = |cause: zenoh::Error| BusError::Declare {
            key: key.to_owned(),
            cause: cause.to_string(),
        };
        let fast = self.fast_session().await?;
        let asked = Arc::new(Asked::default());
        // Several lanes of one process keep their answers apart.
        let asker = format!("{}-{}", fast.zid(), LANES.fetch_add(1, Ordering::Relaxed));
        let on_answer = {
            let asked = Arc::clone(&asked);
            move |sample: Sample| asked.take_part(&sample)
        };
        let answers = fast.declare_subscriber(keys::batch_answer(&asker)).callback(on_answer);
        let answers = answers.await.map_err(declare_error)?;
        let on_presence = {
            let asked = Arc::clone(&asked);
            move |sample: Sample| {
                if sample.kind() == SampleKind::Delete {
                    asked.give_up();
                }
            }
        };
        let presence = self.session.liveliness().declare_subscriber(keys::alive(kind, id));
        let presence = presence.callback(on_presence).await.map_err(declare_error)?;
        let key = KeyExpr::try_from(key.to_owned()).map_err(declare_error)?;
        let mut lane = Lane {
            bus: self.clone(),
            fast,
            key,
            asker,
            asked,
            shortcut: None,
            _answers: answers,
            _presence: presence,
        };
        lane.greet().await?;
        lane.shortcut = self.shortcut(&lane.key).await;
        Ok(lane)
    }
}

impl Lane {
    /// [`Bus::request`] on the lane's key.
    ///
    /// # Errors
    /// As for [`Bus::request`].
    pub async fn request(&self, request: &Request, deadline: Duration) -> Result<Reply, Error> {
        let payload = wire::encode_request(request);
        if let Some(shortcut) = &self.shortcut
            && let Ok(passage) = shortcut.enter().await
        {
            return reply_of(&self.ask_past_the_bus(passage, &payload, deadline).await?);
        }
        if payload.len() > PART_BYTES {
            return self.bus.request_bytes(&self.key, payload, deadline).await;
        }
        reply_of(&self.ask(payload, deadline).await?)
    }

    /// Never asks twice: the first question may have been heard by a service that is gone.
    async fn ask_past_the_bus(
        &self,
        passage: Passage<'_>,
        payload: &[u8],
        deadline: Duration,
    ) -> Result<Vec<u8>, Error> {
        let mut ticket = self.asked.ticket().ok_or_else(|| self.unreachable())?;
        tokio::select! {
            asked = passage.ask(payload, deadline) => {
                asked.map_err(|cause| self.unreachable().found(cause))?
            }
            // Of a service that stands still only the bus takes notice.
            _ = &mut ticket.answer => Err(self.unreachable()),
        }
    }

    async fn ask(&self, payload: Vec<u8>, deadline: Duration) -> Result<Vec<u8>, Error> {
        let mut ticket = self.asked.ticket().ok_or_else(|| self.unreachable())?;
        let mut note = ticket.number.to_le_bytes().to_vec();
        note.extend(self.asker.as_bytes());
        let put = self.fast.put(&self.key, payload).express(true).attachment(note);
        put.wait().map_err(|cause| self.unreachable().found(cause))?;
        match tokio::time::timeout(deadline, &mut ticket.answer).await {
            Ok(Ok(answer)) => Ok(answer),
            Ok(Err(_)) => Err(self.unreachable()),
            Err(_) => Err(timed_out(&self.key, deadline)),
        }
    }

    /// Waits until the service answers: its subscription may be known later than its presence.
    async fn greet(&self) -> Result<(), BusError> {
        let begun = Instant::now();
        loop {
            match self.ask(Vec::new(), GREETING_PAUSE).await {
                Ok(_) => return Ok(()),
                Err(error) if begun.elapsed() > GREETING_DEADLINE => {
                    let (key, cause) = (self.key.to_string(), error.to_string());
                    return Err(BusError::Declare { key, cause });
                }
                // An error of the transport comes at once; it is not asked again in a hurry.
                Err(error) if error.code == ErrorCode::Unreachable => {
                    tokio::time::sleep(GREETING_PAUSE).await;
                }
                Err(_) => {}
            }
        }
    }

    fn unreachable(&self) -> Error {
        Error::new(ErrorCode::Unreachable, format!("nobody answers on {:?}", self.key.as_str()))
    }
}

impl Asked {
    fn lock(&self) -> MutexGuard<'_, State> {
        // Nothing panics while it holds the lock.
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// `None` when the service is gone.
    fn ticket(&self) -> Option<Ticket<'_>> {
        let (sender, answer) = oneshot::channel();
        let mut state = self.lock();
        if state.is_gone {
            return None;
        }
        state.next += 1;
        let number = state.next;
        state.waiting.insert(number, Waiting { sender, received: Vec::new() });
        Some(Ticket { asked: self, number, answer })
    }

    fn take_part(&self, sample: &Sample) {
        let note = sample.attachment().and_then(|note| AnswerNote::read(&note.to_bytes()));
        let Some(AnswerNote { number, bytes }) = note else {
            return tracing::debug!("an answer that belongs to no question");
        };
        let part = sample.payload().to_bytes();
        let mut state = self.lock();
        // Whoever asked may have gone away meanwhile; then nobody wants the answer.
        let Some(waiting) = state.waiting.get_mut(&number) else { return };
        if waiting.received.is_empty() {
            waiting.received.reserve_exact(bytes);
        }
        waiting.received.extend_from_slice(&part);
        if waiting.received.len() < bytes {
            return;
        }
        let whole = state.waiting.remove(&number);
        drop(state);
        if let Some(Waiting { sender, received }) = whole {
            let _ = sender.send(received);
        }
    }

    /// The service is gone: nobody who waits will be answered.
    fn give_up(&self) {
        let mut state = self.lock();
        state.is_gone = true;
        state.waiting.clear();
    }
}

impl Drop for Ticket<'_> {
    fn drop(&mut self) {
        self.asked.lock().waiting.remove(&self.number);
    }
}

/// What travels beside a question: its number, and where its answer goes.
pub(crate) struct QuestionNote {
    pub(crate) number: u64,
    pub(crate) answer_key: KeyExpr<'static>,
}

impl QuestionNote {
    pub(crate) fn read(note: &[u8]) -> Option<Self> {
        let (number, asker) = note.split_first_chunk()?;
        let asker = std::str::from_utf8(asker).ok()?;
        let is_plain = |c: u8| c.is_ascii_alphanumeric() || c == b'-';
        if asker.is_empty() || asker.len() > ASKER_BYTES_MAX || !asker.bytes().all(is_plain) {
            return None;
        }
        let answer_key = KeyExpr::try_from(keys::batch_answer(asker)).ok()?;
        Some(Self { number: u64::from_le_bytes(*number), answer_key })
    }
}

/// Characters of an asker's name.
const ASKER_BYTES_MAX: usize = 64;

/// What travels beside each part of an answer: the question's number and the size of the whole.
struct AnswerNote {
    number: u64,
    bytes: usize,
}

impl AnswerNote {
    fn read(note: &[u8]) -> Option<Self> {
        let (number, bytes) = note.split_first_chunk()?;
        let bytes = u64::from_le_bytes(bytes.try_into().ok()?);
        let bytes =
            usize::try_from(bytes).ok().filter(|bytes| *bytes <= limits::REPLY_BYTES_MAX)?;
        Some(Self { number: u64::from_le_bytes(*number), bytes })
    }

    fn write(&self) -> Vec<u8> {
        [self.number.to_le_bytes(), (self.bytes as u64).to_le_bytes()].concat()
    }
}

/// Sends an answer, in parts if it is large.
pub(crate) fn answer(session: &zenoh::Session, to: &QuestionNote, answer: Vec<u8>) {
    let note = AnswerNote { number: to.number, bytes: answer.len() }.write();
    let put = |part: zenoh::bytes::ZBytes| {
        session.put(&to.answer_key, part).express(true).attachment(note.clone()).wait()
    };
    let sent = if answer.len() <= PART_BYTES {
        put(answer.into())
    } else {
        answer.chunks(PART_BYTES).try_for_each(|part| put(part.into()))
    };
    if let Err(cause) = sent {
        tracing::debug!(key = to.answer_key.as_str(), %cause, "the asker is gone");
    }
}

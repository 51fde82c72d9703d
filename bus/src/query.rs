//! One question, one answer, one deadline.

use std::sync::{Mutex, PoisonError};
use std::time::Duration;

use schemas::wire;
use schemas::{Error, ErrorCode, Reply};
use tokio::sync::oneshot;
use zenoh::Session;
use zenoh::query::{ConsolidationMode, QueryTarget, ReplyError};
use zenoh::sample::{Locality, Sample};

/// The transport forgets a question this much later than the asker does, so that the asker's own
/// clock decides.
const GRACE: Duration = Duration::from_millis(200);

/// Sends `payload` to whoever serves `key` and waits for the first answer.
///
/// # Errors
/// Refusals of the other side, [`ErrorCode::Unreachable`], [`ErrorCode::TimedOut`],
/// [`ErrorCode::TooLarge`].
pub(crate) async fn ask(
    session: &Session,
    key: &str,
    payload: Vec<u8>,
    payload_bytes_max: usize,
    deadline: Duration,
) -> Result<Vec<u8>, Error> {
    let question = (key, payload, payload_bytes_max);
    put(session, question, QueryTarget::BestMatching, deadline).await
}

/// Asks all who serve `key`: the first answer counts that is no refusal.
///
/// # Errors
/// As for [`ask`]; a refusal when all refuse.
pub(crate) async fn ask_all(
    session: &Session,
    key: &str,
    payload: Vec<u8>,
    payload_bytes_max: usize,
    deadline: Duration,
) -> Result<Vec<u8>, Error> {
    put(session, (key, payload, payload_bytes_max), QueryTarget::All, deadline).await
}

/// Answers that are taken of one question to all who serve a key.
const ANSWERS_MAX: usize = 1_024;
/// Bytes of them together.
const ANSWER_BYTES_MAX: usize = 256 * 1024 * 1024;

/// All answers of all who serve `key` by the deadline, up to a bound.
///
/// # Errors
/// [`ErrorCode::Unreachable`] when nobody answers; the first refusal.
pub(crate) async fn ask_every(
    session: &Session,
    key: &str,
    payload: Vec<u8>,
    deadline: Duration,
) -> Result<Vec<Vec<u8>>, Error> {
    let question = session.get(key).payload(payload).express(true).target(QueryTarget::All);
    let question = question.consolidation(ConsolidationMode::None).timeout(deadline);
    let replies = question.await.map_err(|cause| cannot_ask(key, &cause))?;
    let (mut answers, mut bytes) = (Vec::new(), 0);
    while let Ok(reply) = replies.recv_async().await {
        if answers.len() >= ANSWERS_MAX || bytes > ANSWER_BYTES_MAX {
            tracing::warn!(key, bytes, "more is answered than is taken");
            break;
        }
        let answer = reply.into_result();
        let answer = answer.map_err(|no| error_of(key, deadline, &no.payload().to_bytes()))?;
        let answer = answer.payload().to_bytes().into_owned();
        bytes += answer.len();
        answers.push(answer);
    }
    if answers.is_empty() { Err(nobody_answers(key)) } else { Ok(answers) }
}

/// Whether anybody but this process answers on `key`.
pub(crate) async fn ask_others(session: &Session, key: &str, deadline: Duration) -> bool {
    let question = session.get(key).express(true).allowed_destination(Locality::Remote);
    let question = question.consolidation(ConsolidationMode::None).timeout(deadline);
    let Ok(replies) = question.await else { return false };
    replies.recv_async().await.is_ok_and(|reply| reply.result().is_ok())
}

/// What came so far. Dropped by the transport after the last answer: then a refusal counts, and
/// without one the asker learns that nobody answers.
struct Answers {
    asker: Option<oneshot::Sender<Answer>>,
    refusal: Option<Answer>,
}

type Answer = Result<Sample, ReplyError>;

impl Answers {
    fn take(&mut self, answer: Answer) {
        if answer.is_err() {
            self.refusal = Some(answer);
        } else {
            self.tell(answer);
        }
    }

    fn tell(&mut self, answer: Answer) {
        if let Some(asker) = self.asker.take() {
            // The asker may have gone away meanwhile; then nobody wants the answer.
            let _ = asker.send(answer);
        }
    }
}

impl Drop for Answers {
    fn drop(&mut self) {
        if let Some(refusal) = self.refusal.take() {
            self.tell(refusal);
        }
    }
}

async fn put(
    session: &Session,
    (key, payload, payload_bytes_max): (&str, Vec<u8>, usize),
    target: QueryTarget,
    deadline: Duration,
) -> Result<Vec<u8>, Error> {
    if payload.len() > payload_bytes_max {
        return Err(too_large(payload.len(), payload_bytes_max));
    }
    let (sender, receiver) = oneshot::channel();
    let answers = Mutex::new(Answers { asker: Some(sender), refusal: None });
    let on_reply = move |reply: zenoh::query::Reply| {
        // Nothing panics while it holds the lock.
        let mut answers = answers.lock().unwrap_or_else(PoisonError::into_inner);
        answers.take(reply.into_result());
    };
    let question = session
        .get(key)
        .payload(payload)
        .attachment(patience_out(deadline))
        .express(true)
        .target(target)
        // The first answer counts: it need not wait for the word that there are no others.
        .consolidation(ConsolidationMode::None)
        .timeout(deadline + GRACE)
        .callback(on_reply);
    question.await.map_err(|cause| cannot_ask(key, &cause))?;
    match tokio::time::timeout(deadline, receiver).await {
        Err(_) => Err(timed_out(key, deadline)),
        Ok(Err(_)) => Err(nobody_answers(key)),
        Ok(Ok(Ok(sample))) => Ok(sample.payload().to_bytes().into_owned()),
        Ok(Ok(Err(refusal))) => Err(error_of(key, deadline, &refusal.payload().to_bytes())),
    }
}

/// How long the asker of a question waits for the answer, as it goes along with the question.
fn patience_out(deadline: Duration) -> [u8; 4] {
    u32::try_from(deadline.as_millis()).unwrap_or(u32::MAX).to_le_bytes()
}

/// The inverse of [`patience_out`]; `None` for anything else.
pub(crate) fn patience_in(bytes: &[u8]) -> Option<Duration> {
    let millis = u32::from_le_bytes(bytes.try_into().ok()?);
    Some(Duration::from_millis(millis.into()))
}

fn too_large(found_bytes: usize, bytes_max: usize) -> Error {
    Error::new(ErrorCode::TooLarge, "the request is too large")
        .wanted(format_args!("at most {bytes_max} bytes"))
        .found(format_args!("{found_bytes} bytes"))
}

fn cannot_ask(key: &str, cause: &zenoh::Error) -> Error {
    Error::new(ErrorCode::Unreachable, format!("cannot ask {key:?}: {cause}"))
}

fn nobody_answers(key: &str) -> Error {
    Error::new(ErrorCode::Unreachable, format!("nobody answers on {key:?}"))
}

/// What a refusal says: the service's error, or a word of the transport.
fn error_of(key: &str, deadline: Duration, refusal: &[u8]) -> Error {
    if refusal == b"Timeout" { timed_out(key, deadline) } else { refusal_of(key, refusal) }
}

/// What a refusal of a service says.
pub(crate) fn refusal_of(key: &str, refusal: &[u8]) -> Error {
    match wire::decode_reply(refusal) {
        Ok(Reply::Error(error)) => error,
        _ => Error::new(ErrorCode::Unreachable, format!("{key:?} was refused"))
            .found(String::from_utf8_lossy(refusal)),
    }
}

pub(crate) fn timed_out(key: &str, deadline: Duration) -> Error {
    Error::new(ErrorCode::TimedOut, format!("no answer on {key:?} in time"))
        .wanted(format_args!("an answer within {deadline:?}"))
}

//! The answering side: keys that a service serves, and the requests that come in on them.

use std::borrow::Cow;
use std::time::Instant;

use schemas::wire;
use schemas::{Error, ErrorCode, RenderJob, Reply, Request, keys, limits};
use zenoh::Wait;
use zenoh::bytes::ZBytes;
use zenoh::query::{Query, Queryable};

use crate::query::patience_in;
use crate::shortcut::{Listening, Responder};
use crate::{Bus, BusError};

/// A key expression that is served as long as this value lives.
#[must_use = "dropping it ends the service"]
pub struct Serving {
    _declared: Declared,
}

/// Held, never read.
enum Declared {
    Queries { _queryable: Queryable<()> },
    Shortcut { _name: Queryable<()>, _listening: Listening },
}

/// One request that waits for its answer. May be answered from any thread; dropped unanswered, it
/// answers [`ErrorCode::Internal`], so that no asker waits in vain.
#[must_use = "dropping it answers with an internal error"]
pub struct Incoming {
    origin: Option<Origin>,
}

/// How a request came, and its answer goes.
enum Origin {
    /// With when its asker gives up, if it has said so.
    Query(Query, Option<Instant>),
    Shortcut {
        key: String,
        question: Vec<u8>,
        responder: Responder,
    },
}

impl Bus {
    /// Serves every key that matches `key_expr`.
    ///
    /// `handler` runs on the bus's own thread and holds up all other traffic: it may route the
    /// request into a bounded inbox or refuse it, nothing else.
    ///
    /// # Errors
    /// [`BusError::Declare`] when `key_expr` is no key expression.
    pub async fn serve(
        &self,
        key_expr: &str,
        handler: impl Fn(Incoming) + Send + Sync + 'static,
    ) -> Result<Serving, BusError> {
        let queryable = self.answer_queries(key_expr, handler).await?;
        Ok(Serving { _declared: Declared::Queries { _queryable: queryable } })
    }

    async fn answer_queries(
        &self,
        key_expr: &str,
        handler: impl Fn(Incoming) + Send + Sync + 'static,
    ) -> Result<Queryable<()>, BusError> {
        self.session
            .declare_queryable(key_expr)
            .complete(true)
            .callback(move |query| handler(Incoming::by_query(query)))
            .await
            .map_err(|cause| BusError::Declare {
                key: key_expr.to_owned(),
                cause: cause.to_string(),
            })
    }

    /// Serves a key for those on the same machine who come by a shortcut, past the bus; all others
    /// want [`serve`](Self::serve) besides.
    ///
    /// `handler` runs on a thread of the asker's connection: what it does holds up nobody else.
    ///
    /// # Errors
    /// As for [`serve`](Self::serve), and [`BusError::Shortcut`] when the system refuses a socket.
    pub async fn serve_shortcut(
        &self,
        key: &str,
        handler: impl Fn(Incoming) + Send + Sync + 'static,
    ) -> Result<Serving, BusError> {
        let (name, listening) = self.listen_for_shortcuts(key, handler)?;
        let tell = move |incoming: Incoming| incoming.reply_bytes(name.clone().into_bytes());
        let name = self.answer_queries(&keys::shortcut_to(key), tell).await?;
        Ok(Serving { _declared: Declared::Shortcut { _name: name, _listening: listening } })
    }
}

impl Origin {
    fn key(&self) -> &str {
        match self {
            Self::Query(query, _) => query.key_expr().as_str(),
            Self::Shortcut { key, .. } => key,
        }
    }

    fn payload_bytes(&self) -> usize {
        match self {
            Self::Query(query, _) => query.payload().map_or(0, ZBytes::len),
            Self::Shortcut { question, .. } => question.len(),
        }
    }

    /// Aligned for decoding, as what a `Vec` begins with is: what Zenoh has may lie anywhere within
    /// a larger message, and is copied.
    fn payload(&self) -> Cow<'_, [u8]> {
        let owned = |payload: &ZBytes| payload.to_bytes().into_owned();
        match self {
            Self::Query(query, _) => Cow::Owned(query.payload().map(owned).unwrap_or_default()),
            Self::Shortcut { question, .. } => Cow::Borrowed(question),
        }
    }
}

impl Incoming {
    /// A question that has just come on the bus.
    fn by_query(query: Query) -> Self {
        let patience = query.attachment().and_then(|attached| patience_in(&attached.to_bytes()));
        let gives_up_at = patience.and_then(|patience| Instant::now().checked_add(patience));
        Self { origin: Some(Origin::Query(query, gives_up_at)) }
    }

    /// A question that came by a shortcut.
    pub(crate) fn by_shortcut(key: String, question: Vec<u8>, responder: Responder) -> Self {
        Self { origin: Some(Origin::Shortcut { key, question, responder }) }
    }

    /// The key that was asked.
    pub fn key(&self) -> &str {
        self.origin.as_ref().map_or("", Origin::key)
    }

    fn payload(&self) -> Cow<'_, [u8]> {
        self.origin.as_ref().map(Origin::payload).unwrap_or_default()
    }

    /// Whether nobody waits for the answer any more: whoever asked on the bus has run out of
    /// patience, or has left the shortcut.
    pub fn is_given_up(&self) -> bool {
        match &self.origin {
            None => true,
            Some(Origin::Query(_, gives_up_at)) => {
                gives_up_at.is_some_and(|at| at <= Instant::now())
            }
            Some(Origin::Shortcut { responder, .. }) => responder.is_left(),
        }
    }

    /// The verified request in it.
    ///
    /// # Errors
    /// [`ErrorCode::TooLarge`] or [`ErrorCode::InvalidMessage`], to be given to
    /// [`refuse`](Self::refuse).
    pub fn request(&self) -> Result<Request, Error> {
        self.check_size(limits::REQUEST_BYTES_MAX)?;
        wire::decode_request(&self.payload())
    }

    /// The verified render job in it.
    ///
    /// # Errors
    /// [`ErrorCode::TooLarge`] or [`ErrorCode::InvalidMessage`], to be given to
    /// [`refuse`](Self::refuse).
    pub fn render_job(&self) -> Result<RenderJob, Error> {
        self.check_size(limits::REPLY_BYTES_MAX)?;
        wire::decode_render_job(&self.payload())
    }

    /// Answers.
    pub fn reply(mut self, reply: &Reply) {
        match reply {
            Reply::Error(error) => self.send_refusal(error.clone()),
            reply => self.send(wire::encode_reply(reply)),
        }
    }

    /// Answers with a refusal.
    pub fn refuse(mut self, error: Error) {
        self.send_refusal(error);
    }

    /// Answers with bytes that are already encoded, at most
    /// [`MAP_BYTES_MAX`](limits::MAP_BYTES_MAX); more becomes [`ErrorCode::TooLarge`].
    pub fn reply_bytes(mut self, reply: Vec<u8>) {
        self.send(reply);
    }

    /// Looks at the size before anything is copied.
    fn check_size(&self, bytes_max: usize) -> Result<(), Error> {
        let payload_bytes = self.origin.as_ref().map_or(0, Origin::payload_bytes);
        if payload_bytes <= bytes_max {
            Ok(())
        } else {
            Err(too_large("request", bytes_max, payload_bytes))
        }
    }

    fn send(&mut self, reply: Vec<u8>) {
        if reply.len() > limits::MAP_BYTES_MAX {
            return self.send_refusal(too_large("reply", limits::MAP_BYTES_MAX, reply.len()));
        }
        let query = match self.origin.take() {
            None => return,
            Some(Origin::Shortcut { responder, .. }) => return responder.answer(false, reply),
            Some(Origin::Query(query, _)) => query,
        };
        // A wildcard was asked: answer under a key that the asker's expression contains.
        if let Err(cause) = query.reply(query.key_expr(), reply).express(true).wait() {
            tracing::debug!(key = query.key_expr().as_str(), %cause, "the asker is gone");
        }
    }

    /// Refusals travel as such, so that an answer of bare bytes cannot be taken for one.
    fn send_refusal(&mut self, error: Error) {
        let refusal = wire::encode_reply(&Reply::Error(error));
        let query = match self.origin.take() {
            None => return,
            Some(Origin::Shortcut { responder, .. }) => return responder.answer(true, refusal),
            Some(Origin::Query(query, _)) => query,
        };
        if let Err(cause) = query.reply_err(refusal).wait() {
            tracing::debug!(key = query.key_expr().as_str(), %cause, "the asker is gone");
        }
    }
}

impl Drop for Incoming {
    fn drop(&mut self) {
        if self.origin.is_some() {
            let error =
                Error::new(ErrorCode::Internal, "the request was dropped without an answer");
            self.send_refusal(error);
        }
    }
}

fn too_large(what: &str, bytes_max: usize, found_bytes: usize) -> Error {
    Error::new(ErrorCode::TooLarge, format!("the {what} is too large"))
        .wanted(format_args!("at most {bytes_max} bytes"))
        .found(format_args!("{found_bytes} bytes"))
}

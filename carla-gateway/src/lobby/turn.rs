//! Whose turn it is at the endpoint, and whose comes.

use super::Call;
use crate::rpc::{ConnectionId, Ticket};

/// Whose turn comes, in the order of arrival.
#[derive(Debug)]
pub(super) enum Waiting {
    Call(Call),
    /// A client is gone; its calls come before.
    Gone(ConnectionId),
}

/// The present job.
#[derive(Debug)]
pub(super) struct UnderWay {
    pub(super) purpose: Purpose,
    /// The newest client when it began.
    pub(super) newest_client: Option<ConnectionId>,
}

/// Whom it is for.
#[derive(Debug)]
pub(super) enum Purpose {
    Call {
        ticket: Ticket,
        is_load: bool,
    },
    Prepare(Ticket),
    /// The tick of those who asked for it.
    Advance(Vec<ConnectionId>),
    TickByItself,
    ShowEpisode,
}

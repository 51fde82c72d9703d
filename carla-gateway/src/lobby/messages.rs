//! What a lobby is told, and what it says.

use std::net::IpAddr;

use tokio::task::JoinHandle;
use tokio::time::Instant;

use super::pace::Loss;
use crate::archive::Prepared;
use crate::dialect::EpisodeSettings;
use crate::rpc::{Answer, ConnectionId, Request, Ticket};
use crate::visited::VisitedTick;
use crate::whereabouts::Whereabouts;

/// What a lobby hears.
#[derive(Debug)]
pub(crate) enum Event {
    /// A client connected.
    Connected(ConnectionId, Whereabouts),
    /// A client is gone.
    Disconnected(ConnectionId),
    /// A client calls.
    Called(Call),
    /// A world that clients visit has ticked.
    Ticked(VisitedTick),
    /// The job that was begun is done.
    Done(Box<Report>),
    /// It is [`due`](super::Lobby::due), and nothing else has happened.
    Due,
}

/// One call of a client.
#[derive(Debug)]
pub(crate) struct Call {
    pub(crate) ticket: Ticket,
    pub(crate) request: Request,
    /// What was made ready for it, if it comes again.
    pub(crate) prepared: Option<Prepared>,
}

/// A call that comes again when something is ready for it.
#[derive(Debug)]
pub(crate) struct Again {
    pub(crate) request: Request,
    pub(crate) ready: JoinHandle<Prepared>,
}

/// What is to be done, in this order.
#[derive(Debug)]
pub(crate) enum Do {
    /// Answers a call.
    Answer(Ticket, Answer),
    /// Answers a call when its answer is there.
    AnswerLater(Ticket, JoinHandle<Answer>),
    /// Has a call come again.
    CallAgain(Ticket, Again),
    /// Has the endpoint do something; its report comes before the next job.
    Begin(Job),
    /// Wakes a Traffic Manager that has slept through a frame.
    Wake(IpAddr, u16),
    /// Has whoever holds a port of this machine lend it to a client's Traffic Manager, which is
    /// about to start.
    BorrowPort(u16, Whereabouts),
    /// Says that so many clients who share the clock were waited for in vain.
    TellMissing(usize),
    /// Says that ticks take longer than their period, and how much time was lost lately.
    TellLoss(Loss),
    /// Says that the Traffic Manager at a port is in asynchronous mode while its client ticks.
    TellRestless(u16),
}

/// One job of the endpoint.
#[derive(Debug)]
pub(crate) struct Job {
    pub(crate) task: Task,
    pub(crate) brief: Brief,
}

/// What the endpoint does, one thing at a time.
#[derive(Debug)]
pub(crate) enum Task {
    /// What a call says, with what was made ready for it.
    Call(Request, Option<Prepared>),
    /// Gets ready for the tick of a client; the answer is the number of the frame to come.
    Prepare,
    /// The tick of a client, which has got its answer.
    Advance,
    /// A tick of its own accord, in asynchronous mode from now on.
    TickByItself,
    /// Sends the first frame of a new episode to all clients.
    ShowEpisode,
    /// Shows a tick of a world that clients visit.
    ShowVisited(VisitedTick),
    /// Shows such a world as it is, once more.
    StandStill,
}

/// What the endpoint has to know for a job.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Brief {
    /// When the last tick began.
    pub(crate) last_tick: Instant,
    /// Whose call it is; nobody's, if the world ticks by itself.
    pub(crate) caller: Option<ConnectionId>,
    /// The caller came after the world of the episode was lost, and finds a new one.
    pub(crate) finds_new_world: bool,
    /// Frames come without anybody's tick.
    pub(crate) ticks_by_itself: bool,
    /// A client's tick waits for those of others.
    pub(crate) shares_clock: bool,
}

/// What came of a job, and how the endpoint is after it.
#[derive(Debug)]
pub(crate) struct Report {
    pub(crate) answer: Answer,
    /// Takes the place of the answer.
    pub(crate) later: Option<JoinHandle<Answer>>,
    /// Takes the place of the answer.
    pub(crate) again: Option<Again>,
    pub(crate) timing: Timing,
    /// The client's Traffic Managers take a step before its call returns.
    pub(crate) expects_step: bool,
    /// The caller has asked for the frame to come, as with a tick.
    pub(crate) asks_for_frame: bool,
    /// The frame that clients were promised comes when others have asked for it, too.
    pub(crate) awaits_world: bool,
    pub(crate) settings: EpisodeSettings,
    pub(crate) frame_number: u64,
    pub(crate) episodes_begun: u64,
    pub(crate) world: WorldState,
    pub(crate) last_tick: Instant,
}

/// When a call is answered.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Timing {
    /// At once.
    #[default]
    Now,
    /// The call has destroyed a vehicle: when a step of the caller's Traffic Managers that has it
    /// is over.
    AfterManagersStep,
    /// The call has put actors into the world: when they were seen.
    WithNextFrame,
}

/// What there is of the world.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum WorldState {
    /// It was not needed yet.
    #[default]
    None,
    Alive,
    /// It is that of a session, which ticks it.
    Visited,
    /// It is gone.
    Lost,
}

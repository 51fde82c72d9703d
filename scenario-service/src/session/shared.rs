//! A world that several sessions share, each with an ego of its own: it is ticked when all of them
//! have asked for a step, and waits for nobody longer than a lease.
//!
//! One task owns the world; [`Participant`]s send it what they want. It ends when all are gone.

mod host;
mod rounds;

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, PoisonError};

use schemas::{ActorId, Command, Error, ErrorCode, SharedFrame};
use tokio::sync::{mpsc, oneshot};

use super::world::{EpisodeWorld, Told, Trouble, Work};
use super::{SessionContext, random_id};
use crate::episode::{Company, Episode};
use crate::scenario::sharing::Sharing;
use host::Host;

/// What a session asks of the task that owns the world. Every participant waits for one step at
/// most, so that few of them ever wait.
enum Message {
    Join {
        ego: Option<String>,
        answer: oneshot::Sender<Result<Joined, Error>>,
    },
    Step {
        seat: usize,
        work: Work,
        answer: oneshot::Sender<Result<Told, Trouble>>,
    },
    Leave {
        seat: usize,
        is_over: bool,
    },
    /// The world should be elsewhere if its service ends.
    MoveAway {
        answer: oneshot::Sender<Result<(), Error>>,
    },
    /// Whoever made the world has no more use for it.
    End,
}

/// What comes of joining.
pub(super) struct Joined {
    pub(super) participant: Participant,
    /// At the present tick.
    pub(super) episode: Episode,
    pub(super) company: Company,
}

/// The worlds of a tenant that can be joined, by their codes.
#[derive(Default)]
pub(crate) struct SharedWorlds(Mutex<BTreeMap<String, mpsc::WeakUnboundedSender<Message>>>);

impl SharedWorlds {
    /// Takes part in one.
    ///
    /// # Errors
    /// There is no such world, or no such ego that is free.
    pub(super) async fn join(&self, code: &str, ego: Option<&str>) -> Result<Joined, Error> {
        let mailbox = self.lock().get(code).and_then(mpsc::WeakUnboundedSender::upgrade);
        let gone = || {
            let wanted = "metadata.world_id of a reset with num_egos, while somebody is in it";
            let code: String = code.chars().take(64).collect();
            let error = Error::new(ErrorCode::UnknownWorld, "there is no such world to join");
            error.wanted(wanted).found(code)
        };
        let (answer, joined) = oneshot::channel();
        let message = Message::Join { ego: ego.map(str::to_owned), answer };
        mailbox.ok_or_else(gone)?.send(message).map_err(|_| gone())?;
        joined.await.map_err(|_| gone())?
    }

    fn add(&self, code: String, mailbox: &mpsc::UnboundedSender<Message>) {
        let mut open = self.lock();
        open.retain(|_, mailbox| mailbox.strong_count() > 0);
        open.insert(code, mailbox.downgrade());
    }

    fn lock(
        &self,
    ) -> std::sync::MutexGuard<'_, BTreeMap<String, mpsc::WeakUnboundedSender<Message>>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// A new world to share.
pub(super) struct Opened {
    pub(super) world: EpisodeWorld,
    pub(super) frame: SharedFrame,
    /// What each ego's session begins with; the first is that of whoever made the world.
    pub(super) egos: Vec<(ActorId, Episode)>,
    /// Before the first tick.
    pub(super) opening: Vec<Command>,
    pub(super) sharing: Sharing,
}

/// Has a world shared from now on. Gives the first ego to whoever made it.
pub(super) fn open(context: &Arc<SessionContext>, opened: Opened) -> (Participant, Company) {
    let code = random_id();
    let (mailbox, messages) = mpsc::unbounded_channel();
    context.shared.add(code.clone(), &mailbox);
    let host = Host::new(Arc::clone(context), code, opened, mailbox.downgrade());
    let company = host.company(0, None);
    tokio::spawn(host.run(messages));
    (Participant { seat: 0, mailbox, has_left: false }, company)
}

/// A session's part in a shared world.
pub(super) struct Participant {
    seat: usize,
    mailbox: mpsc::UnboundedSender<Message>,
    has_left: bool,
}

impl Participant {
    /// Has something done in the world together with what the others want. Cancelled it is done all
    /// the same, and before whatever is asked for next.
    ///
    /// # Errors
    /// [`Trouble`].
    pub(super) async fn advance(&self, work: Work) -> Result<Told, Trouble> {
        let (answer, told) = oneshot::channel();
        let message = Message::Step { seat: self.seat, work, answer };
        self.mailbox.send(message).map_err(|_| gone())?;
        told.await.map_err(|_| gone())?
    }

    /// Has the world move away from a service that ends, between two rounds.
    ///
    /// # Errors
    /// Why it could not; it should be tried again.
    pub(super) async fn move_away(&self) -> Result<(), Error> {
        let (answer, moved) = oneshot::channel();
        self.tell(Message::MoveAway { answer });
        // Without a task there is no world.
        moved.await.unwrap_or(Ok(()))
    }

    /// Its episode is over: nobody waits for it any more.
    pub(super) fn leave(&mut self) {
        self.has_left = true;
        self.tell(Message::Leave { seat: self.seat, is_over: true });
    }

    /// It goes on elsewhere; who made the world takes it away from all.
    pub(super) fn end(&self) {
        if self.seat == 0 {
            self.tell(Message::End);
        }
    }

    fn tell(&self, message: Message) {
        // A task that has ended waits for nobody.
        let _ = self.mailbox.send(message);
    }
}

impl Drop for Participant {
    fn drop(&mut self) {
        if !self.has_left {
            self.tell(Message::Leave { seat: self.seat, is_over: false });
        }
    }
}

fn gone() -> Trouble {
    Trouble::Gone(Error::new(ErrorCode::UnknownWorld, "the shared world has ended"))
}

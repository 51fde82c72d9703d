//! The task that owns a shared world.

use std::collections::VecDeque;
use std::sync::Arc;
use std::time::Duration;

use schemas::{ActorId, Collision, Command, CommandReply, Error, ErrorCode, SharedFrame};
use tokio::sync::{mpsc, oneshot};
use tokio::time::Instant;

use super::rounds::{NoSeat, Round, Rounds};
use super::{Joined, Message, Opened, Participant};
use crate::episode::{Company, Episode, Other};
use crate::scenario::sharing::Sharing;
use crate::session::SessionContext;
use crate::session::world::{EpisodeWorld, Told, Trouble, Work};

/// Steps of one session that wait for the one before: whoever asked for that has given up, and it
/// is done all the same.
const LATER_MAX: usize = 8;

pub(super) struct Host {
    context: Arc<SessionContext>,
    code: String,
    mailbox: mpsc::WeakUnboundedSender<Message>,
    world: EpisodeWorld,
    frame: SharedFrame,
    egos: Vec<(ActorId, Episode)>,
    opening: Vec<Command>,
    sharing: Sharing,
    rounds: Rounds,
    /// By seat.
    waiting: Vec<Option<Waiting>>,
    /// By seat, what comes after that.
    later: Vec<VecDeque<(Work, Answer)>>,
    /// When the first of the present round began to wait.
    since: Option<Instant>,
    /// Why nothing is done any more.
    ended: Option<Trouble>,
}

type Answer = oneshot::Sender<Result<Told, Trouble>>;

/// Whose step is not done yet, and what came of it so far.
struct Waiting {
    answer: Answer,
    since: Instant,
    replies: Vec<CommandReply>,
    collisions: Vec<Collision>,
    events: Vec<String>,
}

impl Host {
    pub(super) fn new(
        context: Arc<SessionContext>,
        code: String,
        opened: Opened,
        mailbox: mpsc::WeakUnboundedSender<Message>,
    ) -> Self {
        let Opened { world, frame, egos, opening, sharing } = opened;
        let rounds = Rounds::new(egos.len());
        let waiting = egos.iter().map(|_| None).collect();
        let later = egos.iter().map(|_| VecDeque::new()).collect();
        let (since, ended) = (None, None);
        Self {
            context,
            code,
            mailbox,
            world,
            frame,
            egos,
            opening,
            sharing,
            rounds,
            waiting,
            later,
            since,
            ended,
        }
    }

    pub(super) async fn run(mut self, mut messages: mpsc::UnboundedReceiver<Message>) {
        loop {
            let message = match self.deadline() {
                Some(at) => match tokio::time::timeout_at(at, messages.recv()).await {
                    Ok(message) => message,
                    Err(_) => {
                        self.expire();
                        self.play().await;
                        continue;
                    }
                },
                None => messages.recv().await,
            };
            let Some(message) = message else { return };
            self.take(message).await;
            self.play().await;
        }
    }

    /// Who is in the world with an ego.
    pub(super) fn company(&self, seat: usize, waited: Option<Duration>) -> Company {
        let others = (0..self.rounds.count()).filter(|other| *other != seat);
        let other = |other| Other { ego: name(other), live: self.rounds.is_here(other) };
        Company {
            world_id: self.code.clone(),
            ego: name(seat),
            egos: (0..self.rounds.count()).map(name).collect(),
            others: others.map(other).collect(),
            waited_ms: waited.map(|waited| waited.as_millis() as u64),
        }
    }

    async fn take(&mut self, message: Message) {
        match message {
            Message::Join { ego, answer } => {
                // Who has given up leaves with the answer.
                let _ = answer.send(self.join(ego.as_deref()));
            }
            Message::Step { seat, work, answer } => {
                if let Some(trouble) = &self.ended {
                    let _ = answer.send(Err(trouble.clone()));
                } else if self.waiting[seat].is_none() {
                    self.step(seat, work, answer).await;
                } else if self.later[seat].len() < LATER_MAX {
                    self.later[seat].push_back((work, answer));
                } else {
                    let _ = answer.send(Err(Trouble::Refused(too_many())));
                }
            }
            Message::Leave { seat, is_over } => {
                self.waiting[seat] = None;
                self.later[seat].clear();
                self.rounds.leave(seat, is_over);
            }
            Message::MoveAway { answer } => {
                let moved = match self.ended {
                    Some(_) => Ok(()),
                    None => self.world.move_away(&self.context, &self.frame).await,
                };
                // Who has gone is told nothing.
                let _ = answer.send(moved);
            }
            Message::End => self.end(Trouble::Ended),
        }
    }

    fn join(&mut self, ego: Option<&str>) -> Result<Joined, Error> {
        let (code, refused) = (ErrorCode::InvalidArgument, "this ego cannot be joined as");
        if self.ended.is_some() {
            return Err(Error::new(ErrorCode::UnknownWorld, "the shared world has ended"));
        }
        // A world of which somebody is a part has a way to be told things.
        let mailbox = self.mailbox.upgrade();
        let mailbox = mailbox
            .ok_or_else(|| Error::new(ErrorCode::UnknownWorld, "the shared world has ended"))?;
        let number = ego.map(|ego| (0..self.rounds.count()).find(|seat| name(*seat) == ego));
        let wanted = match number {
            Some(None) => Err(NoSeat::Unknown),
            Some(Some(seat)) => self.rounds.join(Some(seat)),
            None => self.rounds.join(None),
        };
        let seat = wanted.map_err(|why| {
            let last = name(self.rounds.count() - 1);
            let why = match why {
                NoSeat::Unknown => format!("one of ego_0 to {last}"),
                NoSeat::Taken => "an ego that no other session steps".to_owned(),
                NoSeat::Over => "an ego whose episode is not over".to_owned(),
                NoSeat::Full => "a world with an ego that is free".to_owned(),
            };
            Error::new(code, refused).wanted(why).found(ego.unwrap_or("none that is free"))
        })?;
        // Whoever has just come has a whole lease.
        self.since = self.since.map(|_| Instant::now());
        let episode = self.egos[seat].1.at(self.frame.clone());
        let participant = Participant { seat, mailbox, has_left: false };
        Ok(Joined { participant, episode, company: self.company(seat, None) })
    }

    /// Has a step wait for its round, if it can be one.
    async fn step(&mut self, seat: usize, work: Work, answer: Answer) {
        if let Err(refused) = self.ask(seat, work).await {
            // Who has gone is told nothing.
            let _ = answer.send(refused);
            return;
        }
        let since = Instant::now();
        self.since.get_or_insert(since);
        let (replies, collisions, events) = Default::default();
        self.waiting[seat] = Some(Waiting { answer, since, replies, collisions, events });
    }

    /// Goes on with the steps of those whose step before is done.
    async fn step_on(&mut self) {
        for seat in 0..self.later.len() {
            while self.waiting[seat].is_none()
                && let Some((work, answer)) = self.later[seat].pop_front()
            {
                self.step(seat, work, answer).await;
            }
        }
    }

    /// Notes a step for the next round; one that takes no time is done at once.
    async fn ask(&mut self, seat: usize, work: Work) -> Result<(), Result<Told, Trouble>> {
        if work.is_checked
            && let Err(trouble) = self.world.check(&self.context, &work).await
        {
            return Err(Err(trouble));
        }
        if work.tick_count == 0 {
            let told = self.world.advance(&self.context, &self.frame, work).await;
            return Err(told.map(|told| {
                self.frame = told.frame.clone();
                Told { company: Some(self.company(seat, None)), ..told }
            }));
        }
        self.rounds.ask(seat, work.commands, work.tick_count);
        Ok(())
    }

    fn deadline(&self) -> Option<Instant> {
        let secs = match self.rounds.lacks_only_guests() {
            true => self.sharing.join_timeout_secs,
            false => self.sharing.lease_secs,
        };
        Some(self.since? + Duration::from_secs_f64(secs))
    }

    /// Goes on without those who were waited for.
    fn expire(&mut self) {
        let what = self.sharing.absent.as_str();
        for seat in self.rounds.expire() {
            let event = format!("{} was waited for in vain: {what}", name(seat));
            for waiting in self.waiting.iter_mut().flatten() {
                waiting.events.push(event.clone());
            }
        }
    }

    async fn play(&mut self) {
        if !self.rounds.is_waiting() {
            self.since = None;
        }
        while self.ended.is_none() && self.rounds.is_due() {
            let round = self.rounds.begin();
            let ticks = round.ticks;
            let (commands, owners) = self.joined(round);
            let work = Work { commands, tick_count: ticks, is_checked: false };
            match self.world.advance(&self.context, &self.frame, work).await {
                Ok(told) => self.tell(told, &owners, ticks),
                Err(trouble) if trouble.is_for_good() => self.end(trouble),
                Err(trouble) => self.fail(&trouble),
            }
            self.since = self.rounds.is_waiting().then(Instant::now);
            if self.ended.is_none() {
                self.step_on().await;
            }
        }
    }

    /// All commands of a round, and whose reply each one's is.
    fn joined(&self, round: Round) -> (Vec<Command>, Vec<Option<usize>>) {
        let mut commands = self.opening.clone();
        let egos = round.absent.iter().map(|seat| self.egos[*seat].0);
        commands.extend(egos.filter_map(|ego| self.sharing.absent.commands(ego)));
        let mut owners = vec![None; commands.len()];
        for (seat, own) in round.commands {
            owners.extend(own.iter().map(|_| Some(seat)));
            commands.extend(own);
        }
        (commands, owners)
    }

    /// Gives everybody their part of what came of a round, and an answer to those whose steps are
    /// done.
    fn tell(&mut self, told: Told, owners: &[Option<usize>], ticks: u32) {
        let Told { frame, replies, collisions, carla_world: told_world, .. } = told;
        self.frame = frame;
        self.opening.clear();
        for (reply, owner) in replies.into_iter().zip(owners) {
            if let Some(waiting) = owner.and_then(|seat| self.waiting[seat].as_mut()) {
                waiting.replies.push(reply);
            }
        }
        for waiting in self.waiting.iter_mut().flatten() {
            waiting.collisions.extend(collisions.iter().cloned());
        }
        for seat in self.rounds.done(ticks) {
            let Some(waiting) = self.waiting[seat].take() else { continue };
            let Waiting { answer, since, replies, collisions, events } = waiting;
            let company = Some(self.company(seat, Some(since.elapsed())));
            let (frame, carla_world) = (self.frame.clone(), told_world.clone());
            let told = Told { frame, replies, collisions, events, company, carla_world };
            // Who has gone is told nothing.
            let _ = answer.send(Ok(told));
        }
    }

    /// Nobody's step is done, and everybody may ask again.
    fn fail(&mut self, trouble: &Trouble) {
        for seat in self.rounds.give_up() {
            if let Some(waiting) = self.waiting[seat].take() {
                let _ = waiting.answer.send(Err(trouble.clone()));
            }
        }
    }

    fn end(&mut self, trouble: Trouble) {
        self.fail(&trouble);
        for (_, answer) in self.later.iter_mut().flat_map(|later| later.drain(..)) {
            let _ = answer.send(Err(trouble.clone()));
        }
        self.ended = Some(trouble);
    }
}

fn too_many() -> Error {
    Error::new(ErrorCode::Capacity, "steps that were given up wait for the other egos")
        .wanted(format_args!("at most {LATER_MAX} after the one under way; ask again later"))
}

/// What an ego is called.
fn name(seat: usize) -> String {
    format!("ego_{seat}")
}

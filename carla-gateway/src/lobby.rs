//! What CARLA's client imposes on a server beside the calls themselves: who is connected, whose
//! turn it is, which calls, reads and answers wait, and for what. A value: it is told what happened
//! and when, and says what is to be done.
//!
//! - Calls are answered one after the other in the order of their arrival; ticks happen between
//!   them. The version and the settings are told at once, even while a call is under way: a Traffic
//!   Manager reads the settings between two frames, on a thread of its own, and must have them
//!   before the next frame comes.
//! - [`changeover`], [`held`], [`late`] and [`managers`] say what ends a client's process, and what
//!   is done about it.

mod changeover;
mod gate;
mod held;
mod late;
mod managers;
mod messages;
mod pace;
mod participants;
mod timing;
mod turn;
mod visits;

use std::collections::{BTreeMap, VecDeque};

use tokio::time::Instant;

use crate::config::Pacing;
use crate::dialect::{ClientVersion, EpisodeSettings};
use crate::rpc::{Answer, ConnectionId, Payload, Ticket};
use crate::whereabouts::Whereabouts;
use changeover::Phase;
use held::HeldLoads;
use late::LateAnswers;
use managers::TrafficManagers;
pub(crate) use messages::{Again, Brief, Call, Do, Event, Job, Report, Task, Timing, WorldState};
use pace::{Pace, QUIET_AFTER_LOAD};
use participants::Participants;
use turn::{Purpose, UnderWay, Waiting};
use visits::Visits;

/// The call that loads a world.
const LOAD: &str = "load_new_episode";
/// Calls, and late answers, that may wait; clients that send more are read more slowly.
pub(crate) const CALLS_MAX: usize = 1_024;

/// Clients of one endpoint, and what they wait for.
#[derive(Debug)]
pub(crate) struct Lobby {
    pub(crate) version: ClientVersion,
    clients: BTreeMap<ConnectionId, Whereabouts>,
    newest_client: Option<ConnectionId>,
    managers: TrafficManagers,
    phase: Phase,
    held: HeldLoads,
    late: LateAnswers,
    pace: Pace,
    participants: Participants,
    visits: Visits,
    waiting: VecDeque<Waiting>,
    under_way: Option<UnderWay>,
    settings: EpisodeSettings,
    frame_number: u64,
    episodes_begun: u64,
    world: WorldState,
    /// The last client that could know the world that is lost; who comes later finds a new one.
    newest_witness: Option<ConnectionId>,
}

impl Lobby {
    /// Nobody is here.
    pub(crate) fn new(pacing: Pacing, version: ClientVersion, now: Instant) -> Self {
        let Pacing { period, sync_lease, clock_lease } = pacing;
        Self {
            version,
            clients: BTreeMap::new(),
            newest_client: None,
            managers: TrafficManagers::default(),
            phase: Phase::default(),
            held: HeldLoads::default(),
            late: LateAnswers::default(),
            pace: Pace::new(period, sync_lease, now),
            participants: Participants::new(clock_lease),
            visits: Visits::default(),
            waiting: VecDeque::new(),
            under_way: None,
            settings: EpisodeSettings::default(),
            frame_number: 0,
            episodes_begun: 0,
            world: WorldState::None,
            newest_witness: None,
        }
    }

    /// How many are here.
    pub(crate) fn client_count(&self) -> usize {
        self.clients.len()
    }

    /// Whether more calls may come.
    pub(crate) fn has_room(&self) -> bool {
        self.waiting.len() < CALLS_MAX
    }

    /// When it has to be told that time has passed, if nothing else happens before.
    pub(crate) fn due(&self) -> Option<Instant> {
        let late = self.late.due().into_iter().chain(self.phase.due());
        if self.under_way.is_some() {
            return late.min();
        }
        let idle = self.managers.due().into_iter().chain(self.held.due(&self.phase));
        let ticks = self.next_tick_at().into_iter().chain(self.participants.due());
        let ticks = ticks.chain(self.visits.due(&self.phase)).chain(self.stands_until());
        late.chain(idle).chain(ticks).min()
    }

    /// Takes in what happened, and says what is to be done about it.
    pub(crate) fn take(&mut self, event: Event, now: Instant) -> Vec<Do> {
        let mut acts = Vec::new();
        match event {
            Event::Connected(client, whereabouts) => {
                if self.clients.is_empty() {
                    self.pace.count_from(now);
                }
                self.clients.insert(client, whereabouts);
                self.newest_client = self.newest_client.max(Some(client));
            }
            Event::Disconnected(client) => self.waiting.push_back(Waiting::Gone(client)),
            Event::Called(call) => self.receive(call, now, &mut acts),
            Event::Ticked(tick) => self.visits.note_tick(tick),
            Event::Done(report) => self.finish(*report, now, &mut acts),
            // No call that could prove the contrary waits.
            Event::Due if self.under_way.is_none() => self.wake_late_managers(now, &mut acts),
            Event::Due => {}
        }
        if self.phase.due().is_some_and(|due| due <= now) {
            self.end_phase(now, &mut acts);
        }
        self.give_late_answers(now, &mut acts);
        while self.under_way.is_none() && self.go_on(now, &mut acts) {}
        self.give_late_answers(now, &mut acts);
        acts
    }

    /// Answers at once what needs no endpoint; everything else waits for its turn.
    fn receive(&mut self, call: Call, now: Instant, acts: &mut Vec<Do>) {
        let Call { ticket, request, prepared } = call;
        let client = ticket.client;
        match request.method.as_str() {
            "version" => acts.push(Do::Answer(ticket, Payload::value(self.version.name()))),
            "get_episode_settings" => {
                self.managers.note_read(client);
                for read in self.phase.note_read(ticket, now) {
                    acts.push(Do::Answer(read, Payload::value(&self.settings)));
                }
            }
            _ => return self.waiting.push_back(Waiting::Call(Call { ticket, request, prepared })),
        }
        self.managers.note_call(client, now);
    }

    /// Begins the next job, or does what needs none; whether there was anything.
    fn go_on(&mut self, now: Instant, acts: &mut Vec<Do>) -> bool {
        if let Some(round) = self.participants.take_round(now) {
            acts.extend((round.missed > 0).then_some(Do::TellMissing(round.missed)));
            let first = round.asked.first().copied();
            self.begin(Task::Advance, Purpose::Advance(round.asked), first, acts);
            return true;
        }
        if let Some(load) = self.held.take_ready(&self.phase, &self.managers, now) {
            self.begin_call(load, acts);
            return true;
        }
        if let Some((tick, promised)) = self.visits.take_due(&self.phase, now) {
            self.begin(Task::ShowVisited(tick), Purpose::Advance(promised), None, acts);
            return true;
        }
        if self.stands_until().is_some_and(|until| until <= now) {
            self.begin(Task::StandStill, Purpose::ShowEpisode, None, acts);
            return true;
        }
        let calls_first = self.pace.owes_a_call() && !self.waiting.is_empty();
        if !calls_first && self.next_tick_at().is_some_and(|due| due <= now) {
            acts.extend(self.pace.note_begin(&self.settings, now).map(Do::TellLoss));
            self.begin(Task::TickByItself, Purpose::TickByItself, None, acts);
            return true;
        }
        self.pace.note_call();
        match self.waiting.pop_front() {
            Some(Waiting::Call(call)) => self.attend(call, now, acts),
            Some(Waiting::Gone(client)) => self.forget(client),
            None => return false,
        }
        true
    }

    /// It is a call's turn.
    fn attend(&mut self, call: Call, now: Instant, acts: &mut Vec<Do>) {
        let client = call.ticket.client;
        // It went while its call was made ready.
        let Some(whereabouts) = self.clients.get(&client).copied() else { return };
        match call.request.method.as_str() {
            "apply_batch" => {
                self.managers.note_batch(client);
                self.late.note_batch(client, now);
            }
            _ => self.managers.note_call(client, now),
        }
        let from = whereabouts.address();
        if let Some((answer, starts)) = self.managers.answer(client, from, &call.request) {
            let starts_here = starts.filter(|_| whereabouts.is_here());
            acts.extend(starts_here.map(|port| Do::BorrowPort(port, whereabouts)));
            return acts.push(Do::Answer(call.ticket, answer));
        }
        if call.request.method == "tick_cue" && self.settings.synchronous_mode {
            return self.begin(Task::Prepare, Purpose::Prepare(call.ticket), Some(client), acts);
        }
        let is_early = call.request.method == LOAD
            && self.held.is_too_early(client, &self.phase, &self.managers, now);
        let call = if is_early { self.held.hold(call) } else { Some(call) };
        if let Some(call) = call {
            self.begin_call(call, acts);
        }
    }

    fn begin_call(&mut self, call: Call, acts: &mut Vec<Do>) {
        let Call { ticket, request, prepared } = call;
        let client = ticket.client;
        if self.phase.note_call(client, &request) {
            // From here on a Traffic Manager may be silent for longer than one that sleeps.
            self.managers.note_batch(client);
        }
        let purpose = Purpose::Call { ticket, is_load: request.method == LOAD };
        self.begin(Task::Call(request, prepared), purpose, Some(client), acts);
    }

    fn begin(
        &mut self,
        task: Task,
        purpose: Purpose,
        caller: Option<ConnectionId>,
        acts: &mut Vec<Do>,
    ) {
        let newest_client = self.newest_client;
        self.under_way = Some(UnderWay { purpose, newest_client });
        let finds_new_world = self.world == WorldState::Lost
            && caller.is_some_and(|caller| Some(caller) > self.newest_witness);
        let last_tick = self.pace.last_tick();
        let ticks_by_itself = self.ticks_by_itself();
        let shares_clock = self.participants.share_clock();
        let brief = Brief { last_tick, caller, finds_new_world, ticks_by_itself, shares_clock };
        acts.push(Do::Begin(Job { task, brief }));
    }

    /// A job is done.
    fn finish(&mut self, report: Report, now: Instant, acts: &mut Vec<Do>) {
        let Some(UnderWay { purpose, newest_client }) = self.under_way.take() else { return };
        let is_new_frame = report.frame_number != self.frame_number;
        self.learn(&report, newest_client, now);
        let Report { answer, later, again, timing, expects_step, asks_for_frame, .. } = report;
        let awaits_world = report.awaits_world;
        match purpose {
            Purpose::Call { ticket, is_load } => {
                if let Some(later) = later {
                    return acts.push(Do::AnswerLater(ticket, later));
                }
                if let Some(again) = again {
                    return acts.push(Do::CallAgain(ticket, again));
                }
                if asks_for_frame {
                    self.participants.note_ask(ticket.client, now);
                }
                if expects_step {
                    self.managers.note_frame(ticket.client, now);
                }
                if is_load && answer.is_ok() {
                    self.held.note_load(ticket.client, now);
                    if self.managers.count(ticket.client) > 0 {
                        return self.change_over(ticket, answer, now, acts);
                    }
                }
                let steps = expects_step && self.managers.count(ticket.client) > 0;
                let timing = self.late.timing(ticket.client, timing, steps, is_new_frame);
                self.answer_in_time(ticket, answer, timing, now, acts);
            }
            Purpose::Prepare(ticket) => {
                let (client, is_ready) = (ticket.client, answer.is_ok());
                acts.push(Do::Answer(ticket, answer));
                if is_ready {
                    self.participants.note_ask(client, now);
                }
            }
            Purpose::Advance(clients) if awaits_world => self.visits.promise(clients),
            Purpose::Advance(clients) => {
                for client in clients {
                    self.managers.note_frame(client, now);
                    let restless = self.managers.take_restless(client);
                    acts.extend(restless.into_iter().map(Do::TellRestless));
                }
            }
            Purpose::TickByItself => {
                self.pace.note_end(self.waiting.len(), answer.is_ok(), now);
            }
            Purpose::ShowEpisode => {}
        }
    }

    /// Takes over how the endpoint is after a job.
    fn learn(&mut self, report: &Report, newest_client: Option<ConnectionId>, now: Instant) {
        if report.frame_number != self.frame_number {
            self.late.note_frame(report.frame_number, now + self.pace.half_period());
            self.visits.note_frame(now);
        }
        if report.world == WorldState::Lost && self.world != WorldState::Lost {
            self.newest_witness = newest_client;
        }
        if report.settings != self.settings {
            self.settings.clone_from(&report.settings);
            self.pace.forget_loss(now);
        }
        self.pace.count_from(report.last_tick);
        let is_new_episode = report.episodes_begun != self.episodes_begun;
        if is_new_episode {
            self.pace.count_from(now + QUIET_AFTER_LOAD);
            self.visits.note_load(now);
        }
        if is_new_episode || !report.settings.synchronous_mode {
            self.participants.forget_round();
        }
        self.frame_number = report.frame_number;
        self.episodes_begun = report.episodes_begun;
        self.world = report.world;
    }

    /// A load is done: answers it once the Traffic Managers of the client have changed over.
    fn change_over(&mut self, ticket: Ticket, answer: Answer, now: Instant, acts: &mut Vec<Do>) {
        self.end_phase(now, acts);
        self.end_phase(now, acts);
        let client = ticket.client;
        self.managers.note_frame(client, now);
        self.phase = Phase::begin((ticket, answer), self.managers.count(client), now);
        self.begin(Task::ShowEpisode, Purpose::ShowEpisode, Some(client), acts);
    }

    /// Answers the load of who changes over, or what still waits after it.
    fn end_phase(&mut self, now: Instant, acts: &mut Vec<Do>) {
        let released = self.phase.end(now);
        if let Some((ticket, answer)) = released.load {
            acts.push(Do::Answer(ticket, answer));
            self.pace.count_from(now + QUIET_AFTER_LOAD);
            self.visits.be_quiet(now);
        }
        for read in released.reads {
            acts.push(Do::Answer(read, Payload::value(&self.settings)));
        }
    }

    /// A client is gone, and its calls are done.
    fn forget(&mut self, client: ConnectionId) {
        self.clients.remove(&client);
        self.managers.forget(client);
        self.held.forget(client);
        self.late.forget(client);
        self.phase.forget(client);
        self.participants.forget(client);
        self.visits.forget(client);
    }

    /// When the world ticks by itself: never while nobody is connected, while clients tick, or
    /// while the Traffic Managers of one change over to a new world.
    fn next_tick_at(&self) -> Option<Instant> {
        let stands =
            self.phase.is_loading() || self.clients.is_empty() || self.world != WorldState::Alive;
        if stands { None } else { self.pace.due(&self.settings) }
    }

    /// When a visited world is shown again that does not tick: those who come wait for a frame.
    fn stands_until(&self) -> Option<Instant> {
        let follows = self.world == WorldState::Visited && !self.settings.synchronous_mode;
        let stands = self.phase.is_loading() || self.clients.is_empty();
        if follows && !stands { self.visits.stands_until() } else { None }
    }

    fn ticks_by_itself(&self) -> bool {
        !self.settings.synchronous_mode && self.next_tick_at().is_some()
    }
}

#[cfg(test)]
mod tests;

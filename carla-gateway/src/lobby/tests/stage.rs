//! A lobby on a virtual clock, with an endpoint that does at once what it is told to finish.

use std::net::Ipv4Addr;
use std::time::Duration;

use serde::Serialize;
use tokio::task::JoinHandle;

use super::super::*;
use crate::archive::Prepared;
use crate::lobby::pace::Loss;
use crate::rpc::{Refusal, Request};

/// Between two ticks.
pub(super) const PERIOD: Duration = Duration::from_millis(40);
pub(super) const PACING: Pacing = Pacing { period: PERIOD, sync_lease: None, clock_lease: None };

/// A lobby, its clock, and what became of calls.
pub(super) struct Stage {
    pub(super) lobby: Lobby,
    pub(super) now: Instant,
    begun_at: Instant,
    /// The job that is under way, and since when.
    pub(super) job: Option<Job>,
    job_begun_at: Instant,
    /// How the endpoint is.
    pub(super) settings: EpisodeSettings,
    pub(super) frame_number: u64,
    pub(super) episodes_begun: u64,
    pub(super) world: WorldState,
    /// When each call was answered, after the beginning.
    pub(super) answers: BTreeMap<(u64, u32), Vec<Duration>>,
    pub(super) refusals: usize,
    pub(super) woken: Vec<u16>,
    pub(super) borrowed: Vec<u16>,
    pub(super) losses: Vec<Loss>,
    /// Clients that were waited for in vain, in all.
    pub(super) missed: usize,
    /// Loads lead into the world of a session.
    pub(super) loads_visit: bool,
    /// Batches have a tick at their end.
    pub(super) batches_tick: bool,
    pub(super) restless: Vec<u16>,
    /// What the present job is answered with, some day.
    pub(super) later: Option<JoinHandle<Answer>>,
    /// Whose answers are somebody else's business.
    pub(super) answered_later: Vec<(u64, u32)>,
    /// What the present call waits for, to come again.
    pub(super) opening: Option<JoinHandle<Prepared>>,
    to_come_again: Vec<(Ticket, Again)>,
    next_id: u32,
}

impl Stage {
    pub(super) fn new() -> Self {
        let now = Instant::now();
        Self {
            lobby: Lobby::new(PACING, ClientVersion::V0_9, now),
            now,
            begun_at: now,
            job: None,
            job_begun_at: now,
            settings: EpisodeSettings::default(),
            frame_number: 0,
            episodes_begun: 0,
            world: WorldState::None,
            answers: BTreeMap::new(),
            refusals: 0,
            woken: Vec::new(),
            borrowed: Vec::new(),
            losses: Vec::new(),
            missed: 0,
            loads_visit: false,
            batches_tick: false,
            restless: Vec::new(),
            later: None,
            answered_later: Vec::new(),
            opening: None,
            to_come_again: Vec::new(),
            next_id: 1,
        }
    }

    /// With so many clients, the first of which has the settings and a world.
    pub(super) fn with(clients: u64, synchronous_mode: bool) -> Self {
        let mut stage = Self::new();
        for client in 1..=clients {
            stage.connect(client);
        }
        stage.settings.synchronous_mode = synchronous_mode;
        stage.call(1, "load_new_episode", (true,));
        stage.finish();
        stage.pass(Duration::from_secs(5));
        stage
    }

    pub(super) fn connect(&mut self, client: u64) {
        let whereabouts = Whereabouts {
            here: (Ipv4Addr::LOCALHOST, 2_000).into(),
            there: (Ipv4Addr::LOCALHOST, 40_000).into(),
        };
        self.tell(Event::Connected(ConnectionId(client), whereabouts));
    }

    pub(super) fn disconnect(&mut self, client: u64) {
        self.tell(Event::Disconnected(ConnectionId(client)));
    }

    /// A call with arguments beside the metadata; gives its number.
    pub(super) fn call(&mut self, client: u64, method: &str, args: impl Serialize) -> u32 {
        let id = self.next_id;
        self.next_id += 1;
        let bytes = rmp_serde::to_vec(&(0, id, method, args)).unwrap();
        let request = Request::parse(&with_metadata(bytes)).unwrap();
        let ticket = request.ticket(ConnectionId(client));
        self.tell(Event::Called(Call { ticket, request, prepared: None }));
        id
    }

    /// As [`call`](Self::call), and the endpoint does what comes of it.
    pub(super) fn call_and_finish(
        &mut self,
        client: u64,
        method: &str,
        args: impl Serialize,
    ) -> u32 {
        let id = self.call(client, method, args);
        self.finish();
        id
    }

    /// A Traffic Manager starts in a client, and steps once.
    pub(super) fn start_manager(&mut self, client: u64, port: u16) {
        self.call(client, "add_traffic_manager_running", (("localhost", port),));
        self.call_and_finish(client, "apply_batch", ((), false));
    }

    /// The endpoint does everything that it is told, in no time.
    pub(super) fn finish(&mut self) {
        while self.job.is_some() {
            self.finish_one(Timing::Now, true);
        }
    }

    /// The endpoint does the present job; as the calls do that it stands for.
    pub(super) fn finish_one(&mut self, timing: Timing, succeeds: bool) {
        let Job { task, brief } = self.job.take().unwrap();
        let mut last_tick = brief.last_tick;
        let mut expects_step = false;
        let (mut asks_for_frame, mut awaits_world) = (false, false);
        match &task {
            Task::Call(request, _) if request.method == "load_new_episode" && succeeds => {
                self.episodes_begun += 1;
                self.frame_number += 1;
                let is_visit = self.loads_visit;
                self.world = if is_visit { WorldState::Visited } else { WorldState::Alive };
            }
            Task::Call(request, _) => {
                expects_step = request.method == "set_episode_settings";
                let ticks = request.method == "apply_batch" && self.batches_tick && succeeds;
                asks_for_frame = ticks && brief.shares_clock;
                self.frame_number += u64::from(ticks && !asks_for_frame);
                if brief.finds_new_world {
                    self.episodes_begun += 1;
                    self.world = WorldState::Alive;
                }
            }
            Task::Advance if self.world == WorldState::Visited => awaits_world = true,
            Task::ShowVisited(_) | Task::StandStill => self.frame_number += 1,
            Task::Advance | Task::TickByItself if succeeds => {
                self.frame_number += 1;
                last_tick = self.job_begun_at;
            }
            Task::Advance | Task::TickByItself | Task::Prepare | Task::ShowEpisode => {}
        }
        let answer = match succeeds {
            true => Ok(Payload::Void),
            false => Err(Refusal("as the test wants".to_owned())),
        };
        let later = self.later.take();
        let again = match (self.opening.take(), task) {
            (Some(ready), Task::Call(request, _)) => Some(Again { request, ready }),
            _ => None,
        };
        self.tell(Event::Done(Box::new(Report {
            answer,
            later,
            again,
            timing,
            expects_step,
            asks_for_frame,
            awaits_world,
            settings: self.settings.clone(),
            frame_number: self.frame_number,
            episodes_begun: self.episodes_begun,
            world: self.world,
            last_tick,
        })));
    }

    /// What calls waited for is ready.
    pub(super) fn come_again(&mut self) {
        for (ticket, Again { request, .. }) in std::mem::take(&mut self.to_come_again) {
            self.tell(Event::Called(Call { ticket, request, prepared: None }));
        }
    }

    /// Time passes; ticks take none.
    pub(super) fn pass(&mut self, span: Duration) {
        let until = self.now + span;
        while let Some(due) = self.lobby.due().filter(|due| *due <= until) {
            self.now = self.now.max(due);
            self.tell(Event::Due);
            self.finish();
        }
        self.now = until;
    }

    /// Since the beginning.
    pub(super) fn elapsed(&self) -> Duration {
        self.now - self.begun_at
    }

    /// Time passes, and the endpoint does not get on.
    pub(super) fn pass_while_busy(&mut self, span: Duration) {
        let until = self.now + span;
        while let Some(due) = self.lobby.due().filter(|due| *due <= until) {
            self.now = self.now.max(due);
            self.tell(Event::Due);
        }
        self.now = until;
    }

    /// Whether a call was answered; never twice.
    pub(super) fn is_answered(&self, client: u64, id: u32) -> bool {
        match self.answers.get(&(client, id)).map(Vec::as_slice) {
            None => false,
            Some([_]) => true,
            Some(more) => panic!("call {id} of {client} was answered at {more:?}"),
        }
    }

    pub(super) fn tell(&mut self, event: Event) {
        for act in self.lobby.take(event, self.now) {
            match act {
                Do::Answer(ticket, answer) => {
                    self.refusals += usize::from(answer.is_err());
                    let of = (ticket.client.0, ticket.id);
                    let at = self.elapsed();
                    self.answers.entry(of).or_default().push(at);
                }
                Do::AnswerLater(ticket, _) => {
                    self.answered_later.push((ticket.client.0, ticket.id));
                }
                Do::CallAgain(ticket, again) => self.to_come_again.push((ticket, again)),
                Do::Begin(job) => {
                    assert!(self.job.is_none(), "two jobs at once");
                    self.job = Some(job);
                    self.job_begun_at = self.now;
                }
                Do::Wake(_, port) => self.woken.push(port),
                Do::BorrowPort(port, _) => self.borrowed.push(port),
                Do::TellLoss(loss) => self.losses.push(loss),
                Do::TellMissing(clients) => self.missed += clients,
                Do::TellRestless(port) => self.restless.push(port),
            }
        }
    }
}

/// Puts `[false]`, which every call begins with, before the arguments.
fn with_metadata(call: Vec<u8>) -> Vec<u8> {
    // [0, id, method, arguments]: the arguments are an array of at most 15.
    let mut rest = &call[..];
    rmp::decode::read_array_len(&mut rest).unwrap();
    rmp::decode::read_int::<u8, _>(&mut rest).unwrap();
    rmp::decode::read_int::<u32, _>(&mut rest).unwrap();
    let length = rmp::decode::read_str_len(&mut rest).unwrap() as usize;
    let at = call.len() - rest.len() + length;
    let (head, arguments) = call.split_at(at);
    let count = match arguments[0] {
        0xc0 => 0,
        array => array - 0x90,
    };
    [head, &[0x91 + count, 0x91, 0xc2], &arguments[1..]].concat()
}

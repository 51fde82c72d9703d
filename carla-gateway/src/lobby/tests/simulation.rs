//! Clients that do anything at any time, services that die, and events that come late, twice or
//! never, on a virtual clock: every call is answered once, frames come in order, nothing is left.

#[path = "../../../../tests/seeds.rs"]
mod seeds;

use std::collections::BTreeSet;
use std::time::Duration;

use schemas::SplitMix64;

use super::super::*;
use super::stage::{PACING, Stage};

const STEPS: usize = 200;
const CLIENTS_MAX: usize = 6;
const METHODS: [&str; 14] = [
    "version",
    "get_episode_settings",
    "get_episode_info",
    "get_spectator",
    "spawn_actor",
    "destroy_actor",
    "tick_cue",
    "load_new_episode",
    "set_episode_settings",
    "apply_batch",
    "add_traffic_manager_running",
    "is_traffic_manager_running",
    "destroy_traffic_manager",
    "get_required_files",
];

struct Dice(SplitMix64);

impl Dice {
    fn roll(&mut self, sides: usize) -> usize {
        (self.0.next_u64() % sides as u64) as usize
    }

    fn one_in(&mut self, sides: usize) -> bool {
        self.roll(sides) == 0
    }
}

struct Simulation {
    dice: Dice,
    stage: Stage,
    clients: Vec<u64>,
    came: u64,
    /// Calls of clients that are here.
    calls: BTreeSet<(u64, u32)>,
}

impl Simulation {
    fn new(seed: u64) -> Self {
        let (clients, calls) = (Vec::new(), BTreeSet::new());
        let mut stage = Stage::new();
        // In half of them clients share the clock.
        if seed % 2 == 1 {
            let pacing = Pacing { clock_lease: Some(Duration::from_secs(2)), ..PACING };
            stage.lobby = Lobby::new(pacing, ClientVersion::V0_9, stage.now);
            stage.batches_tick = true;
        }
        Self { dice: Dice(SplitMix64::new(seed)), stage, clients, came: 0, calls }
    }

    fn step(&mut self) {
        match self.dice.roll(16) {
            0 if self.clients.len() < CLIENTS_MAX => self.connect(),
            1 if self.dice.one_in(4) => self.disconnect(),
            // Time for nothing, and what was done already: neither has an effect.
            2 => self.stage.tell(Event::Due),
            3..=5 => {
                let span = Duration::from_millis(self.dice.roll(400) as u64);
                self.stage.pass_while_busy(span);
            }
            6 if self.dice.one_in(8) => {
                self.stage.pass_while_busy(Duration::from_secs(self.dice.roll(40) as u64));
            }
            7..=11 => self.work(),
            _ => self.call(),
        }
        self.check();
    }

    fn connect(&mut self) {
        self.came += 1;
        self.stage.connect(self.came);
        self.clients.push(self.came);
    }

    fn disconnect(&mut self) {
        if self.clients.is_empty() {
            return;
        }
        let client = self.clients.swap_remove(self.dice.roll(self.clients.len()));
        self.calls.retain(|(of, _)| *of != client);
        for _ in 0..=self.dice.roll(2) {
            self.stage.disconnect(client);
        }
    }

    fn call(&mut self) {
        if self.clients.is_empty() || !self.stage.lobby.has_room() {
            return;
        }
        let client = self.clients[self.dice.roll(self.clients.len())];
        let method = METHODS[self.dice.roll(METHODS.len())];
        // A lost call is one that is never made; one that comes twice is two.
        for _ in 0..=usize::from(self.dice.one_in(8)) {
            let port = 8_000 + self.dice.roll(3) as u16;
            let id = match method {
                "add_traffic_manager_running" => {
                    self.stage.call(client, method, (("localhost", port),))
                }
                "is_traffic_manager_running" | "destroy_traffic_manager" => {
                    self.stage.call(client, method, (port,))
                }
                "get_required_files" => {
                    let folder = if self.dice.one_in(3) { "" } else { "TM" };
                    self.stage.call(client, method, (folder,))
                }
                _ => self.stage.call(client, method, ()),
            };
            self.calls.insert((client, id));
        }
    }

    /// The endpoint finishes its job: well, badly, or because its world is gone.
    fn work(&mut self) {
        let Some(job) = &self.stage.job else { return };
        match &job.task {
            Task::Call(request, _) if request.method == "set_episode_settings" => {
                self.stage.settings.synchronous_mode = self.dice.one_in(2);
            }
            Task::TickByItself => self.stage.settings.synchronous_mode = false,
            _ => {}
        }
        if self.dice.one_in(40) && self.stage.world == WorldState::Alive {
            self.stage.world = WorldState::Lost;
        }
        let timings = [Timing::Now, Timing::AfterManagersStep, Timing::WithNextFrame];
        let timing = timings[self.dice.roll(timings.len())];
        let succeeds = self.stage.world != WorldState::Lost && !self.dice.one_in(10);
        self.stage.finish_one(timing, succeeds);
    }

    fn check(&self) {
        let Stage { lobby, job, .. } = &self.stage;
        assert_eq!(job.is_some(), lobby.under_way.is_some(), "a job got lost");
        if let Some(Job { task: Task::TickByItself, .. }) = job {
            assert!(lobby.world == WorldState::Alive && !lobby.clients.is_empty());
            assert!(!lobby.settings.synchronous_mode && !lobby.phase.is_loading());
        }
        if job.is_none() {
            assert!(lobby.waiting.is_empty(), "calls wait for nothing");
        }
        assert!(lobby.waiting.len() <= CALLS_MAX + 2 * CLIENTS_MAX);
        for at in self.stage.answers.values() {
            assert_eq!(at.len(), 1, "answered more than once");
        }
    }

    /// All that was begun comes to its end: nobody waits for ever, and nothing is left.
    fn end(&mut self) {
        for _ in 0..20_000 {
            if self.stage.job.is_none() {
                break;
            }
            self.work();
        }
        self.stage.pass(Duration::from_secs(120));
        for (client, id) in &self.calls {
            assert!(self.stage.is_answered(*client, *id), "call {id} of {client} has no answer");
        }
        for client in std::mem::take(&mut self.clients) {
            self.stage.disconnect(client);
        }
        self.stage.finish();
        let lobby = &self.stage.lobby;
        let left = lobby.clients.len() + lobby.managers.len() + lobby.held.len();
        assert_eq!(lobby.participants.len(), 0);
        assert_eq!(left + lobby.late.len() + lobby.phase.len() + lobby.waiting.len(), 0);
        assert_eq!(lobby.due(), None, "nobody is here, and it does not rest");
    }

    fn run(seed: u64) -> Stage {
        let mut simulation = Self::new(seed);
        for _ in 0..STEPS {
            simulation.step();
        }
        simulation.end();
        simulation.stage
    }
}

#[test]
fn whatever_happens_every_call_is_answered_once_and_nothing_is_left() {
    seeds::each(|seed| drop(Simulation::run(seed)));
}

#[test]
fn the_same_happenings_have_the_same_answers_at_the_same_times() {
    for seed in 0..20 {
        let (first, second) = (Simulation::run(seed), Simulation::run(seed));
        assert_eq!(first.answers, second.answers);
        assert_eq!(first.frame_number, second.frame_number);
    }
}

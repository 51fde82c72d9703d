//! Clients that do anything at any time, over worlds whose answers are lost, late, doubled or too
//! short and whose service dies, on a virtual clock: every call is answered once and in time,
//! frames come in order, what is refused or given up changes nothing, and nothing is left.

mod clock;
#[path = "../../tests/seeds.rs"]
mod seeds;
mod worlds;

use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use schemas::SplitMix64;
use serde_json::Value;

use crate::action::{Action, ActionKind};
use crate::scenario::Profile;
use crate::session::table::{IdleTimes, InUse, Life, Sessions};
use crate::session::{ResetRequest, Session, SessionContext, SessionError};
use crate::testing;
use crate::world_port::WorldPort;
use clock::Clock;
use worlds::{DEADLINE_MILLIS, LATE_MILLIS, UnreliableWorlds};

const CLIENTS: u64 = 4;
const CALLS: usize = 20;
const SESSIONS_MAX: u32 = 3;
/// A reset asks for maps and a world, a step for a copy and its tick, behind others' steps.
const ANSWER_MILLIS_MAX: u64 = 6 * DEADLINE_MILLIS;
/// Polls after which nothing that happened at one moment has any further effect.
const TURNS: usize = 20;
const SCENARIOS: [&str; 5] = ["trolley_saves", "bias_2v1", "free_roam", "maze_navigation", "nope"];

/// What came of a call.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Outcome {
    Done,
    Refused,
    Lost,
    /// The caller went before the answer.
    GivenUp,
    Full,
}

type History = Arc<Mutex<Vec<(u64, u64, Outcome)>>>;

/// One client with one session after the other.
struct Client {
    number: u64,
    dice: SplitMix64,
    clock: Clock,
    worlds: Arc<UnreliableWorlds>,
    sessions: Arc<Sessions>,
    history: History,
    /// A call was given up: what it asked for may still be done.
    is_uncertain: bool,
}

impl Client {
    fn roll(&mut self, sides: u64) -> u64 {
        self.dice.next_u64() % sides
    }

    async fn run(mut self) {
        let mut calls = 0;
        while calls < CALLS {
            let life = if self.roll(2) == 0 { Life::Connection } else { Life::Detached };
            match self.sessions.of(testing::visitor()).open(life) {
                Ok(in_use) => {
                    calls += self.converse(&in_use).await;
                    drop(in_use);
                }
                Err(_) => self.note(Outcome::Full),
            }
            calls += 1;
            let pause_millis = self.roll(500);
            self.clock.sleep(pause_millis).await;
            self.sessions.reap();
        }
    }

    /// Some calls of one session.
    async fn converse(&mut self, in_use: &InUse) -> usize {
        let count = 1 + self.roll(12) as usize;
        for _ in 0..count {
            let outcome = self.call(&mut *in_use.session.lock().await).await;
            self.note(outcome);
            let pause_millis = self.roll(40);
            self.clock.sleep(pause_millis).await;
        }
        count
    }

    async fn call(&mut self, session: &mut Session) -> Outcome {
        let before = Seen::of(session, &self.worlds);
        let begun_millis = self.clock.now_millis();
        let patience_millis = (self.roll(12) == 0).then(|| self.roll(30));
        let is_reset = self.roll(8) == 0;
        let (request, action) = (self.reset_request(), self.action());
        let call = async {
            match is_reset {
                true => session.reset(request).await,
                false => session.step(&action).await,
            }
        };
        let result = tokio::select! {
            biased;
            result = call => Some(result),
            () = self.lose_patience(patience_millis) => None,
        };
        let taken_millis = self.clock.now_millis() - begun_millis;
        assert!(
            taken_millis <= ANSWER_MILLIS_MAX,
            "{action:?} was answered {taken_millis} ms late"
        );
        let after = Seen::of(session, &self.worlds);
        // A first step begins an episode before it does anything else.
        let begins = is_reset || before.tick.is_none();
        let outcome = match result {
            Some(Ok(_)) if begins => Outcome::Done,
            Some(Ok(_)) => {
                let has_ticked = after.tick > before.tick;
                // Whoever ticks says from where, so that no other tick can have come between.
                self.is_uncertain &= !has_ticked;
                after.must_follow(&before, action.kind, self.is_uncertain);
                Outcome::Done
            }
            Some(Err(SessionError::WorldLost(_))) => {
                assert_eq!(after.tick, None, "a lost world is still used");
                Outcome::Lost
            }
            Some(Err(error)) => {
                if is_reset || !begins {
                    after.must_equal(&before, self.is_uncertain, &error.to_string());
                }
                Outcome::Refused
            }
            None => {
                if is_reset || !begins {
                    after.must_equal(&before, true, "a call that was given up");
                }
                Outcome::GivenUp
            }
        };
        let goes_on = outcome == Outcome::Refused || (outcome == Outcome::Done && !begins);
        self.is_uncertain = outcome == Outcome::GivenUp || (self.is_uncertain && goes_on);
        outcome
    }

    async fn lose_patience(&self, after_millis: Option<u64>) {
        match after_millis {
            Some(millis) => self.clock.sleep(millis).await,
            None => std::future::pending().await,
        }
    }

    fn reset_request(&mut self) -> ResetRequest {
        let name = SCENARIOS[self.roll(SCENARIOS.len() as u64) as usize];
        ResetRequest {
            scenario_name: Some(name.to_owned()),
            seed: Some(self.roll(50)),
            episode_id: Some("e".to_owned()),
            ..ResetRequest::default()
        }
    }

    fn action(&mut self) -> Action {
        let kind = ActionKind::ALL[self.roll(ActionKind::ALL.len() as u64) as usize];
        // The toy knows no way to places that are far away.
        let destination = [0.0, 2_000.0][self.roll(2) as usize];
        Action {
            lane_direction: Some("left".to_owned()),
            destination_x: Some(destination),
            destination_y: Some(destination),
            destination_z: Some(0.0),
            ..Action::of(kind)
        }
    }

    fn note(&self, outcome: Outcome) {
        self.history.lock().unwrap().push((self.clock.now_millis(), self.number, outcome));
    }
}

/// A session and its world between two calls.
struct Seen {
    state: Value,
    /// Its tick in the eyes of the session.
    tick: Option<u64>,
    /// The world's tick and hash, if the session has one that exists.
    world: Option<(u64, u64)>,
}

impl Seen {
    fn of(session: &Session, worlds: &UnreliableWorlds) -> Self {
        let episode = session.present();
        let look = episode.and_then(|(_, world)| worlds.toys.look(world?));
        Self {
            state: serde_json::to_value(session.state()).unwrap(),
            tick: episode.map(|(tick, _)| tick.0),
            world: look.map(|(tick, hash)| (tick.0, hash)),
        }
    }

    fn must_follow(&self, before: &Self, action: ActionKind, is_uncertain: bool) {
        let steps = |seen: &Self| seen.state["step_count"].as_u64().unwrap();
        assert_eq!(steps(self), steps(before) + 1, "{action:?}");
        match action {
            ActionKind::CaptureImage => assert_eq!(self.tick, before.tick),
            // Without an agent there is nothing to follow.
            ActionKind::FollowRoute => assert!(self.tick >= before.tick),
            _ => assert!(self.tick > before.tick, "{action:?} came before"),
        }
        // The service may have died since it answered.
        if let Some((tick, _)) = self.world.filter(|_| !is_uncertain) {
            assert_eq!(Some(tick), self.tick, "the world is not where the episode believes it is");
        }
    }

    fn must_equal(&self, before: &Self, is_uncertain: bool, why: &str) {
        assert_eq!(self.state, before.state, "{why} has changed something");
        // The service may have died meanwhile, or the world may have been made again.
        if let (Some(now), Some(then)) = (self.world, before.world)
            && !is_uncertain
        {
            assert_eq!(now, then, "{why} has changed the world");
        }
    }
}

struct Simulation {
    clock: Clock,
    worlds: Arc<UnreliableWorlds>,
    context: Arc<SessionContext>,
    sessions: Arc<Sessions>,
    history: History,
}

impl Simulation {
    fn new(seed: u64) -> Self {
        let clock = Clock::default();
        let worlds = Arc::new(UnreliableWorlds::new(seed, clock.clone()));
        let port = Arc::clone(&worlds) as Arc<dyn WorldPort>;
        let context = SessionContext::new(
            testing::visitor().tenant,
            port,
            "trolley_saves".to_owned(),
            Profile::Documented,
        );
        context.maps.learn(testing::map());
        let context = Arc::new(context);
        let idle = IdleTimes { connected: Duration::MAX, detached: Duration::ZERO };
        let sessions = testing::sessions(&context, SESSIONS_MAX, idle);
        Self { clock, worlds, context, sessions, history: History::default() }
    }

    async fn run(&self, seed: u64) {
        let clients: Vec<_> = (1..=CLIENTS)
            .map(|number| {
                let client = Client {
                    number,
                    dice: SplitMix64::new(seed ^ (number << 32)),
                    clock: self.clock.clone(),
                    worlds: Arc::clone(&self.worlds),
                    sessions: Arc::clone(&self.sessions),
                    history: Arc::clone(&self.history),
                    is_uncertain: false,
                };
                tokio::spawn(client.run())
            })
            .collect();
        let mut dice = SplitMix64::new(!seed);
        loop {
            settle().await;
            if clients.iter().all(tokio::task::JoinHandle::is_finished) {
                break;
            }
            if dice.next_u64().is_multiple_of(400) {
                self.worlds.die(dice.next_u64() % 5_000);
            }
            assert!(self.clock.go_on(), "somebody waits, and nothing will happen");
        }
        for client in clients {
            client.await.unwrap();
        }
        self.end().await;
    }

    /// Nobody is here and nothing goes wrong any more: nothing is left.
    async fn end(&self) {
        self.worlds.heal();
        self.sessions.reap();
        assert_eq!(self.sessions.load().0, 0, "sessions are left");
        let start = Instant::now();
        // What is carried out late is listed late, and freed when no answer can come any more.
        for count in 1..=4 {
            let collector = Arc::clone(&self.context.collector);
            let clock = self.clock.clone();
            let sweeping = tokio::spawn(async move {
                clock.sleep(LATE_MILLIS).await;
                collector.sweep(start + count * Duration::from_millis(LATE_MILLIS)).await;
            });
            while !sweeping.is_finished() {
                self.clock.go_on();
                settle().await;
            }
            sweeping.await.unwrap();
        }
        assert_eq!(self.worlds.toys.count(), 0, "worlds are left");
        assert!(self.context.ticker.is_idle(), "steps wait for nobody");
    }
}

/// Lets everything have its effect that has happened.
async fn settle() {
    for _ in 0..TURNS {
        tokio::task::yield_now().await;
    }
}

fn simulate(seed: u64) -> Simulation {
    // Its timers go by the wall clock: none of them is ever due here.
    let runtime = tokio::runtime::Builder::new_current_thread().enable_time().build().unwrap();
    let simulation = Simulation::new(seed);
    runtime.block_on(simulation.run(seed));
    simulation
}

#[test]
fn whatever_the_worlds_do_every_call_is_answered_and_nothing_is_left() {
    let (mut outcomes, mut met) = ([0_usize; 5], [0_usize; 6]);
    seeds::each(|seed| {
        let simulation = simulate(seed);
        for (_, _, outcome) in simulation.history.lock().unwrap().iter() {
            outcomes[*outcome as usize] += 1;
        }
        for (sum, count) in met.iter_mut().zip(&simulation.worlds.met) {
            *sum += count.load(std::sync::atomic::Ordering::Relaxed);
        }
    });
    println!("done, refused, lost, given up, full: {outcomes:?}; misfortunes: {met:?}");
    assert!(outcomes.iter().chain(&met).all(|count| *count > 0), "{outcomes:?}, {met:?}");
}

#[test]
fn the_same_misfortunes_have_the_same_outcomes_at_the_same_times() {
    for seed in 0..10 {
        let (first, second) = (simulate(seed), simulate(seed));
        assert_eq!(*first.history.lock().unwrap(), *second.history.lock().unwrap());
    }
}

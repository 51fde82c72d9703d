//! One world with its agents, through one episode after the other.

use std::sync::Arc;

use schemas::{ActorId, Error, ErrorCode, Frame, SplitMix64};

use crate::action::Action;
use crate::agent::{Agent, Outcome, Rules};
use crate::course::{Course, Start};
use crate::end::Cause;
use crate::motion::{Motion, Shape};
use crate::observe::{Encoder, View};
use crate::rows::Rows;
use crate::scene::{Neighbour, Scene};
use crate::spec::{Autoreset, Spec};
use crate::tier::Tier;

/// Starts that are tried, one after the other, when something stands in the way at one.
const TRIES: usize = 64;

/// What all worlds of a batch share.
pub(crate) struct Shared<T: Tier> {
    course: Arc<Course>,
    kit: T::Kit,
    rules: Rules,
    encoder: Encoder,
    autoreset: Autoreset,
    decision_ticks: u32,
    hash_every: u64,
}

/// One world in its episode.
#[derive(Clone)]
pub(crate) struct Env<T: Tier> {
    sim: T,
    agents: Vec<Agent>,
    /// Seeds of the episodes to come.
    stream: SplitMix64,
    /// Of the present episode.
    seed: u64,
    ticks: u64,
    /// Hash of the state when it was last worked out.
    hash: u64,
    /// Every agent's episode has ended, and the next one has not begun.
    over: bool,
}

impl<T: Tier> Shared<T> {
    /// # Errors
    /// What of the spec cannot be.
    pub(crate) fn new(spec: &Spec, course: &Arc<Course>) -> Result<Self, Error> {
        Ok(Self {
            kit: T::kit(course)?,
            rules: Rules::new(spec, &course.task)?,
            encoder: Encoder::new(spec.observation, spec.normalise, &course.map, &course.lines),
            autoreset: spec.autoreset,
            decision_ticks: spec.decision_ticks,
            hash_every: u64::from(spec.hash_every) * u64::from(spec.decision_ticks),
            course: Arc::clone(course),
        })
    }

    /// About what a world takes.
    pub(crate) fn world_bytes(&self) -> usize {
        T::WORLD_BYTES + self.course.body_count() * T::BODY_BYTES
    }

    /// A world and its agents at the start that a seed picks.
    ///
    /// # Errors
    /// Why nobody can start anywhere near.
    fn begin(&self, episode_seed: u64) -> Result<(T, Vec<Agent>), Error> {
        let first = self.course.start_of(episode_seed);
        let count = self.course.start_count();
        let mut refused = Error::new(ErrorCode::SpawnBlocked, "no start is free");
        for index in (first..first + TRIES.min(count)).map(|index| index % count) {
            match T::begin(&self.course, &self.kit, index) {
                Ok(sim) => {
                    let Start { agents: starts, sky, .. } = self.course.start(index);
                    let new = |(agent, start)| Agent::new(start, sky.number, &sim.motion(agent));
                    let mut agents: Vec<Agent> = starts.iter().enumerate().map(new).collect();
                    let mut colours = Vec::new();
                    sim.lights(&mut colours);
                    agents.iter_mut().for_each(|agent| agent.look_out(&colours));
                    return Ok((sim, agents));
                }
                Err(error) => refused = error,
            }
        }
        Err(refused)
    }
}

impl<T: Tier> Env<T> {
    /// A world in the first episode of a seed.
    ///
    /// # Errors
    /// Why nobody can start anywhere.
    pub(crate) fn new(shared: &Shared<T>, seed: u64) -> Result<Self, Error> {
        let mut stream = SplitMix64::new(seed);
        let seed = episode_seed(&mut stream);
        let (sim, agents) = shared.begin(seed)?;
        let hash = sim.hash();
        Ok(Self { sim, agents, stream, seed, ticks: 0, hash, over: false })
    }

    /// Begins the next episode of its stream, or the first one of another seed.
    ///
    /// # Errors
    /// As for [`new`](Self::new); then nothing has changed.
    pub(crate) fn begin(&mut self, shared: &Shared<T>, seed: Option<u64>) -> Result<(), Error> {
        let mut stream = seed.map_or_else(|| self.stream.clone(), SplitMix64::new);
        let seed = episode_seed(&mut stream);
        let (sim, agents) = shared.begin(seed)?;
        let hash = sim.hash();
        *self = Self { sim, agents, stream, seed, ticks: 0, hash, over: false };
        Ok(())
    }

    /// Gives it episodes of its own from here on.
    pub(crate) fn reseed(&mut self, number: u64) {
        let root = SplitMix64::new(self.stream.state() ^ number).next_u64();
        self.stream = SplitMix64::new(root);
    }

    pub(crate) fn frame(&self) -> Option<(Frame, Vec<ActorId>)> {
        self.sim.frame()
    }

    pub(crate) fn is_over(&self) -> bool {
        self.over
    }

    /// Writes what it is now, as after a reset.
    pub(crate) fn show(&self, shared: &Shared<T>, rows: &mut Rows<'_>, scene: &mut Scene) {
        self.look(shared, scene);
        self.encode(shared, rows, scene);
        for (alive, agent) in rows.alive.iter_mut().zip(&self.agents) {
            *alive = u8::from(agent.alive);
        }
        rows.rewards.fill(0.0);
        rows.terminations.fill(0);
        rows.truncations.fill(0);
        self.sign(rows);
    }

    /// Writes the observations of all agents, of a scene that is theirs.
    fn encode(&self, shared: &Shared<T>, rows: &mut Rows<'_>, scene: &Scene) {
        let width = shared.encoder.width();
        for (index, agent) in self.agents.iter().enumerate() {
            let row = &mut rows.observations[index * width..(index + 1) * width];
            if agent.alive {
                let motion = self.sim.motion(index);
                let view = view(agent, (index, &motion), self.sim.shape(index), scene);
                shared.encoder.encode(&view, row);
            } else {
                row.fill(0.0);
            }
        }
    }

    /// Makes the scene that of this world, as far as anybody looks at it.
    fn look(&self, shared: &Shared<T>, scene: &mut Scene) {
        scene.colours.clear();
        self.sim.lights(&mut scene.colours);
        scene.everybody.clear();
        if !shared.encoder.sees_others() {
            return;
        }
        for (index, agent) in self.agents.iter().enumerate() {
            let (motion, shape) = (self.sim.motion(index), self.sim.shape(index));
            scene.everybody.push(Neighbour::agent(&motion, shape, agent.alive));
        }
        self.sim.others(&mut scene.everybody);
    }

    fn sign(&self, rows: &mut Rows<'_>) {
        rows.seeds.fill(self.seed);
        rows.ticks.fill(self.ticks);
        rows.hashes.fill(self.hash);
    }

    /// Advances by one step, of which `actions` has a row for each agent.
    ///
    /// - **Domain:** a world whose episode is over begins the next one instead.
    ///
    /// # Errors
    /// As for [`begin`](Self::begin).
    pub(crate) fn step(
        &mut self,
        shared: &Shared<T>,
        actions: &[f32],
        rows: &mut Rows<'_>,
        scene: &mut Scene,
    ) -> Result<(), Error> {
        if self.over {
            self.begin(shared, None)?;
            self.show(shared, rows, scene);
            return Ok(());
        }
        for (index, row) in actions.chunks_exact(Action::WIDTH).enumerate() {
            if self.agents[index].alive {
                self.sim.drive(index, Action::from_row(row));
            }
        }
        let fault = (0..shared.decision_ticks).any(|_| self.sim.tick().is_err());
        self.ticks += u64::from(shared.decision_ticks);
        self.look(shared, scene);
        for index in 0..self.agents.len() {
            let action = actions.get(index * Action::WIDTH..).unwrap_or_default();
            self.judge(shared, (index, Action::from_row(action), fault), rows, scene);
        }
        self.over = self.agents.iter().all(|agent| !agent.alive);
        if self.over || shared.hash_every > 0 && self.ticks.is_multiple_of(shared.hash_every) {
            self.hash = self.sim.hash();
        }
        self.sign(rows);
        if self.over && shared.autoreset == Autoreset::SameStep {
            self.begin_within(shared, rows, scene)?;
        }
        Ok(())
    }

    /// Writes one agent's row of a step.
    fn judge(
        &mut self,
        shared: &Shared<T>,
        (index, action, fault): (usize, Action, bool),
        rows: &mut Rows<'_>,
        scene: &Scene,
    ) {
        let width = shared.encoder.width();
        let row = &mut rows.observations[index * width..(index + 1) * width];
        let agent = &mut self.agents[index];
        rows.alive[index] = u8::from(agent.alive);
        if !agent.alive {
            row.fill(0.0);
            rows.rewards[index] = 0.0;
            rows.terminations[index] = 0;
            rows.truncations[index] = 0;
            return;
        }
        let (motion, shape) = (self.sim.motion(index), self.sim.shape(index));
        let contacts = self.sim.take_contacts(index);
        let outcome = Outcome { motion: &motion, contacts, colours: &scene.colours };
        let verdict = agent.advance(&shared.rules, action, &outcome);
        let cause = if fault { Some(Cause::Fault) } else { verdict.cause };
        shared.encoder.encode(&view(agent, (index, &motion), shape, scene), row);
        rows.rewards[index] = verdict.reward;
        rows.terminations[index] = u8::from(cause.is_some_and(|cause| !cause.truncates()));
        rows.truncations[index] = u8::from(cause.is_some_and(Cause::truncates));
        let Some(cause) = cause else { return };
        agent.alive = false;
        let columns = crate::episode::EPISODE_COLUMNS.len();
        agent.conclude(&mut rows.episodes[index * columns..(index + 1) * columns], cause);
        if shared.autoreset == Autoreset::SameStep {
            rows.finals[index * width..(index + 1) * width].copy_from_slice(row);
        }
        if self.agents.iter().any(|agent| agent.alive) {
            self.sim.remove(index);
        }
    }

    /// Begins the next episode in the step that ended the last one: what that step was worth stays.
    fn begin_within(
        &mut self,
        shared: &Shared<T>,
        rows: &mut Rows<'_>,
        scene: &mut Scene,
    ) -> Result<(), Error> {
        let hash = self.hash;
        self.begin(shared, None)?;
        self.look(shared, scene);
        self.encode(shared, rows, scene);
        self.sign(rows);
        // Of the episode that ended.
        rows.hashes.fill(hash);
        Ok(())
    }
}

/// The seed of the next episode of a stream; below 2⁶³, as signed numbers hold it, too.
fn episode_seed(stream: &mut SplitMix64) -> u64 {
    stream.next_u64() >> 1
}

fn view<'a>(
    agent: &'a Agent,
    (index, motion): (usize, &'a Motion),
    shape: Shape,
    scene: &'a Scene,
) -> View<'a> {
    let Agent { route, place, last, light, .. } = agent;
    View { motion, shape, route, place, last: *last, light: *light, index, scene }
}

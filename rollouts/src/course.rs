//! A town prepared for a task: pairs of starts and goals, and the starts that episodes begin at.
//!
//! Pairs are drawn from one seed, so that a town and a task have the same ones everywhere; an
//! episode's seed then picks one of up to [`STARTS`] starts, each a pair (several with several
//! agents) a little beside its exact pose, with cars and people of the world's own elsewhere.

mod others;
mod pairs;
mod parking;

use std::sync::{Arc, OnceLock};

use roads::Map;
use schemas::{Error, ErrorCode, Pose, SplitMix64, Vec3, level_pose, yaw_rad};
use world::Town;

use crate::limits::{BODIES_MAX, STARTS, STARTS_MIN};
use crate::line::StopLine;
use crate::route::Route;
use crate::spec::Spec;
use crate::task::{Sky, Task};
use others::Places;
pub(crate) use others::{CarStart, WalkerStart};
use pairs::Pair;

/// Starts of one world are at least this far apart, in metres.
const APART_M: f32 = 12.0;

/// A town prepared for a task. Shared by all worlds; nothing in it changes.
#[derive(Debug)]
pub struct Course {
    pub(crate) map: Arc<Map>,
    pub(crate) town: Arc<Town>,
    pub(crate) task: Task,
    /// Where lights hold traffic; none in worlds without lights.
    pub(crate) lines: Vec<StopLine>,
    agents: usize,
    pairs: Vec<Pair>,
    others: Places,
    skies: Vec<Sky>,
    starts: Vec<OnceLock<Start>>,
}

/// Where the agents of a world begin.
#[derive(Debug)]
pub(crate) struct Start {
    pub agents: Vec<AgentStart>,
    pub cars: Vec<CarStart>,
    pub walkers: Vec<WalkerStart>,
    pub sky: Sky,
}

/// Where one agent begins, and where it is to go.
#[derive(Clone, Debug)]
pub(crate) struct AgentStart {
    /// Box centre on the ground.
    pub pose: Pose,
    pub speed_mps: f32,
    pub route: Arc<Route>,
    pub limit_secs: f32,
    /// Position among the pairs.
    pub pair: usize,
}

impl Course {
    /// Draws the pairs of a task in a town.
    ///
    /// - **Cost:** that of the town's ground and lanes, and of some thousand ways: tenths of a
    ///   second for a town.
    ///
    /// # Errors
    /// `InvalidArgument` for a spec that cannot be, or a town that has not as many starts as a
    /// world has agents, or no room for its cars and people.
    pub fn new(spec: &Spec, map: Arc<Map>) -> Result<Self, Error> {
        Self::of_task(spec, Task::named(&spec.task)?, map)
    }

    /// As [`new`](Self::new), for a task that need not be one of the [`TASKS`](crate::TASKS).
    ///
    /// # Errors
    /// As for [`new`](Self::new).
    pub fn of_task(spec: &Spec, task: Task, map: Arc<Map>) -> Result<Self, Error> {
        spec.check()?;
        let town = Arc::new(Town::new(Arc::clone(&map)));
        let has_lights = spec.lights.unwrap_or(task.others.lights);
        let lines = if has_lights { StopLine::all(&map) } else { Vec::new() };
        let pairs = pairs::draw(&map, town.network(), &task, &lines, spec.pairs);
        let others = Places::of(&town, &task, spec)?;
        let skies = task.weathers.skies(&spec.weathers)?;
        let bodies = spec.worlds * (spec.agents + others.count());
        if bodies > BODIES_MAX {
            return Err(Error::new(ErrorCode::InvalidArgument, "the worlds hold too many")
                .wanted(format!("at most {BODIES_MAX} agents, cars and people in all worlds"))
                .found(bodies));
        }
        let count = starts_of(others.count());
        let starts = std::iter::repeat_with(OnceLock::new).take(count).collect();
        let agents = spec.agents;
        let course = Self { map, town, task, lines, agents, pairs, others, skies, starts };
        match course.chosen(&mut SplitMix64::new(0)).len() {
            0 => {
                let (task, town) = (&course.task.name, course.map.name());
                Err(Error::new(ErrorCode::InvalidArgument, "the town has no way of the task")
                    .wanted(format!("a town with ways of {task}"))
                    .found(town))
            }
            found if found < spec.agents => {
                Err(Error::new(ErrorCode::InvalidArgument, "the town has not so many starts")
                    .wanted(format!("at most {found} agents for {} here", course.task.name))
                    .found(spec.agents))
            }
            _ => Ok(course),
        }
    }

    /// How many pairs of a start and a goal there are.
    #[must_use]
    pub fn pair_count(&self) -> usize {
        self.pairs.len()
    }

    /// Length of the shortest way of each pair, in metres.
    pub fn lengths_m(&self) -> impl Iterator<Item = f32> + '_ {
        self.pairs.iter().map(|pair| pair.route.length_m())
    }

    /// How many starts there are.
    pub(crate) fn start_count(&self) -> usize {
        self.starts.len()
    }

    /// Whether lights take their turns in its worlds.
    pub(crate) fn has_lights(&self) -> bool {
        !self.lines.is_empty()
    }

    /// Agents, cars and people of one world.
    pub(crate) fn body_count(&self) -> usize {
        self.agents + self.others.count()
    }

    /// Whether there is anybody but agents.
    pub(crate) fn has_others(&self) -> bool {
        self.others.count() > 0
    }

    /// Weathers that its starts have, by number from 1 on.
    pub(crate) fn skies(&self) -> &[Sky] {
        &self.skies
    }

    /// Which start an episode of a seed has.
    pub(crate) fn start_of(&self, episode_seed: u64) -> usize {
        let count = self.starts.len() as u64;
        (SplitMix64::new(episode_seed).next_u64() % count) as usize
    }

    /// One of the starts, worked out when it is first asked for.
    pub(crate) fn start(&self, index: usize) -> &Start {
        let index = index % self.starts.len();
        self.starts[index].get_or_init(|| {
            let mut random = SplitMix64::new(index as u64);
            let chosen = self.chosen(&mut random);
            let begin = |&pair: &usize| self.begin(pair, &mut random);
            let agents: Vec<AgentStart> = chosen.iter().map(begin).collect();
            let (cars, walkers) = self.others.draw(&self.town, &agents, &mut random);
            // Last, so that all else is the same in every weather.
            let sky = random.choose(&self.skies).copied().unwrap_or(self.skies[0]);
            Start { agents, cars, walkers, sky }
        })
    }

    /// As many pairs as a world has agents, whose starts are far enough from each other. Fewer
    /// where the town has not as many.
    fn chosen(&self, random: &mut SplitMix64) -> Vec<usize> {
        let mut order: Vec<usize> = (0..self.pairs.len()).collect();
        shuffle(&mut order, random);
        let mut chosen: Vec<usize> = Vec::with_capacity(self.agents);
        for index in order {
            let place = |index: usize| self.pairs[index].start.translation.vector;
            let free = |other: &usize| (place(*other) - place(index)).norm() > APART_M;
            if chosen.len() < self.agents && chosen.iter().all(free) {
                chosen.push(index);
            }
        }
        chosen
    }

    fn begin(&self, index: usize, random: &mut SplitMix64) -> AgentStart {
        let (pair, beginning) = (&self.pairs[index], self.task.start);
        let (slowest, fastest) = beginning.speed_mps;
        let beside_m = beginning.beside_m * (2.0 * share(random) - 1.0);
        let turned_rad = beginning.turned_rad * (2.0 * share(random) - 1.0);
        let speed_mps = slowest + (fastest - slowest) * share(random);
        let left = pair.start.rotation * Vec3::y();
        let position_m = pair.start.translation.vector + left * beside_m;
        AgentStart {
            pose: level_pose(position_m, yaw_rad(&pair.start) + turned_rad),
            speed_mps,
            route: Arc::clone(&pair.route),
            limit_secs: self.task.limit_secs(pair.route.length_m()),
            pair: index,
        }
    }
}

/// Starts in readiness for worlds with so many others.
fn starts_of(others: usize) -> usize {
    (STARTS * 8 / (8 + others)).max(STARTS_MIN)
}

/// A number from 0 to below 1.
fn share(random: &mut SplitMix64) -> f32 {
    (random.next_u64() >> 40) as f32 / (1u64 << 24) as f32
}

/// Fisher and Yates's shuffle.
fn shuffle<T>(items: &mut [T], random: &mut SplitMix64) {
    for last in (1..items.len()).rev() {
        let other = (random.next_u64() % (last as u64 + 1)) as usize;
        items.swap(last, other);
    }
}

#[cfg(test)]
mod tests;

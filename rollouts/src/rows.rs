//! The arrays that steps write.

use std::ops::Range;

use crate::episode::EPISODE_COLUMNS;
use crate::spec::Spec;

/// Arrays of some worlds, world after world, within each agent after agent.
///
/// `observations` has `width` columns, `finals` likewise; `episodes` has those of
/// [`EPISODE_COLUMNS`]. All else has one value a row, or a world.
#[derive(Debug)]
pub struct Rows<'a> {
    /// By row: what the agent observes.
    pub observations: &'a mut [f32],
    /// By row: what an agent whose episode ended in this step observed last, where the next one has
    /// begun already.
    pub finals: &'a mut [f32],
    /// By row.
    pub rewards: &'a mut [f32],
    /// By row: 1 where the task ended the episode in this step.
    pub terminations: &'a mut [u8],
    /// By row: 1 where the episode was cut off in this step.
    pub truncations: &'a mut [u8],
    /// By row: 0 where the row is padding, as its agent's episode was over before.
    pub alive: &'a mut [u8],
    /// By row: numbers of the episode that ended in this step.
    pub episodes: &'a mut [f32],
    /// By world: seed of its episode.
    pub seeds: &'a mut [u64],
    /// By world: ticks since its episode began.
    pub ticks: &'a mut [u64],
    /// By world: hash of its state when it was last worked out.
    pub hashes: &'a mut [u64],
}

impl Rows<'_> {
    /// Those of one world among as many as there are.
    pub(crate) fn world(&mut self, index: usize) -> Rows<'_> {
        let worlds = self.seeds.len().max(1);
        Rows {
            observations: part(self.observations, index, worlds),
            finals: part(self.finals, index, worlds),
            rewards: part(self.rewards, index, worlds),
            terminations: part(self.terminations, index, worlds),
            truncations: part(self.truncations, index, worlds),
            alive: part(self.alive, index, worlds),
            episodes: part(self.episodes, index, worlds),
            seeds: part(self.seeds, index, worlds),
            ticks: part(self.ticks, index, worlds),
            hashes: part(self.hashes, index, worlds),
        }
    }
}

/// One of so many equal parts of an array.
fn part<T>(array: &mut [T], index: usize, of: usize) -> &mut [T] {
    let size = array.len() / of;
    &mut array[index * size..(index + 1) * size]
}

/// Arrays of a whole batch on the heap, for whoever steps in process.
#[derive(Clone, Debug, Default, PartialEq)]
#[allow(missing_docs, reason = "as in `Rows`")]
pub struct Buffers {
    pub observations: Vec<f32>,
    pub finals: Vec<f32>,
    pub rewards: Vec<f32>,
    pub terminations: Vec<u8>,
    pub truncations: Vec<u8>,
    pub alive: Vec<u8>,
    pub episodes: Vec<f32>,
    pub seeds: Vec<u64>,
    pub ticks: Vec<u64>,
    pub hashes: Vec<u64>,
}

impl Buffers {
    /// Zeros of the right sizes.
    #[must_use]
    pub fn new(spec: &Spec) -> Self {
        let (rows, worlds) = (spec.rows(), spec.worlds);
        Self {
            observations: vec![0.0; rows * spec.width()],
            finals: vec![0.0; rows * spec.width()],
            rewards: vec![0.0; rows],
            terminations: vec![0; rows],
            truncations: vec![0; rows],
            alive: vec![0; rows],
            episodes: vec![0.0; rows * EPISODE_COLUMNS.len()],
            seeds: vec![0; worlds],
            ticks: vec![0; worlds],
            hashes: vec![0; worlds],
        }
    }

    /// All of them.
    pub fn rows(&mut self) -> Rows<'_> {
        let worlds = self.seeds.len();
        self.of_worlds(0..worlds)
    }

    /// Those of a range of worlds.
    pub fn of_worlds(&mut self, worlds: Range<usize>) -> Rows<'_> {
        let all = self.seeds.len().max(1);
        Rows {
            observations: range(&mut self.observations, &worlds, all),
            finals: range(&mut self.finals, &worlds, all),
            rewards: range(&mut self.rewards, &worlds, all),
            terminations: range(&mut self.terminations, &worlds, all),
            truncations: range(&mut self.truncations, &worlds, all),
            alive: range(&mut self.alive, &worlds, all),
            episodes: range(&mut self.episodes, &worlds, all),
            seeds: range(&mut self.seeds, &worlds, all),
            ticks: range(&mut self.ticks, &worlds, all),
            hashes: range(&mut self.hashes, &worlds, all),
        }
    }
}

fn range<'a, T>(array: &'a mut [T], worlds: &Range<usize>, all: usize) -> &'a mut [T] {
    let size = array.len() / all;
    &mut array[worlds.start * size..worlds.end * size]
}

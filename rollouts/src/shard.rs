//! Some of a batch's worlds, stepped by one thread.

use std::ops::Range;
use std::sync::Arc;

use schemas::{ActorId, Error, ErrorCode, Frame};

use crate::action::Action;
use crate::course::Course;
use crate::env::{Env, Shared};
use crate::kinematic::KinematicWorld;
use crate::physics::PhysicsWorld;
use crate::rows::Rows;
use crate::scene::Scene;
use crate::spec::{Autoreset, Spec, TierKind};
use crate::tier::Tier;

/// Which worlds begin anew, and how.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reset {
    /// It goes on.
    Keep,
    /// The next episode of its stream.
    Next,
    /// The first episode of this seed.
    Seed(u64),
}

/// Some of the worlds of a batch, one after the other.
pub struct Shard {
    tier: Box<dyn Worlds + Send>,
    autoreset: Autoreset,
    agents: usize,
}

/// One world as it is, to be [restored](Shard::restore) in any shard of the same spec.
pub struct Snapshot {
    world: Box<dyn std::any::Any + Send + Sync>,
    bytes: usize,
}

impl Snapshot {
    /// About as much as it takes.
    #[must_use]
    pub fn bytes(&self) -> usize {
        self.bytes
    }
}

impl Shard {
    /// Worlds `worlds` of the spec's, each in the first episode of its seed.
    ///
    /// # Errors
    /// `InvalidArgument` for a spec that cannot be, or why nobody can start in the town.
    pub fn new(spec: &Spec, course: &Arc<Course>, worlds: Range<usize>) -> Result<Self, Error> {
        Ok(Self::all(spec, course, &[worlds])?.remove(0))
    }

    /// Several shards that share what they can: prepared starts first of all.
    ///
    /// # Errors
    /// As for [`new`](Self::new).
    pub fn all(
        spec: &Spec,
        course: &Arc<Course>,
        parts: &[Range<usize>],
    ) -> Result<Vec<Self>, Error> {
        spec.check()?;
        match spec.tier {
            TierKind::Physics => several::<PhysicsWorld>(spec, course, parts),
            TierKind::Kinematic => several::<KinematicWorld>(spec, course, parts),
        }
    }

    /// How many worlds it has.
    #[must_use]
    pub fn worlds(&self) -> usize {
        self.tier.count()
    }

    /// Begins worlds anew, each as its entry says, and writes their rows; `None`: all of them, with
    /// the next episode. Rows of the others stay as they are.
    ///
    /// # Errors
    /// `InvalidArgument` for a wrong number of entries, or why nobody can start.
    pub fn reset(&mut self, resets: Option<&[Reset]>, rows: &mut Rows<'_>) -> Result<(), Error> {
        let all = vec![Reset::Next; self.worlds()];
        let resets = resets.unwrap_or(&all);
        if resets.len() != self.worlds() {
            return Err(Error::new(ErrorCode::InvalidArgument, "resets and worlds do not match")
                .wanted(self.worlds())
                .found(resets.len()));
        }
        self.tier.reset(resets, rows)
    }

    /// Writes the rows of all worlds as they are, as after a reset.
    pub fn show(&mut self, rows: &mut Rows<'_>) {
        for world in 0..self.worlds() {
            self.tier.show_one(world, rows);
        }
    }

    /// Writes the rows of one world as it is; those of the others stay as they are.
    ///
    /// - **Domain:** nothing is written for a world that it has not.
    pub fn show_one(&mut self, world: usize, rows: &mut Rows<'_>) {
        if world < self.worlds() {
            self.tier.show_one(world, rows);
        }
    }

    /// Whether a step may be taken with these actions, a row for each agent.
    ///
    /// # Errors
    /// `InvalidArgument` for actions that are none, or for a world whose episode is over when
    /// nothing begins the next one.
    pub fn check(&self, actions: &[f32]) -> Result<(), Error> {
        Action::check(actions, self.worlds() * self.agents)?;
        match self.tier.first_over().filter(|_| self.autoreset == Autoreset::Disabled) {
            None => Ok(()),
            Some(world) => Err(Error::new(
                ErrorCode::InvalidArgument,
                format!("the episode of world {world} of this shard is over"),
            )
            .wanted("a reset of it first, as autoreset is disabled")),
        }
    }

    /// Advances every world by one step and writes its rows.
    ///
    /// # Errors
    /// As for [`check`](Self::check), with nothing changed; otherwise why nobody can start.
    pub fn step(&mut self, actions: &[f32], rows: &mut Rows<'_>) -> Result<(), Error> {
        self.check(actions)?;
        self.tier.step(actions, rows)
    }

    /// One world as it is.
    ///
    /// # Errors
    /// `InvalidArgument` for a world that it has not.
    pub fn snapshot(&self, world: usize) -> Result<Snapshot, Error> {
        self.tier.snapshot(world).ok_or_else(|| unknown(world, self.worlds()))
    }

    /// One world as a frame, for whoever has it drawn, and the actors that its agents drive.
    ///
    /// # Errors
    /// `InvalidArgument` for a world that it has not; `Unsupported` in the kinematic tier.
    pub fn frame(&self, world: usize) -> Result<(Frame, Vec<ActorId>), Error> {
        if world >= self.worlds() {
            return Err(unknown(world, self.worlds()));
        }
        self.tier.frame(world).ok_or_else(|| {
            Error::new(ErrorCode::Unsupported, "kinematic worlds cannot be drawn")
                .wanted("tier physics")
        })
    }

    /// Lets a world go on from a snapshot; with `stream` the episodes to come are its own, without
    /// those of the snapshot. Its rows are to be [shown](Self::show) again.
    ///
    /// # Errors
    /// `InvalidArgument` for a world that it has not, or a snapshot of another batch.
    pub fn restore(
        &mut self,
        world: usize,
        snapshot: &Snapshot,
        stream: Option<u64>,
    ) -> Result<(), Error> {
        if world >= self.worlds() {
            return Err(unknown(world, self.worlds()));
        }
        if self.tier.restore(world, snapshot, stream) {
            return Ok(());
        }
        Err(Error::new(ErrorCode::InvalidArgument, "the snapshot is of another kind of world")
            .wanted("a snapshot of this batch"))
    }
}

fn unknown(world: usize, count: usize) -> Error {
    Error::new(ErrorCode::InvalidArgument, "there is no such world")
        .wanted(format!("below {count}"))
        .found(world)
}

/// Worlds of one tier.
trait Worlds {
    fn count(&self) -> usize;
    fn reset(&mut self, resets: &[Reset], rows: &mut Rows<'_>) -> Result<(), Error>;
    fn show_one(&mut self, world: usize, rows: &mut Rows<'_>);
    fn first_over(&self) -> Option<usize>;
    fn step(&mut self, actions: &[f32], rows: &mut Rows<'_>) -> Result<(), Error>;
    fn snapshot(&self, world: usize) -> Option<Snapshot>;
    fn frame(&self, world: usize) -> Option<(Frame, Vec<ActorId>)>;
    fn restore(&mut self, world: usize, snapshot: &Snapshot, stream: Option<u64>) -> bool;
}

struct Of<T: Tier> {
    shared: Arc<Shared<T>>,
    envs: Vec<Env<T>>,
    /// That of the world whose turn it is.
    scene: Scene,
}

fn several<T: Tier + Sync + 'static>(
    spec: &Spec,
    course: &Arc<Course>,
    parts: &[Range<usize>],
) -> Result<Vec<Shard>, Error> {
    let shared = Arc::new(Shared::<T>::new(spec, course)?);
    let shard = |worlds: &Range<usize>| {
        let seed = |world: usize| spec.seed.wrapping_add(world as u64);
        let envs = worlds.clone().map(|world| Env::new(&shared, seed(world)));
        let envs = envs.collect::<Result<Vec<_>, _>>()?;
        let tier = Box::new(Of { shared: Arc::clone(&shared), envs, scene: Scene::default() });
        Ok(Shard { tier, autoreset: spec.autoreset, agents: spec.agents })
    };
    parts.iter().map(shard).collect()
}

impl<T: Tier + Sync + 'static> Worlds for Of<T> {
    fn count(&self) -> usize {
        self.envs.len()
    }

    fn reset(&mut self, resets: &[Reset], rows: &mut Rows<'_>) -> Result<(), Error> {
        for (index, (env, reset)) in self.envs.iter_mut().zip(resets).enumerate() {
            match *reset {
                Reset::Keep => continue,
                Reset::Next => env.begin(&self.shared, None)?,
                Reset::Seed(seed) => env.begin(&self.shared, Some(seed))?,
            }
            env.show(&self.shared, &mut rows.world(index), &mut self.scene);
        }
        Ok(())
    }

    fn show_one(&mut self, world: usize, rows: &mut Rows<'_>) {
        if let Some(env) = self.envs.get(world) {
            env.show(&self.shared, &mut rows.world(world), &mut self.scene);
        }
    }

    fn first_over(&self) -> Option<usize> {
        self.envs.iter().position(Env::is_over)
    }

    fn step(&mut self, actions: &[f32], rows: &mut Rows<'_>) -> Result<(), Error> {
        let width = actions.len() / self.envs.len().max(1);
        for (index, env) in self.envs.iter_mut().enumerate() {
            let own = &actions[index * width..(index + 1) * width];
            env.step(&self.shared, own, &mut rows.world(index), &mut self.scene)?;
        }
        Ok(())
    }

    fn snapshot(&self, world: usize) -> Option<Snapshot> {
        let world = Box::new(self.envs.get(world)?.clone());
        Some(Snapshot { world, bytes: self.shared.world_bytes() })
    }

    fn frame(&self, world: usize) -> Option<(Frame, Vec<ActorId>)> {
        self.envs.get(world)?.frame()
    }

    fn restore(&mut self, world: usize, snapshot: &Snapshot, stream: Option<u64>) -> bool {
        let Some(from) = snapshot.world.downcast_ref::<Env<T>>() else { return false };
        let Some(env) = self.envs.get_mut(world) else { return false };
        env.clone_from(from);
        if let Some(stream) = stream {
            env.reseed(stream);
        }
        true
    }
}

//! The world as a value.

use std::sync::Arc;

use schemas::{
    ActorId, ActorState, Collision, Error, ErrorCode, Halt, HiddenScenery, MapRef, Pose,
    SplitMix64, Tick, WalkerPose, Weather, WorldId, limits,
};
use serde::{Deserialize, Serialize};

use crate::actor::Actor;
use crate::collision::Contacts;
use crate::paint::Painted;
use crate::physics::Physics;
use crate::scenery::NearFixtures;
use crate::sensors::{Readings, Sensors};
use crate::time_step::TimeStep;
use crate::town::Town;
use crate::traffic::Lights;

/// What a new world is made of.
#[derive(Clone, Debug)]
pub struct WorldConfig {
    /// Its identity; no part of its state.
    pub id: WorldId,
    /// Of the process that owns it; no part of its state.
    pub epoch: u64,
    /// Root of all its randomness.
    pub seed: u64,
    /// Length of one tick in seconds.
    pub dt_secs: f64,
    /// Where it is.
    pub map: Arc<Town>,
}

/// One simulated world: commands in, frames out.
///
/// - **Determinism:** the same town, seed, step and commands give the same states bit for bit, also
///   through [`snapshot`](Self::snapshot), [`restore`](Self::restore) and [`fork`](Self::fork).
/// - **Cost:** a car and three pedestrians tick in tens of microseconds and take some tens of
///   kilobytes.
pub struct World {
    pub(crate) id: WorldId,
    pub(crate) epoch: u64,
    pub(crate) town: Arc<Town>,
    pub(crate) state: State,
    /// Of the last tick; gone in copies and restored worlds until they tick.
    pub(crate) readings: Readings,
}

/// Everything that decides how a world goes on; this and nothing else is in a snapshot.
#[derive(Clone, Serialize, Deserialize)]
pub(crate) struct State {
    pub tick: Tick,
    /// Length of the last tick, or of the next one at tick 0.
    pub dt_secs: f64,
    /// Since tick 0.
    pub sim_secs: f64,
    pub step: TimeStep,
    pub seed: u64,
    pub rng: SplitMix64,
    pub weather: Weather,
    /// Ids that are given in turn begin here, with those of the town's lights and signs.
    pub first_actor: ActorId,
    pub next_actor: u32,
    /// Ordered by id.
    pub actors: Vec<Actor>,
    pub contacts: Contacts,
    /// Of the last tick.
    pub collisions: Vec<Collision>,
    pub fixtures: NearFixtures,
    /// What of the town is not there.
    pub hidden: HiddenScenery,
    pub paint: Painted,
    pub physics: Physics,
    /// `None` in a world without the town's lights and signs.
    pub traffic: Option<Lights>,
    pub sensors: Sensors,
    /// Distance from other vehicles within which traffic has dynamics; `None`: everywhere.
    pub hybrid_m: Option<f32>,
    /// Ordered by actor.
    pub halted: Vec<Halt>,
    /// Ordered by walker.
    pub walker_poses: Vec<WalkerPose>,
}

impl State {
    /// Which actor of its world one is, from 1 on: the same in a world with other ids. Another one
    /// for each id, also for those below the first that the world gives in turn.
    pub(crate) fn number_of(&self, id: u32) -> u32 {
        id.wrapping_sub(self.first_actor.get()).wrapping_add(1)
    }
}

impl World {
    /// An empty world at tick 0 under CARLA's `ClearNoon`.
    ///
    /// # Errors
    /// `InvalidArgument` for a step outside of the limits.
    pub fn new(config: WorldConfig) -> Result<Self, Error> {
        let step = TimeStep::new(config.dt_secs)?;
        Ok(Self {
            id: config.id,
            epoch: config.epoch,
            town: config.map,
            state: State {
                tick: Tick(0),
                dt_secs: config.dt_secs,
                sim_secs: 0.0,
                step,
                seed: config.seed,
                rng: SplitMix64::new(config.seed),
                weather: Weather::CLEAR_NOON,
                first_actor: ActorId::FIRST,
                next_actor: ActorId::FIRST.get(),
                actors: Vec::new(),
                contacts: Contacts::default(),
                collisions: Vec::new(),
                fixtures: NearFixtures::default(),
                hidden: HiddenScenery::default(),
                paint: Painted::default(),
                physics: Physics::new(),
                traffic: None,
                sensors: Sensors::default(),
                hybrid_m: None,
                halted: Vec::new(),
                walker_poses: Vec::new(),
            },
            readings: Readings::default(),
        })
    }

    /// As [`new`](Self::new), with the town's traffic lights and signs as its first actors.
    ///
    /// Lights take their turns and vehicles know their speed limit and the light they are at. All
    /// that is in every frame, so that small worlds are better off without.
    ///
    /// # Errors
    /// As for [`new`](Self::new), and `Capacity` for a town with more signals than a world has
    /// actors.
    pub fn with_traffic(config: WorldConfig) -> Result<Self, Error> {
        let mut world = Self::new(config)?;
        let count = world.town.traffic.count();
        if count > limits::ACTORS_PER_WORLD_MAX {
            return Err(Error::new(ErrorCode::Capacity, "the map has too many lights and signs")
                .wanted(format!("at most {}", limits::ACTORS_PER_WORLD_MAX))
                .found(count));
        }
        world.state.next_actor += count as u32;
        world.state.traffic = Some(Lights::new(&world.town.traffic));
        Ok(world)
    }

    /// This new world, with the ids of its actors from `first` on: those of the world that it
    /// follows are not given again. Nothing else is different in it.
    ///
    /// # Errors
    /// `Capacity` where there are not so many ids.
    pub fn numbered_from(mut self, first: ActorId) -> Result<Self, Error> {
        let given = self.state.next_actor - self.state.first_actor.get();
        self.state.next_actor = first.get().checked_add(given).ok_or_else(ids_used_up)?;
        self.state.first_actor = first;
        Ok(self)
    }

    /// A copy under another id that goes on bit for bit as this one would.
    pub fn fork(&self, id: WorldId) -> Self {
        Self {
            id,
            epoch: self.epoch,
            town: Arc::clone(&self.town),
            state: self.state.clone(),
            readings: Readings::default(),
        }
    }

    /// Its identity.
    pub fn id(&self) -> WorldId {
        self.id
    }

    /// Completed ticks.
    pub fn tick_number(&self) -> Tick {
        self.state.tick
    }

    /// Actors in it now.
    pub fn actor_count(&self) -> usize {
        self.fixed_count() + self.state.actors.len()
    }

    /// How many lights and signs of the town are in it.
    pub(crate) fn fixed_count(&self) -> usize {
        let lights = self.state.traffic.as_ref();
        lights.map_or(0, |lights| self.town.traffic.count() - lights.gone().len())
    }

    /// The town's lights and signs that are in it, with their positions among all of the town.
    pub(crate) fn fixed_actors(&self) -> impl Iterator<Item = (usize, ActorState)> {
        let lights = self.state.traffic.iter();
        lights.flat_map(|lights| {
            let all = self.town.traffic.actors(self.state.first_actor).enumerate();
            all.filter(|(position, _)| lights.stands(*position))
        })
    }

    /// Whether this is the id of a light or sign of the town, in a world that has or had it.
    pub(crate) fn is_fixed(&self, id: ActorId) -> bool {
        self.state.traffic.is_some()
            && self.town.traffic.position(id, self.state.first_actor).is_some()
    }

    /// The position of a light or sign of the town that is in it.
    pub(crate) fn fixed_position(&self, id: ActorId) -> Option<usize> {
        let lights = self.state.traffic.as_ref()?;
        let position = self.town.traffic.position(id, self.state.first_actor)?;
        lights.stands(position).then_some(position)
    }

    /// Where a light or sign of the town stands that is in it.
    pub(crate) fn fixed_pose(&self, id: ActorId) -> Option<Pose> {
        self.town.traffic.pose(self.fixed_position(id)?)
    }

    /// Its map.
    pub fn map_ref(&self) -> &MapRef {
        self.town.map_ref()
    }

    /// The OpenDRIVE text of its map.
    pub fn map_text(&self) -> &str {
        self.town.roads.text()
    }

    /// Contacts of the last tick, ordered by (actor, other).
    pub fn collisions(&self) -> &[Collision] {
        &self.state.collisions
    }
}

impl State {
    /// Where an actor is in `actors`.
    ///
    /// # Errors
    /// `UnknownActor`.
    pub(crate) fn index_of(&self, id: ActorId) -> Result<usize, Error> {
        self.actors.binary_search_by_key(&id, |actor| actor.id).map_err(|_| {
            Error::new(ErrorCode::UnknownActor, "no such actor in this world")
                .wanted("the id of a living actor")
                .found(id)
        })
    }
}

pub(crate) fn ids_used_up() -> Error {
    Error::new(ErrorCode::Capacity, "every actor id has been given out").wanted("a new server")
}

//! Traffic of the world's own: who belongs to it, and how it drives.

use std::sync::Arc;

use agents::{Agent, Body, Claims, Driver, Held, Scene, Senses};
use schemas::{ActorId, AgentBehaviour, Error, ErrorCode, Pose, SplitMix64, Vec3, limits};

use crate::actor::Actor;
use crate::blueprint::{self, BodySpec};
use crate::physics::BodyState;
use crate::spawn::Wish;
use crate::step;
use crate::town::Town;
use crate::traffic::{Broken, RoadRules};
use crate::wheel::{AtTheWheel, TrafficDriver};
use crate::world::{State, World};

/// Way between places at which a vehicle may begin, in metres.
const PLACES_M: f32 = 20.0;

impl World {
    /// Hands a vehicle to a driver of traffic; one `of_world` was brought by the world itself.
    pub(crate) fn set_traffic(
        &mut self,
        id: ActorId,
        behaviour: AgentBehaviour,
        of_world: bool,
    ) -> Result<(), Error> {
        let (_, body) = self.vehicle_mut(id)?;
        let index = self.state.index_of(id)?;
        let driver = TrafficDriver::new(Driver::new(behaviour), of_world);
        self.state.seat(index, AtTheWheel::Traffic(driver));
        self.state.physics.wake(body);
        Ok(())
    }

    /// Spawns cars on free places of the lanes and hands them to drivers of traffic; all or none.
    pub(crate) fn spawn_traffic(
        &mut self,
        count: u32,
        behaviour: Option<AgentBehaviour>,
    ) -> Result<(), Error> {
        if self.actor_count() + count as usize > limits::ACTORS_PER_WORLD_MAX {
            return Err(Error::new(ErrorCode::Capacity, "the world is full")
                .wanted(format!("at most {} actors", limits::ACTORS_PER_WORLD_MAX)));
        }
        let before = self.state.clone();
        let spawned = self.try_spawn_traffic(count, behaviour);
        if spawned.is_err() {
            self.state = before;
        }
        spawned
    }

    /// What each driver of traffic and each agent at a wheel waited for in the last tick, ordered
    /// by vehicle.
    pub fn held(&self) -> impl Iterator<Item = (ActorId, Held)> {
        let driver = |actor: &Actor| {
            let vehicle = actor.vehicle.as_deref()?;
            let traffic = vehicle.wheel.traffic().map(|traffic| traffic.driver.held());
            let agent = vehicle.agent.as_deref().filter(|_| vehicle.wheel.is_agent());
            Some((actor.id, traffic.or(agent.map(Agent::held))?))
        };
        self.state.actors.iter().filter_map(driver)
    }

    /// How often each vehicle has broken rules of the road, ordered by vehicle; nothing is told of
    /// a world without lights and signs.
    pub fn rules_broken(&self) -> impl Iterator<Item = (ActorId, Broken)> {
        let broken = |actor: &Actor| Some((actor.id, actor.vehicle.as_deref()?.rules.broken()));
        self.state.actors.iter().filter_map(broken)
    }

    fn try_spawn_traffic(
        &mut self,
        count: u32,
        behaviour: Option<AgentBehaviour>,
    ) -> Result<(), Error> {
        let town = Arc::clone(&self.town);
        let mut places: Vec<Pose> = town.network().places(PLACES_M);
        shuffle(&mut places, &mut self.state.rng);
        let mut left = count;
        for pose in places {
            if left == 0 {
                break;
            }
            let cars = cars();
            let rng = &mut self.state.rng;
            let Some(blueprint) = rng.choose(&cars).copied() else { break };
            let mixed = [AgentBehaviour::Cautious, AgentBehaviour::Normal, AgentBehaviour::Normal];
            let drawn = rng.choose(&mixed).copied().unwrap_or(AgentBehaviour::Normal);
            let linear_mps = Vec3::zeros();
            let (attributes, attachment, id) = (&[], None, None);
            let wish = Wish { blueprint, pose: &pose, linear_mps, attributes, attachment, id };
            match self.spawn(&wish) {
                Ok(id) => self.set_traffic(id, behaviour.unwrap_or(drawn), true)?,
                Err(error) if error.code == ErrorCode::SpawnBlocked => continue,
                Err(error) => return Err(error),
            }
            left -= 1;
        }
        if left == 0 {
            return Ok(());
        }
        Err(Error::new(ErrorCode::SpawnBlocked, "the lanes have no room for so many vehicles")
            .wanted(format!("at most {} vehicles", count - left))
            .found(count))
    }
}

/// Blueprints of cars with four wheels, in the order of the library.
fn cars() -> Vec<&'static str> {
    let all = blueprint::all().iter();
    let car = all.filter(|blueprint| match &blueprint.body {
        BodySpec::Vehicle(model) => model.length_m < 5.6 && model.width_m > 1.4,
        _ => false,
    });
    car.map(|blueprint| blueprint.id.as_str()).collect()
}

/// **Source:** Fisher and Yates; Durstenfeld, "Algorithm 235: Random permutation", 1964.
fn shuffle(places: &mut [Pose], rng: &mut SplitMix64) {
    for last in (1..places.len()).rev() {
        let other = (rng.next_u64() % (last as u64 + 1)) as usize;
        places.swap(last, other);
    }
}

impl State {
    /// Lets drivers of traffic and agents look around: what they hold and wish for, and what
    /// everybody else is on.
    pub(crate) fn look_around(&mut self, town: &Town, scene: &Scene) -> Claims {
        let network = town.network();
        let mut claims = Claims::default();
        for actor in &self.actors {
            if actor.vehicle.is_some() && !actor.asks() && actor.is_solid() {
                claims.occupy(network, &self.seen(actor));
            }
        }
        for index in 0..self.actors.len() {
            self.with_driver(index, town, scene, |driver, senses, rng| {
                driver.look(senses, &town.roads, &mut claims, &mut || rng.next_u64());
            });
            self.with_agent(index, town, scene, |agent, senses, rng| {
                agent.look(senses, &town.roads, &mut claims, &mut || rng.next_u64());
            });
        }
        self.judge_people(town, scene);
        self.judge_ways(town, scene, &claims);
        claims
    }

    /// Whether there is somebody whom a vehicle could have to let over a crossing, where lights and
    /// signs are.
    pub(crate) fn has_people_to_let_over(&self, town: &Town) -> bool {
        let is_judged = self.traffic.is_some() && town.has_crossings;
        is_judged && self.actors.iter().any(|actor| actor.walker.is_some())
    }

    /// Counts who does not let people over crossings, where lights and signs are.
    pub(crate) fn judge_people(&mut self, town: &Town, scene: &Scene) {
        if self.traffic.is_some() && town.has_crossings {
            let all = |_: &Actor| true;
            self.judge(all, |rules, body| rules.judge_people(town.network(), scene, body));
        }
    }

    /// Counts who drives into junctions before others, where lights and signs are.
    fn judge_ways(&mut self, town: &Town, scene: &Scene, claims: &Claims) {
        if self.traffic.is_none() {
            return;
        }
        let network = town.network();
        let asks_nobody = |actor: &Actor| !actor.asks();
        self.judge(asks_nobody, |rules, body| {
            rules.judge_way(claims.entering(network, scene, body));
        });
    }

    /// Calls for every such vehicle on the road.
    fn judge(&mut self, is_such: impl Fn(&Actor) -> bool, judge: impl Fn(&mut RoadRules, &Body)) {
        for index in 0..self.actors.len() {
            let actor = &self.actors[index];
            if actor.vehicle.is_none() || !actor.is_solid() || !is_such(actor) {
                continue;
            }
            let body = self.seen(actor);
            if let Some(vehicle) = self.actors[index].vehicle_mut() {
                judge(&mut vehicle.rules, &body);
            }
        }
    }

    /// Lets drivers of traffic choose this tick's controls.
    pub(crate) fn flow(&mut self, town: &Town, scene: &Scene, claims: &mut Claims) {
        let witnesses = self.witnesses();
        for index in 0..self.actors.len() {
            let vehicle = self.actors[index].vehicle.as_deref();
            let Some(traffic) = vehicle.and_then(|vehicle| vehicle.wheel.traffic()) else {
                continue;
            };
            let rails = self.belongs_on_rails(&self.actors[index], &witnesses);
            if rails != traffic.on_rails {
                self.set_rails(index, rails);
            }
            if rails {
                let glide = self.with_driver(index, town, scene, |driver, senses, _| {
                    driver.glide(senses, claims)
                });
                if let Some(glide) = glide.flatten() {
                    self.glide(index, &glide);
                }
                continue;
            }
            let control = self.with_driver(index, town, scene, |driver, senses, _| {
                driver.control(senses, claims)
            });
            if let Some(control) = control {
                self.set_control(index, control);
            }
        }
    }

    /// The body and the motion of a vehicle that was not moved since all looked around.
    fn as_driver(&self, index: usize, scene: &Scene) -> (Body, BodyState) {
        let actor = &self.actors[index];
        let seen = scene.body_about(index, actor.id).copied();
        (seen.unwrap_or_else(|| self.seen(actor)), self.motion_of(actor))
    }

    fn with_driver<T>(
        &mut self,
        index: usize,
        town: &Town,
        scene: &Scene,
        act: impl FnOnce(&mut Driver, &Senses<'_>, &mut SplitMix64) -> T,
    ) -> Option<T> {
        let is_on_rails = self.actors[index].vehicle.as_deref()?.wheel.traffic()?.on_rails;
        let (body, motion) = self.as_driver(index, scene);
        let (dt_secs, grip) = (self.dt_secs as f32, self.grip());
        let rng = &mut self.rng;
        let vehicle = self.actors[index].vehicle_mut()?;
        let view = if is_on_rails { step::unsteered_view } else { step::view };
        let view = view(vehicle.tuning.fit(), &motion, grip);
        let driver = &mut *vehicle.wheel.traffic_mut()?.driver;
        let network = town.network();
        let senses = Senses { network, scene, view: &view, body: &body, dt_secs };
        Some(act(driver, &senses, rng))
    }

    /// As [`with_driver`](Self::with_driver), for the agent that drives a vehicle.
    pub(crate) fn with_agent<T>(
        &mut self,
        index: usize,
        town: &Town,
        scene: &Scene,
        act: impl FnOnce(&mut Agent, &Senses<'_>, &mut SplitMix64) -> T,
    ) -> Option<T> {
        if !self.actors[index].vehicle.as_deref()?.wheel.is_agent() {
            return None;
        }
        let (body, motion) = self.as_driver(index, scene);
        let (dt_secs, grip) = (self.dt_secs as f32, self.grip());
        let rng = &mut self.rng;
        let vehicle = self.actors[index].vehicle_mut()?;
        let view = step::view(vehicle.tuning.fit(), &motion, grip);
        let agent = vehicle.agent.as_deref_mut()?;
        let network = town.network();
        let senses = Senses { network, scene, view: &view, body: &body, dt_secs };
        Some(act(agent, &senses, rng))
    }
}

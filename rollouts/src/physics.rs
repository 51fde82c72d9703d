//! The tier of rigid bodies: a [`World`] whose cars the agents drive.

use std::sync::{Arc, OnceLock};

use blueprints::{Class, VehicleModel};
use schemas::{
    ActorId, ActorKind, Command, Error, ErrorCode, Frame, Pose, TrafficCommand, TrafficLightColour,
    Translation3, Vec3, VehicleCommand, VehicleControl, VehicleFailure, WalkerCommand, Weather,
    WorldId, level_pose,
};
use world::{World, WorldConfig};

use crate::action::Action;
use crate::course::{Course, Start};
use crate::limits::TICK_SECS;
use crate::motion::{Contacts, Motion, Shape};
use crate::scene::Neighbour;
use crate::tier::{Fault, Tier, velocity_mps};

/// What agents drive.
pub(crate) const BLUEPRINT: &str = "vehicle.lincoln.mkz";

/// A world with a car for each agent.
pub(crate) struct PhysicsWorld {
    world: World,
    cars: Vec<ActorId>,
    shape: Shape,
    /// By agent, since it was last asked.
    contacts: Vec<Contacts>,
}

/// Worlds at their starts, each made when it is first asked for and copied from then on.
pub(crate) struct Starts(Vec<OnceLock<Result<PhysicsWorld, Error>>>);

/// How far above the ground everybody begins.
const LIFT_M: f32 = 0.05;

impl Clone for PhysicsWorld {
    fn clone(&self) -> Self {
        Self {
            world: self.world.fork(self.world.id()),
            cars: self.cars.clone(),
            shape: self.shape,
            contacts: self.contacts.clone(),
        }
    }
}

impl Tier for PhysicsWorld {
    type Kit = Starts;
    // Measured: 10 kB of a car, 134 kB with 65 others, 372 kB with 220.
    const WORLD_BYTES: usize = 8 * 1024;
    const BODY_BYTES: usize = 2 * 1024;

    fn kit(course: &Course) -> Result<Starts, Error> {
        model()?;
        let count = course.start_count();
        Ok(Starts(std::iter::repeat_with(OnceLock::new).take(count).collect()))
    }

    fn begin(course: &Course, kit: &Starts, start: usize) -> Result<Self, Error> {
        let made = kit.0[start].get_or_init(|| Self::new(course, start));
        made.clone()
    }

    fn drive(&mut self, agent: usize, action: Action) {
        let (actor, control) = (self.cars[agent], action.control());
        let command = Command::Vehicle(VehicleCommand::Control { actor, control });
        let driven = self.world.apply(&command);
        debug_assert!(driven.is_ok(), "a car that lives takes every control in range: {driven:?}");
    }

    fn tick(&mut self) -> Result<(), Fault> {
        self.world.tick().map_err(|_| Fault)?;
        for collision in self.world.collisions().iter().filter(|collision| collision.started) {
            let pair = [Some(collision.actor), collision.other];
            for (own, other) in [(pair[0], pair[1]), (pair[1], pair[0])] {
                let agent = self.cars.iter().position(|car| Some(*car) == own);
                if let Some(contacts) = agent.and_then(|agent| self.contacts.get_mut(agent)) {
                    let kind = other.and_then(|id| self.world.actor(id)).map(|actor| actor.kind);
                    count(contacts, kind);
                }
            }
        }
        Ok(())
    }

    fn motion(&self, agent: usize) -> Motion {
        let Some(car) = self.world.actor(self.cars[agent]) else { return Motion::default() };
        let (position_m, rotation) =
            (car.world_from_actor.translation.vector, car.world_from_actor.rotation);
        let (forward, left) = (rotation * Vec3::x(), rotation * Vec3::y());
        let level = forward.xy().norm().max(1.0e-6);
        Motion {
            x_m: position_m.x,
            y_m: position_m.y,
            cos: forward.x / level,
            sin: forward.y / level,
            speed_mps: forward.dot(&car.linear_velocity_mps),
            along_mps2: forward.dot(&car.linear_acceleration_mps2),
            left_mps2: left.dot(&car.linear_acceleration_mps2),
            yaw_radps: car.angular_velocity_radps.z,
            road_wheel_rad: car.road_wheel_rad,
            overturned: car.failure == VehicleFailure::Rollover,
        }
    }

    fn shape(&self, _: usize) -> Shape {
        self.shape
    }

    fn take_contacts(&mut self, agent: usize) -> Contacts {
        std::mem::take(&mut self.contacts[agent])
    }

    fn others(&self, everybody: &mut Vec<Neighbour>) {
        let others = self.world.bodies().filter(|body| !self.cars.contains(&body.id));
        everybody.extend(others.map(|body| Neighbour::of(&body)));
    }

    fn lights(&self, colours: &mut Vec<TrafficLightColour>) {
        colours.extend(self.world.light_colours());
    }

    fn remove(&mut self, agent: usize) {
        let removed = self.world.apply(&Command::DestroyActor { actor: self.cars[agent] });
        debug_assert!(removed.is_ok(), "an agent is removed once: {removed:?}");
    }

    fn hash(&self) -> u64 {
        self.world.state_hash()
    }

    fn frame(&self) -> Option<(Frame, Vec<ActorId>)> {
        Some((self.world.frame(), self.cars.clone()))
    }
}

impl PhysicsWorld {
    /// # Errors
    /// Why a car cannot stand where it should.
    fn new(course: &Course, start: usize) -> Result<Self, Error> {
        let id = WorldId::new(1)
            .ok_or_else(|| Error::new(ErrorCode::Internal, "1 should be the id of a world"))?;
        let (map, seed) = (Arc::clone(&course.town), start as u64);
        let config = WorldConfig { id, epoch: 0, seed, dt_secs: TICK_SECS, map };
        let mut world = match course.has_lights() {
            true => World::with_traffic(config)?,
            false => World::new(config)?,
        };
        let Start { agents, sky, .. } = course.start(start);
        if sky.weather != Weather::CLEAR_NOON {
            world.apply(&Command::SetWeather { weather: sky.weather })?;
        }
        let mut cars = Vec::with_capacity(agents.len());
        for agent in agents {
            let command = Command::spawn(BLUEPRINT, lifted(&agent.pose), velocity_mps(agent));
            cars.extend(world.apply(&command)?);
        }
        populate(&mut world, course.start(start))?;
        let contacts = vec![Contacts::default(); cars.len()];
        Ok(Self { world, cars, shape: shape(model()?), contacts })
    }
}

/// Puts the world's own cars and people in; who finds something in the way is left out.
///
/// # Errors
/// What of them cannot be.
fn populate(world: &mut World, start: &Start) -> Result<(), Error> {
    for car in &start.cars {
        let spawn = Command::spawn(car.blueprint, lifted(&car.pose), Vec3::zeros());
        let Some(actor) = unless_blocked(world.apply(&spawn))? else { continue };
        world.apply(&match car.behaviour {
            Some(behaviour) => Command::Traffic(TrafficCommand::Join { actor, behaviour }),
            None => Command::Vehicle(VehicleCommand::Control { actor, control: parked() }),
        })?;
    }
    for walker in &start.walkers {
        let middle_m = walker.foot_m + Vec3::z() * (walker.model.height_m / 2.0 + LIFT_M);
        let spawn = Command::spawn(walker.blueprint, level_pose(middle_m, 0.0), Vec3::zeros());
        let Some(actor) = unless_blocked(world.apply(&spawn))? else { continue };
        world.apply(&Command::Walker(WalkerCommand::Agent {
            actor,
            goal_m: None,
            speed_mps: Some(walker.speed_mps),
            crossing_share: walker.crossing_share,
        }))?;
    }
    Ok(())
}

fn parked() -> VehicleControl {
    VehicleControl { brake: 1.0, hand_brake: true, ..VehicleControl::default() }
}

fn unless_blocked(spawned: Result<Option<ActorId>, Error>) -> Result<Option<ActorId>, Error> {
    match spawned {
        Err(error) if error.code == ErrorCode::SpawnBlocked => Ok(None),
        other => other,
    }
}

/// A little above the ground, so that no wheel begins below a slope.
fn lifted(pose: &Pose) -> Pose {
    let position_m = pose.translation.vector + Vec3::z() * LIFT_M;
    Pose::from_parts(Translation3::from(position_m), pose.rotation)
}

fn count(contacts: &mut Contacts, with: Option<ActorKind>) {
    match with {
        Some(ActorKind::Vehicle) => contacts.vehicles += 1,
        Some(ActorKind::Walker) => contacts.walkers += 1,
        _ => contacts.things += 1,
    }
}

/// # Errors
/// `UnknownBlueprint` when the library has lost what agents drive.
pub(crate) fn model() -> Result<&'static VehicleModel, Error> {
    match blueprints::find(BLUEPRINT).map(|blueprint| blueprint.class) {
        Some(Class::Vehicle(model)) => Ok(model),
        _ => Err(Error::new(ErrorCode::UnknownBlueprint, "agents have nothing to drive")
            .wanted(BLUEPRINT)),
    }
}

pub(crate) fn shape(model: &VehicleModel) -> Shape {
    let rear_m = model.physics.wheels.iter().map(|wheel| -wheel.position_m.x);
    Shape { length_m: model.length_m, width_m: model.width_m, rear_m: rear_m.fold(0.0, f32::max) }
}

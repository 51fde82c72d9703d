//! One actor: what it is, what carries it, and what drives it.

use agents::Agent;
use blueprints::WalkerModel;
use schemas::{ActorId, ActorKind, ActorState, Attribute, Vec3, VehicleFailure};
use serde::{Deserialize, Serialize};

use crate::blueprint::{self, Blueprint, BodySpec};
use crate::body::Body;
use crate::physics::{BodyHandle, BodyState};
use crate::traffic::RoadRules;
use crate::vehicle::{Ackermann, Tuning, VehicleState};
use crate::walker::Walker;
use crate::wheel::{AtTheWheel, Hold};

/// Something that was spawned.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Actor {
    pub id: ActorId,
    /// Index of [`blueprint::get`].
    pub blueprint: u16,
    pub body: Body,
    /// Those given when it was spawned.
    pub attributes: Vec<Attribute>,
    pub colour_rgb: u32,
    /// CARLA's `VehicleLightState` flags.
    pub lights: u32,
    /// Open doors; bits as in [`ActorState::doors`].
    pub doors: u8,
    pub switches: Switches,
    /// Mean over the last tick.
    pub acceleration_mps2: Vec3,
    /// Velocity at the end of the last tick.
    pub last_mps: Vec3,
    pub outside: Outside,
    /// `None` for everything without wheels.
    pub vehicle: Option<Box<Vehicle>>,
    /// `None` for everything without legs.
    pub walker: Option<Box<Walker>>,
}

/// What of a body is on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct Switches {
    /// Off: it stays where it is put.
    pub physics: bool,
    /// Off: it does not fall.
    pub gravity: bool,
    /// Off: nothing touches it.
    pub collisions: bool,
}

impl Switches {
    pub(crate) const ALL_ON: Self = Self { physics: true, gravity: true, collisions: true };

    /// One bit each, for the state hash.
    pub(crate) fn bits(self) -> u64 {
        u64::from(self.physics) | u64::from(self.gravity) << 1 | u64::from(self.collisions) << 2
    }
}

/// What only vehicles have.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Vehicle {
    pub state: VehicleState,
    pub tuning: Tuning,
    pub ackermann: Ackermann,
    pub wheel: AtTheWheel,
    /// Whether a client's control holds until the next one.
    pub sticky: bool,
    /// Its navigation agent, whether it drives or not.
    pub agent: Option<Box<Agent>>,
    /// What lights and signs say to it; empty in a world without them.
    pub rules: RoadRules,
    /// How long it has been lying on its side or roof.
    pub tipped_secs: f32,
    /// The trigger it is in, and what that changed.
    pub altered: Option<Altered>,
}

/// What a trigger did to a vehicle.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Altered {
    pub by: ActorId,
    /// Friction of the tyres outside, by wheel.
    pub before: Vec<f32>,
}

/// What clients do to a body beyond driving it.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(crate) struct Outside {
    /// Held against all forces, actor frame.
    pub held_mps: Option<Vec3>,
    /// During the next tick, world frame.
    pub force_n: Vec3,
    /// During the next tick, world frame.
    pub torque_nm: Vec3,
    /// Velocity that a client reports of an actor that it moves by poses, world frame.
    pub told_mps: Vec3,
}

impl Outside {
    /// Numbers that decide how an actor goes on, in a fixed order, for the state hash.
    pub(crate) fn values(&self) -> impl Iterator<Item = f32> + '_ {
        let held = self.held_mps.iter().flat_map(|held| held.data.0[0]);
        let vectors = [&self.force_n, &self.torque_nm, &self.told_mps].into_iter();
        held.chain(vectors.flat_map(|vector| vector.data.0[0]))
    }
}

/// Friction of a tyre that a trigger gives it, at most.
pub(crate) const FRICTION_MAX: f32 = 100.0;
/// Lying on its side or roof this long, a vehicle has failed.
const ROLLOVER_SECS: f32 = 1.0;

impl Vehicle {
    fn gear(&self) -> i8 {
        self.state.drivetrain.gear(self.tuning.fit())
    }

    fn failure(&self) -> VehicleFailure {
        let lies = self.tipped_secs > ROLLOVER_SECS;
        if lies { VehicleFailure::Rollover } else { VehicleFailure::None }
    }

    /// A vehicle of a blueprint that rolls freely at a speed; `None` for blueprints without wheels.
    pub(crate) fn rolling(blueprint: u16, forward_mps: f32) -> Option<Self> {
        let tuning = Tuning::standard(blueprint)?;
        let state = VehicleState::rolling(tuning.fit(), forward_mps);
        let ackermann = Ackermann::default();
        Some(Self {
            state,
            tuning,
            ackermann,
            wheel: AtTheWheel::Client(Hold::Sticky),
            sticky: true,
            agent: None,
            rules: RoadRules::default(),
            tipped_secs: 0.0,
            altered: None,
        })
    }

    /// One whose client's controls hold for one tick each.
    pub(crate) fn without_sticky_control(self) -> Self {
        Self { wheel: AtTheWheel::Client(Hold::Spent), sticky: false, ..self }
    }

    /// Whoever drives no longer does: the last control stays for as long as it holds. An agent
    /// keeps its route.
    pub(crate) fn leave(&mut self) {
        self.wheel = AtTheWheel::Client(self.hold());
    }

    /// How long the last control holds.
    pub(crate) fn hold(&self) -> Hold {
        match self.wheel {
            AtTheWheel::Client(hold) => hold,
            _ if self.sticky => Hold::Sticky,
            _ => Hold::Spent,
        }
    }

    /// Numbers that decide how it goes on.
    pub(crate) fn values(&self) -> impl Iterator<Item = f32> + '_ {
        let target = self.wheel.ackermann().unwrap_or_default();
        let targets = [target.steer_rad, target.speed_mps];
        self.state.values().chain(self.ackermann.values()).chain(targets)
    }

    fn fits(&self, blueprint: u16) -> bool {
        self.tuning.blueprint() == blueprint
            && self.state.wheels.len() == self.tuning.fit().wheels.len()
            && self.altered.as_ref().is_none_or(|altered| altered.fits(self.state.wheels.len()))
    }
}

impl Altered {
    /// Whether it fits a vehicle with so many wheels.
    pub(crate) fn fits(&self, wheel_count: usize) -> bool {
        let is_friction = |friction: &f32| (0.0..=FRICTION_MAX).contains(friction);
        self.before.len() == wheel_count && self.before.iter().all(is_friction)
    }
}

impl Actor {
    pub(crate) fn blueprint(&self) -> &'static Blueprint {
        blueprint::get(self.blueprint).expect("spawn and restore admit known blueprints only")
    }

    /// Its body in the physics, of those that have one.
    pub(crate) fn rigid(&self) -> Option<BodyHandle> {
        self.body.rigid()
    }

    /// Whether other bodies can touch it.
    pub(crate) fn is_solid(&self) -> bool {
        self.rigid().is_some() && self.switches.collisions
    }

    /// Whether somebody drives who asks others before junctions.
    pub(crate) fn asks(&self) -> bool {
        let wheel = self.vehicle.as_deref().map(|vehicle| &vehicle.wheel);
        wheel.is_some_and(|wheel| wheel.traffic().is_some() || wheel.is_agent())
    }

    /// What only vehicles have, of vehicles.
    pub(crate) fn vehicle_mut(&mut self) -> Option<&mut Vehicle> {
        self.vehicle.as_deref_mut()
    }

    /// The walker and its data, of walkers.
    pub(crate) fn walker_mut(&mut self) -> Option<(&'static WalkerModel, &mut Walker)> {
        let BodySpec::Walker(spec) = &self.blueprint().body else { return None };
        Some((spec, self.walker.as_deref_mut()?))
    }

    /// The public state of this actor.
    pub(crate) fn state(&self, body: &BodyState, type_index: u16) -> ActorState {
        let blueprint = self.blueprint();
        let rules = self.vehicle.as_deref().map(|vehicle| vehicle.rules).unwrap_or_default();
        let failure = self.vehicle.as_deref().map(Vehicle::failure).unwrap_or_default();
        let vehicle = self.vehicle.as_deref().map(|vehicle| &vehicle.state);
        let walker = self.walker.as_deref();
        let at_rest =
            ActorState::at_rest(self.id, blueprint.kind(), type_index, body.world_from_body);
        ActorState {
            gear: self.vehicle.as_deref().map_or(0, Vehicle::gear),
            linear_velocity_mps: body.linear_mps,
            angular_velocity_radps: body.angular_radps,
            linear_acceleration_mps2: self.acceleration_mps2,
            box_centre_m: blueprint.box_centre_m(),
            box_half_extent_m: blueprint.box_half_extent_m(),
            control: vehicle.map_or_else(Default::default, |state| state.control),
            road_wheel_rad: vehicle.map_or(0.0, |state| state.road_wheel_rad),
            colour_rgb: self.colour_rgb,
            speed_limit_mps: rules.speed_limit_mps,
            traffic_light: rules.holder(),
            parent: self.body.attachment().map(|to| to.parent),
            lights: self.lights,
            doors: self.doors,
            failure,
            walker: walker.map(|walker| walker.control).unwrap_or_default(),
            gait_rad: walker.map_or(0.0, |walker| walker.gait_rad),
            ..at_rest
        }
    }

    /// Whether the parts fit the blueprint; what a snapshot may get wrong.
    pub(crate) fn is_consistent(&self) -> bool {
        blueprint::get(self.blueprint).is_some_and(|blueprint| {
            let bodyless = matches!(blueprint.body, BodySpec::None(_));
            (blueprint.kind() == ActorKind::Vehicle) == self.vehicle.is_some()
                && (blueprint.kind() == ActorKind::Walker) == self.walker.is_some()
                && (self.vehicle.is_none() && self.walker.is_none() || self.rigid().is_some())
                && self.vehicle.as_deref().is_none_or(|vehicle| vehicle.fits(self.blueprint))
                && !(bodyless && self.rigid().is_some())
        })
    }
}

//! One actor: what it is, what carries it, and what drives it.

use agents::Pilot;
use schemas::{ActorId, ActorKind, ActorState, Attribute, Vec3};
use serde::{Deserialize, Serialize};

use crate::blueprint::{self, Blueprint, BodySpec};
use crate::body::Body;
use crate::physics::{BodyHandle, BodyState};
use crate::vehicle::{self, Ackermann, Tuning, VehicleState};

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
    /// `None` for everything without wheels.
    pub vehicle: Option<Box<Vehicle>>,
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
    /// Who turns the wheel, if not the last [`SetControl`](schemas::Command::SetControl).
    pub pilot: Option<Pilot>,
}

impl Vehicle {
    /// A vehicle of a blueprint that rolls freely at a speed; `None` for blueprints without wheels.
    pub(crate) fn rolling(blueprint: u16, forward_mps: f32) -> Option<Self> {
        let tuning = Tuning::standard(blueprint)?;
        let state = VehicleState::rolling(tuning.fit(), forward_mps);
        Some(Self { state, tuning, ackermann: Ackermann::default(), pilot: None })
    }

    fn fits(&self, blueprint: u16) -> bool {
        self.tuning.blueprint() == blueprint
            && self.state.wheels.len() == self.tuning.fit().wheels.len()
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

    /// What only vehicles have, of vehicles.
    pub(crate) fn vehicle_mut(&mut self) -> Option<&mut Vehicle> {
        self.vehicle.as_deref_mut()
    }

    /// The public state of this actor.
    pub(crate) fn state(&self, body: &BodyState, type_index: u16) -> ActorState {
        let blueprint = self.blueprint();
        let vehicle = self.vehicle.as_deref().map(|vehicle| &vehicle.state);
        let up_z = (body.world_from_body.rotation * Vec3::z()).z;
        let at_rest =
            ActorState::at_rest(self.id, blueprint.kind(), type_index, body.world_from_body);
        ActorState {
            gear: vehicle.map_or(0, |state| state.drivetrain.gear),
            linear_velocity_mps: body.linear_mps,
            angular_velocity_radps: body.angular_radps,
            linear_acceleration_mps2: self.acceleration_mps2,
            box_centre_m: blueprint.box_centre_m(),
            box_half_extent_m: blueprint.box_half_extent_m(),
            control: vehicle.map_or_else(Default::default, |state| state.control),
            road_wheel_rad: vehicle.map_or(0.0, |state| state.road_wheel_rad),
            colour_rgb: self.colour_rgb,
            parent: self.body.attachment().map(|to| to.parent),
            lights: self.lights,
            doors: self.doors,
            failure: vehicle.map_or_else(Default::default, |_| vehicle::failure(up_z)),
            ..at_rest
        }
    }

    /// Whether the parts fit the blueprint; what a snapshot may get wrong.
    pub(crate) fn is_consistent(&self) -> bool {
        blueprint::get(self.blueprint).is_some_and(|blueprint| {
            let bodyless = matches!(blueprint.body, BodySpec::None(_));
            (blueprint.kind() == ActorKind::Vehicle) == self.vehicle.is_some()
                && self
                    .vehicle
                    .as_deref()
                    .is_none_or(|vehicle| self.rigid().is_some() && vehicle.fits(self.blueprint))
                && !(bodyless && self.rigid().is_some())
        })
    }
}

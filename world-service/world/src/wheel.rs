//! Who drives a vehicle.

use agents::{Driver, Pilot};
use schemas::{AckermannControl, VehicleControl};
use serde::{Deserialize, Serialize};

/// Who drives a vehicle: exactly one at a time.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) enum AtTheWheel {
    /// A client, with pedals and steering wheel.
    Client(Hold),
    /// A client, with a target for the vehicle's [`Ackermann`](crate::vehicle::Ackermann)
    /// controller.
    Ackermann(AckermannControl),
    /// A driver that keeps its lane.
    Pilot(Box<Pilot>),
    /// The vehicle's own navigation agent.
    Agent,
    /// A driver of the world's own traffic.
    Traffic(TrafficDriver),
}

/// How long a client's control holds: CARLA's `sticky_control`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) enum Hold {
    /// Until the next one.
    Sticky,
    /// For the next tick; it is still to come.
    OneTick,
    /// Its tick is over.
    Spent,
}

/// A driver of the world's own traffic.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct TrafficDriver {
    pub driver: Box<Driver>,
    /// Whether its vehicle moves without dynamics, as far traffic does.
    pub on_rails: bool,
    /// Whether the world brought the vehicle, and takes it elsewhere where a road ends.
    pub of_world: bool,
}

impl TrafficDriver {
    /// One that drives with dynamics.
    pub(crate) fn new(driver: Driver, of_world: bool) -> Self {
        Self { driver: Box::new(driver), on_rails: false, of_world }
    }
}

impl Hold {
    /// The control that takes the place of one whose tick is over.
    pub(crate) fn replaces(&mut self) -> Option<VehicleControl> {
        match *self {
            Self::Sticky => return None,
            Self::OneTick => *self = Self::Spent,
            Self::Spent => return Some(VehicleControl::default()),
        }
        None
    }
}

impl AtTheWheel {
    pub(crate) fn pilot(&self) -> Option<&Pilot> {
        if let Self::Pilot(pilot) = self { Some(pilot) } else { None }
    }

    pub(crate) fn ackermann(&self) -> Option<AckermannControl> {
        if let Self::Ackermann(target) = self { Some(*target) } else { None }
    }

    pub(crate) fn traffic(&self) -> Option<&TrafficDriver> {
        if let Self::Traffic(traffic) = self { Some(traffic) } else { None }
    }

    pub(crate) fn traffic_mut(&mut self) -> Option<&mut TrafficDriver> {
        if let Self::Traffic(traffic) = self { Some(traffic) } else { None }
    }

    pub(crate) fn is_agent(&self) -> bool {
        matches!(self, Self::Agent)
    }
}

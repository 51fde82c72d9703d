//! Physics of a vehicle as either client has it.

use schemas::{Pose, VehiclePhysics};
use serde::{Deserialize, Deserializer, Serialize};

use super::chaos::ChaosControl;
use super::{ClientVersion, VehiclePhysicsControl};
use crate::dialect::version::{Either, either};

/// What clients read, change and send back.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(untagged)]
pub(crate) enum PhysicsControl {
    /// As Unreal Engine 4 has it.
    Old(VehiclePhysicsControl),
    /// As Unreal Engine 5 has it.
    New(Box<ChaosControl>),
}

impl PhysicsControl {
    /// Of a vehicle that is somewhere.
    pub(crate) fn of(physics: &VehiclePhysics, at: &Pose, version: ClientVersion) -> Self {
        match version {
            ClientVersion::V0_9 => Self::Old(VehiclePhysicsControl::of(physics, at)),
            ClientVersion::V0_10 => Self::New(Box::new(ChaosControl::of(physics, at))),
        }
    }

    /// In our units; what it does not speak of stays.
    pub(crate) fn ours(&self, now: &VehiclePhysics) -> VehiclePhysics {
        match self {
            Self::Old(control) => control.ours(now),
            Self::New(control) => control.ours(now),
        }
    }

    /// How many wheels it speaks of.
    pub(crate) fn wheel_count(&self) -> usize {
        match self {
            Self::Old(control) => control.wheel_count(),
            Self::New(control) => control.wheel_count(),
        }
    }
}

impl<'de> Deserialize<'de> for PhysicsControl {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let control = either::<D, VehiclePhysicsControl, Box<ChaosControl>>(deserializer, 17, 30)?;
        Ok(match control {
            Either::Old(control) => Self::Old(control),
            Either::New(control) => Self::New(control),
        })
    }
}

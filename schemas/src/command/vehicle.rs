//! Changes of vehicles.

use serde::{Deserialize, Serialize};

use crate::{AckermannControl, AckermannGains, ActorId, VehicleControl, VehiclePhysics};

/// One change of a vehicle.
#[derive(Clone, Debug, PartialEq)]
pub enum VehicleCommand {
    /// Manual driving, until replaced; ends any pilot.
    Control {
        /// Which vehicle.
        actor: ActorId,
        /// How.
        control: VehicleControl,
    },
    /// Drives towards a speed and a wheel angle, until replaced; ends any pilot.
    Ackermann {
        /// Which vehicle.
        actor: ActorId,
        /// To what.
        control: AckermannControl,
    },
    /// Changes how the Ackermann controller reacts.
    AckermannGains {
        /// Which vehicle.
        actor: ActorId,
        /// To what.
        gains: AckermannGains,
    },
    /// Hands a vehicle to a driver that runs inside the tick.
    Pilot {
        /// Which vehicle.
        actor: ActorId,
        /// What the driver does.
        mode: PilotMode,
        /// `None`: the speed at the moment of the command.
        target_speed_mps: Option<f32>,
    },
    /// Changes how a vehicle drives.
    Physics {
        /// Which vehicle.
        actor: ActorId,
        /// To what.
        physics: Box<VehiclePhysics>,
    },
    /// Switches lamps.
    Lights {
        /// Which vehicle.
        actor: ActorId,
        /// CARLA's `VehicleLightState` flags.
        lights: u32,
    },
    /// Opens or closes doors.
    Doors {
        /// Which vehicle.
        actor: ActorId,
        /// Bits as in [`ActorState::doors`](crate::ActorState::doors).
        doors: u8,
        /// Open or close.
        open: bool,
    },
}

/// What an in-tick driver does.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum PilotMode {
    /// Keep the lane at a target speed.
    KeepLane,
    /// Move to the left neighbouring lane of the same direction, then keep it.
    ChangeLaneLeft,
    /// Move to the right neighbouring lane of the same direction, then keep it.
    ChangeLaneRight,
}

//! What vehicles are told, and how their parts stand.

use crate::bytes::{Long, record};

record! {
    /// What a vehicle is told.
    VehicleControl {
        /// Which one.
        id: u32,
        /// −1 to 1, positive to the right.
        steer: f32,
        /// 0 to 1.
        throttle: f32,
        /// 0 to 1.
        brake: f32,
        /// Whether the hand brake is on.
        hand_brake: bool,
        /// Negative in reverse.
        gear: i32,
    }
}

/// The lights of vehicles, one bit each.
pub mod light {
    /// With their names in texts, in the order of texts.
    pub const NAMES: [(u32, &str); 11] = [
        (1, "Position"),
        (2, "LowBeam"),
        (4, "HighBeam"),
        (8, "Brake"),
        (16, "RightBlinker"),
        (32, "LeftBlinker"),
        (64, "Reverse"),
        (256, "Interior"),
        (128, "Fog"),
        (512, "Special1"),
        (1024, "Special2"),
    ];
}

record! {
    /// Which lights of a vehicle burn.
    VehicleLights {
        /// Which one.
        id: u32,
        /// Sum of [`light::NAMES`].
        flags: u32,
    }
}

record! {
    /// How one wheel stands.
    WheelPose {
        /// 0 front left, 1 front right, 2 back left, 3 back right; of two-wheelers 0 front, 1 back.
        wheel: u8,
        /// In degrees.
        steer_deg: f32,
        /// In degrees.
        rotation_deg: f32,
    }
}

record! {
    /// How the wheels of a vehicle stand.
    Wheels {
        /// Which one.
        id: u32,
        /// Each of them.
        wheels: Long<WheelPose>,
    }
}

record! {
    /// How the rider of a two-wheeler moves.
    Biker {
        /// Which one.
        id: u32,
        /// Forwards, in cm/s.
        speed: f32,
        /// Of the engine, as a share of its maximum.
        engine: f32,
    }
}

record! {
    /// A door that is opened or closed.
    Door {
        /// Of which vehicle.
        id: u32,
        /// 0 front left, 1 front right, 2 rear left, 3 rear right, 4 hood, 5 boot, 6 all.
        door: u8,
        /// Whether it is open from now on.
        is_open: bool,
    }
}

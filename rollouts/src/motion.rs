//! How one vehicle moves at the end of a step: all that observations, rewards and ends know of it.

/// Frame: world x east, y north; along and to the left of the vehicle.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Motion {
    /// Box centre on the ground.
    pub x_m: f32,
    pub y_m: f32,
    /// Of the heading, counter-clockwise from x.
    pub cos: f32,
    pub sin: f32,
    /// Along the vehicle, negative backwards.
    pub speed_mps: f32,
    /// Mean over the last tick.
    pub along_mps2: f32,
    pub left_mps2: f32,
    /// Positive to the left.
    pub yaw_radps: f32,
    pub road_wheel_rad: f32,
    /// It lies on its side or roof.
    pub overturned: bool,
}

/// What a vehicle ran into in one step.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Contacts {
    pub vehicles: u32,
    pub walkers: u32,
    /// Buildings, poles and other things that stand.
    pub things: u32,
}

impl Contacts {
    pub(crate) fn any(self) -> bool {
        self.vehicles + self.walkers + self.things > 0
    }
}

/// Size of a vehicle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Shape {
    pub length_m: f32,
    pub width_m: f32,
    /// From the box centre back to the rear axle.
    pub rear_m: f32,
}

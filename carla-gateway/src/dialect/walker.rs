//! Walking.

use schemas::WalkerControl as Ours;
use serde::{Deserialize, Serialize};

use super::Vector3D;

#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct WalkerControl {
    pub(crate) direction: Vector3D,
    pub(crate) speed: f32,
    pub(crate) jump: bool,
}

impl WalkerControl {
    /// In our axes; the direction becomes a unit vector, or zero.
    pub(crate) fn ours(self) -> Ours {
        let direction = self.direction.ours();
        let length = direction.norm();
        let usable = length.is_finite() && length > 1e-6;
        Ours {
            direction: if usable { direction / length } else { schemas::Vec3::zeros() },
            speed_mps: self.speed,
            jump: self.jump,
        }
    }
}

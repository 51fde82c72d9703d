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
    /// In our axes; a direction without a finite length is none.
    pub(crate) fn ours(self) -> Ours {
        let told = self.direction.ours();
        let direction = if told.norm().is_finite() { told } else { schemas::Vec3::zeros() };
        Ours { direction, speed_mps: self.speed, jump: self.jump }
    }
}

//! What a driver inside the tick knows.

use crate::network::Network;
use crate::pilot::VehicleView;
use crate::scene::{Body, Scene};

/// What a driver knows of its vehicle and the world around it.
#[derive(Clone, Copy, Debug)]
pub struct Senses<'a> {
    /// Lanes of the map.
    pub network: &'a Network,
    /// Everybody.
    pub scene: &'a Scene,
    /// The own vehicle.
    pub view: &'a VehicleView,
    /// The own box.
    pub body: &'a Body,
    /// Length of the tick.
    pub dt_secs: f32,
}

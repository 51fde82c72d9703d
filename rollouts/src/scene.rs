//! Who and what is around the agents of a world at the end of a step, for their observations.

use agents::Body;
use schemas::TrafficLightColour;

use crate::motion::{Motion, Shape};

/// A vehicle or person as others see it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Neighbour {
    /// Middle of its box, world frame.
    pub x_m: f32,
    pub y_m: f32,
    /// Of its heading.
    pub cos: f32,
    pub sin: f32,
    /// World frame.
    pub x_mps: f32,
    pub y_mps: f32,
    pub length_m: f32,
    pub width_m: f32,
    pub is_walker: bool,
    /// An agent whose episode is over is not there.
    pub is_there: bool,
}

/// Everybody in a world and what its lights show; room that is used again from world to world.
#[derive(Debug, Default)]
pub(crate) struct Scene {
    /// Agents first, in their order, then all others.
    pub everybody: Vec<Neighbour>,
    /// In the order of the map's lights; none in a world without.
    pub colours: Vec<TrafficLightColour>,
}

impl Neighbour {
    /// An agent, or its place where it is not there.
    pub(crate) fn agent(motion: &Motion, shape: Shape, is_there: bool) -> Self {
        let Motion { x_m, y_m, cos, sin, speed_mps, .. } = *motion;
        let Shape { length_m, width_m, .. } = shape;
        let (x_mps, y_mps) = (speed_mps * cos, speed_mps * sin);
        let is_walker = false;
        Self { x_m, y_m, cos, sin, x_mps, y_mps, length_m, width_m, is_walker, is_there }
    }

    pub(crate) fn of(body: &Body) -> Self {
        let level = body.forward.xy().norm().max(1.0e-6);
        Self {
            x_m: body.centre_m.x,
            y_m: body.centre_m.y,
            cos: body.forward.x / level,
            sin: body.forward.y / level,
            x_mps: body.velocity_mps.x,
            y_mps: body.velocity_mps.y,
            length_m: 2.0 * body.half_m.x,
            width_m: 2.0 * body.half_m.y,
            is_walker: body.is_walker,
            is_there: true,
        }
    }
}

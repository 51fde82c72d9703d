//! A post of a traffic light or sign.

use nalgebra::{Isometry3, Translation3, Vector3};

/// What a post carries.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Carried {
    /// The lamps of a light.
    Lamps,
    /// The board of a sign.
    Board,
}

/// The post of a signal. Its frame has its origin at the foot, x along the traffic that the signal
/// speaks to, z up; lengths are in metres.
#[derive(Clone, Debug, PartialEq)]
pub struct Post {
    /// Position among [`Map::landmarks`](crate::Map::landmarks) of the first one of its signal.
    pub landmark: usize,
    /// Position among the lights of [`Map::traffic_lights`](crate::Map::traffic_lights), of those
    /// that are.
    pub light: Option<usize>,
    /// World from post.
    pub foot: Isometry3<f64>,
    /// Of the post.
    pub radius_m: f64,
    /// Height of its top above the foot.
    pub top_m: f64,
    /// How deep it begins below the foot.
    pub root_m: f64,
    /// What is at its top.
    pub carried: Carried,
    /// Middle of that.
    pub post_from_carried: Translation3<f64>,
    /// Half of its size along the axes of the post.
    pub carried_half_m: Vector3<f64>,
    /// Whether it stands where cars drive, as some maps have it.
    pub is_on_lane: bool,
    /// Whether it repeats the lamps of a light beyond its junction.
    pub is_far_side: bool,
}

impl Post {
    /// World from the middle of what it carries.
    #[must_use]
    pub fn world_from_carried(&self) -> Isometry3<f64> {
        self.foot * self.post_from_carried
    }
}

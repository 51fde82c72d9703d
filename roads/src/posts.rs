//! The posts of traffic lights and signs with what they carry: one description for pictures, rays
//! and bodies.

use std::collections::{BTreeMap, BTreeSet};

use nalgebra::{Isometry3, Point3, Translation3, Vector3};

use crate::far_side::FarSide;
use crate::kinds::LaneType;
use crate::landmarks::{LIGHT_HEAD_HALF_M, Landmark};
use crate::lights::TrafficLight;
use crate::map::Map;

/// Height of a light's post above its foot, in metres.
const LIGHT_POST_M: f64 = 3.9;
/// Radius of a light's and of a sign's post, in metres.
const LIGHT_RADIUS_M: f64 = 0.07;
const SIGN_RADIUS_M: f64 = 0.035;
/// How deep posts begin below their foot, in metres: the land beside a road is lower.
const ROOT_M: f64 = 0.5;
/// Width and height of a board whose map gives none or nonsense, in metres.
const BOARD_M: f64 = 0.7;
/// Sizes of boards and heights of their lower edges that make sense, in metres.
const BOARD_SANE_M: std::ops::RangeInclusive<f64> = 0.2..=6.0;
const EDGE_SANE_M: [f64; 2] = [0.5, 8.0];
/// Half of the thickness of a board, and how far before the post its middle is, in metres.
const BOARD_HALF_THICKNESS_M: f64 = 0.03;
const BOARD_BEFORE_M: f64 = 0.06;
/// A lane this far above or below the foot of a post is another storey, in metres.
const STOREY_M: f64 = 3.0;

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
    /// Position among [`Map::landmarks`] of the first one of its signal.
    pub landmark: usize,
    /// Position among the lights of [`Map::traffic_lights`], of those that are.
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

/// Those of the signals, then those with far-side lamps.
pub(crate) fn list(map: &Map) -> Vec<Post> {
    let lights = map.traffic_lights().lights;
    let mut posts = of_signals(map, &lights);
    let far_side = FarSide::new(map);
    let beyond: Vec<Post> = posts
        .iter()
        .filter_map(|near| {
            let foot = far_side.foot(lights.get(near.light?)?)?;
            Some(Post { foot, is_on_lane: false, is_far_side: true, ..near.clone() })
        })
        .collect();
    posts.extend(beyond);
    posts
}

fn of_signals(map: &Map, lights: &[TrafficLight]) -> Vec<Post> {
    let light_of: BTreeMap<&str, usize> =
        lights.iter().enumerate().map(|(at, light)| (light.id.as_str(), at)).collect();
    let mut known = BTreeSet::new();
    let upright = map.landmarks().iter().enumerate().filter(|(_, landmark)| {
        !landmark.name.contains("Stencil") && known.insert(landmark.id.as_str())
    });
    upright
        .map(|(at, landmark)| {
            let light = light_of.get(landmark.id.as_str()).copied();
            Post {
                landmark: at,
                light,
                is_on_lane: is_on_lane(map, landmark),
                ..if landmark.dynamic || light.is_some() {
                    light_post(landmark)
                } else {
                    sign_post(landmark)
                }
            }
        })
        .collect()
}

fn light_post(landmark: &Landmark) -> Post {
    let foot = landmark.foot();
    let [x, y, z] = LIGHT_HEAD_HALF_M;
    Post {
        landmark: 0,
        light: None,
        foot,
        radius_m: LIGHT_RADIUS_M,
        top_m: LIGHT_POST_M,
        root_m: ROOT_M,
        carried: Carried::Lamps,
        post_from_carried: foot.inv_mul(&landmark.light_head()).translation,
        carried_half_m: Vector3::new(x, y, z),
        is_on_lane: false,
        is_far_side: false,
    }
}

fn sign_post(landmark: &Landmark) -> Post {
    let sane = |size_m: f64| if BOARD_SANE_M.contains(&size_m) { size_m } else { BOARD_M };
    let half_m = Vector3::new(
        BOARD_HALF_THICKNESS_M,
        sane(landmark.width_m) / 2.0,
        sane(landmark.height_m) / 2.0,
    );
    let edge_m = landmark.z_offset_m.clamp(EDGE_SANE_M[0], EDGE_SANE_M[1]);
    Post {
        landmark: 0,
        light: None,
        foot: landmark.foot(),
        radius_m: SIGN_RADIUS_M,
        top_m: edge_m + 2.0 * half_m.z,
        root_m: ROOT_M,
        carried: Carried::Board,
        post_from_carried: Translation3::new(-BOARD_BEFORE_M, 0.0, edge_m + half_m.z),
        carried_half_m: half_m,
        is_on_lane: false,
        is_far_side: false,
    }
}

fn is_on_lane(map: &Map, landmark: &Landmark) -> bool {
    let foot = Point3::from(landmark.foot().translation.vector);
    let lane = map.inside(foot, LaneType::Driving.into()).and_then(|place| map.lane_pose(&place));
    lane.is_some_and(|lane| (lane.point.z - foot.z).abs() < STOREY_M)
}

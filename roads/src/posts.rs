//! The posts of traffic lights and signs with what they carry: one description for pictures, rays
//! and bodies.

use std::collections::{BTreeMap, BTreeSet};

use nalgebra::{Point3, Translation3, Vector3};

use crate::far_side::FarSide;
use crate::kinds::LaneType;
use crate::landmarks::{LIGHT_HEAD_HALF_M, Landmark};
use crate::lights::TrafficLight;
use crate::map::Map;
use crate::post::{Carried, Post};

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

impl Map {
    /// The posts of all signals that stand beside roads, each once, in the order of the landmarks,
    /// then those with far-side lamps in the same order; what is only painted has none.
    ///
    /// **Cost:** made on the first call.
    #[must_use]
    pub fn posts(&self) -> &[Post] {
        self.posts.get_or_init(|| list(self))
    }

    /// The [`posts`](Self::posts) with their places among the things that can be hidden: they come
    /// after the [`scenery`](Self::scenery), whose places are their positions in it.
    pub fn posts_with_places(&self) -> impl Iterator<Item = (u32, &Post)> {
        let first = u32::try_from(self.scenery().len()).unwrap_or(u32::MAX);
        (first..).zip(self.posts())
    }

    /// How many things can be hidden: scenery, posts and what these carry.
    #[must_use]
    pub fn place_count(&self) -> usize {
        self.scenery().len() + 2 * self.posts().len()
    }

    /// The place among them of what a post carries: they come after those of the posts.
    #[must_use]
    pub fn carried_place(&self, post: u32) -> u32 {
        post.saturating_add(u32::try_from(self.posts().len()).unwrap_or(u32::MAX))
    }
}

fn list(map: &Map) -> Vec<Post> {
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

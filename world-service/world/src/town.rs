//! What all worlds of one map share: the road network, the ground and the scenery.

use std::sync::{Arc, OnceLock};

use agents::Network;
use roads::nav::NavMesh;
use roads::{Map, mesh};
use schemas::{MapRef, Pose, Vec3};

use crate::ground::Ground;
use crate::rays::TownRays;
use crate::scenery::Scenery;
use crate::traffic::{Lights, TrafficPlan};

/// The static part of a map, built once and shared by every world on it.
#[derive(Debug)]
pub struct Town {
    pub(crate) roads: Arc<Map>,
    pub(crate) ground: Ground,
    pub(crate) scenery: Scenery,
    pub(crate) traffic: TrafficPlan,
    pub(crate) rays: TownRays,
    /// Whether people have crossings over its roads.
    pub(crate) has_crossings: bool,
    network: OnceLock<Network>,
    beginnings: OnceLock<Vec<Pose>>,
    nav: OnceLock<Option<NavMesh>>,
    map: MapRef,
}

impl Town {
    /// Prepares a map for driving.
    ///
    /// - **Cost:** linear in the triangles of the map; milliseconds for a town.
    pub fn new(roads: Arc<Map>) -> Self {
        let ground = Ground::new(triangles(&mesh::ground(&roads)));
        let scenery = Scenery::new(boxes(&roads).chain(post_boxes(&roads)));
        let map = MapRef { name: roads.name().to_owned(), digest: roads.digest().to_owned() };
        let traffic = TrafficPlan::new(&roads);
        let rays = TownRays::new(Arc::clone(&roads));
        let has_crossings = !roads.crosswalks().is_empty();
        let (network, beginnings, nav) = (OnceLock::new(), OnceLock::new(), OnceLock::new());
        Self { roads, ground, scenery, traffic, rays, has_crossings, network, beginnings, nav, map }
    }

    /// Where people walk, made when the first of them asks; `None` on maps without sidewalks.
    pub fn nav(&self) -> Option<&NavMesh> {
        let mesh = || NavMesh::new(&self.roads).ok().filter(|mesh| !mesh.is_empty());
        self.nav.get_or_init(mesh).as_ref()
    }

    /// The lanes for drivers inside the tick; made when the first of them asks.
    pub fn network(&self) -> &Network {
        self.network.get_or_init(|| Network::new(&self.roads))
    }

    /// Where traffic begins anew: where roads begin, or anywhere on a map on which none does.
    pub(crate) fn beginnings(&self) -> &[Pose] {
        /// How far behind the beginning of a road a vehicle is put.
        const BEHIND_M: f32 = 6.0;
        /// Way between places on a map on which no road begins.
        const PLACES_M: f32 = 20.0;
        let places = || {
            let sources = self.network().sources(BEHIND_M);
            if sources.is_empty() { self.network().places(PLACES_M) } else { sources }
        };
        self.beginnings.get_or_init(places)
    }

    /// The map that it was made of.
    pub fn roads(&self) -> &Arc<Map> {
        &self.roads
    }

    /// Its traffic lights at the beginning of their turns, for whoever has them without a world.
    pub fn lights(&self) -> Lights {
        Lights::new(&self.traffic)
    }

    /// Lets its lights take their turns for a time.
    pub fn advance_lights(&self, lights: &mut Lights, dt_secs: f64) {
        lights.advance(&self.traffic, dt_secs);
    }

    /// The map's name and digest.
    pub fn map_ref(&self) -> &MapRef {
        &self.map
    }
}

fn boxes(roads: &Map) -> impl Iterator<Item = (u32, Pose, Vec3)> {
    let things = (0..).zip(roads.scenery());
    things.map(|(place, item)| {
        (place, nalgebra::convert(item.pose), nalgebra::convert(item.half_extent_m))
    })
}

/// The posts of lights and signs, but those that a map has where cars drive.
fn post_boxes(roads: &Map) -> impl Iterator<Item = (u32, Pose, Vec3)> {
    let posts = roads.posts_with_places().filter(|(_, post)| !post.is_on_lane);
    posts.map(|(place, post)| {
        let (foot, half_m) = (post.foot.cast(), post.radius_m as f32);
        let (root_m, top_m) = (post.root_m as f32, post.top_m as f32);
        let middle = Pose::translation(0.0, 0.0, (top_m - root_m) / 2.0);
        (place, foot * middle, Vec3::new(half_m, half_m, (top_m + root_m) / 2.0))
    })
}

fn triangles(mesh: &mesh::GroundMesh) -> Vec<([Vec3; 3], f32)> {
    let corner = |index: u32| mesh.positions_m.get(index as usize).copied().map(Vec3::from);
    mesh.indices
        .iter()
        .zip(&mesh.materials)
        .filter_map(|(&[a, b, c], material)| {
            Some(([corner(a)?, corner(b)?, corner(c)?], material.friction()))
        })
        .collect()
}

//! What rays meet of a map.

use std::sync::{Arc, OnceLock};

use roads::mesh::{self, GroundMesh};
use roads::{Carried, Map, Post, SceneryBox, SceneryKind};
use schemas::{HiddenScenery, Pose, SemanticTag, Vec3};

use super::bounds::Bounds;
use super::mesh::{Face, Mesh};
use super::shape::Shape;
use super::solids::{Solid, Solids};
use super::tag;

/// Share of its height by which a tree's crown hangs over the upper end of the trunk.
const CROWN_OVERLAP: f32 = 0.1;

/// Ground and scenery of a map, shared by all its worlds and built when first asked for.
#[derive(Debug)]
pub(crate) struct TownRays {
    roads: Arc<Map>,
    ground: OnceLock<Mesh>,
    scenery: OnceLock<Solids>,
}

impl TownRays {
    pub(crate) fn new(roads: Arc<Map>) -> Self {
        Self { roads, ground: OnceLock::new(), scenery: OnceLock::new() }
    }

    /// - **Cost:** the first time n log n in the triangles; some tenths of a second for a town.
    pub(crate) fn ground(&self) -> &Mesh {
        let build = || {
            let all = [mesh::ground(&self.roads), mesh::decks(&self.roads)];
            let all: Vec<Face> = all.iter().flat_map(faces).collect();
            Mesh::met_from_both_sides(&all)
        };
        self.ground.get_or_init(build)
    }

    pub(crate) fn scenery(&self) -> &Solids {
        let build = || {
            let things = self.roads.scenery();
            let scenery = (0..).zip(things).flat_map(|(place, thing)| solids(place, thing));
            let posts = self.roads.posts_with_places();
            let posts = posts
                .flat_map(|(place, post)| parts([place, self.roads.carried_place(place)], post));
            Solids::new(scenery.chain(posts).collect())
        };
        self.scenery.get_or_init(build)
    }

    /// Tag of the scenery nearest to a point within `reach_m`, of what is not hidden.
    pub(crate) fn scenery_tag_at(
        &self,
        point_m: Vec3,
        reach_m: f32,
        hidden: &HiddenScenery,
    ) -> Option<u8> {
        let mut nearest: Option<(f32, u8)> = None;
        let around = Bounds::around([point_m]).grown(reach_m);
        self.scenery().overlapping(&around, hidden, |solid| {
            let Some(closest_m) = solid.closest_m(point_m) else { return };
            let distance_m = (closest_m - point_m).norm();
            if nearest.is_none_or(|(nearest_m, _)| distance_m < nearest_m) {
                nearest = Some((distance_m, solid.tag));
            }
        });
        nearest.map(|(_, tag)| tag)
    }
}

fn faces(mesh: &GroundMesh) -> impl Iterator<Item = Face> {
    let corner = |index: u32| mesh.positions_m.get(index as usize).copied().map(Vec3::from);
    mesh.indices.iter().zip(&mesh.materials).filter_map(move |(&[a, b, c], &material)| {
        let corners = [corner(a)?, corner(b)?, corner(c)?];
        Some(Face { corners, tag: tag::of_material(material) })
    })
}

/// A box, and the crown above it if it is the trunk of a tree.
fn solids(place: u32, item: &SceneryBox) -> impl Iterator<Item = Solid> + use<> {
    let tag = item.label.number();
    let world_from_box: Pose = nalgebra::convert(item.pose);
    let half_m: Vec3 = nalgebra::convert(item.half_extent_m);
    let solid = Solid::new(Shape::Box { half_m }, &world_from_box, tag, place);
    let crown = (item.kind == SceneryKind::Tree && item.crown_radius_m > 0.0).then(|| {
        let (height_m, radius_m) = (item.height_m as f32, item.crown_radius_m as f32);
        let trunk_m = 2.0 * half_m.z;
        let half_height_m = (height_m - trunk_m * (1.0 - CROWN_OVERLAP)) / 2.0;
        let above_m = height_m - half_height_m - half_m.z;
        let radii_m = Vec3::new(radius_m, radius_m, half_height_m);
        let world_from_crown = world_from_box * Pose::translation(0.0, 0.0, above_m);
        Solid::new(Shape::Ellipsoid { radii_m }, &world_from_crown, tag, place)
    });
    std::iter::once(solid).chain(crown)
}

/// A post, and the lamps or the board at it, with their places.
fn parts([post_place, carried_place]: [u32; 2], post: &Post) -> [Solid; 2] {
    let solid = |shape, post_from_shape: Pose, tag: SemanticTag, place| {
        let world_from_shape = post.foot.cast() * post_from_shape;
        Solid::new(shape, &world_from_shape, tag.number(), place)
    };
    let (root_m, top_m, radius_m) = (post.root_m as f32, post.top_m as f32, post.radius_m as f32);
    let half_segment_m = (top_m + root_m) / 2.0 - radius_m;
    let pole = Shape::Capsule { half_segment_m, radius_m };
    let middle = Pose::translation(0.0, 0.0, (top_m - root_m) / 2.0);
    let carried = Shape::Box { half_m: nalgebra::convert(post.carried_half_m) };
    let tag = match post.carried {
        Carried::Lamps => SemanticTag::TrafficLight,
        Carried::Board => SemanticTag::TrafficSigns,
    };
    [
        solid(pole, middle, SemanticTag::Poles, post_place),
        solid(carried, post.post_from_carried.cast::<f32>().into(), tag, carried_place),
    ]
}

#[cfg(test)]
mod tests {
    use schemas::{Attribute, Command, SensorCommand, WorldId};

    use super::*;
    use crate::rays::bvh::Stack;
    use crate::rays::ray::Ray;
    use crate::{Town, World, WorldConfig};

    #[test]
    fn whoever_looks_up_to_a_bridge_meets_its_underside() {
        let text = roads::town::build("Town04").expect("the town exists");
        let map = Arc::new(Map::parse("Town04", &text).expect("the town is valid"));
        let faces: Vec<Face> = faces(&mesh::decks(&map)).collect();
        assert!(faces.len() > 400, "{}", faces.len());
        let rays = TownRays::new(map);
        let mut stack = Stack::new();
        let mut undersides = 0;
        for Face { corners: [a, b, c], .. } in faces {
            let normal = (b - a).cross(&(c - a));
            // Neither sides nor the slopes between embankments and bridges.
            if normal.norm() < 0.1 || normal.normalize().z > -0.99 {
                continue;
            }
            let below_m = (a + b + c) / 3.0 - Vec3::z() * 0.3;
            let hit = rays.ground().nearest(&Ray::new(below_m, Vec3::z()), 10.0, &mut stack);
            let hit = hit.expect("something lies above");
            assert!(hit.distance_m < 0.31, "{below_m}: {} m", hit.distance_m);
            assert_eq!(hit.tag, SemanticTag::Bridge.number());
            undersides += 1;
        }
        assert!(undersides > 150, "{undersides}");
    }

    #[test]
    fn nothing_is_built_for_rays_before_the_first_one_is_cast() {
        let text = roads::town::build("Town02").expect("the town exists");
        let map = Map::parse("Town02", &text).expect("the town is valid");
        let map = Arc::new(Town::new(Arc::new(map)));
        let id = WorldId::new(1).unwrap();
        let config = WorldConfig { id, epoch: 1, seed: 1, dt_secs: 0.05, map: Arc::clone(&map) };
        let mut world = World::new(config).unwrap();
        let mut spawn = |blueprint: &str, attributes: Vec<Attribute>| {
            let mut command = Command::spawn(blueprint, Pose::identity(), Vec3::zeros());
            if let Command::SpawnActor { attributes: given, .. } = &mut command {
                *given = attributes;
            }
            let sensor = world.apply(&command).unwrap().unwrap();
            world.apply(&Command::Sensor(SensorCommand::Listen { sensor, on: true })).unwrap();
            world.tick().unwrap();
            map.rays.ground.get().is_some()
        };
        assert!(!spawn("sensor.other.imu", Vec::new()));
        assert!(!spawn("sensor.other.gnss", Vec::new()));
        let range = Attribute { id: "range".to_owned(), value: "20".to_owned() };
        assert!(spawn("sensor.lidar.ray_cast", vec![range]));
    }
}

//! Do depth, tags, ids and normals tell what is there? Every expected value follows from where the
//! test put things, not from another picture.

#![allow(clippy::unwrap_used, reason = "a test may panic")]

mod common;

use std::collections::BTreeMap;
use std::sync::Arc;

use common::{camera, car, depth_m, draw, frame, job, of_kind, pillar, project, renderers, town};
use render_service::{Material, Surface, TownScene, WallKind};
use schemas::{
    ActorId, ActorKind, ActorState, Camera, DEPTH_MAX_M, Frame, Image, ImageKind, MapRef, Pose,
    RenderJob, SemanticTag, TagId, UnitQuaternion, Vec3, level_pose,
};

/// Above the road, turned about all axes.
fn crooked() -> Camera {
    let turn = UnitQuaternion::from_euler_angles(0.1, 0.35, 0.6);
    let carrier_from_camera = Pose::from_parts(Vec3::new(-40.0, -30.0, 7.0).into(), turn);
    Camera { carrier_from_camera, ..camera() }
}

/// Direction through the middle of a pixel, 1 along the view.
fn ray(camera: &Camera, column: u32, row: u32) -> Vec3 {
    let half = (camera.horizontal_fov_rad / 2.0).tan();
    let side = 2.0 * half / camera.width_px as f32;
    let left = (camera.width_px as f32 / 2.0 - (column as f32 + 0.5)) * side;
    let up = (camera.height_px as f32 / 2.0 - (row as f32 + 0.5)) * side;
    camera.carrier_from_camera.rotation * Vec3::new(1.0, left, up)
}

fn tag_id(image: &Image, column: u32, row: u32) -> (SemanticTag, u32) {
    let at = ((row * image.width_px + column) * 4) as usize;
    let pixel = TagId::unpack(image.data[at..at + 4].try_into().unwrap());
    (pixel.tag.unwrap(), pixel.id)
}

fn pixels(image: &Image) -> impl Iterator<Item = (SemanticTag, u32)> {
    let places =
        (0..image.height_px).flat_map(|row| (0..image.width_px).map(move |column| (column, row)));
    places.map(|(column, row)| tag_id(image, column, row))
}

fn walker(id: u32, at: Vec3) -> ActorState {
    ActorState {
        kind: ActorKind::Walker,
        type_index: 1,
        box_centre_m: Vec3::zeros(),
        box_half_extent_m: Vec3::new(0.2, 0.2, 0.9),
        ..car(id, level_pose(at, 0.0), 0)
    }
}

fn with_types(actors: Vec<ActorState>) -> Frame {
    let types =
        ["vehicle.tesla.model3", "walker.pedestrian.0001", "vehicle.yamaha.yzf"].map(String::from);
    Frame { types: types.to_vec(), ..frame(actors) }
}

#[test]
fn depth_of_a_level_road_is_that_of_the_plane_to_a_centimetre_and_of_the_sky_a_kilometre() {
    for mut renderer in renderers() {
        for camera in [camera(), crooked()] {
            let job = job(frame(vec![]), vec![of_kind(ImageKind::Depth, &camera)]);
            let image = draw(&mut renderer, &town(&[]), &job).remove(0);
            let eye = camera.carrier_from_camera.translation.vector;
            let (mut on_road, mut in_sky) = (0, 0);
            for row in 0..image.height_px {
                for column in (0..image.width_px).step_by(7) {
                    let direction = ray(&camera, column, row);
                    let wanted_m = -eye.z / direction.z;
                    let hit = eye + direction * wanted_m;
                    let found_m = depth_m(&image, column, row);
                    if direction.z > 1e-3 {
                        in_sky += 1;
                        assert_eq!(found_m, DEPTH_MAX_M, "{column} {row}");
                    } else if direction.z < 0.0 && wanted_m < 60.0 && hit.xy().amax() < 99.0 {
                        on_road += 1;
                        let error_m = (found_m - wanted_m).abs();
                        assert!(error_m < 0.01, "{column} {row}: {found_m} m, wanted {wanted_m} m");
                    }
                }
            }
            assert!(on_road > 5_000 && in_sky > 1_000, "{on_road} of road, {in_sky} of sky");
        }
    }
}

#[test]
fn normals_of_a_level_road_point_up_in_the_axes_of_the_camera() {
    for mut renderer in renderers() {
        for camera in [camera(), crooked()] {
            let job = job(frame(vec![]), vec![of_kind(ImageKind::Normals, &camera)]);
            let image = draw(&mut renderer, &town(&[]), &job).remove(0);
            assert_eq!(image.data.len(), 640 * 360 * 3);
            let wanted = camera.carrier_from_camera.rotation.inverse() * Vec3::z() * 127.0;
            let at = (340 * 640 + 320) * 3;
            for (found, wanted) in image.data[at..at + 3].iter().zip(wanted.iter()) {
                let found = f32::from(i8::from_le_bytes([*found]));
                assert!((found - wanted).abs() < 1.0, "{found}, wanted {wanted}");
            }
            assert_eq!(image.data[..3], [0; 3], "the sky has a normal");
        }
    }
}

#[test]
fn everything_in_a_street_has_its_tag_and_actors_have_their_ids() {
    for mut renderer in renderers() {
        let slab = |material: Material, from: [f32; 2], to: [f32; 2]| {
            let mut slab = Surface::empty(material, WallKind::Plaster);
            let corner = |x: f32, y: f32| Vec3::new(x, y, 0.02);
            slab.positions_m = vec![
                corner(from[0], from[1]),
                corner(to[0], from[1]),
                corner(to[0], to[1]),
                corner(from[0], to[1]),
            ];
            slab.normals = vec![Vec3::z(); 4];
            slab.triangles = vec![[0, 1, 2], [0, 2, 3]];
            slab
        };
        let things = [
            pillar(Material::Wall, [30.0, 15.0], 4.0, 9.0),
            pillar(Material::Metal, [12.0, 4.0], 0.15, 5.0),
            pillar(Material::Foliage, [20.0, -9.0], 1.5, 5.0),
            slab(Material::Sidewalk, [5.0, 4.0], [11.0, 8.0]),
            slab(Material::MarkingWhite, [4.0, -0.3], [9.0, 0.3]),
            slab(Material::Grass, [5.0, -9.0], [11.0, -5.0]),
        ];
        let actors = vec![
            car(70_000, level_pose(Vec3::new(20.0, -3.0, 0.0), 0.0), 0x20_4080),
            walker(70_001, Vec3::new(12.0, -1.5, 0.9)),
        ];
        let instance = of_kind(ImageKind::Instance, &camera());
        let semantic = of_kind(ImageKind::Semantic, &camera());
        let job = job(with_types(actors), vec![instance.clone(), semantic]);
        let images = draw(&mut renderer, &town(&things), &job);
        for (at, tag, id) in [
            (Vec3::new(6.0, -3.0, 0.0), SemanticTag::Roads, 0),
            (Vec3::new(6.0, 0.0, 0.0), SemanticTag::RoadLines, 0),
            (Vec3::new(8.0, 6.0, 0.0), SemanticTag::Sidewalks, 0),
            (Vec3::new(8.0, -7.0, 0.0), SemanticTag::Terrain, 0),
            (Vec3::new(26.0, 14.0, 4.0), SemanticTag::Buildings, 0),
            (Vec3::new(11.85, 4.0, 3.0), SemanticTag::Poles, 0),
            (Vec3::new(18.5, -9.0, 3.0), SemanticTag::Vegetation, 0),
            (Vec3::new(17.6, -3.0, 0.8), SemanticTag::Car, 70_000),
            (Vec3::new(12.0, -1.5, 1.2), SemanticTag::Pedestrians, 70_001),
            (Vec3::new(50.0, 0.0, 20.0), SemanticTag::Sky, 0),
        ] {
            let (column, row) = project(&instance, &at);
            assert_eq!(tag_id(&images[0], column, row), (tag, id), "at {at:?}");
            let semantic = images[1].data[(row * 640 + column) as usize];
            assert_eq!(SemanticTag::from_number(semantic), Some(tag), "at {at:?}");
        }
        assert_eq!(images[1].data.len(), 640 * 360);
    }
}

#[test]
fn a_motorcycle_and_its_rider_have_tags_of_their_own_and_one_id() {
    for mut renderer in renderers() {
        let motorcycle = ActorState {
            type_index: 2,
            box_half_extent_m: Vec3::new(1.1, 0.4, 0.75),
            ..car(5, level_pose(Vec3::new(6.0, 0.0, 0.0), 0.7), 0xc0_1010)
        };
        let job = job(with_types(vec![motorcycle]), vec![of_kind(ImageKind::Instance, &camera())]);
        let image = draw(&mut renderer, &town(&[]), &job).remove(0);
        let mut count: BTreeMap<(SemanticTag, u32), usize> = BTreeMap::new();
        for pixel in pixels(&image) {
            *count.entry(pixel).or_default() += 1;
        }
        let of = |tag| count.get(&(tag, 5)).copied().unwrap_or_default();
        let (machine, rider) = (of(SemanticTag::Motorcycle), of(SemanticTag::Rider));
        assert!(machine > 500 && rider > 500, "{count:?}");
        assert_eq!(count.keys().filter(|(_, id)| *id != 0).count(), 2, "{count:?}");
    }
}

#[test]
fn pictures_of_one_pose_are_the_same_together_in_any_order_and_alone() {
    for mut renderer in renderers() {
        let town = town(&[pillar(Material::Wall, [30.0, 8.0], 5.0, 9.0)]);
        let small = Camera { width_px: 97, height_px: 61, ..crooked() };
        let kinds = [
            ImageKind::Normals,
            ImageKind::Rgb,
            ImageKind::Depth,
            ImageKind::Instance,
            ImageKind::Semantic,
        ];
        let mut cameras: Vec<Camera> = Vec::new();
        for (number, kind) in kinds.into_iter().enumerate() {
            for base in [&small, &camera()] {
                cameras.push(Camera { id: number as u32, ..of_kind(kind, base) });
            }
        }
        let actors = vec![car(3, level_pose(Vec3::new(12.0, 1.0, 0.0), 0.3), 0x20a040)];
        let together = draw(&mut renderer, &town, &job(frame(actors.clone()), cameras.clone()));
        for (camera, image) in cameras.iter().zip(&together) {
            assert_eq!((image.camera, image.kind), (camera.id, camera.kind));
            let alone =
                draw(&mut renderer, &town, &job(frame(actors.clone()), vec![camera.clone()]));
            assert!(alone[0] == *image, "{:?} depends on what is drawn beside it", camera.kind);
        }
    }
}

/// A street of the built-in town, and who is what and how far seen from a car on it.
fn street() -> (roads::Map, Arc<TownScene>, RenderJob) {
    let text = roads::town::build("Town10HD_Opt").unwrap();
    let map = roads::Map::parse("Town10HD_Opt", &text).unwrap();
    let town = Arc::new(TownScene::of_map(&map));
    let start: Pose = map.spawn_points()[3].cast();
    let over = Camera {
        carrier_from_camera: start * level_pose(Vec3::new(0.0, 0.0, 2.0), 0.3),
        ..camera()
    };
    let map_ref = MapRef { name: String::new(), digest: map.digest().to_owned() };
    let cameras = [ImageKind::Instance, ImageKind::Depth].map(|kind| of_kind(kind, &over));
    let job = job(Frame { map: map_ref, ..frame(vec![]) }, cameras.to_vec());
    (map, town, job)
}

/// Goal: ids of scenery are those of the map. Method: follow every pixel of a house to the point
/// that its depth says; it must lie on the box of that id.
#[test]
fn what_is_labelled_as_a_house_of_a_town_lies_on_the_walls_of_that_house() {
    for mut renderer in renderers() {
        let (map, town, job) = street();
        let over = &job.cameras[0];
        let images = draw(&mut renderer, &town, &job);
        let mut seen: BTreeMap<SemanticTag, usize> = BTreeMap::new();
        for row in 0..360 {
            for column in 0..640 {
                let (tag, id) = tag_id(&images[0], column, row);
                *seen.entry(tag).or_default() += 1;
                if tag != SemanticTag::Buildings {
                    continue;
                }
                let house = &map.scenery()[(id - TagId::SCENERY) as usize];
                let eye = over.carrier_from_camera.translation.vector;
                let depth_m = depth_m(&images[1], column, row);
                let hit = eye + ray(over, column, row) * depth_m;
                let local = house.pose.cast::<f32>().inverse_transform_point(&hit.into());
                let outside = local.coords.abs() - house.half_extent_m.cast::<f32>();
                let tolerance_m = 0.02 + 1e-3 * depth_m;
                assert!(
                    outside.max().abs() < tolerance_m,
                    "{column} {row}: {outside:?} off house {id}"
                );
            }
        }
        for tag in [
            SemanticTag::Roads,
            SemanticTag::RoadLines,
            SemanticTag::Sidewalks,
            SemanticTag::Buildings,
            SemanticTag::Vegetation,
            SemanticTag::Poles,
            SemanticTag::Sky,
        ] {
            assert!(seen.get(&tag).is_some_and(|count| *count > 20), "no {tag:?}: {seen:?}");
        }
        assert!(!seen.contains_key(&SemanticTag::None), "{seen:?}");
    }
}

/// Goal: hidden things are in no picture, and nothing else changes. Method: hide one house; its
/// pixels show what is behind, farther away, and all others are as before.
#[test]
fn a_hidden_house_lets_see_what_is_behind_it() {
    for mut renderer in renderers() {
        let (_, town, mut whole) = street();
        let before = draw(&mut renderer, &town, &whole);
        let pixels = || (0..360).flat_map(|row| (0..640).map(move |column| (column, row)));
        let houses = pixels().map(|(column, row)| tag_id(&before[0], column, row));
        let house =
            houses.filter(|(tag, _)| *tag == SemanticTag::Buildings).map(|(_, id)| id).max();
        let house = house.unwrap();
        whole.frame.hidden.set(house - TagId::SCENERY, true);
        let after = draw(&mut renderer, &town, &whole);
        let mut uncovered = 0;
        for (column, row) in pixels() {
            let [was, is] = [&before, &after].map(|images| tag_id(&images[0], column, row));
            if was.1 == house {
                uncovered += 1;
                assert_ne!(is.1, house);
                let [near_m, far_m] =
                    [&before, &after].map(|images| depth_m(&images[1], column, row));
                assert!(far_m > near_m, "{column} {row}: {near_m} {far_m}");
            } else {
                assert_eq!(is, was, "{column} {row}");
            }
        }
        assert!(uncovered > 20, "{uncovered}");
        whole.frame.hidden.set(house - TagId::SCENERY, false);
        assert!(draw(&mut renderer, &town, &whole) == before);
    }
}

#[test]
fn an_actor_is_found_under_its_id_only() {
    for mut renderer in renderers() {
        let actors: Vec<ActorState> = (0..6u32)
            .map(|at| {
                let row = at as f32;
                car(11 + at, level_pose(Vec3::new(9.0 + 3.0 * row, 5.0 * row - 12.0, 0.0), row), 0)
            })
            .collect();
        let wanted: Vec<ActorId> = actors.iter().map(|actor| actor.id).collect();
        let job = job(frame(actors), vec![of_kind(ImageKind::Instance, &camera())]);
        let image = draw(&mut renderer, &town(&[]), &job).remove(0);
        let mut found: Vec<u32> =
            pixels(&image).filter(|(tag, _)| *tag == SemanticTag::Car).map(|(_, id)| id).collect();
        found.sort_unstable();
        found.dedup();
        assert_eq!(found, wanted.iter().map(|id| id.get()).collect::<Vec<_>>());
    }
}

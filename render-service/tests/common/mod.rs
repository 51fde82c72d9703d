//! A street of our own: a level square of asphalt, so that every pixel's origin is known.

#![allow(dead_code, reason = "each test file uses a part of it")]

use std::sync::Arc;

use render_service::{AdapterChoice, Material, Renderer, Surface, TownScene, WallKind};
use schemas::{
    ActorId, ActorKind, ActorState, Camera, Frame, Image, ImageEncoding, ImageKind, MapRef, Pose,
    RenderJob, Tick, UnitQuaternion, Vec3, WorldId, level_pose,
};

pub(crate) const DIGEST: &str = "0000000000000000000000000000000000000000000000000000000000000000";

/// What draws, one after the other: processors, then what Vulkan has.
pub(crate) fn renderers() -> impl Iterator<Item = Renderer> {
    std::iter::once_with(|| Some(Renderer::new(AdapterChoice::Software).unwrap()))
        .chain(std::iter::once_with(device))
        .flatten()
        .inspect(|renderer| eprintln!("drawn by {}", renderer.adapter_name()))
}

/// A GPU, else Mesa's software Vulkan; `None` on a machine without Vulkan.
pub(crate) fn device() -> Option<Renderer> {
    let is_gpu = |renderer: &Renderer| !renderer.adapter_name().ends_with("software");
    let gpu = Renderer::new(AdapterChoice::Best).ok().filter(is_gpu);
    gpu.or_else(llvmpipe)
}

/// Mesa's software Vulkan; `None`, said aloud, where it is missing.
pub(crate) fn llvmpipe() -> Option<Renderer> {
    let opened = Renderer::new(AdapterChoice::Named("llvmpipe".to_owned()));
    opened.inspect_err(|error| eprintln!("not drawn by Mesa: {error}")).ok()
}

/// Asphalt from -100 m to 100 m, and these things on it.
pub(crate) fn town(things: &[Surface]) -> Arc<TownScene> {
    let corner = |x: f32, y: f32| Vec3::new(100.0 * x, 100.0 * y, 0.0);
    let mut ground = Surface::empty(Material::Asphalt, WallKind::Plaster);
    ground.positions_m =
        vec![corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)];
    ground.normals = vec![Vec3::z(); 4];
    ground.triangles = vec![[0, 1, 2], [0, 2, 3]];
    let surfaces: Vec<Surface> = std::iter::once(ground).chain(things.iter().cloned()).collect();
    Arc::new(TownScene::new(DIGEST, &surfaces))
}

/// An upright box without top and bottom.
pub(crate) fn pillar(material: Material, centre: [f32; 2], half: f32, height: f32) -> Surface {
    let mut surface = Surface::empty(material, WallKind::Plaster);
    for (normal, along) in [
        (Vec3::x(), Vec3::y()),
        (Vec3::y(), -Vec3::x()),
        (-Vec3::x(), -Vec3::y()),
        (-Vec3::y(), Vec3::x()),
    ] {
        let first = surface.positions_m.len() as u32;
        let middle = Vec3::new(centre[0], centre[1], 0.0) + normal * half;
        for (across, z) in [(-1.0, 0.0), (1.0, 0.0), (1.0, height), (-1.0, height)] {
            surface.positions_m.push(middle + along * (across * half) + Vec3::z() * z);
            surface.normals.push(normal);
        }
        surface.triangles.extend([[first, first + 1, first + 2], [first, first + 2, first + 3]]);
    }
    surface
}

pub(crate) fn frame(actors: Vec<ActorState>) -> Frame {
    let map = MapRef { name: "Square".to_owned(), digest: DIGEST.to_owned() };
    Frame {
        tick: Tick(20),
        state_hash: 99,
        sim_secs: 1.0,
        types: vec!["vehicle.tesla.model3".to_owned()],
        actors,
        ..Frame::empty(WorldId::new(1).unwrap(), map)
    }
}

pub(crate) fn car(id: u32, world_from_actor: Pose, colour_rgb: u32) -> ActorState {
    ActorState {
        gear: 1,
        box_centre_m: Vec3::new(0.0, 0.0, 0.74),
        box_half_extent_m: Vec3::new(2.4, 1.0, 0.74),
        colour_rgb,
        ..ActorState::at_rest(ActorId::new(id).unwrap(), ActorKind::Vehicle, 0, world_from_actor)
    }
}

/// 640 × 360, 90°, raw; 1.5 m above the origin, looking along x.
pub(crate) fn camera() -> Camera {
    Camera {
        id: 7,
        carrier: None,
        carrier_from_camera: level_pose(Vec3::new(0.0, 0.0, 1.5), 0.0),
        width_px: 640,
        height_px: 360,
        horizontal_fov_rad: std::f32::consts::FRAC_PI_2,
        kind: ImageKind::Rgb,
        encoding: ImageEncoding::Rgba8,
        jpeg_quality: 75,
        quality: None,
        ignored: Vec::new(),
        exposure: schemas::Exposure::PLAIN,
    }
}

/// The same camera for another kind of picture, in the first encoding that carries it; colour raw.
pub(crate) fn of_kind(kind: ImageKind, camera: &Camera) -> Camera {
    let encoding = match kind {
        ImageKind::Rgb => ImageEncoding::Rgba8,
        _ => kind.encodings()[0],
    };
    Camera { kind, encoding, ..camera.clone() }
}

pub(crate) fn draw(renderer: &mut Renderer, town: &Arc<TownScene>, job: &RenderJob) -> Vec<Image> {
    renderer.render(&[(Arc::clone(town), job)]).remove(0).unwrap().images
}

/// The pixel in which a fixed camera sees a point of the world.
pub(crate) fn project(camera: &Camera, point: &Vec3) -> (u32, u32) {
    let seen = camera.carrier_from_camera.inverse_transform_point(&(*point).into());
    let scale = camera.width_px as f32 / 2.0 / (camera.horizontal_fov_rad / 2.0).tan();
    let column = camera.width_px as f32 / 2.0 - seen.y / seen.x * scale;
    let row = camera.height_px as f32 / 2.0 - seen.z / seen.x * scale;
    (column as u32, row as u32)
}

/// Metres of one pixel of a depth picture.
pub(crate) fn depth_m(image: &Image, column: u32, row: u32) -> f32 {
    let at = ((row * image.width_px + column) * 4) as usize;
    f32::from_le_bytes(image.data[at..at + 4].try_into().unwrap())
}

/// Straight down from a height; the picture's top is towards x, its left towards y.
pub(crate) fn camera_above(height_m: f32) -> Camera {
    let down = UnitQuaternion::from_euler_angles(0.0, std::f32::consts::FRAC_PI_2, 0.0);
    Camera {
        carrier_from_camera: Pose::from_parts(Vec3::new(0.0, 0.0, height_m).into(), down),
        ..camera()
    }
}

pub(crate) fn job(frame: Frame, cameras: Vec<Camera>) -> RenderJob {
    RenderJob {
        tenant: "local".parse().unwrap(),
        frame,
        cameras,
        staging: schemas::Staging::default(),
    }
}

/// Red, green, blue of one pixel of a raw picture.
pub(crate) fn pixel(image: &Image, column: u32, row: u32) -> [i32; 3] {
    let at = ((row * image.width_px + column) * 4) as usize;
    [0, 1, 2].map(|channel| i32::from(image.data[at + channel]))
}

/// Mean brightness of a square of 9 × 9 pixels.
pub(crate) fn brightness(image: &Image, column: u32, row: u32) -> f32 {
    let around = (row - 4..=row + 4).flat_map(|y| (column - 4..=column + 4).map(move |x| (x, y)));
    let sum: i32 = around.map(|(x, y)| pixel(image, x, y).iter().sum::<i32>()).sum();
    sum as f32 / (81.0 * 3.0)
}

/// Places of the pixels for which this holds.
pub(crate) fn places(image: &Image, holds: impl Fn([i32; 3]) -> bool) -> Vec<(u32, u32)> {
    (0..image.height_px)
        .flat_map(|y| (0..image.width_px).map(move |x| (x, y)))
        .filter(|(x, y)| holds(pixel(image, *x, *y)))
        .collect()
}

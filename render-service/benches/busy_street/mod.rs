//! A street of a town with twelve cars and as many people, as a car on it sees it.

use schemas::{
    ActorId, ActorKind, ActorState, Camera, Frame, ImageEncoding, ImageKind, MapRef, Pose,
    RenderJob, Vec3, WorldId, level_pose,
};

/// How far a spawn point is above its road, in metres.
const DROP_M: f32 = 0.5;

/// A street of the town, seen by a car on the road below one of its spawn points.
pub(crate) fn job(map: &roads::Map, spawn: usize, (width_px, height_px): (u32, u32)) -> RenderJob {
    let points = map.spawn_points();
    let above =
        points.get(spawn * 7 % points.len().max(1)).map_or_else(Pose::identity, |pose| pose.cast());
    let start = above * level_pose(Vec3::new(0.0, 0.0, -DROP_M), 0.0);
    let mut actors = Vec::new();
    for at in 0..12u32 {
        let row = at as f32;
        let ahead =
            start * level_pose(Vec3::new(12.0 + 9.0 * row, 3.5 * (at % 3) as f32, 0.0), 0.0);
        actors.push(actor(1 + at, ActorKind::Vehicle, ahead, Vec3::new(2.4, 1.0, 0.74)));
        let aside = start * level_pose(Vec3::new(7.0 + 3.0 * row, -3.0, 0.95), row);
        actors.push(actor(100 + at, ActorKind::Walker, aside, Vec3::new(0.19, 0.19, 0.93)));
    }
    actors.sort_by_key(|actor| actor.id);
    let camera = Camera {
        id: 1,
        carrier: None,
        carrier_from_camera: start * level_pose(Vec3::new(2.5, 0.0, 1.0), 0.0),
        width_px,
        height_px,
        horizontal_fov_rad: std::f32::consts::FRAC_PI_2,
        kind: ImageKind::Rgb,
        encoding: ImageEncoding::Jpeg,
        jpeg_quality: 75,
        quality: None,
        ignored: Vec::new(),
        exposure: schemas::Exposure::PLAIN,
    };
    let map = MapRef { name: map.name().to_owned(), digest: map.digest().to_owned() };
    let frame = Frame {
        sim_secs: 1.0,
        types: vec!["vehicle.tesla.model3".to_owned()],
        actors,
        ..Frame::empty(WorldId::new(1).expect("not zero"), map)
    };
    RenderJob {
        tenant: "bench".parse().expect("a name"),
        frame,
        cameras: vec![camera],
        staging: schemas::Staging::default(),
    }
}

fn actor(id: u32, kind: ActorKind, world_from_actor: Pose, box_half_extent_m: Vec3) -> ActorState {
    let lift_m = if kind == ActorKind::Vehicle { box_half_extent_m.z } else { 0.0 };
    ActorState {
        gear: 1,
        box_centre_m: Vec3::new(0.0, 0.0, lift_m),
        box_half_extent_m,
        colour_rgb: 0xa0_2020,
        ..ActorState::at_rest(ActorId::new(id).expect("not zero"), kind, 0, world_from_actor)
    }
}

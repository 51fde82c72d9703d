//! People: standing, or walking as fast as they move.

use nalgebra::Matrix4;
use schemas::{ActorState, Vec3};

use super::super::shape::Shape;
use super::super::walker::{HIP_Y, HIP_Z, SHOULDER_Y, SHOULDER_Z};
use super::Placer;
use super::clothes::Clothes;

/// Below this speed a person stands.
const STANDING_MPS: f32 = 0.15;
/// Length of a double step per height of the person at walking pace.
const STRIDE_PER_HEIGHT: f32 = 0.85;

pub(super) fn place(placer: &mut Placer, actor: &ActorState, sim_secs: f64) {
    let clothes = Clothes::of(actor.id);
    let height_m = 2.0 * actor.box_half_extent_m.z;
    let foot_m = actor.box_centre_m - Vec3::z() * actor.box_half_extent_m.z;
    let actor_from_person = Matrix4::new_translation(&foot_m) * Matrix4::new_scaling(height_m);
    let mut put = |shape: Shape, person_from_shape: Matrix4<f32>| {
        placer.put(shape, actor_from_person * person_from_shape, clothes.tints);
    };
    put(Shape::Torso, Matrix4::identity());
    put(Shape::Head, Matrix4::identity());
    if clothes.long_hair {
        put(Shape::LongHair, Matrix4::identity());
    }
    if clothes.backpack {
        put(Shape::Backpack, Matrix4::identity());
    }
    let swing_rad = swing_rad(actor, height_m, sim_secs, clothes.stride);
    for side in [-1.0f32, 1.0] {
        let hip = Vec3::new(0.0, side * HIP_Y, HIP_Z);
        put(Shape::Leg, jointed(hip, side * swing_rad, 0.0));
        let shoulder = Vec3::new(0.0, side * SHOULDER_Y, SHOULDER_Z);
        put(Shape::Arm, jointed(shoulder, -side * 0.8 * swing_rad, side * 0.10));
    }
}

/// A limb that hangs from a joint, swung ahead and spread aside.
fn jointed(joint: Vec3, ahead_rad: f32, aside_rad: f32) -> Matrix4<f32> {
    Matrix4::new_translation(&joint)
        * Matrix4::from_axis_angle(&Vec3::x_axis(), aside_rad)
        * Matrix4::from_axis_angle(&Vec3::y_axis(), -ahead_rad)
}

/// How far the left leg is ahead: a function of the frame alone, so that a frame is always drawn
/// alike.
fn swing_rad(actor: &ActorState, height_m: f32, sim_secs: f64, stride: f32) -> f32 {
    let speed_mps = actor.linear_velocity_mps.xy().norm();
    if speed_mps.is_nan() || speed_mps < STANDING_MPS {
        return 0.0;
    }
    let strides =
        sim_secs * f64::from(speed_mps.min(6.0) / (STRIDE_PER_HEIGHT * height_m).max(0.1));
    let turns = (strides + f64::from(stride)).fract() as f32;
    let reach_rad = 0.32 + 0.10 * (speed_mps - 1.0).clamp(0.0, 3.0);
    reach_rad * (std::f32::consts::TAU * turns).sin()
}

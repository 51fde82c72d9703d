//! People: standing, or walking as fast as they move.

use nalgebra::Matrix4;
use schemas::gait::{self, ARM_ASIDE_RAD, HIP_Y, HIP_Z, SHOULDER_Y, SHOULDER_Z};
use schemas::{ActorState, Vec3};

use super::super::shape::Shape;
use super::Placer;
use super::clothes::Clothes;

pub(super) fn place(placer: &mut Placer, actor: &ActorState) {
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
    let (leg_rad, arm_rad) = (gait::leg_rad(actor), gait::arm_rad(actor));
    for side in [-1.0f32, 1.0] {
        let hip = Vec3::new(0.0, side * HIP_Y, HIP_Z);
        put(Shape::Leg, jointed(hip, side * leg_rad, 0.0));
        let shoulder = Vec3::new(0.0, side * SHOULDER_Y, SHOULDER_Z);
        put(Shape::Arm, jointed(shoulder, side * arm_rad, side * ARM_ASIDE_RAD));
    }
}

/// A limb that hangs from a joint, swung ahead and spread aside.
fn jointed(joint: Vec3, ahead_rad: f32, aside_rad: f32) -> Matrix4<f32> {
    Matrix4::new_translation(&joint)
        * Matrix4::from_axis_angle(&Vec3::x_axis(), aside_rad)
        * Matrix4::from_axis_angle(&Vec3::y_axis(), -ahead_rad)
}

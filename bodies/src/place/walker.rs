//! People: standing, or walking as fast as they move, or as somebody put their limbs.

use nalgebra::Matrix4;
use schemas::gait::{self, ARM_ASIDE_RAD, CHEST_Z, HEAD_Z, HIP_Y, HIP_Z, SHOULDER_Y, SHOULDER_Z};
use schemas::{ActorState, Limb, PosedLimb, Vec3};

use super::Placer;
use super::clothes::Clothes;
use crate::shape::Shape;

pub(super) fn place(placer: &mut Placer, actor: &ActorState, limbs: &[PosedLimb]) {
    if !limbs.is_empty() {
        return place_limbs(placer, actor, limbs);
    }
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

/// Limbs where somebody put them, bent at knees and elbows.
fn place_limbs(placer: &mut Placer, actor: &ActorState, limbs: &[PosedLimb]) {
    let clothes = Clothes::of(actor.id);
    let height = Matrix4::new_scaling(2.0 * actor.box_half_extent_m.z);
    for limb in limbs {
        let world_from_limb = limb.world_from_limb.to_homogeneous() * height;
        let mut put = |shape: Shape, down: f32| {
            let from_shape = Matrix4::new_translation(&(Vec3::z() * -down));
            placer.put_in_world(shape, world_from_limb * from_shape, clothes.tints);
        };
        match limb.limb {
            Limb::Trunk => {
                put(Shape::Torso, CHEST_Z);
                if clothes.backpack {
                    put(Shape::Backpack, CHEST_Z);
                }
            }
            Limb::Head => {
                put(Shape::Head, HEAD_Z);
                if clothes.long_hair {
                    put(Shape::LongHair, HEAD_Z);
                }
            }
            Limb::LeftArm | Limb::RightArm => put(Shape::UpperArm, 0.0),
            Limb::LeftForearm | Limb::RightForearm => put(Shape::Forearm, 0.0),
            Limb::LeftThigh | Limb::RightThigh => put(Shape::Thigh, 0.0),
            Limb::LeftShin | Limb::RightShin => put(Shape::Shin, 0.0),
        }
    }
}

/// A limb that hangs from a joint, swung ahead and spread aside.
fn jointed(joint: Vec3, ahead_rad: f32, aside_rad: f32) -> Matrix4<f32> {
    Matrix4::new_translation(&joint)
        * Matrix4::from_axis_angle(&Vec3::x_axis(), aside_rad)
        * Matrix4::from_axis_angle(&Vec3::y_axis(), -ahead_rad)
}

//! CARLA's attachments `SpringArm` and `SpringArmGhost`: an arm at the origin of the parent, at
//! whose end the actor hangs.
//!
//! **Source:** CARLA's `ActorAttacher`, and Unreal Engine's `USpringArmComponent` with what that
//! sets. The arm has the length and the direction of the place that was asked for, and whoever
//! hangs there looks along it, at the parent; its own rotation comes on top of that. The arm turns
//! with the parent's heading, late, and neither pitches nor rolls with it.

use nalgebra::{Matrix3, RealField, Rotation3};
use schemas::{AttachmentKind, Pose, UnitQuaternion, Vec3};

use crate::body::{Attached, Body};
use crate::rays::{Ray, RayScene, Sweep};
use crate::town::Town;
use crate::world::State;

/// Share of the way to where the parent heads that the arm turns, per second: CARLA's
/// `CameraRotationLagSpeed`.
const TURN_PER_SEC: f32 = 8.0;
/// The turn is followed in steps of at most this: Unreal Engine's `CameraLagMaxTimeStep`.
const STEP_SECS_MAX: f32 = 1.0 / 60.0;
/// Time below which no further step is made.
const REST_SECS: f32 = 1.0e-4;
/// How much higher the arm of a `SpringArm` is, so that it clears bumps: CARLA's `TargetOffset`.
const LIFT_M: f32 = 0.3;
/// Radius of the ball that has to have room along a `SpringArm`: Unreal Engine's `ProbeSize`.
const PROBE_M: f32 = 0.12;
/// Shorter arms have no direction.
const LENGTH_M_MIN: f32 = 1.0e-4;

/// Where what was just attached is, by an arm or rigidly.
pub(crate) fn attached_at(kind: AttachmentKind, parent: &Pose, parent_from_actor: &Pose) -> Pose {
    match kind {
        AttachmentKind::Rigid => parent * parent_from_actor,
        AttachmentKind::SpringArm | AttachmentKind::SpringArmGhost => {
            at_end(kind, parent, parent_from_actor, &wanted(parent, parent_from_actor))
        }
    }
}

/// Where it is `dt_secs` after it was at [`Attached::world_from_actor`].
pub(crate) fn follow(attached: &Attached, parent: &Pose, dt_secs: f32) -> Pose {
    let Attached { to, parent_from_actor, world_from_actor } = attached;
    let was = world_from_actor.rotation * parent_from_actor.rotation.inverse();
    let arm = turned(&was, &wanted(parent, parent_from_actor), dt_secs);
    at_end(to.kind, parent, parent_from_actor, &arm)
}

impl State {
    /// Brings what hangs on a `SpringArm` before whatever a ball meets that moves along it; a
    /// `SpringArmGhost` goes through.
    pub(crate) fn draw_in_spring_arms(&mut self, town: &Town) {
        for index in 0..self.actors.len() {
            let Body::Attached(attached) = &self.actors[index].body else { continue };
            if attached.to.kind != AttachmentKind::SpringArm {
                continue;
            }
            if let Some(place_m) = self.before_what_is_in_the_way(attached, town)
                && let Body::Attached(attached) = &mut self.actors[index].body
            {
                attached.world_from_actor.translation.vector = place_m;
            }
        }
    }

    fn before_what_is_in_the_way(&self, attached: &Attached, town: &Town) -> Option<Vec3> {
        let parent = self.actor(attached.to.parent)?;
        let origin_m = origin_m(attached.to.kind, &self.pose_of(parent));
        let arm_m = attached.world_from_actor.translation.vector - origin_m;
        let ray = Ray::new(origin_m, arm_m.try_normalize(LENGTH_M_MIN)?);
        let ball = Sweep { ray, radius_m: PROBE_M, reach_m: arm_m.norm() };
        let actors = self.actors_but(&[parent.id]);
        let scene = RayScene { town: &town.rays, hidden: &self.hidden, actors: &actors };
        let touch = scene.sweep(&ball, true, None)?;
        Some(ray.at(touch.distance_m))
    }
}

/// The arm without delay, world frame: x along it, towards the parent.
fn wanted(parent: &Pose, parent_from_actor: &Pose) -> UnitQuaternion<f32> {
    let forward = parent.rotation * Vec3::x();
    let heading_rad = RealField::atan2(forward.y, forward.x);
    let heading = UnitQuaternion::from_axis_angle(&Vec3::z_axis(), heading_rad);
    heading * along(parent_from_actor.translation.vector)
}

/// A rotation whose x points from a place to the origin, level sideways.
fn along(place_m: Vec3) -> UnitQuaternion<f32> {
    let Some(forward) = (-place_m).try_normalize(LENGTH_M_MIN) else {
        return UnitQuaternion::identity();
    };
    let up = if forward.z.abs() < 1.0 - 1.0e-4 { Vec3::z() } else { Vec3::x() };
    let left = up.cross(&forward).normalize();
    let axes = Matrix3::from_columns(&[forward, left, forward.cross(&left)]);
    UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(axes))
}

/// An arm on its way to another direction.
fn turned(
    was: &UnitQuaternion<f32>,
    wanted: &UnitQuaternion<f32>,
    dt_secs: f32,
) -> UnitQuaternion<f32> {
    // Unlike spherical interpolation it is exact between directions that hardly differ.
    let between = |a: &UnitQuaternion<f32>, b: &UnitQuaternion<f32>, share: f32| {
        let nearer = if a.coords.dot(&b.coords) < 0.0 { -b.into_inner() } else { b.into_inner() };
        UnitQuaternion::new_normalize(a.lerp(&UnitQuaternion::new_unchecked(nearer), share))
    };
    let (mut now, mut passed_secs) = (*was, 0.0);
    while dt_secs - passed_secs > REST_SECS {
        let step_secs = STEP_SECS_MAX.min(dt_secs - passed_secs);
        passed_secs += step_secs;
        let goal = between(was, wanted, (passed_secs / dt_secs).min(1.0));
        now = between(&now, &goal, (TURN_PER_SEC * step_secs).min(1.0));
    }
    now
}

fn at_end(
    kind: AttachmentKind,
    parent: &Pose,
    parent_from_actor: &Pose,
    arm: &UnitQuaternion<f32>,
) -> Pose {
    let length_m = parent_from_actor.translation.vector.norm();
    let place_m = origin_m(kind, parent) - arm * Vec3::x() * length_m;
    Pose::from_parts(place_m.into(), arm * parent_from_actor.rotation)
}

/// Where the arm begins.
fn origin_m(kind: AttachmentKind, parent: &Pose) -> Vec3 {
    let lift_m = if kind == AttachmentKind::SpringArm { LIFT_M } else { 0.0 };
    parent.translation.vector + Vec3::z() * lift_m
}

#[cfg(test)]
mod tests {
    use std::f32::consts::{FRAC_PI_2, FRAC_PI_6};

    use schemas::level_pose;

    use super::*;

    const GHOST: AttachmentKind = AttachmentKind::SpringArmGhost;

    fn pitched(down_rad: f32) -> UnitQuaternion<f32> {
        UnitQuaternion::from_axis_angle(&Vec3::y_axis(), down_rad)
    }

    #[test]
    fn what_hangs_behind_looks_at_its_parent_and_its_own_rotation_comes_on_top() {
        let parent = level_pose(Vec3::new(10.0, 5.0, 0.0), FRAC_PI_2);
        let up = Pose::from_parts(Vec3::new(-6.0, 0.0, 2.5).into(), pitched(-0.14));
        let told = attached_at(GHOST, &parent, &up);
        let place_m = Vec3::new(10.0, -1.0, 2.5);
        assert!((told.translation.vector - place_m).norm() < 1.0e-4, "{told}");
        let down_rad = (2.5_f32 / 6.0).atan() - 0.14;
        let (roll, pitch, yaw) = told.rotation.euler_angles();
        assert!((pitch - down_rad).abs() < 1.0e-4, "{pitch}");
        assert!(roll.abs() < 1.0e-4 && (yaw - FRAC_PI_2).abs() < 1.0e-4, "{roll} {yaw}");
        let lifted = attached_at(AttachmentKind::SpringArm, &parent, &up);
        assert!((lifted.translation.vector - place_m - Vec3::z() * 0.3).norm() < 1.0e-4);
    }

    #[test]
    fn what_hangs_ahead_looks_back_and_what_hangs_above_looks_down() {
        let parent = level_pose(Vec3::zeros(), 0.0);
        let ahead = level_pose(Vec3::new(5.0, -1.0, 1.0), 0.0);
        let told = attached_at(GHOST, &parent, &ahead);
        let to_parent = -ahead.translation.vector.normalize();
        assert!((told.rotation * Vec3::x() - to_parent).norm() < 1.0e-4);
        let above = level_pose(Vec3::new(0.0, 0.0, 20.0), 0.0);
        let told = attached_at(GHOST, &parent, &above);
        assert!((told.rotation * Vec3::x() + Vec3::z()).norm() < 1.0e-4);
        assert!((told.rotation * Vec3::z() - Vec3::x()).norm() < 1.0e-4, "its top is ahead");
        let inside = level_pose(Vec3::zeros(), 0.3);
        assert_eq!(attached_at(GHOST, &parent, &inside).rotation, inside.rotation);
    }

    #[test]
    fn it_does_not_nod_or_roll_with_its_parent() {
        let behind = level_pose(Vec3::new(-6.0, 0.0, 2.5), 0.0);
        let level = attached_at(GHOST, &level_pose(Vec3::zeros(), 0.4), &behind);
        let heading = UnitQuaternion::from_axis_angle(&Vec3::z_axis(), 0.4);
        let nodding = Pose::from_parts(Vec3::zeros().into(), heading * pitched(FRAC_PI_6));
        let told = attached_at(GHOST, &nodding, &behind);
        assert!(told.rotation.angle_to(&level.rotation) < 1.0e-3);
        assert!((told.translation.vector - level.translation.vector).norm() < 1.0e-3);
    }

    #[test]
    fn it_turns_late_and_keeps_its_length() {
        let behind = level_pose(Vec3::new(-6.0, 0.0, 0.0), 0.0);
        let parent = level_pose(Vec3::zeros(), FRAC_PI_2);
        let to = schemas::Attachment { parent: schemas::ActorId::new(1).unwrap(), kind: GHOST };
        let world_from_actor = attached_at(GHOST, &level_pose(Vec3::zeros(), 0.0), &behind);
        let mut attached = Attached { to, parent_from_actor: behind, world_from_actor };
        let mut yaw_rad = Vec::new();
        for _ in 0..40 {
            attached.world_from_actor = follow(&attached, &parent, 0.05);
            let told = attached.world_from_actor;
            assert!((told.translation.vector.norm() - 6.0).abs() < 1.0e-3);
            yaw_rad.push(told.rotation.euler_angles().2);
        }
        assert!((0.2..0.6).contains(&(yaw_rad[0] / FRAC_PI_2)), "{yaw_rad:?}");
        assert!(yaw_rad.is_sorted() && (yaw_rad[39] - FRAC_PI_2).abs() < 0.01, "{yaw_rad:?}");
    }
}

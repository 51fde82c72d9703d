//! How a walker's limbs swing; shared by pictures and by whoever asks for bones. Lengths are in
//! heights of the person: x ahead, y left, z up from the ground.

use nalgebra::ComplexField;

use crate::ActorState;

/// Height of the hip joints.
pub const HIP_Z: f32 = 0.50;
/// Height of the shoulder joints.
pub const SHOULDER_Z: f32 = 0.805;
/// Distance of a hip joint from the middle.
pub const HIP_Y: f32 = 0.048;
/// Distance of a shoulder joint from the middle.
pub const SHOULDER_Y: f32 = 0.125;
/// Height of the chest, about which the trunk turns.
pub const CHEST_Z: f32 = 0.73;
/// Height of the joint of the head.
pub const HEAD_Z: f32 = 0.89;
/// From a shoulder down to the elbow.
pub const UPPER_ARM: f32 = 0.165;
/// From a hip down to the knee.
pub const THIGH: f32 = 0.25;
/// How far arms are spread aside.
pub const ARM_ASIDE_RAD: f32 = 0.10;

/// Below this speed a person stands.
const STANDING_MPS: f32 = 0.15;
/// Swing of an arm over that of a leg.
const ARM_SHARE: f32 = 0.8;

/// How far the left leg is ahead; the right one is as far behind.
pub fn leg_rad(walker: &ActorState) -> f32 {
    let speed_mps = walker.linear_velocity_mps.xy().norm();
    if speed_mps.is_nan() || speed_mps < STANDING_MPS {
        return 0.0;
    }
    let reach_rad = 0.32 + 0.10 * (speed_mps - 1.0).clamp(0.0, 3.0);
    // Not the platform's: lidars see limbs, and measure the same on every machine.
    reach_rad * ComplexField::sin(walker.gait_rad)
}

/// How far the left arm is ahead; the right one is as far behind.
pub fn arm_rad(walker: &ActorState) -> f32 {
    -ARM_SHARE * leg_rad(walker)
}

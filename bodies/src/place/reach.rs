//! How far an actor's shapes reach.

use schemas::{ActorKind, ActorState, Limb, PosedLimb, Vec3};

/// Beyond the box of a vehicle: plates and lamps at its ends, wheels, mirrors, lamps on the roof.
const TRIM_M: [f32; 3] = [0.15, 0.12, 0.1];
/// By how much wheels that steer stand out more, per radian, and at most.
const STEERED_M: f32 = 0.45;
/// Beyond it with a door open, at most.
const DOOR_M: f32 = 1.8;
/// Top of a rider's helmet, above the ground.
const RIDER_M: f32 = 1.6;
/// From the middle of a person to where limbs swing, in heights of the person.
const LIMBS: [f32; 2] = [0.45, 0.25];
/// Beyond the soles and the crown of a person.
const SOLE_M: f32 = 0.1;

/// How far the shapes of a limb that somebody put elsewhere are from its joint at most, in heights
/// of the person.
fn reach_of(limb: Limb) -> f32 {
    match limb {
        Limb::Trunk => 0.32,
        Limb::Head => 0.16,
        Limb::LeftArm | Limb::RightArm => 0.20,
        Limb::LeftForearm | Limb::RightForearm => 0.24,
        Limb::LeftThigh | Limb::RightThigh => 0.29,
        Limb::LeftShin | Limb::RightShin => 0.29,
    }
}

/// A box around all shapes of an actor, without placing them: its lowest and highest corner.
///
/// - **Frame:** the actor's.
pub fn bounds(actor: &ActorState, limbs: &[PosedLimb]) -> [Vec3; 2] {
    if !limbs.is_empty() {
        return bounds_of_limbs(actor, limbs);
    }
    let half = actor.box_half_extent_m;
    let mut reach = half;
    match actor.kind {
        ActorKind::Vehicle => {
            let steered_m = STEERED_M * actor.road_wheel_rad.abs().min(1.0);
            reach += if actor.doors == 0 {
                Vec3::from(TRIM_M) + Vec3::y() * steered_m
            } else {
                Vec3::repeat(DOOR_M)
            };
            reach.z = reach.z.max(RIDER_M - half.z);
        }
        ActorKind::Walker => {
            let height_m = 2.0 * half.z;
            let [ahead, aside] = LIMBS.map(|part| part * height_m);
            reach = Vec3::new(half.x.max(ahead), half.y.max(aside), half.z + SOLE_M);
        }
        _ => {}
    }
    [actor.box_centre_m - reach, actor.box_centre_m + reach]
}

fn bounds_of_limbs(actor: &ActorState, limbs: &[PosedLimb]) -> [Vec3; 2] {
    let height_m = 2.0 * actor.box_half_extent_m.z;
    let actor_from_world = actor.world_from_actor.inverse();
    let around = |limb: &PosedLimb| {
        let joint_m = (actor_from_world * limb.world_from_limb).translation.vector;
        let reach_m = Vec3::repeat(reach_of(limb.limb) * height_m);
        [joint_m - reach_m, joint_m + reach_m]
    };
    let nothing = [Vec3::repeat(f32::INFINITY), Vec3::repeat(f32::NEG_INFINITY)];
    limbs
        .iter()
        .map(around)
        .fold(nothing, |[low_m, high_m], [low, high]| [low_m.inf(&low), high_m.sup(&high)])
}

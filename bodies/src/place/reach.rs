//! How far an actor's shapes reach.

use schemas::{ActorKind, ActorState, Vec3};

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

/// A box around all shapes of an actor whose limbs nobody put elsewhere, without placing them:
/// its lowest and highest corner.
///
/// - **Frame:** the actor's.
pub fn bounds(actor: &ActorState) -> [Vec3; 2] {
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

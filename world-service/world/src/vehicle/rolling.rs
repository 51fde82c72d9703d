//! The wheels of a vehicle that touch the ground, advanced several at once.
//!
//! What the tyre model works out for one wheel depends on no other. So that one instruction serves
//! several wheels, their values lie side by side; the results are those of one wheel after the
//! other, to the bit.

use schemas::Vec3;

use super::Wheel;
use super::brakes::WheelBrake;
use super::fit::WHEELS_MAX;
use super::telemetry::Contact;
use super::tyre::{self, Tyre, TyreForce, TyreInput};

/// Wheels that are advanced at once.
const TOGETHER: usize = 4;

/// One value of each.
type Values = [f32; TOGETHER];

/// A wheel on the ground in one substep.
#[derive(Clone, Copy, Debug)]
pub(super) struct Rolling {
    pub input: TyreInput,
    /// Where it touches the ground, and its axes there, in the world.
    pub point_m: Vec3,
    pub forward: Vec3,
    pub left: Vec3,
    /// Of the ground, upwards.
    pub normal: Vec3,
}

impl Rolling {
    /// What the ground does to the wheel, with this force of its tyre.
    pub(super) fn force_n(&self, tyre: &TyreForce) -> Vec3 {
        let Self { input, forward, left, normal, .. } = self;
        normal * input.load_n + forward * tyre.forward_n + left * tyre.left_n
    }
}

/// By wheel; none for one in the air.
pub(super) type Rollings = [Option<Rolling>; WHEELS_MAX];

/// Advances all wheels on the ground and tells the forces on their tyres.
pub(super) fn advance(wheels: &mut [Wheel], rollings: &Rollings) -> [TyreForce; WHEELS_MAX] {
    let mut forces = [TyreForce::default(); WHEELS_MAX];
    let several = wheels.chunks_mut(TOGETHER).zip(rollings.chunks(TOGETHER));
    for ((wheels, rollings), forces) in several.zip(forces.chunks_mut(TOGETHER)) {
        if rollings.iter().all(Option::is_none) {
            continue;
        }
        let mut together = Together::default();
        for (lane, (wheel, rolling)) in wheels.iter().zip(rollings).enumerate() {
            if let Some(rolling) = rolling {
                together.set(lane, wheel, &rolling.input);
            }
        }
        let advanced = together.advanced();
        for (lane, (wheel, rolling)) in wheels.iter_mut().zip(rollings).enumerate() {
            let Some(rolling) = rolling else { continue };
            let (spin_radps, tyre, force) = advanced.get(lane);
            let contact = Contact::new(&rolling.input, &force, spin_radps);
            *wheel = Wheel { spin_radps, tyre, contact };
            forces[lane] = force;
        }
    }
    forces
}

/// Several wheels and what acts on them; the last values are the same for all.
#[derive(Clone, Copy, Debug, Default)]
struct Together {
    spin_radps: Values,
    deflection_forward_m: Values,
    deflection_left_m: Values,
    forward_mps: Values,
    left_mps: Values,
    load_n: Values,
    nominal_load_n: Values,
    friction: Values,
    lateral_stiffness: Values,
    lateral_load_max: Values,
    longitudinal_stiffness: Values,
    radius_m: Values,
    damping_nms: Values,
    inertia_kgm2: Values,
    drive_nm: Values,
    brake_nm: Values,
    brake_low_n: Values,
    brake_less_n: Values,
    anti_lock: [bool; TOGETHER],
    damping_share: f32,
    traction_control: bool,
    dt_secs: f32,
}

/// Several wheels after the substep, and the forces on them.
#[derive(Clone, Copy, Debug, Default)]
struct Advanced {
    spin_radps: Values,
    deflection_forward_m: Values,
    deflection_left_m: Values,
    forward_n: Values,
    left_n: Values,
}

impl Together {
    fn set(&mut self, lane: usize, wheel: &Wheel, input: &TyreInput) {
        self.spin_radps[lane] = wheel.spin_radps;
        self.deflection_forward_m[lane] = wheel.tyre.forward_m;
        self.deflection_left_m[lane] = wheel.tyre.left_m;
        self.forward_mps[lane] = input.forward_mps;
        self.left_mps[lane] = input.left_mps;
        self.load_n[lane] = input.load_n;
        self.nominal_load_n[lane] = input.nominal_load_n;
        self.friction[lane] = input.friction;
        self.lateral_stiffness[lane] = input.lateral_stiffness;
        self.lateral_load_max[lane] = input.lateral_load_max;
        self.longitudinal_stiffness[lane] = input.longitudinal_stiffness;
        self.radius_m[lane] = input.radius_m;
        self.damping_nms[lane] = input.damping_nms;
        self.inertia_kgm2[lane] = input.inertia_kgm2;
        self.drive_nm[lane] = input.drive_nm;
        self.brake_nm[lane] = input.brake.torque_nm;
        self.brake_low_n[lane] = input.brake.low_n;
        self.brake_less_n[lane] = input.brake.less_n;
        self.anti_lock[lane] = input.brake.anti_lock;
        self.damping_share = input.damping_share;
        self.traction_control = input.traction_control;
        self.dt_secs = input.dt_secs;
    }

    #[inline(always)]
    fn get(&self, lane: usize) -> (Wheel, TyreInput) {
        let tyre = Tyre {
            forward_m: self.deflection_forward_m[lane],
            left_m: self.deflection_left_m[lane],
        };
        let input = TyreInput {
            forward_mps: self.forward_mps[lane],
            left_mps: self.left_mps[lane],
            load_n: self.load_n[lane],
            nominal_load_n: self.nominal_load_n[lane],
            friction: self.friction[lane],
            lateral_stiffness: self.lateral_stiffness[lane],
            lateral_load_max: self.lateral_load_max[lane],
            longitudinal_stiffness: self.longitudinal_stiffness[lane],
            radius_m: self.radius_m[lane],
            damping_nms: self.damping_nms[lane],
            damping_share: self.damping_share,
            inertia_kgm2: self.inertia_kgm2[lane],
            drive_nm: self.drive_nm[lane],
            brake: WheelBrake {
                torque_nm: self.brake_nm[lane],
                anti_lock: self.anti_lock[lane],
                low_n: self.brake_low_n[lane],
                less_n: self.brake_less_n[lane],
            },
            traction_control: self.traction_control,
            dt_secs: self.dt_secs,
        };
        (Wheel { spin_radps: self.spin_radps[lane], tyre, ..Wheel::default() }, input)
    }

    /// Apart from what is around it, or the compiler takes one wheel after the other.
    #[inline(never)]
    fn advanced(&self) -> Advanced {
        let mut advanced = Advanced::default();
        for lane in 0..TOGETHER {
            let (mut wheel, input) = self.get(lane);
            let force = tyre::advance(&mut wheel, &input);
            advanced.set(lane, &wheel, &force);
        }
        advanced
    }
}

impl Advanced {
    #[inline(always)]
    fn set(&mut self, lane: usize, wheel: &Wheel, force: &TyreForce) {
        self.spin_radps[lane] = wheel.spin_radps;
        self.deflection_forward_m[lane] = wheel.tyre.forward_m;
        self.deflection_left_m[lane] = wheel.tyre.left_m;
        self.forward_n[lane] = force.forward_n;
        self.left_n[lane] = force.left_n;
    }

    fn get(&self, lane: usize) -> (f32, Tyre, TyreForce) {
        let (forward_m, left_m) = (self.deflection_forward_m[lane], self.deflection_left_m[lane]);
        let force = TyreForce { forward_n: self.forward_n[lane], left_n: self.left_n[lane] };
        (self.spin_radps[lane], Tyre { forward_m, left_m }, force)
    }
}

#[cfg(test)]
mod tests {
    use schemas::SplitMix64;

    use super::*;

    fn between(rng: &mut SplitMix64, low: f32, high: f32) -> f32 {
        low + (high - low) * ((rng.next_u64() >> 40) as f32 / 16_777_216.0)
    }

    /// A wheel that rolls, slides or stands, driven or braked.
    fn any(rng: &mut SplitMix64) -> (Wheel, Rolling) {
        let mut one_of = |share: f32| between(rng, 0.0, 1.0) < share;
        let [stands, locks, brakes, anti_lock, bears] = [0.2, 0.2, 0.4, 0.7, 0.5].map(&mut one_of);
        let traction_control = !brakes;
        let mut value = |low: f32, high: f32| between(rng, low, high);
        let forward_mps = if stands { 0.0 } else { value(-3.0, 30.0) };
        let input = TyreInput {
            forward_mps,
            left_mps: value(-1.0, 1.0),
            load_n: value(500.0, 8_000.0),
            nominal_load_n: 4_000.0,
            friction: value(0.3, 1.5),
            lateral_stiffness: 18.0,
            lateral_load_max: 2.0,
            longitudinal_stiffness: value(15.0, 25.0),
            radius_m: 0.33,
            damping_nms: 0.25,
            damping_share: 1.0,
            inertia_kgm2: value(1.0, 3.0),
            drive_nm: if brakes { 0.0 } else { value(-100.0, 800.0) },
            brake: WheelBrake {
                torque_nm: if brakes { value(0.0, 3_000.0) } else { 0.0 },
                anti_lock,
                low_n: if bears { value(0.0, 3_000.0) } else { f32::INFINITY },
                less_n: if bears { value(0.0, 500.0) } else { 0.0 },
            },
            traction_control,
            dt_secs: 0.01,
        };
        let spin_radps = if locks { 0.0 } else { forward_mps / 0.33 * value(0.9, 1.1) };
        let tyre = Tyre { forward_m: value(-0.01, 0.01), left_m: value(-0.01, 0.01) };
        let (point_m, forward, left, normal) = (Vec3::zeros(), Vec3::x(), Vec3::y(), Vec3::z());
        let rolling = Rolling { input, point_m, forward, left, normal };
        (Wheel { spin_radps, tyre, ..Wheel::default() }, rolling)
    }

    #[test]
    fn several_wheels_at_once_are_as_one_after_the_other_to_the_bit() {
        let mut rng = SplitMix64::new(7);
        for round in 0..2_000 {
            let count = 1 + round % WHEELS_MAX;
            let all: Vec<(Wheel, Rolling)> = (0..count).map(|_| any(&mut rng)).collect();
            // Those of one vehicle have the same switch.
            let traction_control = all[0].1.input.traction_control;
            let mut rollings: Rollings = [None; WHEELS_MAX];
            for (slot, (index, (_, rolling))) in rollings.iter_mut().zip(all.iter().enumerate()) {
                let input = TyreInput { traction_control, ..rolling.input };
                *slot = (index != round % 7).then_some(Rolling { input, ..*rolling });
            }
            let before: Vec<Wheel> = all.iter().map(|(wheel, _)| *wheel).collect();
            let mut after = before.clone();
            let forces = advance(&mut after, &rollings);
            for (index, wheel) in before.iter().enumerate() {
                let mut alone = *wheel;
                let force = rollings[index].as_ref().map_or_else(TyreForce::default, |rolling| {
                    tyre::advance(&mut alone, &rolling.input)
                });
                let bits = |wheel: &Wheel, force: &TyreForce| {
                    let Tyre { forward_m, left_m } = wheel.tyre;
                    [wheel.spin_radps, forward_m, left_m, force.forward_n, force.left_n]
                        .map(f32::to_bits)
                };
                assert_eq!(bits(&after[index], &forces[index]), bits(&alone, &force), "{wheel:?}");
            }
        }
    }
}

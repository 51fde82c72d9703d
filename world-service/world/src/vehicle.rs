//! The vehicle model: per wheel a spring, a tyre and a brake, driven by an engine through a gearbox.
//!
//! One substep reads the chassis (pose, velocities) and the ground and returns one impulse for the
//! physics engine, which owns the rigid body and its contacts with other bodies. All parts are pure
//! functions of [`VehicleSpec`] and [`VehicleState`].
//!
//! **Frame:** x forward, y left, z up from the ground under the box centre (ISO 8855).

mod brakes;
mod chassis;
mod drivetrain;
mod spec;
mod steering;
mod suspension;
mod tyre;

use nalgebra::ComplexField;
use schemas::{Vec3, VehicleControl};
use serde::{Deserialize, Serialize};

pub(crate) use chassis::{Chassis, Impulse};
pub(crate) use spec::{
    Driven, EngineSpec, GRAVITY_MPS2, GearboxSpec, VehicleSpec, understeer_rad_per_mps2,
};

use crate::ground::{Ground, Surface};
use drivetrain::Drivetrain;
use tyre::{Tyre, TyreInput};

/// Wheels of a vehicle, in the order front left, front right, rear left, rear right.
const WHEEL_COUNT: usize = 4;
/// Everything a vehicle remembers besides its rigid body.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct VehicleState {
    pub control: VehicleControl,
    /// Mean angle of the front wheels, positive left.
    pub road_wheel_rad: f32,
    /// Brake pressure as a share of the highest, after the delay of the hydraulics.
    pub brake_pressure: f32,
    pub drivetrain: Drivetrain,
    pub wheels: [Wheel; WHEEL_COUNT],
    carried: bool,
}

/// One wheel.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct Wheel {
    /// Spin, positive when rolling forward.
    pub spin_radps: f32,
    pub tyre: Tyre,
}

/// What a wheel stands on in one substep.
#[derive(Clone, Copy, Debug)]
struct Footing {
    surface: Surface,
    /// Contact point in the world.
    point_m: Vec3,
    /// Upwards movement from the height at rest, in metres; positive is compressed.
    compression_m: f32,
    load_n: f32,
}

impl VehicleState {
    /// A vehicle that rolls freely at `forward_mps`.
    pub(crate) fn rolling(spec: &VehicleSpec, forward_mps: f32) -> Self {
        let spin_radps = forward_mps / spec.wheel_radius_m;
        Self {
            control: VehicleControl::default(),
            road_wheel_rad: 0.0,
            brake_pressure: 0.0,
            drivetrain: Drivetrain::at_speed(spec, forward_mps),
            wheels: [Wheel { spin_radps, tyre: Tyre::default() }; WHEEL_COUNT],
            carried: false,
        }
    }

    /// Numbers that decide how it goes on, in a fixed order, for the state hash.
    pub(crate) fn values(&self) -> impl Iterator<Item = f32> + '_ {
        let control = &self.control;
        let head = [
            control.throttle,
            control.steer,
            control.brake,
            f32::from(u8::from(control.hand_brake)),
            f32::from(u8::from(control.reverse)),
            self.road_wheel_rad,
            self.brake_pressure,
            f32::from(self.drivetrain.gear),
            self.drivetrain.since_shift_secs,
        ];
        let wheels = self
            .wheels
            .iter()
            .flat_map(|wheel| [wheel.spin_radps, wheel.tyre.forward_m, wheel.tyre.left_m]);
        head.into_iter().chain(wheels)
    }

    /// Fits wheels and gear to a speed that was set from outside.
    pub(crate) fn set_rolling(&mut self, spec: &VehicleSpec, forward_mps: f32) {
        let control = self.control;
        *self = Self {
            control,
            road_wheel_rad: self.road_wheel_rad,
            ..Self::rolling(spec, forward_mps)
        };
    }

    /// Lets go of the ground, for a vehicle that is put elsewhere.
    pub(crate) fn lift(&mut self) {
        for wheel in &mut self.wheels {
            wheel.tyre = Tyre::default();
        }
    }

    /// Whether every wheel bears on the ground and no spring is near its end.
    pub(crate) fn is_carried(&self) -> bool {
        self.carried
    }

    /// Advances by `dt_secs` and returns what the wheels and the air do to the chassis.
    ///
    /// - **Domain:** `grip` scales the friction of the whole road, 1 when dry.
    pub(crate) fn substep(
        &mut self,
        spec: &VehicleSpec,
        chassis: &Chassis,
        ground: &Ground,
        grip: f32,
        dt_secs: f32,
    ) -> Impulse {
        let forward_mps = chassis.forward().dot(&chassis.linear_mps);
        self.road_wheel_rad =
            steering::advance(spec, self.road_wheel_rad, self.control.steer, forward_mps, dt_secs);
        self.brake_pressure = brakes::pressure(self.brake_pressure, self.control.brake, dt_secs);

        let footings = suspension::footings(spec, chassis, ground);
        self.carried = suspension::carry(&footings);
        let drive_nm = self.drivetrain.advance(spec, &self.control, &self.spins(), dt_secs);
        let engine_inertia_kgm2 = self.drivetrain.inertia_at_wheel_kgm2(spec, &self.control);
        let mut impulse = chassis::air_drag(spec, chassis, dt_secs);
        for (index, footing) in footings.iter().enumerate() {
            let driven = spec.driven.share(index);
            let input = WheelInput {
                spec,
                index,
                drive_nm: drive_nm * driven,
                inertia_kgm2: spec.wheel_inertia_kgm2 + engine_inertia_kgm2 * driven,
                grip,
                dt_secs,
            };
            impulse += self.wheel_substep(&input, chassis, footing.as_ref());
        }
        impulse
    }

    fn spins(&self) -> [f32; WHEEL_COUNT] {
        self.wheels.map(|wheel| wheel.spin_radps)
    }

    fn wheel_substep(
        &mut self,
        input: &WheelInput,
        chassis: &Chassis,
        footing: Option<&Footing>,
    ) -> Impulse {
        let WheelInput { spec, index, dt_secs, .. } = *input;
        let brake = brakes::wheel(spec, index, self.brake_pressure, self.control.hand_brake);
        let traction_control = self.control.throttle > 0.0;
        let wheel = &mut self.wheels[index];
        let Some(footing) = footing else {
            wheel.tyre = Tyre::default();
            wheel.spin_radps =
                brakes::free_spin(wheel.spin_radps, input.drive_nm, brake.torque_nm, input);
            return Impulse::default();
        };

        let steer_rad = steering::wheel_rad(spec, index, self.road_wheel_rad);
        let (forward, left) = contact_axes(chassis, footing.surface.normal, steer_rad);
        let velocity_mps = chassis.velocity_at(footing.point_m);
        let force = tyre::advance(
            wheel,
            &TyreInput {
                forward_mps: velocity_mps.dot(&forward),
                left_mps: velocity_mps.dot(&left),
                load_n: footing.load_n,
                nominal_load_n: spec.static_load_n(index),
                friction: spec.grip * footing.surface.friction * input.grip,
                lateral_stiffness: spec::lateral_stiffness(index),
                radius_m: spec.wheel_radius_m,
                inertia_kgm2: input.inertia_kgm2,
                drive_nm: input.drive_nm,
                brake,
                traction_control,
                dt_secs,
            },
        );
        let total_n = footing.surface.normal * footing.load_n
            + forward * force.forward_n
            + left * force.left_n;
        chassis.impulse_at(footing.point_m, total_n * dt_secs)
    }
}

/// What stays the same for one wheel during one substep.
struct WheelInput<'a> {
    spec: &'a VehicleSpec,
    index: usize,
    drive_nm: f32,
    inertia_kgm2: f32,
    grip: f32,
    dt_secs: f32,
}

/// Rolling direction of a steered wheel and its left, both in the ground's plane.
fn contact_axes(chassis: &Chassis, normal: Vec3, steer_rad: f32) -> (Vec3, Vec3) {
    let heading = chassis.forward() * ComplexField::cos(steer_rad)
        + chassis.left() * ComplexField::sin(steer_rad);
    let in_plane = heading - normal * heading.dot(&normal);
    // A vehicle standing on its nose has no heading in the plane; its wheels then do not roll.
    let forward = in_plane.try_normalize(1.0e-3).unwrap_or_else(|| chassis.left().cross(&normal));
    (forward, normal.cross(&forward))
}

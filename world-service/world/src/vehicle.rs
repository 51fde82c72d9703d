//! The vehicle model: per wheel a spring, a tyre and a brake, driven by an engine through a
//! gearbox.
//!
//! One substep reads the chassis (pose, velocities) and the ground and returns one impulse for the
//! physics engine, which owns the rigid body and its contacts with other bodies. All parts are pure
//! functions of a [`Fit`], which is a model with CARLA's parameters, and a [`VehicleState`].
//!
//! **Frame:** x forward, y left, z up from the ground under the box centre (ISO 8855).

mod ackermann;
mod balance;
mod brakes;
mod chassis;
pub(crate) mod check;
mod drivetrain;
mod fit;
mod rolling;
mod stability;
mod steering;
mod suspension;
mod telemetry;
mod tyre;
mod wander;

use schemas::{Vec3, VehicleControl};
use serde::{Deserialize, Serialize};

pub(crate) use ackermann::Ackermann;
pub(crate) use chassis::{Chassis, Impulse};
pub(crate) use fit::{Fit, GRAVITY_MPS2, Tuning};
pub(crate) use telemetry::telemetry;

use crate::ground::{Ground, Known, Surface};
use balance::PitchGuard;
use brakes::WheelBrake;
use chassis::Heading;
use drivetrain::Drivetrain;
use fit::{WHEELS_MAX, WheelFit};
use rolling::{Rolling, Rollings};
use stability::Stability;
use suspension::Footings;
use telemetry::Contact;
use tyre::{Tyre, TyreInput};

/// Upright enough that only the wheels can touch the ground (cosine).
const UPRIGHT: f32 = 0.9;
/// The same of a two-wheeler, which leans.
const UPRIGHT_LEANING: f32 = 0.5;

/// Road wheels this near to what the control wants are there.
const STEERED_RAD: f32 = 0.005;

/// Everything a vehicle remembers besides its rigid body.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct VehicleState {
    pub control: VehicleControl,
    /// Mean angle of the steered wheels, positive left.
    pub road_wheel_rad: f32,
    /// Brake pressure as a share of the highest, after the delay of the hydraulics.
    pub brake_pressure: f32,
    pub drivetrain: Drivetrain,
    pub stability: Stability,
    /// In the order of [`Fit::wheels`].
    pub wheels: Vec<Wheel>,
    carried: bool,
    /// Whether it was put somewhere and has not come to stand since.
    landing: bool,
    /// What was below each wheel; saves time and decides nothing.
    #[serde(skip)]
    known: [Known; WHEELS_MAX],
}

/// One wheel.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct Wheel {
    /// Spin, positive when rolling forward.
    pub spin_radps: f32,
    pub tyre: Tyre,
    /// What it did in the last substep; decides nothing.
    pub contact: Contact,
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
    pub(crate) fn rolling(fit: &Fit, forward_mps: f32) -> Self {
        let wheel = |wheel: &WheelFit| Wheel {
            spin_radps: forward_mps / wheel.physics.radius_m,
            ..Wheel::default()
        };
        Self {
            control: VehicleControl::default(),
            road_wheel_rad: 0.0,
            brake_pressure: 0.0,
            drivetrain: Drivetrain::put(fit, forward_mps),
            stability: Stability::default(),
            wheels: fit.wheels.iter().map(wheel).collect(),
            carried: false,
            landing: false,
            known: [Known::default(); WHEELS_MAX],
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
            f32::from(u8::from(control.manual_gear)),
            f32::from(control.gear),
            self.road_wheel_rad,
            self.brake_pressure,
            f32::from(self.drivetrain.gear),
            self.drivetrain.since_shift_secs,
            self.drivetrain.engine_rpm,
            f32::from(u8::from(self.landing)),
        ];
        let head = head.into_iter().chain(self.stability.values());
        let wheels = self
            .wheels
            .iter()
            .flat_map(|wheel| [wheel.spin_radps, wheel.tyre.forward_m, wheel.tyre.left_m]);
        head.chain(wheels)
    }

    /// Fits wheels and gear to a speed that was set from outside.
    pub(crate) fn set_rolling(&mut self, fit: &Fit, forward_mps: f32) {
        let control = self.control;
        let drivetrain = match self.drivetrain.gear {
            0 => Drivetrain::put(fit, forward_mps),
            _ => Drivetrain::at_speed(fit, forward_mps),
        };
        *self = Self {
            control,
            drivetrain,
            road_wheel_rad: self.road_wheel_rad,
            ..Self::rolling(fit, forward_mps)
        };
    }

    /// Sets gear and engine to what the wheels turn, for an engine of another kind.
    pub(crate) fn couple(&mut self, fit: &Fit) {
        self.drivetrain = Drivetrain::on_wheels(fit, &self.wheels);
    }

    /// Lets go of the ground, for a vehicle that is put somewhere; it lands without a bounce.
    pub(crate) fn lift(&mut self) {
        self.landing = true;
        for wheel in &mut self.wheels {
            wheel.tyre = Tyre::default();
        }
    }

    /// Whether its wheels are still on their way to where the control wants them.
    pub(crate) fn is_steering(&self, fit: &Fit) -> bool {
        let wanted_rad = steering::wanted_rad(fit, self.control.steer, 0.0);
        (wanted_rad - self.road_wheel_rad).abs() > STEERED_RAD
    }

    /// Whether its engine revs up before the vehicle moves.
    pub(crate) fn is_revving(&self) -> bool {
        self.drivetrain.is_in_neutral() && self.control.throttle > 0.0
    }

    /// Whether only its wheels can touch the ground, at this height of its up axis.
    pub(crate) fn rides_on_wheels(&self, fit: &Fit, up_z: f32) -> bool {
        let upright = if fit.model.is_two_wheeler() { UPRIGHT_LEANING } else { UPRIGHT };
        up_z > upright && self.carried
    }

    /// Advances by `dt_secs` and returns what the wheels and the air do to the chassis.
    ///
    /// - **Domain:** `grip` scales the friction of the whole road, 1 when dry.
    pub(crate) fn substep(
        &mut self,
        fit: &Fit,
        chassis: &Chassis,
        ground: &Ground,
        grip: f32,
        dt_secs: f32,
    ) -> Impulse {
        let forward_mps = chassis.forward().dot(&chassis.linear_mps);
        self.road_wheel_rad =
            steering::advance(fit, self.road_wheel_rad, self.control.steer, forward_mps, dt_secs);
        self.brake_pressure = brakes::pressure(self.brake_pressure, self.control.brake, dt_secs);

        let below = (ground, &mut self.known);
        let footings = suspension::footings(fit, chassis, below, self.landing);
        // One that hangs on fewer wheels than it has stands, though it never lands.
        let is_moved = self.landing && !suspension::stand(chassis, &footings);
        let settling_mps =
            if is_moved { wander::settling_mps(fit, chassis.origin_m()) } else { 0.0 };
        self.carried = suspension::carry(fit, &footings);
        self.landing = self.landing && !(self.carried && suspension::stand(chassis, &footings));
        let guard = balance::pitch_guard(fit, &footings);
        let asked = (self.road_wheel_rad, grip);
        self.stability = self.stability.advanced(fit, chassis, &footings, asked, dt_secs);
        let throttle = if self.stability.acts() { 0.0 } else { self.control.throttle };
        let control = VehicleControl { throttle, ..self.control };
        let drive = self.drivetrain.advance(fit, &control, &self.wheels, dt_secs);
        let mut impulse = chassis::air_drag(fit, chassis, dt_secs);
        impulse += balance::rider(fit, chassis, &footings, self.road_wheel_rad, dt_secs);
        let mut rollings: Rollings = [const { None }; WHEELS_MAX];
        let mut heading = None;
        for (index, footing) in footings.iter().take(fit.wheels.len()).enumerate() {
            let wheel = &fit.wheels[index];
            let brake = self.brake(fit, index, (&footings, &guard), (forward_mps, grip));
            let input = WheelInput {
                fit,
                wheel,
                brake,
                drive_nm: drive.torque_nm * wheel.drive_share * guard.drive_share,
                inertia_kgm2: wheel.inertia_kgm2 + drive.inertia_kgm2 * wheel.drive_share,
                settling_mps,
                grip,
                dt_secs,
            };
            let touches = footing.as_ref().map(|footing| {
                let on_ground = chassis.heading_on(footing.surface.normal, heading);
                (footing, *heading.insert(on_ground))
            });
            rollings[index] = self.roll(index, &input, chassis, touches);
        }
        let forces = rolling::advance(&mut self.wheels, &rollings);
        for (rolling, force) in rollings.iter().zip(forces) {
            let Some(rolling) = rolling else { continue };
            impulse += chassis.impulse_at(rolling.point_m, rolling.force_n(&force) * dt_secs);
        }
        impulse
    }

    /// What pedal, hand brake and stability control do at a wheel.
    fn brake(
        &self,
        fit: &Fit,
        index: usize,
        (footings, guard): (&Footings, &PitchGuard),
        (forward_mps, grip): (f32, f32),
    ) -> WheelBrake {
        let wheel = &fit.wheels[index];
        let pulled = (self.brake_pressure, self.control.hand_brake);
        let mut brake = brakes::wheel(wheel, pulled, fit.physics.anti_lock);
        brake.torque_nm *= guard.brake_share(wheel);
        brake.take(wheel, &self.stability.share(fit, wheel));
        if brake.anti_lock {
            brake.low_n = brakes::low_n(fit, footings, index, grip);
        }
        if brakes::holds(self.control.throttle, self.wheels[index].spin_radps, forward_mps) {
            brake.torque_nm = brake.torque_nm.max(wheel.physics.brake_nm_max);
        }
        brake
    }

    /// How a wheel rolls on the ground; one in the air spins on alone.
    fn roll(
        &mut self,
        index: usize,
        input: &WheelInput,
        chassis: &Chassis,
        touches: Option<(&Footing, Heading)>,
    ) -> Option<Rolling> {
        let WheelInput { fit, wheel: own, brake, dt_secs, .. } = *input;
        let traction_control = self.control.throttle > 0.0;
        let steer_rad = steering::wheel_rad(fit, own, self.road_wheel_rad);
        let wheel = &mut self.wheels[index];
        let Some((footing, heading)) = touches else {
            wheel.tyre = Tyre::default();
            wheel.spin_radps = brakes::free_spin(wheel.spin_radps, brake.torque_nm, input);
            wheel.contact = Contact::default();
            return None;
        };

        let (forward, left) = heading.axes(steer_rad);
        let velocity_mps = chassis.velocity_at(footing.point_m);
        let forward_mps = velocity_mps.dot(&forward);
        let turned_rad = wander::slip_rad(fit, own, footing.point_m, forward_mps);
        let ground_left_mps = turned_rad * forward_mps + input.settling_mps;
        let tyre_input = TyreInput {
            forward_mps,
            left_mps: velocity_mps.dot(&left) - ground_left_mps,
            load_n: footing.load_n,
            nominal_load_n: own.load_n,
            friction: own.physics.tyre_friction * footing.surface.friction * input.grip,
            lateral_stiffness: own.physics.lateral_stiffness,
            lateral_load_max: own.physics.lateral_stiffness_load_max,
            longitudinal_stiffness: own.physics.longitudinal_stiffness,
            radius_m: own.physics.radius_m,
            damping_nms: own.physics.damping_rate,
            damping_share: fit.tyre_damping_share,
            inertia_kgm2: input.inertia_kgm2,
            drive_nm: input.drive_nm,
            brake,
            traction_control,
            dt_secs,
        };
        let Footing { point_m, surface, .. } = *footing;
        Some(Rolling { input: tyre_input, point_m, forward, left, normal: surface.normal })
    }
}

/// What stays the same for one wheel during one substep.
#[derive(Clone, Copy)]
struct WheelInput<'a> {
    fit: &'a Fit,
    wheel: &'a WheelFit,
    brake: WheelBrake,
    drive_nm: f32,
    inertia_kgm2: f32,
    /// To the left, of the ground below a vehicle that lands.
    settling_mps: f32,
    grip: f32,
    dt_secs: f32,
}

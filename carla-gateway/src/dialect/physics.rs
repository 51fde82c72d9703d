//! What makes a vehicle drive as it does, and what it measures.

mod chaos;
mod recorded;
mod versions;

pub(crate) use versions::PhysicsControl;

use schemas::{Gear as OurGear, Pose, Vec3, VehiclePhysics, VehicleTelemetry};
use schemas::{WheelPhysics as OurWheel, WheelTelemetry as OurWheelTelemetry, carla};
use serde::{Deserialize, Serialize};

use super::{ClientVersion, Location, Vector2D, Vector3D};

/// CARLA gives lengths of wheels in centimetres.
const CM_PER_M: f32 = 100.0;

#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Gear {
    ratio: f32,
    down_ratio: f32,
    up_ratio: f32,
}

/// Angles in degrees, radius and position in centimetres, position in the world. Longitudinal
/// stiffness is that of the whole tyre over the acceleration of gravity, in kilograms; ours is over
/// the tyre's load.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Wheel {
    tire_friction: f32,
    damping_rate: f32,
    max_steer_angle: f32,
    radius: f32,
    max_brake_torque: f32,
    max_handbrake_torque: f32,
    lat_stiff_max_load: f32,
    lat_stiff_value: f32,
    long_stiff_value: f32,
    position: Vector3D,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct VehiclePhysicsControl {
    torque_curve: Vec<Vector2D>,
    max_rpm: f32,
    moi: f32,
    damping_rate_full_throttle: f32,
    damping_rate_zero_throttle_clutch_engaged: f32,
    damping_rate_zero_throttle_clutch_disengaged: f32,
    use_gear_autobox: bool,
    gear_switch_time: f32,
    clutch_strength: f32,
    final_ratio: f32,
    forward_gears: Vec<Gear>,
    mass: f32,
    drag_coefficient: f32,
    center_of_mass: Location,
    /// Kilometres per hour, share of the full lock.
    steering_curve: Vec<Vector2D>,
    wheels: Vec<Wheel>,
    use_sweep_wheel_collision: bool,
}

impl VehiclePhysicsControl {
    /// Of a vehicle that is somewhere.
    pub(crate) fn of(physics: &VehiclePhysics, world_from_vehicle: &Pose) -> Self {
        let point = |&(x, y): &(f32, f32)| Vector2D { x, y };
        let gear = |gear: &OurGear| Gear {
            ratio: gear.ratio,
            down_ratio: gear.down_share,
            up_ratio: gear.up_share,
        };
        let carried_kg = carried_kg(physics.mass_kg, physics.wheels.len());
        let steering = |&(mps, share): &(f32, f32)| Vector2D { x: carla::kmh(mps), y: share };
        Self {
            torque_curve: physics.torque_curve.iter().map(point).collect(),
            max_rpm: physics.engine_rpm_max,
            moi: physics.engine_inertia_kgm2,
            damping_rate_full_throttle: physics.damping_full_throttle,
            damping_rate_zero_throttle_clutch_engaged: physics
                .damping_closed_throttle_clutch_engaged,
            damping_rate_zero_throttle_clutch_disengaged: physics
                .damping_closed_throttle_clutch_disengaged,
            use_gear_autobox: physics.automatic_gearbox,
            gear_switch_time: physics.gear_switch_secs,
            clutch_strength: physics.clutch_strength,
            final_ratio: physics.final_ratio,
            forward_gears: physics.forward_gears.iter().map(gear).collect(),
            mass: physics.mass_kg,
            drag_coefficient: physics.drag_coefficient,
            center_of_mass: Location::of(physics.centre_of_mass_m),
            steering_curve: physics.steering_curve.iter().map(steering).collect(),
            wheels: paired(
                physics.wheels.iter().map(|wheel| Wheel::of(wheel, carried_kg, world_from_vehicle)),
            ),
            use_sweep_wheel_collision: physics.sweep_wheel_collision,
        }
    }

    /// In our units. Positions of wheels are the vehicle's own: CARLA takes no others either.
    pub(crate) fn ours(&self, now: &VehiclePhysics) -> VehiclePhysics {
        let step = if self.wheels.len() == 2 * now.wheels.len() { 2 } else { 1 };
        let carried_kg = carried_kg(self.mass, now.wheels.len());
        let wheel = |(wheel, now): (&Wheel, &OurWheel)| wheel.ours(carried_kg, now.position_m);
        VehiclePhysics {
            torque_curve: self.torque_curve.iter().map(|point| (point.x, point.y)).collect(),
            engine_rpm_max: self.max_rpm,
            engine_inertia_kgm2: self.moi,
            damping_full_throttle: self.damping_rate_full_throttle,
            damping_closed_throttle_clutch_engaged: self.damping_rate_zero_throttle_clutch_engaged,
            damping_closed_throttle_clutch_disengaged: self
                .damping_rate_zero_throttle_clutch_disengaged,
            automatic_gearbox: self.use_gear_autobox,
            gear_switch_secs: self.gear_switch_time,
            clutch_strength: self.clutch_strength,
            final_ratio: self.final_ratio,
            forward_gears: self.forward_gears.iter().map(Gear::ours).collect(),
            mass_kg: self.mass,
            drag_coefficient: self.drag_coefficient,
            centre_of_mass_m: self.center_of_mass.ours(),
            steering_curve: self
                .steering_curve
                .iter()
                .map(|point| (carla::mps(point.x), point.y))
                .collect(),
            wheels: self.wheels.iter().step_by(step).zip(&now.wheels).map(wheel).collect(),
            sweep_wheel_collision: self.use_sweep_wheel_collision,
            handling: now.handling,
            anti_lock: now.anti_lock,
            stability_control: now.stability_control,
        }
    }

    /// How many wheels it speaks of.
    pub(crate) fn wheel_count(&self) -> usize {
        self.wheels.len()
    }
}

/// CARLA's physics gives two-wheelers four wheels, a pair on each axle; programs count on it.
fn paired<T: Copy>(wheels: impl ExactSizeIterator<Item = T>) -> Vec<T> {
    let times = if wheels.len() == 2 { 2 } else { 1 };
    wheels.flat_map(|wheel| std::iter::repeat_n(wheel, times)).collect()
}

/// How many wheels CARLA counts on a vehicle that has this many here.
pub(crate) fn counted(wheels: usize) -> usize {
    if wheels == 2 { 4 } else { wheels }
}

/// What each of the wheels that CARLA counts carries of a vehicle.
fn carried_kg(mass_kg: f32, wheels: usize) -> f32 {
    mass_kg / counted(wheels) as f32
}

impl Gear {
    fn ours(&self) -> OurGear {
        OurGear { ratio: self.ratio, down_share: self.down_ratio, up_share: self.up_ratio }
    }
}

impl Wheel {
    fn of(wheel: &OurWheel, carried_kg: f32, world_from_vehicle: &Pose) -> Self {
        let in_world_m = world_from_vehicle.transform_point(&wheel.position_m.into()).coords;
        Self {
            tire_friction: wheel.tyre_friction,
            damping_rate: wheel.damping_rate,
            max_steer_angle: wheel.steer_rad_max.to_degrees(),
            radius: wheel.radius_m * CM_PER_M,
            max_brake_torque: wheel.brake_nm_max,
            max_handbrake_torque: wheel.hand_brake_nm_max,
            lat_stiff_max_load: wheel.lateral_stiffness_load_max,
            lat_stiff_value: wheel.lateral_stiffness,
            long_stiff_value: wheel.longitudinal_stiffness * carried_kg,
            position: Vector3D::of(in_world_m * CM_PER_M),
        }
    }

    fn ours(&self, carried_kg: f32, position_m: Vec3) -> OurWheel {
        OurWheel {
            tyre_friction: self.tire_friction,
            damping_rate: self.damping_rate,
            steer_rad_max: self.max_steer_angle.to_radians(),
            radius_m: self.radius / CM_PER_M,
            brake_nm_max: self.max_brake_torque,
            hand_brake_nm_max: self.max_handbrake_torque,
            lateral_stiffness_load_max: self.lat_stiff_max_load,
            lateral_stiffness: self.lat_stiff_value,
            longitudinal_stiffness: self.long_stiff_value / carried_kg,
            position_m,
        }
    }
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub(crate) struct WheelTelemetry {
    tire_friction: f32,
    lat_slip: f32,
    long_slip: f32,
    omega: f32,
    tire_load: f32,
    normalized_tire_load: f32,
    torque: f32,
    long_force: f32,
    lat_force: f32,
    normalized_long_force: f32,
    normalized_lat_force: f32,
}

/// What a vehicle did in the last tick.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub(crate) struct TelemetryData {
    speed: f32,
    steer: f32,
    throttle: f32,
    brake: f32,
    engine_rpm: f32,
    gear: i32,
    drag: f32,
    wheels: Vec<WheelTelemetry>,
}

impl TelemetryData {
    pub(crate) fn of(telemetry: &VehicleTelemetry) -> Self {
        Self {
            speed: telemetry.speed_mps,
            steer: -telemetry.steer,
            throttle: telemetry.throttle,
            brake: telemetry.brake,
            engine_rpm: telemetry.engine_rpm,
            gear: i32::from(telemetry.gear),
            drag: telemetry.drag_n,
            wheels: match &telemetry.wheels[..] {
                wheels @ [_, _] => {
                    paired(wheels.iter().map(|wheel| WheelTelemetry::of(wheel).half()))
                }
                wheels => wheels.iter().map(WheelTelemetry::of).collect(),
            },
        }
    }
}

impl WheelTelemetry {
    /// One of the pair that shares what this one carries.
    fn half(self) -> Self {
        Self {
            tire_load: self.tire_load / 2.0,
            torque: self.torque / 2.0,
            long_force: self.long_force / 2.0,
            lat_force: self.lat_force / 2.0,
            ..self
        }
    }

    /// Slip and forces to the side are positive right.
    fn of(wheel: &OurWheelTelemetry) -> Self {
        Self {
            tire_friction: wheel.tyre_friction,
            lat_slip: -wheel.lateral_slip,
            long_slip: wheel.longitudinal_slip,
            omega: wheel.spin_radps,
            tire_load: wheel.load_n,
            normalized_tire_load: wheel.load_share,
            torque: wheel.torque_nm,
            long_force: wheel.longitudinal_force_n,
            lat_force: -wheel.lateral_force_n,
            normalized_long_force: wheel.longitudinal_force_share,
            normalized_lat_force: -wheel.lateral_force_share,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_two_wheeler_has_a_pair_of_wheels_on_each_axle() {
        let blueprint = blueprints::find("vehicle.yamaha.yzf").unwrap();
        let blueprints::Class::Vehicle(model) = blueprint.class else { unreachable!() };
        let mut told = VehiclePhysicsControl::of(&model.physics, &Pose::identity());
        assert_eq!(told.wheel_count(), 4);
        assert_eq!(told.wheels[0], told.wheels[1]);
        assert_ne!(told.wheels[1].position, told.wheels[2].position);
        for wheel in &mut told.wheels[2..] {
            wheel.tire_friction = 0.5;
        }
        let ours = told.ours(&model.physics);
        assert_eq!(ours.wheels.len(), 2);
        assert_eq!(ours.wheels[1].tyre_friction, 0.5);
        assert_eq!(ours.wheels[0], model.physics.wheels[0]);
    }

    #[test]
    fn longitudinal_stiffness_is_that_of_the_tyre_whatever_it_carries() {
        let blueprint = blueprints::find("vehicle.tesla.model3").unwrap();
        let blueprints::Class::Vehicle(model) = blueprint.class else { unreachable!() };
        let mut told = VehiclePhysicsControl::of(&model.physics, &Pose::identity());
        (told.mass, told.wheels[0].long_stiff_value) = (1_600.0, 1_000.0);
        assert_eq!(told.ours(&model.physics).wheels[0].longitudinal_stiffness, 2.5);
        told.mass = 3_200.0;
        assert_eq!(told.ours(&model.physics).wheels[0].longitudinal_stiffness, 1.25);
    }
}

//! Physics of a vehicle as clients of 0.10 have it: the parameters of Unreal Engine 5's vehicles.
//! Those that nothing corresponds to here have their defaults, and what clients write there has no
//! effect.

use schemas::{Gear as OurGear, Pose, VehiclePhysics, WheelPhysics as OurWheel, carla};
use serde::{Deserialize, Serialize};

use super::{CM_PER_M, Location, Vector2D, Vector3D, carried_kg, paired};

/// `EAxleType`.
const FRONT: u8 = 1;
const REAR: u8 = 2;

/// Lengths in centimetres, angles in degrees, places in the world in metres.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct ChaosWheel {
    axle_type: u8,
    offset: Vector3D,
    wheel_radius: f32,
    wheel_width: f32,
    wheel_mass: f32,
    cornering_stiffness: f32,
    friction_force_multiplier: f32,
    side_slip_modifier: f32,
    slip_threshold: f32,
    skid_threshold: f32,
    max_steer_angle: f32,
    affected_by_steering: bool,
    affected_by_brake: bool,
    affected_by_handbrake: bool,
    affected_by_engine: bool,
    abs_enabled: bool,
    traction_control_enabled: bool,
    max_wheelspin_rotation: f32,
    external_torque_combine_method: u8,
    lateral_slip_graph: Vec<Vector2D>,
    suspension_axis: Vector3D,
    suspension_force_offset: Vector3D,
    suspension_max_raise: f32,
    suspension_max_drop: f32,
    suspension_damping_ratio: f32,
    wheel_load_ratio: f32,
    spring_rate: f32,
    spring_preload: f32,
    suspension_smoothing: i32,
    rollbar_scaling: f32,
    sweep_shape: u8,
    sweep_type: u8,
    max_brake_torque: f32,
    max_hand_brake_torque: f32,
    wheel_index: i32,
    location: Location,
    old_location: Location,
    velocity: Location,
}

/// The torque at full throttle is `max_torque` times the curve over its highest point, as in Unreal
/// Engine 5. All gears change at the same speeds of the engine.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct ChaosControl {
    torque_curve: Vec<Vector2D>,
    max_torque: f32,
    max_rpm: f32,
    idle_rpm: f32,
    brake_effect: f32,
    rev_up_moi: f32,
    rev_down_rate: f32,
    differential_type: u8,
    front_rear_split: f32,
    use_automatic_gears: bool,
    gear_change_time: f32,
    final_ratio: f32,
    forward_gear_ratios: Vec<f32>,
    reverse_gear_ratios: Vec<f32>,
    change_up_rpm: f32,
    change_down_rpm: f32,
    transmission_efficiency: f32,
    mass: f32,
    drag_coefficient: f32,
    center_of_mass: Location,
    chassis_width: f32,
    chassis_height: f32,
    downforce_coefficient: f32,
    drag_area: f32,
    inertia_tensor_scale: Vector3D,
    sleep_threshold: f32,
    sleep_slope_limit: f32,
    /// Kilometres per hour, share of the full lock.
    steering_curve: Vec<Vector2D>,
    wheels: Vec<ChaosWheel>,
    use_sweep_wheel_collision: bool,
}

impl ChaosControl {
    pub(super) fn of(physics: &VehiclePhysics, world_from_vehicle: &Pose) -> Self {
        let point = |&(x, y): &(f32, f32)| Vector2D { x, y };
        let steering = |&(mps, share): &(f32, f32)| Vector2D { x: carla::kmh(mps), y: share };
        let first = physics.forward_gears.first();
        let rpm = |share: f32| share * physics.engine_rpm_max;
        let wheels = paired(physics.wheels.iter()).into_iter().zip(0..);
        let wheels = wheels.map(|(wheel, index)| ChaosWheel::of(wheel, index, world_from_vehicle));
        Self {
            torque_curve: physics.torque_curve.iter().map(point).collect(),
            max_torque: highest(physics.torque_curve.iter().map(|point| point.1)),
            max_rpm: physics.engine_rpm_max,
            idle_rpm: 1.0,
            brake_effect: 1.0,
            rev_up_moi: physics.engine_inertia_kgm2,
            rev_down_rate: 600.0,
            differential_type: 0,
            front_rear_split: 0.5,
            use_automatic_gears: physics.automatic_gearbox,
            gear_change_time: physics.gear_switch_secs,
            final_ratio: physics.final_ratio,
            forward_gear_ratios: physics.forward_gears.iter().map(|gear| gear.ratio).collect(),
            reverse_gear_ratios: first.iter().map(|gear| gear.ratio).collect(),
            change_up_rpm: first.map_or(0.0, |gear| rpm(gear.up_share)),
            change_down_rpm: first.map_or(0.0, |gear| rpm(gear.down_share)),
            transmission_efficiency: 1.0,
            mass: physics.mass_kg,
            drag_coefficient: physics.drag_coefficient,
            center_of_mass: Location::of(physics.centre_of_mass_m),
            chassis_width: 180.0,
            chassis_height: 140.0,
            downforce_coefficient: 0.0,
            drag_area: 0.0,
            inertia_tensor_scale: Vector3D { x: 1.0, y: 1.0, z: 1.0 },
            sleep_threshold: 10.0,
            sleep_slope_limit: 0.866,
            steering_curve: physics.steering_curve.iter().map(steering).collect(),
            wheels: wheels.collect(),
            use_sweep_wheel_collision: physics.sweep_wheel_collision,
        }
    }

    pub(super) fn ours(&self, now: &VehiclePhysics) -> VehiclePhysics {
        let step = if self.wheels.len() == 2 * now.wheels.len() { 2 } else { 1 };
        let highest = highest(self.torque_curve.iter().map(|point| point.y));
        let share = if highest > 0.0 { self.max_torque / highest } else { 1.0 };
        let steering = |point: &Vector2D| (carla::mps(point.x), point.y);
        let wheels = self.wheels.iter().step_by(step).zip(&now.wheels);
        let carried_kg = [now.mass_kg, self.mass].map(|kg| carried_kg(kg, now.wheels.len()));
        VehiclePhysics {
            torque_curve: self.torque_curve.iter().map(|at| (at.x, at.y * share)).collect(),
            engine_rpm_max: self.max_rpm,
            engine_inertia_kgm2: self.rev_up_moi,
            automatic_gearbox: self.use_automatic_gears,
            gear_switch_secs: self.gear_change_time,
            final_ratio: self.final_ratio,
            forward_gears: self.gears(now),
            mass_kg: self.mass,
            drag_coefficient: self.drag_coefficient,
            centre_of_mass_m: self.center_of_mass.ours(),
            steering_curve: self.steering_curve.iter().map(steering).collect(),
            wheels: wheels.map(|(wheel, now)| wheel.ours(now, carried_kg)).collect(),
            sweep_wheel_collision: self.use_sweep_wheel_collision,
            ..now.clone()
        }
    }

    /// The gears, of which each keeps when it changes unless a client wants that otherwise.
    fn gears(&self, now: &VehiclePhysics) -> Vec<OurGear> {
        let told = Self::of(now, &Pose::identity());
        let share = |rpm: f32| if self.max_rpm > 0.0 { rpm / self.max_rpm } else { 0.0 };
        let is_same = |a: f32, b: f32| (a - b).abs() < 1.0;
        let keeps_up = is_same(self.change_up_rpm, told.change_up_rpm);
        let keeps_down = is_same(self.change_down_rpm, told.change_down_rpm);
        let ratios = self.forward_gear_ratios.iter().enumerate();
        let gear = |(index, &ratio): (usize, &f32)| {
            let known = now.forward_gears.get(index).or(now.forward_gears.last());
            let kept = |keeps: bool, of: fn(&OurGear) -> f32, rpm: f32| {
                known.filter(|_| keeps).map_or_else(|| share(rpm), of)
            };
            OurGear {
                ratio,
                down_share: kept(keeps_down, |gear| gear.down_share, self.change_down_rpm),
                up_share: kept(keeps_up, |gear| gear.up_share, self.change_up_rpm),
            }
        };
        ratios.map(gear).collect()
    }

    pub(super) fn wheel_count(&self) -> usize {
        self.wheels.len()
    }
}

impl ChaosWheel {
    fn of(wheel: &OurWheel, index: i32, world_from_vehicle: &Pose) -> Self {
        let in_world_m = world_from_vehicle.transform_point(&wheel.position_m.into()).coords;
        Self {
            axle_type: if wheel.position_m.x > 0.0 { FRONT } else { REAR },
            offset: Vector3D::default(),
            wheel_radius: wheel.radius_m * CM_PER_M,
            wheel_width: 30.0,
            wheel_mass: 30.0,
            cornering_stiffness: 1_000.0,
            friction_force_multiplier: wheel.tyre_friction,
            side_slip_modifier: 1.0,
            slip_threshold: 20.0,
            skid_threshold: 20.0,
            max_steer_angle: wheel.steer_rad_max.to_degrees(),
            affected_by_steering: wheel.steer_rad_max > 0.0,
            affected_by_brake: wheel.brake_nm_max > 0.0,
            affected_by_handbrake: wheel.hand_brake_nm_max > 0.0,
            affected_by_engine: true,
            abs_enabled: false,
            traction_control_enabled: false,
            max_wheelspin_rotation: 30.0,
            external_torque_combine_method: 0,
            lateral_slip_graph: Vec::new(),
            suspension_axis: Vector3D { x: 0.0, y: 0.0, z: -1.0 },
            suspension_force_offset: Vector3D::default(),
            suspension_max_raise: 10.0,
            suspension_max_drop: 10.0,
            suspension_damping_ratio: 0.5,
            wheel_load_ratio: 0.5,
            spring_rate: 250.0,
            spring_preload: 50.0,
            suspension_smoothing: 0,
            rollbar_scaling: 0.15,
            sweep_shape: 0,
            sweep_type: 0,
            max_brake_torque: wheel.brake_nm_max,
            max_hand_brake_torque: wheel.hand_brake_nm_max,
            wheel_index: index,
            location: Location::of(in_world_m),
            old_location: Location::of(in_world_m),
            velocity: Location::default(),
        }
    }

    /// With what it carried before and carries from now on; the tyre is as stiff as before.
    fn ours(&self, now: &OurWheel, [before_kg, carried_kg]: [f32; 2]) -> OurWheel {
        let of = |affected: bool, value: f32| if affected { value } else { 0.0 };
        OurWheel {
            tyre_friction: self.friction_force_multiplier,
            steer_rad_max: of(self.affected_by_steering, self.max_steer_angle).to_radians(),
            radius_m: self.wheel_radius / CM_PER_M,
            brake_nm_max: of(self.affected_by_brake, self.max_brake_torque),
            hand_brake_nm_max: of(self.affected_by_handbrake, self.max_hand_brake_torque),
            longitudinal_stiffness: now.longitudinal_stiffness * before_kg / carried_kg,
            ..*now
        }
    }
}

fn highest(numbers: impl Iterator<Item = f32>) -> f32 {
    numbers.fold(0.0, f32::max)
}

#[cfg(test)]
mod tests {
    use blueprints::Class;

    use super::*;
    use crate::dialect::{ClientVersion, PhysicsControl};

    fn physics(blueprint: &str) -> VehiclePhysics {
        match blueprints::find(blueprint).unwrap().class {
            Class::Vehicle(model) => model.physics.clone(),
            _ => unreachable!("no vehicle"),
        }
    }

    fn read_back(control: &ChaosControl) -> PhysicsControl {
        rmp_serde::from_slice(&rmp_serde::to_vec(control).unwrap()).unwrap()
    }

    #[test]
    fn what_was_told_and_comes_back_changes_nothing() {
        for blueprint in ["vehicle.lincoln.mkz", "vehicle.yamaha.yzf", "vehicle.tesla.model3"] {
            let now = physics(blueprint);
            for version in [ClientVersion::V0_9, ClientVersion::V0_10] {
                let told = PhysicsControl::of(&now, &Pose::identity(), version);
                let bytes = rmp_serde::to_vec(&told).unwrap();
                let back: PhysicsControl = rmp_serde::from_slice(&bytes).unwrap();
                assert_eq!(back, told, "{blueprint}");
                assert_eq!(back.wheel_count(), 4);
                let ours = back.ours(&now);
                // But for what conversions of units round.
                let differs = |a: f32, b: f32| (a - b).abs() > 1e-5 * a.abs().max(1.0);
                for (wheel, before) in ours.wheels.iter().zip(&now.wheels) {
                    assert!(!differs(wheel.radius_m, before.radius_m));
                    assert!(!differs(wheel.steer_rad_max, before.steer_rad_max));
                    let stiffness = [wheel, before].map(|wheel| wheel.longitudinal_stiffness);
                    assert!(!differs(stiffness[0], stiffness[1]));
                }
                let steering_curve = now.steering_curve.clone();
                let wheels = now.wheels.clone();
                assert_eq!(VehiclePhysics { wheels, steering_curve, ..ours }, now, "{blueprint}");
            }
        }
    }

    #[test]
    fn torque_gears_and_brakes_are_as_unreal_engine_5_takes_them() {
        let now = physics("vehicle.lincoln.mkz");
        let mut wanted = ChaosControl::of(&now, &Pose::identity());
        wanted.max_torque *= 2.0;
        wanted.change_up_rpm = 0.5 * wanted.max_rpm;
        wanted.wheels[3].affected_by_brake = false;
        wanted.mass = 2_000.0;
        let ours = read_back(&wanted).ours(&now);
        let twice = 2.0 * highest(now.torque_curve.iter().map(|point| point.1));
        assert!((highest(ours.torque_curve.iter().map(|point| point.1)) - twice).abs() < 0.1);
        assert!(ours.forward_gears.iter().all(|gear| gear.up_share == 0.5));
        assert_eq!(ours.forward_gears[0].down_share, now.forward_gears[0].down_share);
        assert_eq!(ours.wheels[3].brake_nm_max, 0.0);
        assert_eq!(ours.mass_kg, 2_000.0);
    }
}

//! Inertial measurement: `sensor.other.imu`.

use nalgebra::RealField;
use schemas::{Error, Measurement, Vec3};
use serde::{Deserialize, Serialize};

use super::config::{NOISE_MAX, Settings};
use super::mount::Mount;
use super::noise::Noise;
use crate::vehicle::GRAVITY_MPS2;

/// CARLA's attributes, and the velocity of the tick before.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Imu {
    /// m/s², by axis of the sensor.
    acceleration_deviation: [f64; 3],
    /// rad/s, by axis of the sensor.
    gyro_deviation: [f64; 3],
    /// rad/s, by axis of the sensor.
    gyro_bias: [f64; 3],
    /// Of the sensor's place at the end of the last tick, world frame.
    velocity_mps: Option<Vec3>,
    /// Mean over the last tick, world frame, without gravity.
    acceleration_mps2: Vec3,
}

impl Imu {
    pub(super) fn new(settings: Settings) -> Result<Self, Error> {
        // CARLA's spins count clockwise about x and z.
        let [bias_x, bias_y, bias_z] =
            settings.axes("noise_gyro_bias_?", -NOISE_MAX..=NOISE_MAX)?;
        Ok(Self {
            acceleration_deviation: settings.axes("noise_accel_stddev_?", 0.0..=NOISE_MAX)?,
            gyro_deviation: settings.axes("noise_gyro_stddev_?", 0.0..=NOISE_MAX)?,
            gyro_bias: [-bias_x, bias_y, -bias_z],
            velocity_mps: None,
            acceleration_mps2: Vec3::zeros(),
        })
    }

    /// Whether it differs from `fresh` by the motion it followed only.
    pub(super) fn is_used(&self, fresh: &Self) -> bool {
        let (velocity_mps, acceleration_mps2) = (None, Vec3::zeros());
        Self { velocity_mps, acceleration_mps2, ..self.clone() } == *fresh
    }

    /// Follows the motion; once in every tick, whether it measures or not.
    pub(super) fn feel(&mut self, mount: &Mount, dt_secs: f64) {
        let before_mps = self.velocity_mps.replace(mount.velocity_mps);
        let change_mps = mount.velocity_mps - before_mps.unwrap_or(mount.velocity_mps);
        self.acceleration_mps2 = change_mps / dt_secs as f32;
    }

    pub(super) fn measure(&self, mount: &Mount, noise: &mut Noise) -> Measurement {
        let rotation = &mount.world_from_sensor.rotation;
        let felt_mps2 = self.acceleration_mps2 + Vec3::z() * GRAVITY_MPS2;
        let mut with_noise = |value: Vec3, deviations: [f64; 3], biases: [f64; 3]| {
            let noise = [0, 1, 2].map(|axis: usize| biases[axis] + noise.normal(deviations[axis]));
            value + Vec3::from(noise.map(|noise| noise as f32))
        };
        Measurement::Imu {
            acceleration_mps2: with_noise(
                rotation.inverse_transform_vector(&felt_mps2),
                self.acceleration_deviation,
                [0.0; 3],
            ),
            angular_velocity_radps: with_noise(
                rotation.inverse_transform_vector(&mount.angular_radps),
                self.gyro_deviation,
                self.gyro_bias,
            ),
            compass_rad: compass_rad(rotation * Vec3::x()),
        }
    }
}

/// Clockwise from north, which is +y, from 0 to 2π.
pub(super) fn compass_rad(forward: Vec3) -> f32 {
    let rad = RealField::atan2(forward.x, forward.y);
    if rad < 0.0 { rad + f32::two_pi() } else { rad }
}

#[cfg(test)]
mod tests {
    use std::f32::consts::{FRAC_PI_2, PI};

    use schemas::{Pose, level_pose};

    use super::*;

    fn mount(world_from_sensor: Pose, velocity_mps: Vec3, angular_radps: Vec3) -> Mount {
        Mount { world_from_sensor, velocity_mps, angular_radps, carrier: None, host: None }
    }

    fn read(imu: &Imu, mount: &Mount) -> (Vec3, Vec3, f32) {
        let mut noise = Noise::new(0, 0, 1);
        let Measurement::Imu { acceleration_mps2, angular_velocity_radps, compass_rad } =
            imu.measure(mount, &mut noise)
        else {
            panic!("an IMU measures motion")
        };
        (acceleration_mps2, angular_velocity_radps, compass_rad)
    }

    #[test]
    fn at_rest_it_feels_gravity_upwards_in_its_own_frame() {
        let mut imu = Imu::new(Settings(&[])).unwrap();
        let mut at = mount(level_pose(Vec3::zeros(), 1.0), Vec3::zeros(), Vec3::zeros());
        imu.feel(&at, 0.05);
        let (level, spin, _) = read(&imu, &at);
        assert!((level - Vec3::z() * 9.81).norm() < 1.0e-5, "{level}");
        assert_eq!(spin, Vec3::zeros());
        // Nose up by 90 degrees: up is forward.
        at.world_from_sensor.rotation =
            schemas::UnitQuaternion::from_axis_angle(&Vec3::y_axis(), -FRAC_PI_2);
        let (nose_up, ..) = read(&imu, &at);
        assert!((nose_up - Vec3::x() * 9.81).norm() < 1.0e-5, "{nose_up}");
    }

    #[test]
    fn in_a_left_turn_it_feels_v_squared_over_r_to_the_left() {
        let (speed_mps, radius_m, dt_secs) = (10.0_f32, 20.0_f32, 0.01_f32);
        let spin = Vec3::z() * (speed_mps / radius_m);
        let mut imu = Imu::new(Settings(&[])).unwrap();
        let at = |tick: f32| {
            let yaw_rad = spin.z * dt_secs * tick;
            let pose = level_pose(Vec3::zeros(), yaw_rad);
            mount(pose, pose.rotation * Vec3::x() * speed_mps, spin)
        };
        for tick in 0..3u8 {
            imu.feel(&at(tick.into()), dt_secs.into());
        }
        let (acceleration, angular, _) = read(&imu, &at(2.0));
        // The mean over a tick lags by half a tick of turning: 0.0025 rad of 5 m/s².
        assert!((acceleration - Vec3::new(0.0, 5.0, 9.81)).norm() < 0.02, "{acceleration}");
        assert!((angular - spin).norm() < 1.0e-6, "{angular}");
    }

    #[test]
    fn the_compass_counts_clockwise_from_north() {
        for (yaw_rad, compass_rad) in
            [(FRAC_PI_2, 0.0), (0.0, FRAC_PI_2), (-FRAC_PI_2, PI), (PI, 1.5 * PI)]
        {
            let imu = Imu::new(Settings(&[])).unwrap();
            let at = mount(level_pose(Vec3::zeros(), yaw_rad), Vec3::zeros(), Vec3::zeros());
            let (.., found_rad) = read(&imu, &at);
            let off = (found_rad - compass_rad + PI).rem_euclid(2.0 * PI) - PI;
            assert!(off.abs() < 1.0e-5, "yaw {yaw_rad}: {found_rad}");
        }
    }
}

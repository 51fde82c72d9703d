//! From the steering control to the angle of each wheel.

use nalgebra::{ComplexField, RealField};
use schemas::Handling;

use super::fit::{Fit, WheelFit};

/// How fast the road wheels turn: a quick driver at the steering wheel, 16 : 1.
const RATE_RADPS: f32 = 1.0;
/// Share of the way to full lock by which CARLA's wheels turn in a second, away from the middle and
/// towards it: the rates of input that Unreal's vehicles begin with.
const CARLA_AWAY_PER_SEC: f32 = 2.5;
const CARLA_BACK_PER_SEC: f32 = 5.0;

/// The mean road-wheel angle after `dt_secs` towards what `steer` asks.
pub(super) fn advance(
    fit: &Fit,
    road_wheel_rad: f32,
    steer: f32,
    forward_mps: f32,
    dt_secs: f32,
) -> f32 {
    let speed_mps = forward_mps.abs();
    let change_rad = wanted_rad(fit, steer, speed_mps) - road_wheel_rad;
    let rate_radps = match fit.physics.handling {
        Handling::Real => RATE_RADPS,
        Handling::Carla => {
            let goes_back = change_rad * road_wheel_rad < 0.0;
            let per_sec = if goes_back { CARLA_BACK_PER_SEC } else { CARLA_AWAY_PER_SEC };
            // A curve that leaves no lock at a speed does not hold the wheels where they are.
            (per_sec * wanted_rad(fit, 1.0, speed_mps)).max(RATE_RADPS)
        }
    };
    let step_rad = rate_radps * dt_secs;
    road_wheel_rad + change_rad.clamp(-step_rad, step_rad)
}

/// The mean road-wheel angle that `steer` asks for at a speed.
pub(super) fn wanted_rad(fit: &Fit, steer: f32, speed_mps: f32) -> f32 {
    let lock_rad = steer * fit.full_lock_rad(speed_mps);
    match fit.physics.handling {
        Handling::Real => lock_rad,
        // From the inner wheel to the middle of the axle: all roll around one point.
        Handling::Carla => {
            let (sine, cosine) = ComplexField::sin_cos(lock_rad);
            let base_m = fit.wheelbase_m.max(0.1);
            RealField::atan2(sine * base_m, cosine * base_m + sine.abs() * fit.half_track_m)
        }
    }
}

/// The angle of one wheel: all front wheels roll around the same point (Ackermann).
pub(super) fn wheel_rad(fit: &Fit, wheel: &WheelFit, mean_rad: f32) -> f32 {
    let angle_rad = mean_rad * wheel.steer_share;
    if angle_rad == 0.0 || !wheel.is_front {
        return angle_rad;
    }
    let (sine, cosine) = ComplexField::sin_cos(angle_rad);
    let base_m = fit.wheelbase_m.max(0.1);
    let ahead_m = cosine * base_m - angle_rad.signum() * sine.abs() * wheel.foot_m.y;
    RealField::atan2(sine * base_m, ahead_m)
}

/// Linear between the points, constant beyond them.
pub(super) fn interpolate(points: &[(f32, f32)], at: f32) -> f32 {
    let Some((first, last)) = points.first().zip(points.last()) else { return 0.0 };
    if at <= first.0 {
        return first.1;
    }
    points.windows(2).find(|pair| at <= pair[1].0).map_or(last.1, |pair| {
        let [(x0, y0), (x1, y1)] = [pair[0], pair[1]];
        // A step in the curve has two points at one place.
        if x1 > x0 { y0 + (y1 - y0) * (at - x0) / (x1 - x0) } else { y1 }
    })
}

#[cfg(test)]
mod tests {
    use schemas::VehiclePhysics;

    use super::super::Tuning;
    use super::*;

    fn as_in_carla() -> Fit {
        let blueprint = blueprints::index_of("vehicle.lincoln.mkz_2020").unwrap();
        let real = Tuning::standard(blueprint).unwrap();
        let mut physics =
            VehiclePhysics { handling: Handling::Carla, ..real.fit().physics.clone() };
        for wheel in physics.wheels.iter_mut().filter(|wheel| wheel.steer_rad_max > 0.0) {
            wheel.steer_rad_max = 70.0f32.to_radians();
        }
        real.with(physics).fit().clone()
    }

    /// Mean of both front wheels.
    fn front_deg(fit: &Fit, mean_rad: f32) -> f32 {
        let wheels = [0, 1].map(|index| wheel_rad(fit, &fit.wheels[index], mean_rad));
        f32::midpoint(wheels[0], wheels[1]).to_degrees()
    }

    #[test]
    fn carlas_wheels_stand_as_those_of_its_lincoln_were_measured() {
        let fit = as_in_carla();
        // CARLA 0.9.16, at a stand: control, mean angle of the front wheels.
        for (steer, measured_deg) in
            [(0.2, 13.17), (0.4, 25.15), (0.6, 36.47), (0.8, 47.53), (1.0, 58.43)]
        {
            for side in [1.0, -1.0] {
                let found = front_deg(&fit, wanted_rad(&fit, side * steer, 0.0)) * side;
                assert!((found - measured_deg).abs() < 0.7, "{steer}: {found}, {measured_deg}");
            }
        }
        // At speed: angle over the 6° asked for by a line through what 0.2 gives at a stand.
        for (mps, measured) in [(4.96, 0.972), (10.77, 0.899), (15.24, 0.858), (19.36, 0.825)] {
            let steer = 0.2 * 6.0 / 13.17;
            let found = front_deg(&fit, wanted_rad(&fit, steer, mps)) / 6.0;
            assert!((found - measured).abs() < 0.035, "{mps} m/s: {found}, {measured}");
        }
    }

    #[test]
    fn carlas_wheels_turn_to_their_lock_in_two_fifths_of_a_second_and_back_in_one_fifth() {
        let fit = as_in_carla();
        let turn = |from_rad: f32, steer: f32, secs: f32| {
            let steps = (secs / 0.01) as usize;
            (0..steps).fold(from_rad, |rad, _| advance(&fit, rad, steer, 0.0, 0.01))
        };
        let lock_rad = wanted_rad(&fit, 1.0, 0.0);
        assert!((turn(0.0, 1.0, 0.2) / lock_rad - 0.5).abs() < 0.01);
        assert!(turn(0.0, 1.0, 0.36) < 0.95 * lock_rad && turn(0.0, 1.0, 0.41) == lock_rad);
        assert!((turn(lock_rad, 0.0, 0.1) / lock_rad - 0.5).abs() < 0.01);
        assert!(turn(lock_rad, 0.0, 0.18) > 0.05 * lock_rad && turn(lock_rad, 0.0, 0.21) == 0.0);
    }

    #[test]
    fn carlas_wheels_come_back_where_the_curve_leaves_no_lock() {
        let mut fit = as_in_carla();
        fit.physics.steering_curve = vec![(0.0, 1.0), (10.0, 0.0)];
        let after_rad = (0..50).fold(0.4, |rad, _| advance(&fit, rad, 1.0, 20.0, 0.01));
        assert_eq!(after_rad, 0.0);
    }

    #[test]
    fn points_between_are_linear_and_beyond_are_constant() {
        let points = [(1.0, 10.0), (3.0, 20.0), (4.0, 0.0)];
        for (at, wanted) in [(0.0, 10.0), (2.0, 15.0), (3.5, 10.0), (9.0, 0.0)] {
            assert_eq!(interpolate(&points, at), wanted);
        }
    }
}

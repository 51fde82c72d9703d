//! From the steering control to the angle of each front wheel.

use nalgebra::ComplexField;

use super::VehicleSpec;
use super::spec::{is_front, is_left};

/// How fast the road wheels turn: a quick driver at the steering wheel, 16 : 1.
const RATE_RADPS: f32 = 1.0;
/// (speed in metres per second, share of full lock that full control reaches), as CARLA's default
/// steering curve of 20, 60 and 120 km/h.
const SPEED_CURVE: [(f32, f32); 4] = [(0.0, 1.0), (5.56, 0.9), (16.67, 0.8), (33.33, 0.7)];

/// The mean road-wheel angle after `dt_secs` towards what `steer` asks.
pub(super) fn advance(
    spec: &VehicleSpec,
    road_wheel_rad: f32,
    steer: f32,
    forward_mps: f32,
    dt_secs: f32,
) -> f32 {
    let wanted_rad = steer * spec.full_lock_rad(forward_mps.abs());
    let step_rad = RATE_RADPS * dt_secs;
    road_wheel_rad + (wanted_rad - road_wheel_rad).clamp(-step_rad, step_rad)
}

/// The angle of one wheel: both front wheels roll around the same point (Ackermann).
pub(super) fn wheel_rad(spec: &VehicleSpec, wheel: usize, mean_rad: f32) -> f32 {
    if !is_front(wheel) || mean_rad == 0.0 {
        return 0.0;
    }
    let mean_tan = ComplexField::tan(mean_rad);
    let offset_m = if is_left(wheel) { spec.track_m / 2.0 } else { -spec.track_m / 2.0 };
    let tan = mean_tan / (1.0 - offset_m * mean_tan / spec.wheelbase_m);
    ComplexField::atan(tan)
}

/// The share of full lock that full control reaches at a speed.
pub(super) fn speed_share(speed_mps: f32) -> f32 {
    interpolate(&SPEED_CURVE, speed_mps)
}

/// Linear between the points, constant beyond them.
pub(super) fn interpolate(points: &[(f32, f32)], at: f32) -> f32 {
    let Some((first, last)) = points.first().zip(points.last()) else { return 0.0 };
    if at <= first.0 {
        return first.1;
    }
    points.windows(2).find(|pair| at <= pair[1].0).map_or(last.1, |pair| {
        let [(x0, y0), (x1, y1)] = [pair[0], pair[1]];
        y0 + (y1 - y0) * (at - x0) / (x1 - x0)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_between_are_linear_and_beyond_are_constant() {
        let points = [(1.0, 10.0), (3.0, 20.0), (4.0, 0.0)];
        for (at, wanted) in [(0.0, 10.0), (2.0, 15.0), (3.5, 10.0), (9.0, 0.0)] {
            assert_eq!(interpolate(&points, at), wanted);
        }
    }
}

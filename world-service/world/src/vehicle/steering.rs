//! From the steering control to the angle of each wheel.

use nalgebra::{ComplexField, RealField};

use super::fit::{Fit, WheelFit};

/// How fast the road wheels turn: a quick driver at the steering wheel, 16 : 1.
const RATE_RADPS: f32 = 1.0;

/// The mean road-wheel angle after `dt_secs` towards what `steer` asks.
pub(super) fn advance(
    fit: &Fit,
    road_wheel_rad: f32,
    steer: f32,
    forward_mps: f32,
    dt_secs: f32,
) -> f32 {
    let wanted_rad = steer * fit.full_lock_rad(forward_mps.abs());
    let step_rad = RATE_RADPS * dt_secs;
    road_wheel_rad + (wanted_rad - road_wheel_rad).clamp(-step_rad, step_rad)
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
    use super::*;

    #[test]
    fn points_between_are_linear_and_beyond_are_constant() {
        let points = [(1.0, 10.0), (3.0, 20.0), (4.0, 0.0)];
        for (at, wanted) in [(0.0, 10.0), (2.0, 15.0), (3.5, 10.0), (9.0, 0.0)] {
            assert_eq!(interpolate(&points, at), wanted);
        }
    }
}

//! From the place beside the lane to the steering wheel.

mod tight;

use nalgebra::{ComplexField, RealField};
use schemas::Vec3;

use crate::lane_change::Reference;
use crate::network::Network;
use crate::path::Path;
use crate::pilot::VehicleView;
use crate::track::Place;

/// Natural frequency with which the vehicle returns to its path, and the damping of that return.
const RETURN_RADPS: f32 = 2.2;
const DAMPING_RATIO: f32 = 0.9;
/// Who is farther off its path returns as if it were this far off: a heavy lorry that is asked for
/// more sways to its limits.
const OFFSET_M_MAX: f32 = 0.6;
/// Below this speed the gains stay as they are here, or they would grow without bound.
const SPEED_MPS_MIN: f32 = 3.0;
/// How much earlier the curvature of a path is steered for.
const LEAD_SECS: f32 = 0.12;

/// Steer from -1 to 1 that follows the reference beside the lane.
///
/// The path's curvature is fed forward; what is left of offset and sideways speed decays like a
/// damped oscillator: sideways acceleration = speed² / wheelbase · wheel angle for small angles.
pub(crate) fn steer(place: &Place, reference: &Reference, view: &VehicleView) -> f32 {
    let along_mps = place.along_mps.max(SPEED_MPS_MIN);
    let offset_m = (place.left_m - reference.left_m).clamp(-OFFSET_M_MAX, OFFSET_M_MAX);
    let drift_mps = place.left_mps - reference.slope * place.along_mps;
    let wanted_mps2 =
        -RETURN_RADPS * RETURN_RADPS * offset_m - 2.0 * DAMPING_RATIO * RETURN_RADPS * drift_mps;
    let curvature_per_m =
        place.curvature_per_m + reference.bend_per_m + wanted_mps2 / (along_mps * along_mps);
    let sideways_mps2 = curvature_per_m * along_mps * along_mps;
    let road_wheel_rad = ComplexField::atan(view.wheelbase_m * curvature_per_m)
        + view.understeer_rad_per_mps2 * sideways_mps2;
    (steered_rad(road_wheel_rad, view) / view.full_lock_rad).clamp(-1.0, 1.0)
}

/// Steer that follows a path over lanes; 0 where there is none.
pub(crate) fn along(path: &Path, network: &Network, view: &VehicleView) -> f32 {
    let Some(here) = path.at(network, 0.0) else { return 0.0 };
    let along = here.point.heading();
    let left = Vec3::new(-along.y, along.x, 0.0);
    let along_mps = along.dot(&view.velocity_mps);
    if let Some(lock) = tight::lock(path, network, view, along_mps) {
        return lock;
    }
    let ahead_m = along_mps.max(0.0) * LEAD_SECS;
    let bend = path.at(network, ahead_m).unwrap_or(here);
    let place = Place {
        left_m: left.dot(&(view.world_from_vehicle.translation.vector - here.point.point_m)),
        along_mps,
        left_mps: left.dot(&view.velocity_mps),
        curvature_per_m: bend.point.curvature_per_m,
    };
    steer(&place, &Reference::default(), view)
}

/// The angle that the lock limits, for a mean angle of the front wheels.
fn steered_rad(mean_rad: f32, view: &VehicleView) -> f32 {
    if view.half_track_m == 0.0 {
        return mean_rad;
    }
    let (sine, cosine) = ComplexField::sin_cos(mean_rad);
    let base_m = view.wheelbase_m;
    RealField::atan2(sine * base_m, cosine * base_m - sine.abs() * view.half_track_m)
}

#[cfg(test)]
mod tests {
    use schemas::Pose;

    use super::*;

    fn view() -> VehicleView {
        VehicleView {
            world_from_vehicle: Pose::identity(),
            velocity_mps: Vec3::zeros(),
            wheelbase_m: 2.85,
            full_lock_rad: 0.6,
            half_track_m: 0.0,
            bend_per_m_max: 0.24,
            understeer_rad_per_mps2: 0.0,
            grip: VehicleView::DRY,
            start_mps2: 4.0,
        }
    }

    fn place(left_m: f32, left_mps: f32, curvature_per_m: f32) -> Place {
        Place { left_m, along_mps: 10.0, left_mps, curvature_per_m }
    }

    #[test]
    fn left_of_the_lane_it_steers_right_and_the_reverse() {
        let none = Reference::default();
        assert!(steer(&place(0.5, 0.0, 0.0), &none, &view()) < 0.0);
        assert!(steer(&place(-0.5, 0.0, 0.0), &none, &view()) > 0.0);
        assert!(steer(&place(0.0, 1.0, 0.0), &none, &view()) < 0.0);
        assert_eq!(steer(&place(0.0, 0.0, 0.0), &none, &view()), 0.0);
    }

    #[test]
    fn who_is_far_off_its_path_returns_as_if_it_were_a_little_off() {
        let at = |left_m: f32| steer(&place(left_m, 0.0, 0.0), &Reference::default(), &view());
        assert!(
            at(0.3) < 0.6 * at(0.1) && at(OFFSET_M_MAX) < 1.9 * at(0.3),
            "within: in proportion"
        );
        for far_m in [0.7, 2.0, 8.0] {
            assert_eq!(at(far_m), at(OFFSET_M_MAX), "{far_m} m");
            assert_eq!(at(-far_m), -at(OFFSET_M_MAX), "{far_m} m");
        }
        let changes = Reference { left_m: 3.5, ..Reference::default() };
        let after = steer(&place(3.4, 0.0, 0.0), &changes, &view());
        assert!((after + at(0.1)).abs() < 1.0e-4, "off the path of a change, not off the lane");
    }

    #[test]
    fn a_left_curve_is_steered_left_by_its_curvature() {
        let steer = steer(&place(0.0, 0.0, 0.02), &Reference::default(), &view());
        assert!((steer * 0.6 - (2.85f32 * 0.02).atan()).abs() < 1.0e-6);
    }
}

//! A smooth way from one lane to the next.

use serde::{Deserialize, Serialize};

use crate::track::Place;

/// Nearer to the lane's middle than this no way is planned; steering corrects it.
const OFFSET_M_MIN: f32 = 0.5;
/// Steepest course against the lane, as a slope; it lengthens the manoeuvre at low speed.
const SLOPE_MAX: f32 = 0.4;
/// Peak of the second and first derivative of the quintic from 1 to 0 over a unit length.
const QUINTIC_BEND: f32 = 5.774;
const QUINTIC_SLOPE: f32 = 1.875;
/// How much earlier the curvature is asked for: at 75 km/h the vehicle moves sideways that much
/// later than its wheels are told.
const LEAD_SECS: f32 = 0.22;
/// Slower than this the manoeuvre is planned as at this speed.
const SPEED_MPS_MIN: f32 = 1.0;

/// Why a vehicle moves sideways, which says how fast.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Manoeuvre {
    /// To the neighbouring lane, as quickly as a careful driver dares in an emergency.
    Change,
    /// Back to the middle of the own lane, in comfort.
    Return,
}

impl Manoeuvre {
    /// Highest sideways acceleration on a dry road, within its grip.
    const fn peak_mps2(self) -> f32 {
        match self {
            // What passes a group 20 m ahead at 75 km/h.
            Self::Change => 7.3,
            Self::Return => 2.5,
        }
    }
}

/// Sideways path over distance along the new lane: a quintic without jumps in course or curvature.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct LaneChange {
    length_m: f32,
    travelled_m: f32,
    /// Offset and slope where it begins, left of the new lane's middle.
    start_left_m: f32,
    start_slope: f32,
}

/// Where the vehicle should be beside the lane's middle, by distance along the lane.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Reference {
    pub left_m: f32,
    pub slope: f32,
    /// Second derivative.
    pub bend_per_m: f32,
}

impl LaneChange {
    /// From the present place beside a lane to its middle, on a road with this grip; `None` if it
    /// is nearly there.
    pub(crate) fn plan(manoeuvre: Manoeuvre, place: &Place, grip: f32) -> Option<Self> {
        let along_mps = place.along_mps.max(SPEED_MPS_MIN);
        let offset_m = place.left_m.abs();
        let peak_mps2 = manoeuvre.peak_mps2() * grip;
        let by_grip_m = along_mps * (QUINTIC_BEND * offset_m / peak_mps2).sqrt();
        let by_course_m = QUINTIC_SLOPE * offset_m / SLOPE_MAX;
        (offset_m > OFFSET_M_MIN).then(|| Self {
            length_m: by_grip_m.max(by_course_m),
            travelled_m: 0.0,
            start_left_m: place.left_m,
            start_slope: place.left_mps / along_mps,
        })
    }

    /// Moves on and tells where to be; after the end, in the middle of the lane.
    pub(crate) fn advance(change: &mut Option<Self>, along_mps: f32, dt_secs: f32) -> Reference {
        let Some(present) = change else { return Reference::default() };
        present.travelled_m += along_mps.max(0.0) * dt_secs;
        if present.travelled_m >= present.length_m {
            *change = None;
            return Reference::default();
        }
        let lead_m = present.travelled_m + along_mps.max(0.0) * LEAD_SECS;
        let bend_per_m = present.reference(lead_m.min(present.length_m)).bend_per_m;
        Reference { bend_per_m, ..present.reference(present.travelled_m) }
    }

    /// The quintic with given offset and slope at the start, zero bend there, and zero at the end.
    fn reference(&self, travelled_m: f32) -> Reference {
        let (length, u) = (self.length_m, travelled_m / self.length_m);
        let (offset, slope) = (self.start_left_m, self.start_slope * length);
        let c3 = -10.0 * offset - 6.0 * slope;
        let c4 = 15.0 * offset + 8.0 * slope;
        let c5 = -6.0 * offset - 3.0 * slope;
        let (u2, u3) = (u * u, u * u * u);
        Reference {
            left_m: offset + slope * u + c3 * u3 + c4 * u3 * u + c5 * u3 * u2,
            slope: (slope + 3.0 * c3 * u2 + 4.0 * c4 * u3 + 5.0 * c5 * u3 * u) / length,
            bend_per_m: (6.0 * c3 * u + 12.0 * c4 * u2 + 20.0 * c5 * u3) / (length * length),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn place(left_m: f32, along_mps: f32) -> Place {
        Place { left_m, along_mps, left_mps: 0.0, curvature_per_m: 0.0 }
    }

    #[test]
    fn it_begins_at_the_vehicle_and_ends_in_the_middle_of_the_lane() {
        let plan = LaneChange::plan(Manoeuvre::Change, &place(-3.5, 11.0), 1.0).unwrap();
        let (start, end) = (plan.reference(0.0), plan.reference(plan.length_m));
        assert!((start.left_m + 3.5).abs() < 1.0e-5 && start.slope.abs() < 1.0e-5);
        assert!(end.left_m.abs() < 1.0e-5 && end.slope.abs() < 1.0e-5);
        assert!(end.bend_per_m.abs() < 1.0e-4);
    }

    #[test]
    fn sideways_acceleration_stays_within_the_limit() {
        for grip in [1.0, 0.65] {
            let plan = LaneChange::plan(Manoeuvre::Change, &place(3.5, 11.0), grip).unwrap();
            let peak_mps2 = (0..=100)
                .map(|step| plan.reference(plan.length_m * step as f32 / 100.0).bend_per_m.abs())
                .fold(0.0, f32::max)
                * 11.0
                * 11.0;
            assert!((7.2..=7.4).contains(&(peak_mps2 / grip)), "{peak_mps2}");
        }
    }

    #[test]
    fn a_slow_vehicle_takes_a_longer_way_and_not_a_steeper_course() {
        let plan = LaneChange::plan(Manoeuvre::Change, &place(3.5, 2.0), 1.0).unwrap();
        let middle = plan.reference(plan.length_m / 2.0);
        assert!((middle.slope.abs() - SLOPE_MAX).abs() < 0.01, "{middle:?}");
    }
}

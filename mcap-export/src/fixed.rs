//! What is fixed to the ego: told once, and again when somebody has moved it.

use std::collections::BTreeMap;

use schemas::Pose;

/// What counts as moved: more than single precision makes of a town's coordinates.
const MOVED_M: f32 = 1.0e-3;
const MOVED_RAD: f32 = 1.0e-3;

/// Where frames are on the ego, as it was told.
#[derive(Debug, Default)]
pub(crate) struct Fixed(BTreeMap<String, Pose>);

impl Fixed {
    /// Whether a frame is new or elsewhere; from now on it is known.
    pub(crate) fn is_news(&mut self, frame: &str, ego_from_it: &Pose) -> bool {
        let is_same = self.0.get(frame).is_some_and(|before| {
            let way_m = before.translation.vector - ego_from_it.translation.vector;
            let turn_rad = before.rotation.angle_to(&ego_from_it.rotation);
            way_m.norm() < MOVED_M && turn_rad < MOVED_RAD
        });
        if !is_same {
            self.0.insert(frame.to_owned(), *ego_from_it);
        }
        !is_same
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_what_moves_is_told_again() {
        let mut fixed = Fixed::default();
        let at = |x| Pose::translation(x, 0.0, 1.0);
        assert!(fixed.is_news("lidar", &at(0.0)) && fixed.is_news("camera", &at(0.0)));
        assert!(!fixed.is_news("lidar", &at(1e-4)));
        assert!(fixed.is_news("lidar", &at(0.5)) && !fixed.is_news("lidar", &at(0.5)));
        assert!(!fixed.is_news("camera", &at(0.0)));
    }
}

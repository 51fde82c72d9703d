//! CARLA's pedestrians.

use super::{Blueprint, BodySpec, WalkerSpec};

/// Numbers of CARLA's `walker.pedestrian.NNNN`.
const COUNT: u32 = 51;

/// **Source:** median adult, height 1.75 m and 75 kg; radius from a chest depth of 0.25 m and a
/// shoulder breadth of 0.45 m, taken as one circle of about the same area.
static ADULT: WalkerSpec = WalkerSpec { mass_kg: 75.0, height_m: 1.75, radius_m: 0.2 };

pub(super) fn all() -> impl Iterator<Item = Blueprint> {
    (1..=COUNT).map(|number| Blueprint {
        id: format!("walker.pedestrian.{number:04}"),
        body: BodySpec::Walker(&ADULT),
    })
}

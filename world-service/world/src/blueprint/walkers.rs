//! CARLA's pedestrians.

use super::{Blueprint, BodySpec, WalkerSpec};

/// Numbers of CARLA's `walker.pedestrian.NNNN`.
const COUNT: u32 = 52;
/// Numbers of the children among them.
const CHILDREN: [u32; 8] = [9, 10, 11, 12, 13, 14, 48, 49];

/// **Source:** median adult, height 1.75 m and 75 kg; radius from a chest depth of 0.25 m and a
/// shoulder breadth of 0.45 m, taken as one circle of about the same area.
static ADULT: WalkerSpec = WalkerSpec { mass_kg: 75.0, height_m: 1.75, radius_m: 0.2 };

/// **Source:** median child of seven, 1.22 m and 23 kg; radius in proportion.
static CHILD: WalkerSpec = WalkerSpec { mass_kg: 23.0, height_m: 1.22, radius_m: 0.15 };

pub(super) fn all() -> impl Iterator<Item = Blueprint> {
    (1..=COUNT).map(|number| Blueprint {
        id: format!("walker.pedestrian.{number:04}"),
        body: BodySpec::Walker(if CHILDREN.contains(&number) { &CHILD } else { &ADULT }),
    })
}

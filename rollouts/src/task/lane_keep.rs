//! Keeping a lane.

use super::{Beginning, Bends, Task};
use crate::end::End;

pub(super) const LANE_KEEP: Task = Task {
    name: "lane-keep",
    about: "Along a lane through its bends, straight on at junctions, from any speed.",
    lengths_m: [(150.0, 600.0), (100.0, 600.0)],
    fits: keeps_straight_on,
    limit_secs: |length_m| length_m / 3.0 + 10.0,
    beginning: Beginning { speed_mps: (0.0, 10.0), beside_m: 0.5, turned_rad: 0.05 },
    ends: &[End::Arrived, End::Collision, End::OffRoute, End::Overturned],
};

fn keeps_straight_on(bends: &Bends) -> bool {
    bends.turns(30.0, 360.0) == 0
}

//! Tasks of "CARLA: An Open Urban Driving Simulator" (Dosovitskiy and others, CoRL 2017).
//!
//! The pairs of the paper are numbers of CARLA 0.8's start positions, which no map of 0.9 has in
//! that order: here they are drawn under the conditions that the paper and its benchmark give.
//! An episode may take the time of its way at 10 km/h and 10 s more; it succeeds within 2 m of the
//! goal. Weather and pictures are no part of these tasks.

use super::{Beginning, Bends, Task};
use crate::end::End;

/// From a standstill, as a spawned car of the benchmark begins, a little beside the middle.
const STANDSTILL: Beginning = Beginning { speed_mps: (0.0, 0.0), beside_m: 0.2, turned_rad: 0.02 };
const ENDS: &[End] = &[End::Arrived, End::Collision, End::OffRoute, End::Overturned];

pub(super) const STRAIGHT: Task = Task {
    name: "corl17-straight",
    about: "Straight on to a goal.",
    lengths_m: [(60.0, 250.0), (50.0, 150.0)],
    fits: is_straight,
    limit_secs,
    beginning: STANDSTILL,
    ends: ENDS,
};

pub(super) const ONE_TURN: Task = Task {
    name: "corl17-one-turn",
    about: "One turn at a junction on the way to a goal.",
    lengths_m: [(100.0, 600.0), (80.0, 300.0)],
    fits: has_one_turn,
    limit_secs,
    beginning: STANDSTILL,
    ends: ENDS,
};

pub(super) const NAVIGATION: Task = Task {
    name: "corl17-navigation",
    about: "At least three turns on the way to a goal.",
    lengths_m: [(400.0, 1_200.0), (150.0, 600.0)],
    fits: has_turns,
    limit_secs,
    beginning: STANDSTILL,
    ends: ENDS,
};

fn is_straight(bends: &Bends) -> bool {
    let junctions_rad: f32 = bends.junctions_rad.iter().map(|turn| turn.abs()).sum();
    junctions_rad + bends.elsewhere_rad < 10_f32.to_radians()
}

fn has_one_turn(bends: &Bends) -> bool {
    bends.turns(60.0, 120.0) == 1
        && bends.turns(15.0, 360.0) == 1
        && bends.elsewhere_rad < 15_f32.to_radians()
}

fn has_turns(bends: &Bends) -> bool {
    bends.turns(60.0, 120.0) >= 3
}

fn limit_secs(length_m: f32) -> f32 {
    length_m / (10.0 / 3.6) + 10.0
}

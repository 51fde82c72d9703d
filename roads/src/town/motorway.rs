//! Motorways: two carriageways side by side, and interchanges with the streets below them.

use super::course::{Bend, Pose, direction, signed};
use super::plan::{Beside, Control, End, Plan, UNEVEN_M};
use super::profile::{Edge, LANE_M, Profile};

/// From the middle between the carriageways to their left borders, in metres.
const HALF_GAP_M: f64 = 2.5;
/// Length of the junctions where ramps leave and join, in metres.
const FORK_M: f64 = 50.0 - 2.0 * UNEVEN_M;
/// How far a ramp has moved aside where it leaves such a junction, in metres.
const ASIDE_M: f64 = 7.5;
/// Distance of those junctions from the street below, in metres.
const FORK_AWAY_M: f64 = 210.0;
/// Distance of the ramps' ends from the motorway's middle, in metres.
pub(super) const TERMINAL_M: f64 = 55.0;
/// Radius of ramps, in metres.
const RAMP_RADIUS_M: f64 = 90.0;
/// Height of the motorway over the street, in metres.
const BRIDGE_M: f64 = 6.5;
/// Half of the length on which it is that high, in metres.
const BRIDGE_HALF_M: f64 = 25.0;

/// What a motorway is like.
#[derive(Clone, Copy, Debug)]
pub(super) struct Motorway {
    /// Driving lanes of each carriageway.
    pub(super) lanes: i32,
    pub(super) limit_kmh: u32,
}

/// An interchange on one carriageway: where it arrives and where it goes on.
#[derive(Clone, Copy, Debug)]
struct Through {
    arrives: End,
    goes_on: End,
}

/// An interchange: its two carriageways, along the given direction and against it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Interchange {
    carriageways: [Through; 2],
}

impl Motorway {
    fn profile(self) -> Profile {
        Profile::one_way(self.lanes, Edge::HardShoulder, self.limit_kmh)
    }

    /// A bridge over a street that crosses at a right angle, with ramps on all four sides, which
    /// end at junctions [`TERMINAL_M`] right and left of the bridge. The pose looks along the
    /// motorway from the middle of the bridge.
    pub(super) fn interchange(
        self,
        plan: &mut Plan,
        bridge: Pose,
        street: Profile,
        control: Control,
    ) -> Interchange {
        let terminals = [bridge, bridge.reversed()]
            .map(|along| plan.node_with(along.left(-TERMINAL_M).at, control));
        let [right, left] = terminals;
        let across = bridge.turned(std::f64::consts::FRAC_PI_2).heading_rad;
        plan.connect((right, across), (left, across + std::f64::consts::PI), &[], street).beside =
            Beside::Nothing;
        let carriageways =
            [self.half(plan, bridge, right), self.half(plan, bridge.reversed(), left)];
        Interchange { carriageways }
    }

    /// One carriageway of an interchange: the way out, the bridge, the way in.
    fn half(self, plan: &mut Plan, along: Pose, terminal: usize) -> Through {
        let border = along.left(-HALF_GAP_M);
        let (before, after) = (border.ahead(-FORK_AWAY_M), border.ahead(FORK_AWAY_M));
        let out = plan.node_with(before.at, Control::Free);
        let joined = plan.node_with(after.at, Control::Free);
        let half_m = FORK_M / 2.0;
        let bridge_start = before.ahead(half_m);
        let bridge_end = after.ahead(-half_m);
        let length_m = 2.0 * (FORK_AWAY_M - half_m);
        let share = |away_m: f64| 0.5 + away_m / length_m;
        let bridge = plan.connect(
            End::at(out, bridge_start),
            End::at(joined, bridge_end.reversed()),
            &[],
            self.profile(),
        );
        bridge.heights = vec![[share(-BRIDGE_HALF_M), BRIDGE_M], [share(BRIDGE_HALF_M), BRIDGE_M]];
        bridge.beside = Beside::Nothing;
        let outer_m = f64::from(self.lanes - 1) * LANE_M + ASIDE_M;
        let aside_rad = 2.0 * (ASIDE_M / FORK_M).atan();
        let ramp = Profile::one_way(1, Edge::Verge, 50);
        let off = before.ahead(half_m).left(-outer_m).turned(-aside_rad);
        let on = after.ahead(-half_m).left(-outer_m).turned(aside_rad);
        let down = terminal_bend(off, along);
        plan.connect(End::at(out, off), (terminal, along.reversed().heading_rad), &[down], ramp)
            .beside = Beside::Nothing;
        let up = terminal_bend(on, along);
        plan.connect((terminal, along.heading_rad), End::at(joined, on.reversed()), &[up], ramp)
            .beside = Beside::Nothing;
        Through {
            arrives: End::at(out, before.ahead(-half_m).reversed()),
            goes_on: End::at(joined, after.ahead(half_m)),
        }
    }

    /// Both carriageways between two interchanges, along a polyline of their common middle with
    /// rounded corners, and with heights on the way as in a street.
    pub(super) fn connect(
        self,
        plan: &mut Plan,
        from: &Interchange,
        middle: &[Bend],
        to: &Interchange,
        heights: &[[f64; 2]],
    ) {
        let there = (from.carriageways[0].goes_on, to.carriageways[0].arrives);
        let back = (to.carriageways[1].goes_on, from.carriageways[1].arrives);
        let mut middle = middle.to_vec();
        let mut heights = heights.to_vec();
        for (start, end) in [there, back] {
            let bends = aside(&start, &middle, &end);
            let street = plan.connect(start, end, &bends, self.profile());
            street.beside = Beside::Nothing;
            street.heights.clone_from(&heights);
            middle.reverse();
            heights.reverse();
            heights.iter_mut().for_each(|[share, _]| *share = 1.0 - *share);
        }
    }
}

/// The corners of the middle line, moved to the left border of a carriageway.
fn aside(start: &End, middle: &[Bend], end: &End) -> Vec<Bend> {
    let at = |end: &End| end.start.unwrap_or_default();
    let start_middle = Pose::new(at(start), start.leaving_rad).left(HALF_GAP_M).at;
    let end_middle = Pose::new(at(end), end.leaving_rad).left(-HALF_GAP_M).at;
    let mut from = start_middle;
    let mut bends = Vec::new();
    for (index, bend) in middle.iter().enumerate() {
        let next = middle.get(index + 1).map_or(end_middle, |next| next.at);
        let incoming_rad = direction(from, bend.at);
        let half_turn_rad = signed(direction(bend.at, next) - incoming_rad) / 2.0;
        // The border's corner lies on the line that halves the angle.
        let halving = Pose::new(bend.at, incoming_rad + half_turn_rad);
        bends.push(Bend {
            at: halving.left(-HALF_GAP_M / half_turn_rad.cos()).at,
            radius_m: bend.radius_m + half_turn_rad.signum() * HALF_GAP_M,
        });
        from = bend.at;
    }
    bends
}

/// Where a ramp turns from its own direction into that of the motorway's side.
fn terminal_bend(ramp: Pose, along: Pose) -> Bend {
    let line = along.left(-TERMINAL_M);
    let [_, left_m] = line.local(ramp.at);
    let slope_rad = signed(ramp.heading_rad - along.heading_rad);
    Bend { at: ramp.ahead(-left_m / slope_rad.sin()).at, radius_m: RAMP_RADIUS_M }
}

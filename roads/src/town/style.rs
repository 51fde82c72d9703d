//! New towns: a grid of streets with rounded corners, drawn from a seed.

use super::course::Bend;
use super::plan::{Beside, Control, EAST, NORTH, Plan, SOUTH, WEST};
use super::profile::{Edge, Extra, Profile};
use super::random::Random;

/// Blocks along each side of a town, at least and at most.
const BLOCKS: [usize; 2] = [2, 10];
/// Share of the streets between crossings that are left out.
const LEFT_OUT: f64 = 0.3;

/// What a new town is like.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[non_exhaustive]
pub enum Style {
    /// Streets with two lanes each way, an avenue with three, traffic lights.
    City,
    /// Streets with one lane each way, some with parked cars, stop signs and lights.
    Village,
    /// Country roads over hills, stop and yield signs.
    Country,
}

impl Style {
    /// Distance between streets, in metres, at least and at most.
    fn spacing_m(self) -> [f64; 2] {
        match self {
            Self::City => [95.0, 150.0],
            Self::Village => [65.0, 110.0],
            Self::Country => [150.0, 230.0],
        }
    }

    fn beside(self) -> Beside {
        match self {
            Self::City => Beside::Houses { storeys: [3.0, 9.0] },
            Self::Village => Beside::Houses { storeys: [1.0, 4.0] },
            Self::Country => Beside::Trees,
        }
    }

    fn profile(self, random: &mut Random) -> Profile {
        match self {
            Self::City => {
                let street = Profile::street(2, 40);
                random.one_of([street, street, street.with(Extra::Parking)])
            }
            Self::Village => {
                let street = Profile::street(1, 30);
                random.one_of([street, street.with(Extra::Parking), street.with(Extra::Biking)])
            }
            Self::Country => Profile::two_way(1, Edge::Verge, 70),
        }
    }

    fn control(self, random: &mut Random) -> Control {
        match self {
            Self::City => Control::Lights,
            Self::Village => random.one_of([Control::Lights, Control::Stop, Control::AllStop]),
            Self::Country => random.one_of([Control::Stop, Control::Yield]),
        }
    }

    /// Highest junctions, in metres.
    fn height_m(self) -> f64 {
        if self == Self::Country { 4.0 } else { 0.0 }
    }
}

/// Draws a town.
pub(super) fn plan(style: Style, seed: u64, blocks: usize) -> Plan {
    let blocks = blocks.clamp(BLOCKS[0], BLOCKS[1]);
    let mut random = Random::new(seed);
    let mut plan = Plan::new(Control::Lights, style.beside());
    let [xs, ys] = [(); 2].map(|()| lines(style, blocks, &mut random));
    for x in &xs {
        for y in &ys {
            if is_corner(&xs, *x) && is_corner(&ys, *y) {
                continue;
            }
            let control = style.control(&mut random);
            plan.node_with([*x, *y], control);
            plan.raise([*x, *y], random.between(0.0, style.height_m()));
        }
    }
    let avenue = if style == Style::City { blocks / 2 } else { blocks };
    let mut cut = vec![[0.0; 2]; 0];
    for (row, y) in ys.iter().enumerate() {
        for pair in xs.windows(2) {
            let [from, to] = [[pair[0], *y], [pair[1], *y]];
            let is_avenue = row == avenue && row < blocks;
            if !is_avenue && is_left_out(&xs, &ys, [from, to], &mut cut, &mut random) {
                continue;
            }
            let profile =
                if is_avenue { Profile::street(3, 60) } else { style.profile(&mut random) };
            street(&mut plan, &xs, &ys, [from, to], [EAST, WEST], profile);
        }
    }
    for x in &xs {
        for pair in ys.windows(2) {
            let [from, to] = [[*x, pair[0]], [*x, pair[1]]];
            if is_left_out(&xs, &ys, [from, to], &mut cut, &mut random) {
                continue;
            }
            let profile = style.profile(&mut random);
            street(&mut plan, &xs, &ys, [from, to], [NORTH, SOUTH], profile);
        }
    }
    add_corners(&mut plan, &xs, &ys, style, &mut random);
    plan
}

/// Coordinates of the streets in one direction, around 0.
fn lines(style: Style, blocks: usize, random: &mut Random) -> Vec<f64> {
    let [low, high] = style.spacing_m();
    let mut at = vec![0.0];
    for _ in 0..blocks {
        let last = at.last().copied().unwrap_or_default();
        at.push(last + random.between(low, high).round());
    }
    let middle = (at.last().copied().unwrap_or_default() / 2.0).round();
    at.iter().map(|v| v - middle).collect()
}

/// Whether a coordinate is that of the first or the last street.
#[allow(clippy::float_cmp, reason = "the value is one of the list")]
fn is_corner(lines: &[f64], at: f64) -> bool {
    lines.first() == Some(&at) || lines.last() == Some(&at)
}

/// Leaves a street out now and then, where crossings with four arms remain with three. No crossing
/// loses two, so that none is cut off.
fn is_left_out(
    xs: &[f64],
    ys: &[f64],
    ends: [[f64; 2]; 2],
    cut: &mut Vec<[f64; 2]>,
    random: &mut Random,
) -> bool {
    let draw = random.between(0.0, 1.0);
    let is_crossing = |[x, y]: [f64; 2]| !is_corner(xs, x) && !is_corner(ys, y);
    let left_out =
        draw < LEFT_OUT && ends.iter().all(|end| is_crossing(*end) && !cut.contains(end));
    if left_out {
        cut.extend(ends);
    }
    left_out
}

/// A street between two junctions; streets into the corners of the ring are made with those.
fn street(
    plan: &mut Plan,
    xs: &[f64],
    ys: &[f64],
    ends: [[f64; 2]; 2],
    leaving_rad: [f64; 2],
    profile: Profile,
) {
    if ends.iter().any(|[x, y]| is_corner(xs, *x) && is_corner(ys, *y)) {
        return;
    }
    let [from, to] = ends.map(|end| plan.node(end));
    plan.connect((from, leaving_rad[0]), (to, leaving_rad[1]), &[], profile);
}

fn add_corners(plan: &mut Plan, xs: &[f64], ys: &[f64], style: Style, random: &mut Random) {
    let profile = style.profile(random);
    let (Some(last_x), Some(last_y)) = (xs.len().checked_sub(1), ys.len().checked_sub(1)) else {
        return;
    };
    for (x, next_x) in [(0, 1), (last_x, last_x - 1)] {
        for (y, next_y) in [(0, 1), (last_y, last_y - 1)] {
            let bend = Bend { at: [xs[x], ys[y]], radius_m: 22.0 };
            plan.corner([xs[next_x], ys[y]], bend, [xs[x], ys[next_y]], profile);
        }
    }
}

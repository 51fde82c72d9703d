//! The plan of a town: junctions, and the streets between them.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use super::course::{Bend, Pose, direction, distance_m, signed};
use super::draft::ObjectDraft;
use super::named::NamedWay;
use super::profile::{Profile, Side};

/// Directions along a grid.
pub(super) const EAST: f64 = 0.0;
pub(super) const NORTH: f64 = FRAC_PI_2;
pub(super) const WEST: f64 = PI;
pub(super) const SOUTH: f64 = -FRAC_PI_2;

/// Directions that differ by less count as the same way, in radians.
pub(super) const SAME_WAY_RAD: f64 = 0.88;
/// Radius of kerbs at corners, in metres, so that cars can turn right from the outer lane.
const KERB_RADIUS_M: f64 = 6.0;

/// Junctions reach this much less far than whole metres, so that no road is a whole number of them
/// long: `next_until_lane_end` of CARLA's client raises where a step ends exactly at a road's end.
pub(super) const UNEVEN_M: f64 = 0.001;

/// Who may go first at a junction.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Control {
    /// Nobody waits; for roads that part or join.
    Free,
    Lights,
    /// Stop signs for all but the main road.
    Stop,
    /// Yield signs for all but the main road.
    Yield,
    AllStop,
}

/// A junction, level at its height.
#[derive(Clone, Copy, Debug)]
pub(super) struct Node {
    pub(super) at: [f64; 2],
    pub(super) height_m: f64,
    pub(super) control: Control,
}

/// One end of a street: the junction, and the direction in which the street leaves it.
#[derive(Clone, Copy, Debug)]
pub(super) struct End {
    pub(super) node: usize,
    pub(super) leaving_rad: f64,
    /// Where the street begins; `None` where the size of the junction says so.
    pub(super) start: Option<[f64; 2]>,
}

impl From<(usize, f64)> for End {
    fn from((node, leaving_rad): (usize, f64)) -> Self {
        Self { node, leaving_rad, start: None }
    }
}

impl End {
    /// An end away from the lines through its junction's middle; the pose looks along the street.
    pub(super) fn at(node: usize, leaving: Pose) -> Self {
        Self { node, leaving_rad: leaving.heading_rad, start: Some(leaving.at) }
    }
}

#[derive(Clone, Debug)]
pub(super) struct Street {
    pub(super) id: u32,
    pub(super) from: End,
    pub(super) to: End,
    pub(super) bends: Vec<Bend>,
    pub(super) profile: Profile,
    /// Heights on the way: share of the length, metres.
    pub(super) heights: Vec<[f64; 2]>,
    /// Whether it climbs on at these heights, and not only where it goes up or down between them.
    pub(super) climbs_on: bool,
    pub(super) beside: Beside,
}

/// What stands along a street.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Beside {
    Nothing,
    /// Houses of this many storeys.
    Houses {
        storeys: [f64; 2],
    },
    Trees,
}

/// A rectangle of land between streets, up to the sidewalks.
#[derive(Clone, Copy, Debug)]
pub(super) struct Block {
    pub(super) min: [f64; 2],
    pub(super) max: [f64; 2],
    pub(super) use_of_land: LandUse,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum LandUse {
    /// Houses along all four sides around a yard.
    Houses,
    /// One row of houses.
    Row,
    /// Lawn with trees.
    Park,
    /// A paved square without anything on it, as high as the road.
    Square,
}

/// One thing at a place of its own.
#[derive(Clone, Debug)]
pub(super) struct Loose {
    pub(super) at: [f64; 2],
    pub(super) heading_rad: f64,
    pub(super) object: ObjectDraft,
}

#[derive(Clone, Debug)]
pub(super) struct Plan {
    pub(super) nodes: Vec<Node>,
    pub(super) streets: Vec<Street>,
    pub(super) blocks: Vec<Block>,
    pub(super) loose: Vec<Loose>,
    /// Ways that nobody drives; their numbers are no other road's.
    pub(super) named: Vec<NamedWay>,
    /// What new junctions get.
    pub(super) control: Control,
    /// What new streets get.
    pub(super) beside: Beside,
}

/// One arm of a junction.
#[derive(Clone, Copy, Debug)]
pub(super) struct Arm {
    pub(super) street: u32,
    /// Where the street's reference line meets the junction, looking away from it.
    pub(super) pose: Pose,
    pub(super) profile: Profile,
    /// Whether the street's reference line ends at the junction.
    pub(super) ends_here: bool,
}

impl Arm {
    /// Sign of the lanes that lead into the junction.
    pub(super) fn inbound_sign(&self) -> i32 {
        if self.ends_here { -1 } else { 1 }
    }

    pub(super) fn inbound(&self) -> Option<Side> {
        self.profile.side(self.inbound_sign())
    }

    pub(super) fn outbound(&self) -> Option<Side> {
        self.profile.side(-self.inbound_sign())
    }

    pub(super) fn lanes_in(&self) -> i32 {
        self.inbound().map_or(0, |side| side.driving)
    }

    pub(super) fn lanes_out(&self) -> i32 {
        self.outbound().map_or(0, |side| side.driving)
    }

    /// Whether traffic flows one way only.
    pub(super) fn one_way(&self) -> bool {
        self.profile.left.is_none()
    }

    /// The pose of traffic that enters the junction, on the street's reference line.
    pub(super) fn entering(&self) -> Pose {
        self.pose.reversed()
    }
}

impl Plan {
    pub(super) fn new(control: Control, beside: Beside) -> Self {
        Self {
            nodes: Vec::new(),
            streets: Vec::new(),
            blocks: Vec::new(),
            loose: Vec::new(),
            named: Vec::new(),
            control,
            beside,
        }
    }

    /// The junction at a place, within a centimetre, made if there is none yet.
    pub(super) fn node(&mut self, at: [f64; 2]) -> usize {
        let there = |node: &Node| distance_m(node.at, at) < 0.01;
        self.nodes.iter().position(there).unwrap_or_else(|| {
            self.nodes.push(Node { at, height_m: 0.0, control: self.control });
            self.nodes.len() - 1
        })
    }

    /// The junction at a place, with other rules of priority than the plan's.
    pub(super) fn node_with(&mut self, at: [f64; 2], control: Control) -> usize {
        let index = self.node(at);
        if let Some(node) = self.nodes.get_mut(index) {
            node.control = control;
        }
        index
    }

    /// Raises a junction.
    pub(super) fn raise(&mut self, at: [f64; 2], height_m: f64) {
        let index = self.node(at);
        if let Some(node) = self.nodes.get_mut(index) {
            node.height_m = height_m;
        }
    }

    /// Adds a street.
    pub(super) fn connect(
        &mut self,
        from: impl Into<End>,
        to: impl Into<End>,
        bends: &[Bend],
        profile: Profile,
    ) -> &mut Street {
        let id = u32::try_from(self.streets.len()).unwrap_or(0) + 1;
        let index = self.streets.len();
        self.streets.push(Street {
            id,
            from: from.into(),
            to: to.into(),
            bends: bends.to_vec(),
            profile,
            heights: Vec::new(),
            climbs_on: false,
            beside: self.beside,
        });
        &mut self.streets[index]
    }

    /// A straight street between two places.
    pub(super) fn line(&mut self, from: [f64; 2], to: [f64; 2], profile: Profile) {
        let ends = ((self.node(from), direction(from, to)), (self.node(to), direction(to, from)));
        self.connect(ends.0, ends.1, &[], profile);
    }

    /// Streets from west to east through these places.
    pub(super) fn row(&mut self, y: f64, xs: &[f64], profile: Profile) {
        for pair in xs.windows(2) {
            if let [from, to] = pair {
                let ends = (self.node([*from, y]), self.node([*to, y]));
                self.connect((ends.0, EAST), (ends.1, WEST), &[], profile);
            }
        }
    }

    /// Streets from south to north through these places.
    pub(super) fn column(&mut self, x: f64, ys: &[f64], profile: Profile) {
        for pair in ys.windows(2) {
            if let [from, to] = pair {
                let ends = (self.node([x, *from]), self.node([x, *to]));
                self.connect((ends.0, NORTH), (ends.1, SOUTH), &[], profile);
            }
        }
    }

    /// A street around one corner, between two places in line with it.
    pub(super) fn corner(
        &mut self,
        from: [f64; 2],
        bend: Bend,
        to: [f64; 2],
        profile: Profile,
    ) -> &mut Street {
        let ends =
            ((self.node(from), direction(from, bend.at)), (self.node(to), direction(to, bend.at)));
        self.connect(ends.0, ends.1, &[bend], profile)
    }

    /// Gives two streets each other's number and leaves them at their places in the text, by which
    /// things of a town are counted.
    pub(super) fn swap_numbers(&mut self, [a, b]: [u32; 2]) {
        for street in &mut self.streets {
            street.id = match street.id {
                id if id == a => b,
                id if id == b => a,
                id => id,
            };
        }
    }

    /// The arms of a junction, counter-clockwise from east.
    pub(super) fn arms(&self, node: usize) -> Vec<Arm> {
        let mut arms: Vec<Arm> = self
            .ends(node)
            .map(|(street, end, ends_here)| Arm {
                street: street.id,
                pose: self.start(end),
                profile: street.profile,
                ends_here,
            })
            .collect();
        arms.sort_by(|a, b| {
            full_turn(a.pose.heading_rad).total_cmp(&full_turn(b.pose.heading_rad))
        });
        arms
    }

    /// Where a street begins, looking along it away from the junction.
    pub(super) fn start(&self, end: &End) -> Pose {
        match end.start {
            Some(start) => Pose::new(start, end.leaving_rad),
            None => Pose::new(self.at(end.node), end.leaving_rad).ahead(self.reach_m(end)),
        }
    }

    fn ends(&self, node: usize) -> impl Iterator<Item = (&Street, &End, bool)> {
        self.streets
            .iter()
            .flat_map(|street| [(street, &street.from, false), (street, &street.to, true)])
            .filter(move |(_, end, _)| end.node == node)
    }

    /// Distance from a junction's middle to where an arm of it begins: behind the rounded kerbs of
    /// the corners on both sides of it.
    fn reach_m(&self, arm: &End) -> f64 {
        // Kerbs to the left and to the right, looking away from the junction.
        let kerbs_m = |street: &Street, ends_here: bool| {
            let sign = if ends_here { -1 } else { 1 };
            [sign, -sign].map(|sign| street.profile.side(sign).map_or(0.0, Side::kerb_m))
        };
        let turn_rad = |end: &End| full_turn(end.leaving_rad - arm.leaving_rad);
        let along = self.ends(arm.node).filter(|(_, end, _)| end.start.is_none());
        let (own, others): (Vec<_>, Vec<_>) = along.partition(|(_, end, _)| turn_rad(end) < 0.01);
        let Some((street, _, ends_here)) = own.first() else { return KERB_RADIUS_M - UNEVEN_M };
        let [left_m, right_m] = kerbs_m(street, *ends_here);
        let others = others.iter().map(|(street, end, ends_here)| {
            let [their_left_m, their_right_m] = kerbs_m(street, *ends_here);
            (turn_rad(end), their_left_m, their_right_m)
        });
        let mut reach_m: f64 = 0.0;
        for (turn_rad, their_left_m, their_right_m) in others {
            let corners =
                [(turn_rad, left_m, their_right_m), (TAU - turn_rad, right_m, their_left_m)];
            for (between_rad, own_m, their_m) in corners {
                if between_rad < PI - 0.2 {
                    let (sin, cos) = between_rad.sin_cos();
                    let rounding_m = KERB_RADIUS_M * ((PI - between_rad) / 2.0).tan();
                    reach_m = reach_m.max((their_m + own_m * cos) / sin + rounding_m);
                }
            }
        }
        (reach_m - 1e-6).ceil().max(KERB_RADIUS_M) - UNEVEN_M
    }

    pub(super) fn at(&self, node: usize) -> [f64; 2] {
        self.nodes.get(node).map_or([0.0; 2], |node| node.at)
    }

    pub(super) fn height_m(&self, node: usize) -> f64 {
        self.nodes.get(node).map_or(0.0, |node| node.height_m)
    }
}

/// An angle brought into one turn from 0; a hair below a full turn is 0.
fn full_turn(angle_rad: f64) -> f64 {
    let turned = angle_rad.rem_euclid(TAU);
    if turned > TAU - 1e-6 { 0.0 } else { turned }
}

/// Whether two directions are about the same.
pub(super) fn same_way(a_rad: f64, b_rad: f64) -> bool {
    signed(a_rad - b_rad).abs() < SAME_WAY_RAD
}

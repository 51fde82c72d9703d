//! The plan of a town: junctions on a grid and the streets between them.

/// Width of every driving lane, in metres.
pub(super) const LANE_M: f64 = 3.5;
/// Width of the gutter between the outermost driving lane and the kerb, in metres.
pub(super) const GUTTER_M: f64 = 0.5;
/// Width of sidewalks, in metres.
pub(super) const SIDEWALK_M: f64 = 3.0;
/// Radius of the middle line where the ring street turns, in metres. The block inside keeps its
/// corner, for the sidewalk turns with 7.5 m there.
pub(super) const CORNER_RADIUS_M: f64 = 18.0;

/// A direction along the grid.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Compass {
    East,
    North,
    West,
    South,
}

impl Compass {
    pub(super) const ALL: [Self; 4] = [Self::East, Self::North, Self::West, Self::South];

    pub(super) fn left(self) -> Self {
        match self {
            Self::East => Self::North,
            Self::North => Self::West,
            Self::West => Self::South,
            Self::South => Self::East,
        }
    }

    pub(super) fn opposite(self) -> Self {
        self.left().left()
    }

    pub(super) fn right(self) -> Self {
        self.opposite().left()
    }

    pub(super) fn unit(self) -> [f64; 2] {
        match self {
            Self::East => [1.0, 0.0],
            Self::North => [0.0, 1.0],
            Self::West => [-1.0, 0.0],
            Self::South => [0.0, -1.0],
        }
    }

    pub(super) fn heading_rad(self) -> f64 {
        use std::f64::consts::{FRAC_PI_2, PI};
        match self {
            Self::East => 0.0,
            Self::North => FRAC_PI_2,
            Self::West => PI,
            Self::South => -FRAC_PI_2,
        }
    }
}

/// What a street is like, the same on both sides.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Profile {
    /// Two driving lanes per direction.
    Street,
    /// Three driving lanes per direction.
    Avenue,
}

impl Profile {
    /// Driving lanes per direction.
    pub(super) fn lanes(self) -> i32 {
        match self {
            Self::Street => 2,
            Self::Avenue => 3,
        }
    }

    pub(super) fn limit_kmh(self) -> u32 {
        match self {
            Self::Street => 30,
            Self::Avenue => 50,
        }
    }

    /// From the middle line to the kerb.
    pub(super) fn kerb_m(self) -> f64 {
        f64::from(self.lanes()) * LANE_M + GUTTER_M
    }

    /// From the middle line to the outer edge of the sidewalk.
    pub(super) fn half_width_m(self) -> f64 {
        self.kerb_m() + SIDEWALK_M
    }
}

/// A junction and where it lies.
#[derive(Clone, Copy, Debug)]
pub(super) struct Node {
    pub(super) at: [f64; 2],
}

/// One end of a street: the junction, and the direction in which the street leaves it.
#[derive(Clone, Copy, Debug)]
pub(super) struct End {
    pub(super) node: usize,
    pub(super) leaving: Compass,
}

#[derive(Clone, Copy, Debug)]
pub(super) struct Street {
    pub(super) id: u32,
    pub(super) from: End,
    pub(super) to: End,
    /// Where the street turns by a right angle.
    pub(super) corner: Option<[f64; 2]>,
    pub(super) profile: Profile,
}

/// A rectangle of land between streets or beside the ring, up to the sidewalks.
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
}

#[derive(Clone, Debug, Default)]
pub(super) struct Plan {
    pub(super) nodes: Vec<Node>,
    pub(super) streets: Vec<Street>,
    pub(super) blocks: Vec<Block>,
}

/// One arm of a junction.
#[derive(Clone, Copy, Debug)]
pub(super) struct Arm {
    pub(super) street: u32,
    pub(super) leaving: Compass,
    pub(super) profile: Profile,
    /// Whether the street's reference line ends at the junction.
    pub(super) ends_here: bool,
}

impl Plan {
    /// The arms of a junction, counter-clockwise from east.
    pub(super) fn arms(&self, node: usize) -> Vec<Arm> {
        let arm = |street: &Street, end: &End, ends_here| Arm {
            street: street.id,
            leaving: end.leaving,
            profile: street.profile,
            ends_here,
        };
        Compass::ALL
            .into_iter()
            .filter_map(|leaving| {
                self.streets.iter().find_map(|street| {
                    let at = |end: &End| end.node == node && end.leaving == leaving;
                    if at(&street.from) {
                        Some(arm(street, &street.from, false))
                    } else {
                        at(&street.to).then(|| arm(street, &street.to, true))
                    }
                })
            })
            .collect()
    }

    /// Distance from a junction's middle to where its arms begin. The sidewalk around a corner
    /// keeps an inner radius of 7 m, so that cars can turn right from the outer lane.
    pub(super) fn reach_m(&self, node: usize) -> f64 {
        let is_avenue = |arm: &Arm| arm.profile == Profile::Avenue;
        if self.arms(node).iter().any(is_avenue) { 21.0 } else { 18.0 }
    }

    pub(super) fn at(&self, node: usize) -> [f64; 2] {
        self.nodes.get(node).map_or([0.0; 2], |node| node.at)
    }
}

const WEST: f64 = -200.0;
const MIDDLE_WEST: f64 = -70.0;
const MIDDLE_EAST: f64 = 60.0;
const EAST: f64 = 200.0;
const ROWS: [f64; 3] = [-100.0, 0.0, 100.0];
const NORTH: f64 = 200.0;
const SOUTH: f64 = -200.0;

/// A dense inner city of 400 by 400 m: a ring street, cross streets, and an avenue from west to
/// east whose western half is 218 m without a junction.
pub(super) fn inner_city() -> Plan {
    let mut plan = Plan::default();
    add_rows(&mut plan);
    add_columns(&mut plan);
    add_ring_corners(&mut plan);
    add_blocks(&mut plan);
    plan
}

impl Plan {
    fn node(&mut self, at: [f64; 2]) -> usize {
        self.nodes.iter().position(|node| node.at == at).unwrap_or_else(|| {
            self.nodes.push(Node { at });
            self.nodes.len() - 1
        })
    }

    fn connect(&mut self, from: ([f64; 2], Compass), to: ([f64; 2], Compass), profile: Profile) {
        self.connect_by(from, to, None, profile);
    }

    fn connect_by(
        &mut self,
        from: ([f64; 2], Compass),
        to: ([f64; 2], Compass),
        corner: Option<[f64; 2]>,
        profile: Profile,
    ) {
        let id = u32::try_from(self.streets.len()).unwrap_or(0) + 1;
        let from = End { node: self.node(from.0), leaving: from.1 };
        let to = End { node: self.node(to.0), leaving: to.1 };
        self.streets.push(Street { id, from, to, corner, profile });
    }
}

fn add_rows(plan: &mut Plan) {
    use Compass::{East, West};
    let mut row = |y: f64, xs: &[f64], profile| {
        for pair in xs.windows(2) {
            if let [from, to] = pair {
                plan.connect(([*from, y], East), ([*to, y], West), profile);
            }
        }
    };
    row(0.0, &[WEST, MIDDLE_EAST, EAST], Profile::Avenue);
    row(100.0, &[WEST, MIDDLE_WEST, MIDDLE_EAST, EAST], Profile::Street);
    row(-100.0, &[WEST, MIDDLE_WEST, MIDDLE_EAST, EAST], Profile::Street);
    row(NORTH, &[MIDDLE_WEST, MIDDLE_EAST], Profile::Street);
    row(SOUTH, &[MIDDLE_WEST, MIDDLE_EAST], Profile::Street);
}

fn add_columns(plan: &mut Plan) {
    use Compass::{North, South};
    let mut column = |x: f64, ys: &[f64]| {
        for pair in ys.windows(2) {
            if let [from, to] = pair {
                plan.connect(([x, *from], North), ([x, *to], South), Profile::Street);
            }
        }
    };
    column(WEST, &ROWS);
    column(EAST, &ROWS);
    column(MIDDLE_WEST, &[SOUTH, -100.0]);
    column(MIDDLE_WEST, &[100.0, NORTH]);
    column(MIDDLE_EAST, &[SOUTH, -100.0, 0.0, 100.0, NORTH]);
}

fn add_ring_corners(plan: &mut Plan) {
    use Compass::{East, North, South, West};
    let corners = [
        ((WEST, 100.0, North), (MIDDLE_WEST, NORTH, West), [WEST, NORTH]),
        ((MIDDLE_EAST, NORTH, East), (EAST, 100.0, North), [EAST, NORTH]),
        ((EAST, -100.0, South), (MIDDLE_EAST, SOUTH, East), [EAST, SOUTH]),
        ((MIDDLE_WEST, SOUTH, West), (WEST, -100.0, South), [WEST, SOUTH]),
    ];
    for ((x0, y0, leaving), (x1, y1, entering), corner) in corners {
        let (from, to) = (([x0, y0], leaving), ([x1, y1], entering));
        plan.connect_by(from, to, Some(corner), Profile::Street);
    }
}

fn add_blocks(plan: &mut Plan) {
    /// Land of a block begins this far outside the sidewalk's edge: corners are rounded.
    const GAP_M: f64 = 0.1;
    let side = |profile: Profile| profile.half_width_m() + GAP_M;
    let street = side(Profile::Street);
    // A street row is given by its y and by how far its land keeps away from it.
    let rows = [
        (SOUTH, street),
        (-100.0, street),
        (0.0, side(Profile::Avenue)),
        (100.0, street),
        (NORTH, street),
    ];
    for (index, pair) in rows.windows(2).enumerate() {
        let [(y0, gap0), (y1, gap1)] = pair else { continue };
        let beside_avenue = index == 1 || index == 2;
        let columns: &[(f64, f64)] = if beside_avenue {
            &[(WEST, MIDDLE_EAST), (MIDDLE_EAST, EAST)]
        } else {
            &[(WEST, MIDDLE_WEST), (MIDDLE_WEST, MIDDLE_EAST), (MIDDLE_EAST, EAST)]
        };
        for (column, (x0, x1)) in columns.iter().enumerate() {
            let is_park = matches!((index, column), (0 | 2, 1));
            plan.blocks.push(Block {
                min: [x0 + street, y0 + gap0],
                max: [x1 - street, y1 - gap1],
                use_of_land: if is_park { LandUse::Park } else { LandUse::Houses },
            });
        }
    }
    let (near, far, along) = (EAST + street, EAST + street + 24.0, 160.0);
    let outside = [
        ([near, -along], [far, along]),
        ([-along, near], [along, far]),
        ([-far, -along], [-near, along]),
        ([-along, -far], [along, -near]),
    ];
    plan.blocks.extend(outside.map(|(min, max)| Block { min, max, use_of_land: LandUse::Row }));
}

//! How high sidewalks are: a step above the road, but level with it where another road's driving
//! lane leads across.

use nalgebra::{Point3, Vector2};

use super::squares::Squares;
use super::strip::{across, cuts, pieces};
use crate::Map;
use crate::kinds::LaneType;
use crate::lanes::lateral;
use crate::limits::{CROSSED_PIECES_MAX, CROSSED_PLACES_MAX, CROSSED_TRIES_MAX};
use crate::model::{Lane, Road, Section};

/// Height of sidewalks above the road, in metres.
pub(crate) const KERB_M: f64 = 0.15;
/// How far below other lanes those lie that roads cross, in metres. No crack that a wheel would
/// feel.
pub(super) const CROSSED_DROP_M: f64 = 0.008;
/// Climb of a sidewalk from where it is crossed, in metres for each metre.
const CLIMB_M_PER_M: f64 = 0.15;
/// How far a sidewalk stays level beyond the last place where it is known to be crossed, in metres:
/// no less than the distance of such places.
const LEVEL_M: f64 = 0.5;
/// Distance of the places at which a sidewalk is looked at, and longest piece of one that climbs,
/// in metres.
const STEP_M: f64 = 0.5;
/// Share of a driving lane's width on which wheels run.
const WHEELS_SHARE: f64 = 0.8;
/// A lane that lies farther below a sidewalk than this is of another storey, in metres.
const STOREY_M: f64 = 0.5;
/// From here on a place where a sidewalk is crossed makes it no lower, in metres.
const REACH_M: f64 = LEVEL_M + (KERB_M + STOREY_M) / CLIMB_M_PER_M;
/// Side of the squares by which pieces of sidewalks and crossed places are found, in metres.
const SQUARE_M: f64 = 16.0;
/// Pieces with a box longer than this are no sidewalk's and no lane's, in metres.
const PIECE_MAX_M: f64 = 100.0;

/// Where the sidewalks of a map are lower than elsewhere.
#[derive(Debug, Default)]
pub(crate) struct Kerbs {
    /// Places of sidewalks which they must not be higher than.
    crossed: Squares<Point3<f64>>,
    /// Whether no limit ended the search for them.
    is_whole: bool,
}

impl Kerbs {
    /// Looks for driving lanes that lead across the sidewalks of other roads.
    pub(crate) fn new(map: &Map) -> Self {
        let mut walks = Vec::new();
        each_piece(map, LaneType::Sidewalk, 1.0, &mut |piece| {
            walks.push(piece);
            walks.len() <= CROSSED_PIECES_MAX
        });
        let mut is_whole = walks.len() <= CROSSED_PIECES_MAX;
        walks.truncate(CROSSED_PIECES_MAX);
        if walks.is_empty() {
            return Self { is_whole, ..Self::default() };
        }
        let of_squares = |walk| squares_of(Piece::bounds(walk)).map(move |square| (square, walk));
        let mut in_squares: Vec<([i32; 2], &Piece)> =
            walks.iter().flat_map(of_squares).take(4 * CROSSED_PIECES_MAX + 1).collect();
        is_whole &= in_squares.len() <= 4 * CROSSED_PIECES_MAX;
        in_squares.truncate(4 * CROSSED_PIECES_MAX);
        let squares = Squares::new(in_squares);
        let (mut crossed, mut tries) = (Vec::new(), 0);
        each_piece(map, LaneType::Driving, WHEELS_SHARE, &mut |lane| {
            let [low, high] = lane.bounds();
            for square in squares_of([low, high]) {
                tries += 1;
                for walk in squares.within([square; 2]) {
                    tries += 1;
                    if tries > CROSSED_TRIES_MAX || crossed.len() > CROSSED_PLACES_MAX {
                        is_whole = false;
                        return false;
                    }
                    let [walk_low, walk_high] = walk.bounds();
                    let (from, to) = (low.sup(&walk_low), high.inf(&walk_high));
                    let meets = from.x < to.x && from.y < to.y && walk.road != lane.road;
                    // Both may share several squares.
                    if meets && square_of(&from) == square {
                        tries += walk.look(&lane, &mut crossed);
                    }
                }
            }
            true
        });
        crossed.sort_by(|a, b| {
            a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)).then(a.z.total_cmp(&b.z))
        });
        // Lanes that part or meet often lie on each other.
        crossed.dedup();
        let placed = crossed.into_iter().map(|place| (square_of(&place.coords.xy()), place));
        Self { crossed: Squares::new(placed.collect()), is_whole }
    }

    /// Whether every place was found where a road leads across a sidewalk; beyond the limits of the
    /// search, sidewalks stay a step high.
    pub(crate) fn is_whole(&self) -> bool {
        self.is_whole
    }

    /// Height above the road of a sidewalk between two lateral places, in metres: all of its width
    /// is as high as its lowest place.
    pub(crate) fn height_m(&self, road: &Road, s: f64, t: [f64; 2]) -> f64 {
        if self.crossed.is_empty() {
            return KERB_M;
        }
        let [from, to] = across(road, s, t, 0.0);
        let along = to.xy() - from.xy();
        let length2 = along.norm_squared().max(f64::MIN_POSITIVE);
        let [a, b] = [from, to].map(|end| end.coords.xy());
        let near = self.near([a.inf(&b), a.sup(&b)]);
        let heights = near.filter(|place| place.z - from.z > -STOREY_M).map(|place| {
            let share = ((place.xy() - from.xy()).dot(&along) / length2).clamp(0.0, 1.0);
            let away_m = (place.xy() - from.xy() - along * share).norm();
            place.z - from.z + CLIMB_M_PER_M * (away_m - LEVEL_M).max(0.0)
        });
        heights.fold(KERB_M, f64::min)
    }

    /// Where a section is cut, also where the height of its sidewalks changes.
    pub(crate) fn cuts(&self, road: &Road, section: &Section) -> Vec<f64> {
        let cuts = cuts(road, section);
        let is_walk = |lane: &&Lane| lane.lane_type == LaneType::Sidewalk;
        let walks: Vec<i32> = section.lanes.iter().filter(is_walk).map(|lane| lane.id).collect();
        if self.crossed.is_empty() || walks.is_empty() {
            return cuts;
        }
        let borders = |lane: i32, s: f64| {
            let at = lateral(road, section, lane, s);
            [at.inner, at.outer]
        };
        let is_low =
            |s: f64| walks.iter().any(|lane| self.height_m(road, s, borders(*lane, s)) < KERB_M);
        let mut finer = Vec::with_capacity(cuts.len());
        for [from_s, to_s] in pieces(&cuts) {
            finer.push(from_s);
            let corners = walks.iter().flat_map(|lane| {
                [from_s, to_s].into_iter().flat_map(|s| across(road, s, borders(*lane, s), 0.0))
            });
            if self.is_near(corners) {
                let all = steps(to_s - from_s).map(|share| from_s + (to_s - from_s) * share);
                let all: Vec<_> = all.map(|s| (s, is_low(s))).collect();
                let changing = all.windows(3).filter(|around| around.iter().any(|(_, low)| *low));
                finer.extend(changing.filter_map(|around| Some(around.get(1)?.0)));
            }
        }
        finer.extend(cuts.last());
        finer
    }

    /// Whether some crossed place may make a piece with these corners lower.
    fn is_near(&self, corners: impl Iterator<Item = Point3<f64>>) -> bool {
        let corners = corners.map(|corner| corner.coords.xy());
        let around =
            corners.map(|at| [at; 2]).reduce(|[low, high], [at, _]| [low.inf(&at), high.sup(&at)]);
        around.is_some_and(|around| self.near(around).next().is_some())
    }

    /// Crossed places in a box and as far beside it as they make a sidewalk lower.
    fn near(&self, [low, high]: [Vector2<f64>; 2]) -> impl Iterator<Item = &Point3<f64>> {
        let reach = Vector2::repeat(REACH_M);
        let (low, high) = (low - reach, high + reach);
        let found = self.crossed.within([square_of(&low), square_of(&high)]);
        found.filter(move |place| {
            let at = place.coords.xy();
            low.x <= at.x && at.x <= high.x && low.y <= at.y && at.y <= high.y
        })
    }
}

/// A flat piece of a lane.
#[derive(Debug)]
struct Piece {
    /// Position in the model.
    road: usize,
    /// Around it, from the inner corner at its start.
    corners: [Point3<f64>; 4],
}

impl Piece {
    fn bounds(&self) -> [Vector2<f64>; 2] {
        let [first, rest @ ..] = self.corners.map(|corner| corner.coords.xy());
        rest.iter().fold([first; 2], |[low, high], at| [low.inf(at), high.sup(at)])
    }

    /// Adds the places of this sidewalk that a lane crosses; tells how many were looked at.
    fn look(&self, lane: &Self, crossed: &mut Vec<Point3<f64>>) -> usize {
        let [a, b, c, d] = self.corners.map(|corner| corner.coords);
        let long_m = (b - a).norm().max((c - d).norm());
        let wide_m = (d - a).norm().max((c - b).norm());
        let mut count = 0;
        for u in steps(long_m) {
            let [inner, outer] = [a + (b - a) * u, d + (c - d) * u];
            for v in steps(wide_m) {
                let place = inner + (outer - inner) * v;
                count += 1;
                let Some(z) = lane.height_at(place.xy()) else { continue };
                let height_m = z - CROSSED_DROP_M - place.z;
                if (-STOREY_M..KERB_M).contains(&height_m) {
                    crossed.push(Point3::new(place.x, place.y, z - CROSSED_DROP_M));
                }
            }
        }
        count
    }

    fn height_at(&self, place: Vector2<f64>) -> Option<f64> {
        let [a, b, c, d] = self.corners;
        [[a, b, c], [a, c, d]].into_iter().find_map(|[a, b, c]| {
            let (to_b, to_c, to) = (b.xy() - a.xy(), c.xy() - a.xy(), place - a.coords.xy());
            let area = to_b.perp(&to_c);
            let [of_b, of_c] = [to.perp(&to_c) / area, to_b.perp(&to) / area];
            // Written so that a triangle without area has no places.
            let is_inside = of_b >= 0.0 && of_c >= 0.0 && of_b + of_c <= 1.0;
            is_inside.then(|| a.z + of_b * (b.z - a.z) + of_c * (c.z - a.z))
        })
    }
}

/// Calls `take` with the pieces of all lanes of a type, of which a share of the width counts,
/// until it says no.
fn each_piece(map: &Map, lane_type: LaneType, share: f64, take: &mut impl FnMut(Piece) -> bool) {
    let margin = (1.0 - share) / 2.0;
    for (index, road) in map.model.roads.iter().enumerate() {
        for section in &road.sections {
            let wanted = || section.lanes.iter().filter(|lane| lane.lane_type == lane_type);
            if wanted().all(|lane| lane.id == 0) {
                continue;
            }
            let cuts = cuts(road, section);
            for lane in wanted().filter(|lane| lane.id != 0) {
                let ends = |s: f64| {
                    let at = lateral(road, section, lane.id, s);
                    let less = (at.outer - at.inner) * margin;
                    across(road, s, [at.inner + less, at.outer - less], 0.0)
                };
                for [from_s, to_s] in pieces(&cuts) {
                    let ([a, d], [b, c]) = (ends(from_s), ends(to_s));
                    let piece = Piece { road: index, corners: [a, b, c, d] };
                    let [low, high] = piece.bounds();
                    // Written so that places that are no numbers are left out.
                    if (high - low).iter().all(|side_m| *side_m < PIECE_MAX_M) && !take(piece) {
                        return;
                    }
                }
            }
        }
    }
}

/// Shares of a length from 0 to 1, no more than [`STEP_M`] apart.
fn steps(length_m: f64) -> impl Iterator<Item = f64> {
    let count = (length_m / STEP_M).ceil().max(1.0);
    let all = std::iter::successors(Some(0.0), |k| Some(k + 1.0));
    all.take_while(move |k| *k <= count).map(move |k| k / count)
}

#[allow(clippy::cast_possible_truncation, reason = "maps are smaller than the earth")]
fn square_of(at: &Vector2<f64>) -> [i32; 2] {
    [at.x, at.y].map(|v| (v / SQUARE_M).floor() as i32)
}

fn squares_of([low, high]: [Vector2<f64>; 2]) -> impl Iterator<Item = [i32; 2]> {
    let ([x0, y0], [x1, y1]) = (square_of(&low), square_of(&high));
    (x0..=x1).flat_map(move |x| (y0..=y1).map(move |y| [x, y]))
}

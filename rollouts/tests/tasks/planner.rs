//! A driver who looks some seconds ahead: of the speeds and places beside its way it takes the
//! fastest at which it meets nobody, if everybody goes on as now.

use rollouts::Spec;

/// How far ahead it looks, and in what steps.
const AHEAD_SECS: f32 = 5.0;
const STEP_SECS: f32 = 0.25;
const SPEEDS_MPS: [f32; 9] = [22.0, 16.0, 12.0, 8.0, 6.0, 4.5, 3.0, 1.5, 0.0];
const SPEED_UP_MPS2: f32 = 2.0;
const BRAKE_MPS2: f32 = 4.0;
/// Sideways in bends.
const BEND_MPS2: f32 = 2.0;
const WHEELBASE_M: f32 = 2.85;
const LOCK_RAD: f32 = 0.6;
/// From the rear axle to the middles of the front, the middle and the rear of the car.
const DISCS_M: [f32; 3] = [-0.2, 1.4, 3.0];
/// Half the width of a car, and room beside it.
const DISC_M: f32 = 1.1;
const ROOM_M: f32 = 0.25;
/// Way over which it changes its place beside its way.
const ASIDE_OVER_M: f32 = 10.0;
const AHEAD_M: [f32; 8] = [2.0, 4.0, 7.0, 10.0, 15.0, 20.0, 30.0, 40.0];

/// Where it may drive, and whether it stops at its goal.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Planner {
    /// Left of its way, the most wanted first.
    pub(crate) beside_m: &'static [f32],
    pub(crate) stops: bool,
}

/// A point, and the direction of the way there.
type Pose = ([f32; 2], [f32; 2]);

/// One row of `drive`, in its units.
struct Row<'a> {
    names: &'a [String],
    values: &'a [f32],
}

impl Row<'_> {
    fn at(&self, name: &str) -> f32 {
        self.values[self.names.iter().position(|known| known == name).unwrap()]
    }

    /// Its way, as points with their distances.
    fn way(&self) -> Vec<(f32, [f32; 2])> {
        let start = (0.0, [1.4, -self.at("ego.offset")]);
        let point = |ahead_m: f32| {
            let part = |axis: &str| self.at(&format!("route.{ahead_m}m.{axis}"));
            (ahead_m, [part("x"), part("y")])
        };
        std::iter::once(start).chain(AHEAD_M.into_iter().map(point)).collect()
    }

    /// Ten columns of everybody who is there.
    fn partners(&self) -> impl Iterator<Item = &[f32]> {
        let first = self.names.iter().position(|name| name == "partners.0.is_vehicle").unwrap();
        self.values[first..].chunks_exact(10).filter(|partner| partner[0] + partner[1] > 0.0)
    }
}

impl Planner {
    pub(crate) fn act(&self, spec: &Spec, observations: &[f32]) -> Vec<f32> {
        let columns = spec.observation.columns();
        let names: Vec<String> = columns.into_iter().map(|column| column.name).collect();
        let rows = observations.chunks_exact(names.len());
        rows.flat_map(|values| self.drive(&Row { names: &names, values })).collect()
    }

    fn drive(&self, row: &Row<'_>) -> [f32; 2] {
        let (way, speed_mps) = (row.way(), row.at("ego.speed"));
        let most_mps = self.most_mps(row);
        let choices = self.beside_m.iter().flat_map(|beside_m| {
            SPEEDS_MPS.iter().map(move |wanted_mps| (*beside_m, wanted_mps.min(most_mps)))
        });
        // Beside its way only for a gain worth having.
        let worth = |(beside_m, wanted_mps): &(f32, f32)| wanted_mps - 0.5 * beside_m.abs();
        // Beyond a goal to stop at it meets nobody.
        let end_m = if self.stops { row.at("goal.distance") } else { f32::INFINITY };
        let free = choices.filter(|choice| is_free(row, &way, *choice, end_m));
        let best = free.max_by(|a, b| worth(a).total_cmp(&worth(b)));
        let (beside_m, wanted_mps) = best.unwrap_or((row.at("ego.offset"), 0.0));
        let reach_m = (0.5 * speed_mps).clamp(4.5, 11.0);
        let ([x_m, y_m], [cos, sin]) = along(&way, reach_m);
        let (x_m, y_m) = (x_m - sin * beside_m, y_m + cos * beside_m);
        let angle_rad = (2.0 * WHEELBASE_M * y_m / (x_m * x_m + y_m * y_m).max(9.0)).atan();
        [angle_rad / LOCK_RAD, (wanted_mps - speed_mps).clamp(-1.0, 1.0)]
    }

    /// As fast as bends, the limit and a goal to stop at allow.
    fn most_mps(&self, row: &Row<'_>) -> f32 {
        let bend = |ahead_m: &f32| {
            let curvature = row.at(&format!("route.{ahead_m}m.curvature")).abs().max(1.0e-3);
            (BEND_MPS2 / curvature + 2.0 * 1.5 * (ahead_m - 4.0).max(0.0)).sqrt()
        };
        let bends_mps = AHEAD_M.iter().map(bend).fold(f32::INFINITY, f32::min);
        let limit_mps = Some(row.at("ego.limit")).filter(|limit| *limit > 0.0).unwrap_or(14.0);
        let goal_m = (row.at("goal.distance") - 0.3).max(0.0);
        let goal_mps = if self.stops { (2.0 * goal_m).sqrt() } else { f32::INFINITY };
        bends_mps.min(limit_mps).min(goal_mps)
    }
}

/// A place on the way, and its direction.
fn along(way: &[(f32, [f32; 2])], at_m: f32) -> Pose {
    let last = way.len() - 2;
    let index = way.iter().rposition(|(from_m, _)| *from_m <= at_m).unwrap_or(0).min(last);
    let ((from_m, from), (to_m, to)) = (way[index], way[index + 1]);
    let share = (at_m - from_m) / (to_m - from_m);
    let (x, y) = (to[0] - from[0], to[1] - from[1]);
    let length_m = x.hypot(y);
    // The way ends at its goal: points beyond are all there.
    let ahead = if length_m > 0.1 { [x / length_m, y / length_m] } else { [1.0, 0.0] };
    ([from[0] + share * x, from[1] + share * y], ahead)
}

fn is_free(
    row: &Row<'_>,
    way: &[(f32, [f32; 2])],
    (beside_m, wanted_mps): (f32, f32),
    end_m: f32,
) -> bool {
    let offset_m = row.at("ego.offset");
    let (mut speed_mps, mut at_m, mut secs) = (row.at("ego.speed").max(0.0), 0.0, 0.0);
    let partners: Vec<&[f32]> = row.partners().filter(|partner| !follows(partner)).collect();
    while secs < AHEAD_SECS {
        let (at, [cos, sin]) = along(way, at_m);
        let share = (at_m / ASIDE_OVER_M).min(1.0);
        let left_m = offset_m + (beside_m - offset_m) * share;
        for disc_m in DISCS_M {
            let back_m = disc_m - DISCS_M[1];
            let x_m = at[0] + cos * back_m - sin * left_m;
            let y_m = at[1] + sin * back_m + cos * left_m;
            if partners.iter().any(|partner| meets(partner, secs, [x_m, y_m])) {
                return false;
            }
        }
        let change =
            (wanted_mps - speed_mps).clamp(-BRAKE_MPS2 * STEP_SECS, SPEED_UP_MPS2 * STEP_SECS);
        speed_mps += change;
        at_m = (at_m + speed_mps * STEP_SECS).min(end_m);
        secs += STEP_SECS;
        // Who stands does not move into anybody's way.
        if speed_mps <= 0.01 {
            return true;
        }
    }
    true
}

/// Whether somebody drives behind in the same direction, who looks out for itself.
fn follows(partner: &[f32]) -> bool {
    partner[2] < -1.0 && partner[6] > 0.7 && partner[3].abs() < 2.0
}

fn meets(partner: &[f32], secs: f32, [x_m, y_m]: [f32; 2]) -> bool {
    let (cos, sin) = (partner[6], partner[7]);
    let (x_m, y_m) = (x_m - partner[2] - partner[4] * secs, y_m - partner[3] - partner[5] * secs);
    let (along_m, left_m) = ((x_m * cos + y_m * sin).abs(), (y_m * cos - x_m * sin).abs());
    let walks = partner[1] > 0.0;
    // Whoever moves is not exactly where it would be.
    let room_m =
        ROOM_M + if walks { 0.8 } else { 0.12 * secs * partner[4].hypot(partner[5]).min(4.0) };
    let beyond = [(along_m - partner[8] / 2.0).max(0.0), (left_m - partner[9] / 2.0).max(0.0)];
    let lateral_m = if walks { room_m } else { ROOM_M };
    let is_parked = !walks && partner[4].hypot(partner[5]) < 0.1;
    let (room_m, lateral_m) = if is_parked { (0.1, 0.1) } else { (room_m, lateral_m) };
    beyond[0] < DISC_M + room_m && beyond[1] < DISC_M + lateral_m
}

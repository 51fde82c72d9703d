//! Reference lines made of lines and arcs, without kinks.

use std::f64::consts::{PI, TAU};

use super::draft::Piece;

/// Shorter pieces are left out, in metres; the gap is below what lane ends may differ by.
const PIECE_MIN_M: f64 = 0.01;
/// Directions that differ by less are the same, in radians.
const SAME_RAD: f64 = 1e-7;
/// Ways that turn by less at both ends are lines, in radians: 17 m beside them lanes still meet
/// within a centimetre, and an arc would have a radius of many kilometres, by which CARLA's client,
/// which counts in four bytes, is off by centimetres.
const STRAIGHT_RAD: f64 = 5e-4;

/// A point and a direction.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pose {
    pub(super) at: [f64; 2],
    pub(super) heading_rad: f64,
}

impl Pose {
    pub(super) fn new(at: [f64; 2], heading_rad: f64) -> Self {
        Self { at, heading_rad }
    }

    pub(super) fn ahead(self, distance_m: f64) -> Self {
        let (sin, cos) = self.heading_rad.sin_cos();
        let [x, y] = self.at;
        Self { at: [x + distance_m * cos, y + distance_m * sin], ..self }
    }

    pub(super) fn left(self, distance_m: f64) -> Self {
        let (sin, cos) = self.heading_rad.sin_cos();
        let [x, y] = self.at;
        Self { at: [x - distance_m * sin, y + distance_m * cos], ..self }
    }

    pub(super) fn turned(self, angle_rad: f64) -> Self {
        Self { heading_rad: self.heading_rad + angle_rad, ..self }
    }

    pub(super) fn reversed(self) -> Self {
        self.turned(PI)
    }

    /// Another point seen from here: how far ahead, how far to the left.
    pub(super) fn local(self, [x, y]: [f64; 2]) -> [f64; 2] {
        let (sin, cos) = self.heading_rad.sin_cos();
        let (dx, dy) = (x - self.at[0], y - self.at[1]);
        [dx * cos + dy * sin, dy * cos - dx * sin]
    }
}

/// A corner of a polyline, rounded off.
#[derive(Clone, Copy, Debug)]
pub(super) struct Bend {
    pub(super) at: [f64; 2],
    pub(super) radius_m: f64,
}

impl Piece {
    pub(super) fn pose(&self) -> Pose {
        Pose::new([self.x, self.y], self.heading_rad)
    }

    /// Where the line is after `distance_m` of it.
    pub(super) fn pose_at(&self, distance_m: f64) -> Pose {
        let turn_rad = self.curvature * distance_m;
        if turn_rad == 0.0 {
            return self.pose().ahead(distance_m);
        }
        let chord_m = 2.0 * (turn_rad / 2.0).sin() / self.curvature;
        self.pose().turned(turn_rad / 2.0).ahead(chord_m).turned(turn_rad / 2.0)
    }

    /// A point seen from the line: how far along it, how far to the left of it.
    pub(super) fn local(&self, at: [f64; 2]) -> [f64; 2] {
        let [ahead_m, left_m] = self.pose().local(at);
        if self.curvature == 0.0 {
            return [ahead_m, left_m];
        }
        let (radius_m, side) = (1.0 / self.curvature, self.curvature.signum());
        // From the middle of the circle; the line begins where the angle is 0.
        let across_m = radius_m - left_m;
        let turn_rad = ahead_m.atan2(across_m * side).rem_euclid(TAU);
        [turn_rad * radius_m.abs(), radius_m - side * ahead_m.hypot(across_m)]
    }
}

pub(super) fn length_m(pieces: &[Piece]) -> f64 {
    pieces.iter().map(|piece| piece.length_m).sum()
}

/// From one pose to another past rounded corners.
pub(super) fn course(start: Pose, bends: &[Bend], end: Pose) -> Vec<Piece> {
    let mut pieces = Vec::new();
    let mut from = start;
    for (index, bend) in bends.iter().enumerate() {
        let next = bends.get(index + 1).map_or(end.at, |next| next.at);
        let incoming_rad = direction(from.at, bend.at);
        let turn_rad = signed(direction(bend.at, next) - incoming_rad);
        let tangent_m = bend.radius_m * (turn_rad.abs() / 2.0).tan();
        let corner = Pose::new(bend.at, incoming_rad);
        let (arc_start, arc_end) =
            (corner.ahead(-tangent_m), corner.turned(turn_rad).ahead(tangent_m));
        pieces.extend(join(from, arc_start));
        pieces.extend(join(arc_start, arc_end));
        from = arc_end;
    }
    pieces.extend(join(from, end));
    pieces
}

/// From one pose to another: a line; or an arc with a line before or after it; or two arcs.
pub(super) fn join(start: Pose, end: Pose) -> Vec<Piece> {
    let [ahead_m, left_m] = start.local(end.at);
    let turn_rad = signed(end.heading_rad - start.heading_rad);
    if turn_rad.abs() < SAME_RAD && left_m.abs() < 1e-6 {
        return kept([line(start, ahead_m)]);
    }
    let direct = Pose::new(start.at, direction(start.at, end.at));
    let is_along = |pose: Pose| signed(pose.heading_rad - direct.heading_rad).abs() < STRAIGHT_RAD;
    if is_along(start) && is_along(end) {
        return kept([line(direct, distance_m(start.at, end.at))]);
    }
    // Both tangents meet in a corner; the arc takes the shorter of them whole.
    let after_m = left_m / turn_rad.sin();
    let before_m = ahead_m - after_m * turn_rad.cos();
    if turn_rad.abs() > SAME_RAD && before_m > 0.0 && after_m > 0.0 {
        let tangent_m = before_m.min(after_m);
        let radius_m = tangent_m / (turn_rad.abs() / 2.0).tan();
        let arc_start = start.ahead(before_m - tangent_m);
        let arc = Piece {
            length_m: radius_m * turn_rad.abs(),
            curvature: turn_rad.signum() / radius_m,
            ..line(arc_start, 0.0)
        };
        let rest_m = after_m - tangent_m;
        return kept([line(start, before_m - tangent_m), arc, line(end.ahead(-rest_m), rest_m)]);
    }
    biarc(start, end)
}

/// Two arcs with a common tangent where they meet, as long as each other's tangents.
fn biarc(start: Pose, end: Pose) -> Vec<Piece> {
    let unit = |pose: Pose| [pose.heading_rad.cos(), pose.heading_rad.sin()];
    let dot = |a: [f64; 2], b: [f64; 2]| a[0] * b[0] + a[1] * b[1];
    let (t1, t2) = (unit(start), unit(end));
    let v = [end.at[0] - start.at[0], end.at[1] - start.at[1]];
    let (vt, vv) = (dot(v, [t1[0] + t2[0], t1[1] + t2[1]]), dot(v, v));
    let a = 2.0 * (1.0 - dot(t1, t2));
    let tangent_m = if a < 1e-12 { vv / (2.0 * vt) } else { (-vt + (vt * vt + a * vv).sqrt()) / a };
    let middle = [0, 1].map(|k| (start.at[k] + end.at[k] + tangent_m * (t1[k] - t2[k])) / 2.0);
    let first = arc_to(start, middle);
    let joint = first.pose_at(first.length_m);
    kept([first, arc_to(joint, end.at)])
}

/// The arc that leaves a pose and passes through a point.
fn arc_to(start: Pose, to: [f64; 2]) -> Piece {
    let [ahead_m, left_m] = start.local(to);
    let chord_m = ahead_m.hypot(left_m);
    let half_rad = left_m.atan2(ahead_m);
    let curvature = 2.0 * half_rad.sin() / chord_m;
    if curvature.abs() < 1e-9 {
        return line(start, chord_m);
    }
    Piece { length_m: 2.0 * half_rad / curvature, curvature, ..line(start, 0.0) }
}

pub(super) fn line(start: Pose, length_m: f64) -> Piece {
    Piece {
        x: start.at[0],
        y: start.at[1],
        heading_rad: signed(start.heading_rad),
        length_m,
        curvature: 0.0,
    }
}

fn kept<const N: usize>(pieces: [Piece; N]) -> Vec<Piece> {
    pieces.into_iter().filter(|piece| piece.length_m > PIECE_MIN_M).collect()
}

pub(super) fn direction(from: [f64; 2], to: [f64; 2]) -> f64 {
    (to[1] - from[1]).atan2(to[0] - from[0])
}

pub(super) fn distance_m(from: [f64; 2], to: [f64; 2]) -> f64 {
    (to[0] - from[0]).hypot(to[1] - from[1])
}

/// An angle brought into the half-open range from -π (excluded) to π.
pub(super) fn signed(angle_rad: f64) -> f64 {
    PI - (PI - angle_rad).rem_euclid(TAU)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ends_at(start: Pose, end: Pose) {
        let mut at = start;
        for piece in join(start, end) {
            assert!(distance_m(at.at, piece.pose().at) < 0.011, "{piece:?} after {at:?}");
            assert!(signed(at.heading_rad - piece.heading_rad).abs() < 1e-6);
            at = piece.pose_at(piece.length_m);
        }
        assert!(distance_m(at.at, end.at) < 0.011, "{at:?} for {end:?}");
        assert!(signed(at.heading_rad - end.heading_rad).abs() < 1e-6, "{at:?} for {end:?}");
    }

    #[test]
    fn a_join_leaves_and_arrives_in_the_given_directions() {
        let start = Pose::new([3.0, -2.0], 0.4);
        ends_at(start, start.ahead(50.0));
        ends_at(start, start.ahead(50.0).left(3.5));
        ends_at(start, start.ahead(40.0).left(-20.0).turned(-PI / 2.0));
        ends_at(start, start.ahead(20.0).left(20.0).turned(PI / 2.0));
        ends_at(start, start.ahead(60.0).left(12.0).turned(-0.2));
        ends_at(start, start.left(30.0).turned(PI));
    }

    #[test]
    fn a_point_beside_a_bend_is_found_again() {
        for curvature in [0.0, 0.02, -0.03] {
            let piece =
                Piece { length_m: 60.0, curvature, ..line(Pose::new([3.0, -2.0], 0.4), 0.0) };
            for (along_m, left_m) in [(0.5, 4.0), (30.0, -7.0), (59.0, 20.0)] {
                let [s, t] = piece.local(piece.pose_at(along_m).left(left_m).at);
                assert!((s - along_m).abs() < 1e-9 && (t - left_m).abs() < 1e-9, "{s} {t}");
            }
        }
    }
}

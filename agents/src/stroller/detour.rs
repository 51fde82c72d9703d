//! The way around what stands on the sidewalk.

use nalgebra::{ComplexField, Point3};
use roads::nav::{Area, NavMesh};
use schemas::{Pose, Vec3, level_pose};

use crate::scene::Body;

/// How far ahead obstacles count, and how densely the way there is tried.
const AHEAD_M: f32 = 2.1;
const STEP_M: f32 = 0.3;
/// Room between a walker's middle and an obstacle.
const CLEAR_M: f32 = 0.45;
/// Who is nearer already may stay as near, but for this.
const TOUCH_M: f32 = 0.02;
/// Turns that are tried, each to both sides.
const TURN_RAD: f32 = 0.26;
const TURNS: i32 = 8;
/// Steps lower than this are climbed, and a walker passes under what is higher than it.
const CLIMB_M: f32 = 0.3;
const TALL_M: f32 = 1.9;
/// Nobody leaves the mesh by more than this.
const OFF_MESH_M: f32 = 0.2;

/// A box that nobody walks through.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Obstacle {
    /// Origin in the box's middle.
    pub world_from_box: Pose,
    /// Half its size along its own axes.
    pub half_m: Vec3,
}

/// The side on which a walker goes around what is in its way: it does not change its mind.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub(super) enum Side {
    #[default]
    None,
    Left,
    Right,
}

impl Obstacle {
    /// The box of a body on the road.
    pub(super) fn of(body: &Body) -> Self {
        let heading_rad = nalgebra::RealField::atan2(body.forward.y, body.forward.x);
        Self { world_from_box: level_pose(body.centre_m, heading_rad), half_m: body.half_m }
    }

    /// Whether somebody who stands at a height would have to go around it.
    pub(super) fn is_in_the_way(&self, foot_m: f32) -> bool {
        let up = self.world_from_box.rotation.inverse() * Vec3::z();
        let reach_m = up.abs().dot(&self.half_m);
        let middle_m = self.world_from_box.translation.z - foot_m;
        middle_m + reach_m > CLIMB_M && middle_m - reach_m < TALL_M
    }

    /// Distance from a place, seen from above; 0 inside.
    fn away_m(&self, place_m: &Vec3) -> f32 {
        let offset_m = place_m - self.world_from_box.translation.vector;
        let own = self.world_from_box.rotation.inverse() * Vec3::new(offset_m.x, offset_m.y, 0.0);
        let beyond = (own.abs() - self.half_m).map(|beyond_m| beyond_m.max(0.0));
        beyond.xy().norm()
    }
}

/// The free direction that is nearest to the wanted one, and the side it lies on; the wanted one
/// where none is free.
pub(super) fn detour(
    mesh: &NavMesh,
    obstacles: &[Obstacle],
    foot_m: &Vec3,
    way: &Vec3,
    side: Side,
) -> (Vec3, Side) {
    let Some(wanted) = way.try_normalize(1.0e-3) else { return (*way, Side::None) };
    let ahead_m = way.norm().min(AHEAD_M);
    if is_free(obstacles, foot_m, &wanted, ahead_m) {
        return (wanted, Side::None);
    }
    // On the mesh if possible; on the road beside it only where the sidewalk is blocked.
    for may_leave in [false, true] {
        for turn in 1..=TURNS {
            for (sign, to) in [(-1.0, Side::Right), (1.0, Side::Left)] {
                let other_side = side != Side::None && side != to;
                let direction = turned(&wanted, sign * TURN_RAD * turn as f32);
                let place_m = foot_m + direction * ahead_m.min(1.0);
                let stays = may_leave || is_walkable(mesh, &place_m);
                if !other_side && stays && is_free(obstacles, foot_m, &direction, ahead_m) {
                    return (direction, to);
                }
            }
        }
    }
    (wanted, Side::None)
}

fn is_free(obstacles: &[Obstacle], foot_m: &Vec3, direction: &Vec3, ahead_m: f32) -> bool {
    obstacles.iter().all(|obstacle| {
        let clear_m = CLEAR_M.min(obstacle.away_m(foot_m) - TOUCH_M);
        let steps = (ahead_m / STEP_M).ceil().max(1.0) as i32;
        (1..=steps).all(|step| {
            let place_m = foot_m + direction * (step as f32 * STEP_M);
            obstacle.away_m(&place_m) >= clear_m
        })
    })
}

fn is_walkable(mesh: &NavMesh, place_m: &Vec3) -> bool {
    let point: Point3<f64> = nalgebra::convert(Point3::from(*place_m));
    mesh.nearest(point).is_some_and(|(polygon, nearest)| {
        let area = mesh.polygons().get(polygon as usize).map(|polygon| polygon.area);
        let away_m = (nearest - point).xy().norm() as f32;
        area != Some(Area::Road) && away_m < OFF_MESH_M
    })
}

fn turned(direction: &Vec3, turn_rad: f32) -> Vec3 {
    let (sin, cos) = (ComplexField::sin(turn_rad), ComplexField::cos(turn_rad));
    Vec3::new(direction.x * cos - direction.y * sin, direction.x * sin + direction.y * cos, 0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pole(x_m: f32, y_m: f32) -> Obstacle {
        let world_from_box = schemas::level_pose(Vec3::new(x_m, y_m, 1.0), 0.0);
        Obstacle { world_from_box, half_m: Vec3::new(0.1, 0.1, 1.0) }
    }

    #[test]
    fn a_walker_gets_past_a_pole_on_its_way() {
        let mesh = NavMesh::default();
        let obstacles = [pole(3.0, 0.0)];
        let (mut foot_m, mut side) = (Vec3::zeros(), Side::None);
        for _ in 0..100 {
            let way = Vec3::new(6.0, 0.0, 0.0) - foot_m;
            let (direction, to) = detour(&mesh, &obstacles, &foot_m, &way, side);
            side = to;
            foot_m += direction * 0.07;
            assert!(obstacles[0].away_m(&foot_m) > 0.3, "{foot_m}");
        }
        assert!(foot_m.x > 5.5, "{foot_m}");
    }

    #[test]
    fn what_is_low_or_high_is_not_in_the_way() {
        let mut beam = pole(0.0, 0.0);
        assert!(beam.is_in_the_way(0.0));
        beam.world_from_box.translation.z = 4.0;
        assert!(!beam.is_in_the_way(0.0));
        beam.world_from_box.translation.z = -0.8;
        assert!(!beam.is_in_the_way(0.0));
    }
}

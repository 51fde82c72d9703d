//! A ball that moves along a line until it touches something.

use schemas::{ActorId, Vec3};

use super::RayScene;
use super::bounds::Bounds;
use super::ray::Ray;
use super::triangle;

/// The ball counts as touching when its surface is this near.
const TOUCH_M: f32 = 1.0e-4;
/// Steps of the search for the moment of touch; it doubles its correct digits in each.
const STEPS_MAX: usize = 32;

/// What a moving ball touched first.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Touch {
    /// How far the ball moved.
    pub distance_m: f32,
    /// CARLA's semantic tag.
    pub tag: u8,
    /// `None` for ground and scenery.
    pub actor: Option<ActorId>,
}

/// A ball that moves.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sweep {
    pub ray: Ray,
    pub radius_m: f32,
    pub reach_m: f32,
}

impl RayScene<'_> {
    /// What a ball touches first, ground and scenery only if `with_map`. Never crowns of trees, nor
    /// the actor `except`.
    pub(crate) fn sweep(
        &self,
        sweep: &Sweep,
        with_map: bool,
        except: Option<ActorId>,
    ) -> Option<Touch> {
        let mut nearest: Option<Touch> = None;
        let mut consider = |touch: Touch| {
            // Of things equally far the one with the smallest id, then the map.
            let key = |touch: &Touch| order(touch.actor);
            let is_first = nearest.is_none_or(|nearest| {
                let order = touch.distance_m.total_cmp(&nearest.distance_m);
                order.then(key(&touch).cmp(&key(&nearest))).is_lt()
            });
            if touch.distance_m <= sweep.reach_m && is_first {
                nearest = Some(touch);
            }
        };
        let bounds = sweep.bounds();
        self.actors.triangles_near(&bounds, except, |id, tag, corners| {
            let distance_m = sweep.touches(|point_m| Some(triangle::closest_m(corners, point_m)));
            let touch = |distance_m| Touch { distance_m, tag, actor: Some(id) };
            distance_m.map(touch).into_iter().for_each(&mut consider);
        });
        if with_map {
            self.town.ground().triangles_near(&bounds, |corners, tag| {
                let distance_m =
                    sweep.touches(|point_m| Some(triangle::closest_m(corners, point_m)));
                let touch = |distance_m| Touch { distance_m, tag, actor: None };
                distance_m.map(touch).into_iter().for_each(&mut consider);
            });
            self.town.scenery().overlapping(&bounds, self.hidden, |solid| {
                let distance_m = sweep.touches(|point_m| solid.closest_m(point_m));
                let touch = |distance_m| Touch { distance_m, tag: solid.tag, actor: None };
                distance_m.map(touch).into_iter().for_each(&mut consider);
            });
        }
        nearest
    }
}

fn order(actor: Option<ActorId>) -> u32 {
    actor.map_or(u32::MAX, ActorId::get)
}

impl Sweep {
    fn bounds(&self) -> Bounds {
        Bounds::around([self.ray.origin_m, self.ray.at(self.reach_m)]).grown(self.radius_m)
    }

    /// How far the ball moves until it touches a convex shape, of which the point closest to
    /// another one is known.
    ///
    /// The distance from a point of a line to a convex shape is a convex function along the line,
    /// so Newton's method from the near end never steps beyond the touch, and once the distance
    /// does not fall any more there is none.
    fn touches(&self, closest_m: impl Fn(Vec3) -> Option<Vec3>) -> Option<f32> {
        let mut moved_m = 0.0;
        for _ in 0..STEPS_MAX {
            let centre_m = self.ray.at(moved_m);
            let out_m: Vec3 = centre_m - closest_m(centre_m)?;
            let distance_m = out_m.norm();
            let gap_m = distance_m - self.radius_m;
            if gap_m <= TOUCH_M {
                return Some(moved_m);
            }
            let approach = -out_m.dot(&self.ray.direction) / distance_m;
            if approach <= 0.0 {
                return None;
            }
            moved_m += gap_m / approach;
            if moved_m > self.reach_m {
                return None;
            }
        }
        Some(moved_m)
    }
}

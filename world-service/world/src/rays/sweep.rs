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
        let mut nearest: Option<(Meeting, Touch)> = None;
        let mut consider = |meeting: Option<Meeting>, tag: u8, actor: Option<ActorId>| {
            let Some(meeting) = meeting.filter(|meeting| meeting.moved_m <= sweep.reach_m) else {
                return;
            };
            // Of things equally far the one deepest in the ball, then of the smallest id.
            let is_first = nearest.is_none_or(|(other, touch)| {
                let by_way = other.moved_m.total_cmp(&meeting.moved_m);
                let by_depth = other.apart_m.total_cmp(&meeting.apart_m);
                by_way.then(by_depth).then(order(touch.actor).cmp(&order(actor))).is_gt()
            });
            if is_first {
                nearest = Some((meeting, Touch { distance_m: meeting.moved_m, tag, actor }));
            }
        };
        let bounds = sweep.bounds();
        let of_triangle =
            |corners| sweep.meets(|point_m| Some(triangle::closest_m(corners, point_m)));
        self.actors.triangles_near(&bounds, except, |id, tag, corners| {
            consider(of_triangle(corners), tag, Some(id));
        });
        if with_map {
            self.town.ground().triangles_near(&bounds, |corners, tag| {
                consider(of_triangle(corners), tag, None);
            });
            self.town.scenery().overlapping(&bounds, self.hidden, |solid| {
                consider(sweep.meets(|point_m| solid.closest_m(point_m)), solid.tag, None);
            });
        }
        nearest.map(|(_, touch)| touch)
    }
}

/// Where a ball meets a shape.
#[derive(Clone, Copy, Debug)]
struct Meeting {
    /// How far it moved until then.
    moved_m: f32,
    /// From its centre to the shape: its radius, or less where it begins in the shape.
    apart_m: f32,
}

fn order(actor: Option<ActorId>) -> u32 {
    actor.map_or(u32::MAX, ActorId::get)
}

impl Sweep {
    fn bounds(&self) -> Bounds {
        Bounds::around([self.ray.origin_m, self.ray.at(self.reach_m)]).grown(self.radius_m)
    }

    /// Where the ball touches a convex shape, of which the point closest to another one is known.
    ///
    /// The distance from a point of a line to a convex shape is a convex function along the line,
    /// so Newton's method from the near end never steps beyond the touch, and once the distance
    /// does not fall any more there is none.
    fn meets(&self, closest_m: impl Fn(Vec3) -> Option<Vec3>) -> Option<Meeting> {
        let (mut moved_m, mut apart_m) = (0.0, self.radius_m);
        for _ in 0..STEPS_MAX {
            let centre_m = self.ray.at(moved_m);
            let out_m: Vec3 = centre_m - closest_m(centre_m)?;
            apart_m = out_m.norm();
            let gap_m = apart_m - self.radius_m;
            if gap_m <= TOUCH_M {
                break;
            }
            let approach = -out_m.dot(&self.ray.direction) / apart_m;
            if approach <= 0.0 {
                return None;
            }
            moved_m += gap_m / approach;
            if moved_m > self.reach_m {
                return None;
            }
        }
        Some(Meeting { moved_m, apart_m })
    }
}

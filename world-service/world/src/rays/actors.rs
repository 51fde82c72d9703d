//! Actors as rays meet them: with the triangles and the places that pictures show, at their finest.

use std::cell::OnceCell;
use std::sync::OnceLock;

use bodies::{Placed, Shape};
use nalgebra::{Matrix3, Point3};
use schemas::{ActorId, ActorState, PosedLimb, Vec3, WalkerPose, skeleton};

use super::bounds::Bounds;
use super::bvh::{Bvh, PacketStack, Stack};
use super::mesh::{Face, Mesh};
use super::packet::{Mask, Nearest, Packet, RAYS, each};
use super::ray::{Hit, Ray};

/// Actors at one moment. The parts of each are put in place when the first ray comes near it.
#[derive(Debug)]
pub(crate) struct Actors {
    actors: Vec<Actor>,
    sim_secs: f64,
    bvh: Bvh,
}

#[derive(Debug)]
struct Actor {
    state: ActorState,
    type_id: &'static str,
    /// Where somebody put them; none of an actor that moves its own.
    limbs: Vec<PosedLimb>,
    parts: OnceCell<Parts>,
}

/// What an actor is put together from.
#[derive(Debug)]
struct Parts {
    parts: Vec<Part>,
    bvh: Bvh,
}

/// A shape at its place, stretched and turned.
#[derive(Debug)]
struct Part {
    mesh: &'static Mesh,
    at_m: Vec3,
    world_from_shape: Matrix3<f32>,
    shape_from_world: Matrix3<f32>,
    /// CARLA's semantic tag.
    tag: u8,
}

/// The triangles of a shape: shared by all worlds of the process, and built when a ray first comes
/// near one.
fn mesh_of(shape: Shape) -> &'static Mesh {
    static MESHES: [OnceLock<Mesh>; Shape::ALL.len()] =
        [const { OnceLock::new() }; Shape::ALL.len()];
    MESHES[shape as usize].get_or_init(|| {
        let mesh = shape.mesh();
        let corner = |index: u32| Vec3::from(mesh.vertices[index as usize].position);
        let (triangles, _) = mesh.indices.as_chunks::<3>();
        let face = |triangle: &[u32; 3]| Face { corners: triangle.map(corner), tag: 0 };
        Mesh::met_from_outside(&triangles.iter().map(face).collect::<Vec<_>>())
    })
}

impl Actors {
    /// Those that are shown, each with the id of its type; `pose_of` tells how somebody posed a
    /// walker.
    pub(crate) fn new<'a>(
        states: impl Iterator<Item = (ActorState, &'static str)>,
        pose_of: impl Fn(ActorId) -> Option<&'a WalkerPose>,
        sim_secs: f64,
    ) -> Self {
        let shown = states.filter(|(state, _)| bodies::is_shown(state));
        let actor = |(state, type_id): (ActorState, &'static str)| {
            let limbs = skeleton::limbs(&state, pose_of(state.id));
            Actor { state, type_id, limbs, parts: OnceCell::new() }
        };
        let actors: Vec<Actor> = shown.map(actor).collect();
        let bounds: Vec<Bounds> = actors.iter().map(Actor::bounds).collect();
        let bvh = Bvh::new(&bounds, 1, |items| items.first().copied().unwrap_or(0));
        Self { actors, sim_secs, bvh }
    }

    /// The nearest triangle within `reach_m`, seen from outside.
    pub(crate) fn nearest(&self, ray: &Ray, reach_m: f32, stack: &mut Stack) -> Option<Hit> {
        let mut nearest: Option<Hit> = None;
        self.bvh.walk(ray, reach_m, stack, |actor, reach_m, stack| {
            let actor = &self.actors[actor as usize];
            let Parts { parts, bvh } = actor.parts(self.sim_secs);
            let mut reach_m = reach_m;
            bvh.walk(ray, reach_m, stack, |part, part_reach_m, stack| {
                let hit = parts[part as usize].nearest(ray, part_reach_m, stack);
                if let Some(hit) = hit {
                    reach_m = hit.distance_m;
                    nearest = Some(Hit { actor: Some(actor.state.id), ..hit });
                }
                reach_m
            });
            reach_m
        });
        nearest
    }

    /// What the rays of a packet meet nearer than what they met before.
    pub(crate) fn nearest_of(
        &self,
        packet: &Packet,
        nearest: &mut Nearest,
        stack: &mut PacketStack,
    ) {
        self.bvh.walk_packet(packet, nearest, stack, |actor, _, nearest, stack| {
            let actor = &self.actors[actor as usize];
            let Parts { parts, bvh } = actor.parts(self.sim_secs);
            bvh.walk_packet(packet, nearest, stack, |part, mask, nearest, stack| {
                let part = &parts[part as usize];
                part.nearest_of(packet, mask, actor.state.id, nearest, stack);
            });
        });
    }

    /// Adds every triangle within `reach_m` that is seen from outside to `hits`.
    pub(crate) fn all(&self, ray: &Ray, reach_m: f32, stack: &mut Stack, hits: &mut Vec<Hit>) {
        self.bvh.walk(ray, reach_m, stack, |actor, _, stack| {
            let actor = &self.actors[actor as usize];
            let Parts { parts, bvh } = actor.parts(self.sim_secs);
            let first = hits.len();
            bvh.walk(ray, reach_m, stack, |part, _, stack| {
                parts[part as usize].all(ray, reach_m, stack, hits);
                reach_m
            });
            hits[first..].iter_mut().for_each(|hit| hit.actor = Some(actor.state.id));
            reach_m
        });
    }

    /// Visits the triangles near a box, but those of the actor `except`: whose, its tag, and the
    /// corners in the world.
    pub(crate) fn triangles_near(
        &self,
        bounds: &Bounds,
        except: Option<ActorId>,
        mut visit: impl FnMut(ActorId, u8, [Vec3; 3]),
    ) {
        self.bvh.overlapping(bounds, |actor| {
            let actor = &self.actors[actor as usize];
            let id = actor.state.id;
            if Some(id) == except {
                return;
            }
            let Parts { parts, bvh } = actor.parts(self.sim_secs);
            bvh.overlapping(bounds, |part| {
                let part = &parts[part as usize];
                part.mesh.triangles_near(&part.in_shape(bounds), |corners, _| {
                    visit(id, part.tag, corners.map(|corner| part.in_world_m(corner)));
                });
            });
        });
    }
}

impl Actor {
    /// Around all of its parts, wherever they are, world frame.
    fn bounds(&self) -> Bounds {
        let [low_m, high_m] = bodies::bounds(&self.state, &self.limbs);
        let pose = &self.state.world_from_actor;
        let centre_m = (pose * Point3::from((low_m + high_m) / 2.0)).coords;
        let turn = pose.rotation.to_rotation_matrix().into_inner();
        let reach_m = turn.abs() * ((high_m - low_m) / 2.0);
        Bounds { low_m: centre_m - reach_m, high_m: centre_m + reach_m }
    }

    fn parts(&self, sim_secs: f64) -> &Parts {
        self.parts.get_or_init(|| {
            let placed = bodies::place(&self.state, self.type_id, sim_secs, &self.limbs);
            let parts: Vec<Part> = placed.parts.iter().filter_map(Part::new).collect();
            let bounds: Vec<Bounds> = parts.iter().map(Part::bounds).collect();
            let bvh = Bvh::new(&bounds, 1, |items| items.first().copied().unwrap_or(0));
            Parts { parts, bvh }
        })
    }
}

impl Part {
    /// `None` for what has no volume.
    fn new(placed: &Placed) -> Option<Self> {
        let [x, y, z] = placed.instance.world_from_shape;
        let world_from_shape = Matrix3::new(x[0], x[1], x[2], y[0], y[1], y[2], z[0], z[1], z[2]);
        let [tag, ..] = placed.instance.label.to_le_bytes();
        Some(Self {
            mesh: mesh_of(placed.shape),
            at_m: Vec3::new(x[3], y[3], z[3]),
            world_from_shape,
            shape_from_world: world_from_shape.try_inverse()?,
            tag,
        })
    }

    /// World frame.
    fn bounds(&self) -> Bounds {
        let own = self.mesh.bounds();
        let centre_m = self.in_world_m(own.centre_m());
        let reach_m = self.world_from_shape.abs() * ((own.high_m - own.low_m) / 2.0);
        Bounds { low_m: centre_m - reach_m, high_m: centre_m + reach_m }
    }

    fn in_world_m(&self, point: Vec3) -> Vec3 {
        self.at_m + self.world_from_shape * point
    }

    /// A box around a box of the world.
    fn in_shape(&self, bounds: &Bounds) -> Bounds {
        let centre = self.shape_from_world * (bounds.centre_m() - self.at_m);
        let reach = self.shape_from_world.abs() * ((bounds.high_m - bounds.low_m) / 2.0);
        Bounds { low_m: centre - reach, high_m: centre + reach }
    }

    /// The same ray in the shape's frame: distances along it stay metres.
    fn ray_in_shape(&self, ray: &Ray) -> Ray {
        let origin = self.shape_from_world * (ray.origin_m - self.at_m);
        Ray::new(origin, self.shape_from_world * ray.direction)
    }

    fn nearest(&self, ray: &Ray, reach_m: f32, stack: &mut Stack) -> Option<Hit> {
        let hit = self.mesh.nearest(&self.ray_in_shape(ray), reach_m, stack)?;
        Some(self.in_world(hit))
    }

    /// Of some rays of a packet.
    fn nearest_of(
        &self,
        packet: &Packet,
        mask: Mask,
        actor: ActorId,
        nearest: &mut Nearest,
        stack: &mut PacketStack,
    ) {
        let (mut rays, mut count) = ([0; RAYS], 0);
        for ray in each(mask) {
            rays[count] = ray;
            count += 1;
        }
        let own = Packet::new(count, |at| self.ray_in_shape(packet.ray(rays[at])));
        let mut met = Nearest::new(count, |at| nearest.reach_m(rays[at]));
        self.mesh.nearest_of(&own, &mut met, stack);
        for (at, &ray) in rays.iter().enumerate().take(count) {
            nearest.take(ray, &met, at, |hit| Hit { actor: Some(actor), ..self.in_world(hit) });
        }
    }

    fn all(&self, ray: &Ray, reach_m: f32, stack: &mut Stack, hits: &mut Vec<Hit>) {
        let first = hits.len();
        self.mesh.all(&self.ray_in_shape(ray), reach_m, stack, hits);
        hits[first..].iter_mut().for_each(|hit| *hit = self.in_world(*hit));
    }

    fn in_world(&self, hit: Hit) -> Hit {
        let normal = self.shape_from_world.tr_mul(&hit.normal).normalize();
        Hit { normal, tag: self.tag, ..hit }
    }
}

#[cfg(test)]
mod tests {
    use schemas::{ActorKind, Pose};

    use super::*;

    #[test]
    fn rays_meet_the_outside_of_a_car_and_leave_it_from_within() {
        let half_m = Vec3::new(2.4, 1.0, 0.74);
        let state = ActorState {
            box_centre_m: Vec3::z() * half_m.z,
            box_half_extent_m: half_m,
            ..ActorState::at_rest(
                ActorId::new(7).unwrap(),
                ActorKind::Vehicle,
                0,
                Pose::translation(10.0, 0.0, 0.0),
            )
        };
        let actors = Actors::new(std::iter::once((state, "vehicle.tesla.model3")), |_| None, 0.0);
        let mut stack = Stack::new();
        let mut cast = |x: f32, z: f32, along: f32| {
            let ray = Ray::new(Vec3::new(x, 0.35, z), Vec3::x() * along);
            actors.nearest(&ray, 50.0, &mut stack)
        };
        let front = cast(20.0, 0.6, -1.0).unwrap();
        assert!((front.distance_m - (20.0 - 12.4)).abs() < 0.1, "{front:?}");
        assert!(front.normal.x > 0.5 && (front.normal.norm() - 1.0).abs() < 1.0e-5, "{front:?}");
        assert_eq!((front.tag, front.actor.map(ActorId::get)), (14, Some(7)));
        // From the cabin: lower down are the backs of plate and bumper.
        assert_eq!(cast(10.0, 1.2, 1.0), None);
        assert_eq!(cast(30.0, 0.6, 1.0), None);
        let ray = Ray::new(Vec3::new(20.0, 0.35, 0.6), -Vec3::x());
        assert_eq!(actors.nearest(&ray, 7.0, &mut stack), None);
        assert!(stack.is_empty());
    }
}

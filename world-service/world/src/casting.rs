//! Rays that clients cast, and what of the world they can meet.

use schemas::{ActorId, Error, ErrorCode, RayHit, Vec3, limits};

use crate::actor::Actor;
use crate::check;
use crate::rays::{Actors, Hit, Ray, RayScene, Stack, tag};
use crate::world::{State, World};

/// Hits of one ray, so that a long ray through a city stays a short answer.
const HITS_PER_RAY_MAX: usize = 256;

impl World {
    /// Everything that each ray meets, ordered by ray, then by distance; at most 256 for each ray.
    ///
    /// A ray that begins inside of what bodies touch of an actor meets that actor where it begins.
    ///
    /// - **Frame:** from and to in the world, metres.
    ///
    /// # Errors
    /// `InvalidArgument` for points that are not within the limits, `TooLarge` for too many rays.
    pub fn cast_rays(&self, rays: &[(Vec3, Vec3)]) -> Result<Vec<RayHit>, Error> {
        if rays.len() > limits::RAYS_PER_REQUEST_MAX {
            return Err(Error::new(ErrorCode::TooLarge, "too many rays")
                .wanted(format!("at most {}", limits::RAYS_PER_REQUEST_MAX))
                .found(rays.len()));
        }
        for (from_m, to_m) in rays {
            check::vector("start of a ray", *from_m, limits::COORDINATE_M_MAX, "m")?;
            check::vector("end of a ray", *to_m, limits::COORDINATE_M_MAX, "m")?;
        }
        let actors = self.state.actors_but(&[]);
        let scene = self.ray_scene(&actors);
        let mut stack = Stack::new();
        let hits = rays.iter().zip(0..).flat_map(|(&(from_m, to_m), ray)| {
            let begins_in = self.state.around(from_m);
            let found = between(&scene, from_m, to_m, begins_in, &mut stack);
            found.into_iter().map(move |(hit, position_m)| RayHit {
                ray,
                actor: hit.actor,
                tag: hit.tag,
                position_m,
            })
        });
        Ok(hits.collect())
    }

    fn ray_scene<'a>(&'a self, actors: &'a Actors) -> RayScene<'a> {
        RayScene { town: &self.town.rays, hidden: &self.state.hidden, actors }
    }

    /// What lies first in a direction within `reach_m`; the answer of a ray with one hit.
    ///
    /// - **Frame:** point and direction in the world; the direction of any length but 0.
    ///
    /// # Errors
    /// `InvalidArgument` for a point or reach that is not within the limits, or no direction.
    pub fn project_point(
        &self,
        from_m: Vec3,
        direction: Vec3,
        reach_m: f32,
    ) -> Result<Option<RayHit>, Error> {
        check::vector("point", from_m, limits::COORDINATE_M_MAX, "m")?;
        check::range("reach", reach_m, 0.0, limits::COORDINATE_M_MAX, "m")?;
        let direction = direction.try_normalize(f32::MIN_POSITIVE).ok_or_else(|| {
            Error::new(ErrorCode::InvalidArgument, "a ray without direction")
                .wanted("a vector longer than 0")
                .found(direction)
        })?;
        let actors = self.state.actors_but(&[]);
        let scene = self.ray_scene(&actors);
        let ray = Ray::new(from_m, direction);
        let begins_in = self.state.around(from_m).into_iter().next();
        let hit = begins_in.or_else(|| scene.nearest(&ray, reach_m, &mut Stack::new()));
        Ok(hit.map(|hit| RayHit {
            ray: 0,
            actor: hit.actor,
            tag: hit.tag,
            position_m: ray.at(hit.distance_m),
        }))
    }
}

impl State {
    /// Actors as rays meet them at their present places, but some.
    pub(crate) fn actors_but(&self, ignored: &[ActorId]) -> Actors {
        let seen = self.actors.iter().filter(|actor| !ignored.contains(&actor.id));
        let states = seen.map(|actor| {
            let state = actor.state(&self.motion_of(actor), 0);
            (state, actor.blueprint().id.as_str())
        });
        Actors::new(states, |walker| self.walker_pose(walker), self.sim_secs)
    }

    /// Hits of the actors that a point is in, as a ray from there has them.
    fn around(&self, point_m: Vec3) -> Vec<Hit> {
        let is_around = |actor: &&Actor| {
            actor.body.rigid().is_some_and(|body| self.physics.is_inside(body, point_m))
        };
        let hit = |actor: &Actor| Hit {
            distance_m: 0.0,
            normal: Vec3::zeros(),
            tag: tag::of_actor(actor.blueprint()),
            actor: Some(actor.id),
        };
        self.actors.iter().filter(is_around).map(hit).collect()
    }
}

/// What a ray meets, after what it begins in.
fn between(
    scene: &RayScene,
    from_m: Vec3,
    to_m: Vec3,
    mut begins_in: Vec<Hit>,
    stack: &mut Stack,
) -> Vec<(Hit, Vec3)> {
    let along_m = to_m - from_m;
    let Some(direction) = along_m.try_normalize(f32::MIN_POSITIVE) else { return Vec::new() };
    let ray = Ray::new(from_m, direction);
    let met = scene.all(&ray, along_m.norm(), stack);
    // What stands out of the shape, such as a mirror, is a part of what the ray begins in.
    let begun: Vec<_> = begins_in.iter().map(|hit| hit.actor).collect();
    begins_in.extend(met.into_iter().filter(|hit| !begun.contains(&hit.actor)));
    let hits = begins_in.into_iter().take(HITS_PER_RAY_MAX);
    hits.map(|hit| (hit, ray.at(hit.distance_m))).collect()
}

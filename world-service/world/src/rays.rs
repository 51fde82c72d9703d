//! Rays against the ground, the scenery and what moves.
//!
//! The static part of a town is built once per map and only when the first ray is cast on it; what
//! moves is a small tree of its own, built for each tick in which somebody casts a ray. Actors are
//! met as pictures show them ([`bodies`]), not as they collide.

mod actors;
mod bounds;
mod build;
mod bvh;
mod mesh;
mod ray;
mod shape;
mod sight;
mod solids;
mod sweep;
pub(crate) mod tag;
mod town;
mod triangle;

pub(crate) use actors::Actors;
pub(crate) use bvh::Stack;
pub(crate) use ray::{Hit, Ray};
pub(crate) use sight::Sight;
pub(crate) use sweep::Sweep;
pub(crate) use town::TownRays;

use schemas::HiddenScenery;

/// Everything a ray can meet at one moment.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RayScene<'a> {
    pub town: &'a TownRays,
    /// Of the town.
    pub hidden: &'a HiddenScenery,
    pub actors: &'a Actors,
}

impl RayScene<'_> {
    /// What a ray meets first within `reach_m`.
    ///
    /// - **Cost:** a few hundred nanoseconds in a town with 50 vehicles.
    pub(crate) fn nearest(&self, ray: &Ray, reach_m: f32, stack: &mut Stack) -> Option<Hit> {
        let mut nearest = self.town.ground().nearest(ray, reach_m, stack);
        let reach_of = |nearest: Option<Hit>| nearest.map_or(reach_m, |hit| hit.distance_m);
        let scenery = self.town.scenery();
        nearest = scenery.nearest(ray, reach_of(nearest), self.hidden, stack).or(nearest);
        self.actors.nearest(ray, reach_of(nearest), stack).or(nearest)
    }

    /// Everything a ray enters within `reach_m`, from near to far.
    pub(crate) fn all(&self, ray: &Ray, reach_m: f32, stack: &mut Stack) -> Vec<Hit> {
        let mut hits = Vec::new();
        self.town.ground().all(ray, reach_m, stack, &mut hits);
        self.town.scenery().all(ray, reach_m, self.hidden, stack, &mut hits);
        self.actors.all(ray, reach_m, stack, &mut hits);
        hits.sort_by(|a, b| a.distance_m.total_cmp(&b.distance_m).then(a.actor.cmp(&b.actor)));
        // Faces overlap in junctions, and the parts of one car touch: that is one thing.
        hits.dedup_by(|next, kept| next.is_part_of(kept));
        hits
    }
}

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
mod packet;
mod ray;
mod shape;
mod sight;
mod solids;
mod sweep;
pub(crate) mod tag;
mod town;
mod triangle;

pub(crate) use actors::Actors;
use bvh::PacketStack;
pub(crate) use bvh::Stack;
pub(crate) use packet::{Packet, RAYS};
pub(crate) use ray::{Hit, Ray};
pub(crate) use sight::Sight;
pub(crate) use sweep::Sweep;
pub(crate) use town::TownRays;

use packet::Nearest;
use schemas::HiddenScenery;

/// Kept between packets to save allocations.
#[derive(Debug, Default)]
pub(crate) struct Stacks {
    of_packets: PacketStack,
    pub of_rays: Stack,
}

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

    /// What each ray of a packet meets first within `reach_m`: the same as
    /// [one by one](Self::nearest).
    pub(crate) fn nearest_of(
        &self,
        packet: &Packet,
        reach_m: f32,
        stacks: &mut Stacks,
    ) -> [Option<Hit>; RAYS] {
        let mut nearest = Nearest::within(reach_m, packet);
        let stack = &mut stacks.of_packets;
        self.town.ground().nearest_of(packet, &mut nearest, stack);
        self.town.scenery().nearest_of(packet, &mut nearest, self.hidden, stack);
        self.actors.nearest_of(packet, &mut nearest, stack);
        std::array::from_fn(|ray| {
            let again = || self.nearest(packet.ray(ray), reach_m, &mut stacks.of_rays);
            nearest.hit(ray).unwrap_or_else(again)
        })
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

#[cfg(test)]
mod tests {
    use std::f32::consts::TAU;
    use std::sync::Arc;

    use roads::Map;
    use schemas::{Command, Pose, UnitQuaternion, Vec3, WorldId};

    use super::*;
    use crate::{Town, World, WorldConfig};

    /// A town with a dozen cars and people near the first place to start from, and that place.
    fn busy_town() -> (World, Vec3) {
        let text = roads::town::build("Town02").expect("the town exists");
        let map = Map::parse("Town02", &text).expect("the town is valid");
        let points: Vec<Pose> = map.spawn_points().iter().map(|point| point.cast()).collect();
        let map = Arc::new(Town::new(Arc::new(map)));
        let id = WorldId::new(1).unwrap();
        let mut world =
            World::new(WorldConfig { id, epoch: 1, seed: 1, dt_secs: 0.05, map }).unwrap();
        let eye_m = points[0].translation.vector + Vec3::z() * 2.0;
        let mut near = points;
        near.sort_by(|a, b| {
            let away_m = |pose: &Pose| (pose.translation.vector - eye_m).norm();
            away_m(a).total_cmp(&away_m(b))
        });
        for (at, pose) in near.iter().enumerate().take(24) {
            let types = ["vehicle.lincoln.mkz", "walker.pedestrian.0005", "vehicle.yamaha.yzf"];
            let spawn = Command::spawn(types[at % types.len()], *pose, Vec3::zeros());
            world.apply(&spawn).ok();
        }
        (0..20).for_each(|_| world.tick().unwrap());
        (world, eye_m)
    }

    #[test]
    fn packets_meet_what_their_rays_meet_one_by_one() {
        let (world, eye_m) = busy_town();
        let actors = world.state.actors_but(&[]);
        let scene =
            RayScene { town: &world.town.rays, hidden: &world.state.hidden, actors: &actors };
        let (mut stack, mut stacks) = (Stack::new(), Stacks::default());
        let (mut met, mut at_actors) = (0, 0);
        // Level, and pitched and rolled so that rays of a packet run both ways along each axis.
        for turn in [[0.0, 0.0], [0.2, 0.3], [1.4, -0.1]] {
            let turn = UnitQuaternion::from_euler_angles(turn[0], turn[1], 0.4);
            for (step_rad, count) in [(0.003, RAYS), (0.003, 5), (0.1, RAYS), (1.3, 7)] {
                for row in 0..40u8 {
                    for start in 0..24u8 {
                        let elevation_rad = 0.1 - 0.018 * f32::from(row);
                        let ray = |at: usize| {
                            let azimuth_rad = TAU * f32::from(start) / 24.0 + step_rad * at as f32;
                            let (sin, cos) = azimuth_rad.sin_cos();
                            let along = Vec3::new(cos, sin, elevation_rad.tan()).normalize();
                            Ray::new(eye_m, turn * along)
                        };
                        let packet = Packet::new(count, ray);
                        let hits = scene.nearest_of(&packet, 60.0, &mut stacks);
                        for (at, hit) in hits.into_iter().enumerate().take(count) {
                            let alone = scene.nearest(&ray(at), 60.0, &mut stack);
                            assert_eq!(hit, alone, "{at} of {:?}", ray(at));
                            met += u32::from(hit.is_some());
                            at_actors += u32::from(hit.is_some_and(|hit| hit.actor.is_some()));
                        }
                    }
                }
            }
        }
        assert!(met > 10_000 && at_actors > 1_000, "{met} {at_actors}");
    }
}

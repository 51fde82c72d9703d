//! Putting an actor into the world.

use schemas::{ActorId, ActorKind, Error, ErrorCode, Pose, Vec3, limits};

use crate::actor::{Actor, Vehicle};
use crate::blueprint::{self, Blueprint, BodySpec};
use crate::check;
use crate::overlap::OrientedBox;
use crate::place::{self, Placed};
use crate::scenery::Reach;
use crate::traffic::RoadRules;
use crate::vehicle::VehicleState;
use crate::world::World;

/// Common paints of cars, and of clothes.
const PAINTS_RGB: [u32; 8] = [
    0x00F2_F2F0,
    0x0010_1114,
    0x0085_888C,
    0x00B4_B7BA,
    0x001F_3A68,
    0x008C_1C1F,
    0x0035_4A3C,
    0x00C9_B37E,
];
const CLOTHES_RGB: [u32; 8] = [
    0x0026_3238,
    0x0037_474F,
    0x005D_4037,
    0x0045_5A64,
    0x006D_4C41,
    0x0028_3593,
    0x00AD_1457,
    0x0033_691E,
];

/// A spawn that nothing forbids.
struct Request {
    blueprint_index: u16,
    blueprint: &'static Blueprint,
    placed: Placed,
    linear_mps: Vec3,
}

impl World {
    pub(crate) fn spawn(
        &mut self,
        blueprint_id: &str,
        world_from_actor: &Pose,
        linear_mps: Vec3,
    ) -> Result<ActorId, Error> {
        let request = self.check_spawn(blueprint_id, world_from_actor, linear_mps)?;
        let id = self.next_id()?;
        self.insert(id, &request);
        Ok(id)
    }

    /// # Errors
    /// `UnknownBlueprint`, `InvalidArgument`, `Capacity` or `SpawnBlocked`.
    fn check_spawn(
        &self,
        blueprint_id: &str,
        world_from_actor: &Pose,
        linear_mps: Vec3,
    ) -> Result<Request, Error> {
        let unknown = || {
            Error::new(ErrorCode::UnknownBlueprint, "no such blueprint")
                .wanted("an id such as vehicle.lincoln.mkz or walker.pedestrian.0001")
                .found(blueprint_id)
        };
        let blueprint_index = blueprint::index_of(blueprint_id).ok_or_else(unknown)?;
        let blueprint = blueprint::get(blueprint_index).ok_or_else(unknown)?;
        check::pose(world_from_actor)?;
        check::vector("velocity", linear_mps, limits::SPEED_MPS_MAX, "m/s")?;
        if self.actor_count() >= limits::ACTORS_PER_WORLD_MAX {
            return Err(Error::new(ErrorCode::Capacity, "the world is full")
                .wanted(format!("at most {} actors", limits::ACTORS_PER_WORLD_MAX)));
        }
        let placed = place::on_ground(blueprint, world_from_actor, &self.town.ground);
        self.check_free(&OrientedBox::new(&placed.world_from_actor, blueprint))?;
        Ok(Request { blueprint_index, blueprint, placed, linear_mps })
    }

    /// # Errors
    /// `SpawnBlocked` when an actor or scenery is where the box would be.
    fn check_free(&self, wanted: &OrientedBox) -> Result<(), Error> {
        let blocked = |by: String| {
            Error::new(ErrorCode::SpawnBlocked, "something stands where the actor should be")
                .wanted("a free place")
                .found(by)
        };
        for actor in &self.state.actors {
            let pose = self.state.physics.state(actor.body).world_from_body;
            if wanted.overlaps(&OrientedBox::new(&pose, actor.blueprint())) {
                return Err(blocked(format!("{}, {}", actor.id, actor.blueprint().id)));
            }
        }
        let mut near = Vec::new();
        let reach = Reach { centre_m: wanted.centre_m(), radius_m: wanted.radius_m() };
        self.town.scenery.find(reach, &mut near);
        let fixtures = near.into_iter().filter_map(|index| self.town.scenery.get(index));
        for fixture in fixtures {
            if wanted.overlaps(&OrientedBox::of(&fixture.world_from_box, fixture.half_m)) {
                return Err(blocked("scenery of the map".to_owned()));
            }
        }
        Ok(())
    }

    /// # Errors
    /// `Capacity` when a world has used up all ids.
    fn next_id(&mut self) -> Result<ActorId, Error> {
        let next = self.state.next_actor;
        let id = ActorId::new(next).filter(|_| next < u32::MAX);
        let id = id.ok_or_else(|| {
            Error::new(ErrorCode::Capacity, "this world has given out every actor id")
                .wanted("a new world")
        })?;
        self.state.next_actor += 1;
        Ok(id)
    }

    fn insert(&mut self, id: ActorId, request: &Request) {
        let Request { blueprint_index, blueprint, placed, linear_mps } = *request;
        let pose = &placed.world_from_actor;
        let state = &mut self.state;
        let palette = match blueprint.kind() {
            ActorKind::Vehicle => &PAINTS_RGB,
            ActorKind::Walker | ActorKind::Prop => &CLOTHES_RGB,
        };
        let colour_rgb = state.rng.choose(palette).copied().unwrap_or(0);
        let (body, vehicle) = match blueprint.body {
            BodySpec::Vehicle(spec) => {
                let forward_mps = linear_mps.dot(&(pose.rotation * Vec3::x()));
                let vehicle = Vehicle {
                    state: VehicleState::rolling(spec, forward_mps),
                    pilot: None,
                    rules: RoadRules::default(),
                };
                let body = state.physics.insert_vehicle(spec, pose, linear_mps, id);
                (body, Some(Box::new(vehicle)))
            }
            BodySpec::Walker(spec) => {
                let still = placed.standing && linear_mps == Vec3::zeros();
                (state.physics.insert_walker(spec, pose, linear_mps, still, id), None)
            }
        };
        state.actors.push(Actor {
            id,
            blueprint: blueprint_index,
            body,
            colour_rgb,
            acceleration_mps2: Vec3::zeros(),
            vehicle,
        });
    }
}

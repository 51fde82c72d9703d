//! Putting an actor into the world.

use schemas::{ActorId, ActorKind, Attachment, Attribute, Error, ErrorCode, Pose, Vec3, limits};

use crate::actor::{Actor, Outside, Switches, Vehicle};
use crate::attributes;
use crate::blueprint::{self, Blueprint, BodySpec};
use crate::body::{Attached, Body};
use crate::check;
use crate::overlap::OrientedBox;
use crate::place::{self, Placed};
use crate::scenery::Reach;
use crate::sensor::Sensor;
use crate::spring_arm;
use crate::trigger;
use crate::walker::Walker;
use crate::world::{World, ids_used_up};

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

/// What a client asks for; see [`Command::SpawnActor`](schemas::Command::SpawnActor).
pub(crate) struct Wish<'a> {
    pub blueprint: &'a str,
    /// In the parent's frame when attached.
    pub pose: &'a Pose,
    pub linear_mps: Vec3,
    pub attributes: &'a [Attribute],
    pub attachment: Option<Attachment>,
    pub id: Option<ActorId>,
}

/// A spawn that nothing forbids.
struct Request<'a> {
    id: ActorId,
    blueprint_index: u16,
    blueprint: &'static Blueprint,
    place: Place,
    linear_mps: Vec3,
    attributes: &'a [Attribute],
    colour_rgb: Option<u32>,
    sensor: Option<Sensor>,
}

/// What carries a new actor, and its wheels or legs.
type Embodied = (Body, Option<Box<Vehicle>>, Option<Box<Walker>>);

/// Where a new actor begins.
enum Place {
    Alone(Placed),
    On(Attached),
}

impl World {
    pub(crate) fn spawn(&mut self, wish: &Wish<'_>) -> Result<ActorId, Error> {
        let request = self.check_spawn(wish)?;
        let id = request.id;
        self.state.next_actor = self.state.next_actor.max(id.get() + 1);
        self.insert(request);
        Ok(id)
    }

    /// # Errors
    /// `UnknownBlueprint`, `InvalidArgument`, `UnknownActor` for the parent, `Capacity` or
    /// `SpawnBlocked`.
    fn check_spawn<'a>(&self, wish: &Wish<'a>) -> Result<Request<'a>, Error> {
        let (blueprint_index, blueprint) = find_blueprint(wish.blueprint)?;
        check::pose(wish.pose)?;
        check::vector("velocity", wish.linear_mps, limits::SPEED_MPS_MAX, "m/s")?;
        attributes::check(wish.attributes)?;
        let colour_rgb = attributes::colour_rgb(wish.attributes)?;
        if self.actor_count() >= limits::ACTORS_PER_WORLD_MAX {
            return Err(Error::new(ErrorCode::Capacity, "the world is full")
                .wanted(format!("at most {} actors", limits::ACTORS_PER_WORLD_MAX)));
        }
        let place = match wish.attachment {
            Some(to) => Place::On(self.check_attachment(blueprint, to, wish.pose)?),
            None => {
                let placed = self.place(blueprint, wish.pose, wish.linear_mps);
                self.check_free(blueprint, &placed.world_from_actor)?;
                Place::Alone(placed)
            }
        };
        let id = self.check_id(wish)?;
        let sensor = self.check_sensor(blueprint, wish.attributes, id)?;
        trigger::check(blueprint, wish.attributes)?;
        let Wish { linear_mps, attributes, .. } = *wish;
        Ok(Request {
            id,
            blueprint_index,
            blueprint,
            place,
            linear_mps,
            attributes,
            colour_rgb,
            sensor,
        })
    }

    /// `None` for what is no sensor.
    ///
    /// # Errors
    /// As [`Sensor::new`].
    fn check_sensor(
        &self,
        blueprint: &Blueprint,
        attributes: &[Attribute],
        id: ActorId,
    ) -> Result<Option<Sensor>, Error> {
        if blueprint.kind() != ActorKind::Sensor {
            return Ok(None);
        }
        let number = self.state.number_of(id.get());
        Sensor::new(&blueprint.id, attributes, self.state.seed, number).map(Some)
    }

    /// As CARLA: a vehicle begins where it is put and falls. One that begins under way cannot: it
    /// begins on its wheels.
    fn place(&self, blueprint: &Blueprint, wanted: &Pose, linear_mps: Vec3) -> Placed {
        let under_way = linear_mps != Vec3::zeros();
        let place = if under_way { place::on_ground } else { place::exactly };
        place(blueprint, wanted, &self.town.ground)
    }

    /// # Errors
    /// `UnknownActor` for the parent; `InvalidArgument` for what has a will of its own.
    fn check_attachment(
        &self,
        blueprint: &Blueprint,
        to: Attachment,
        parent_from_actor: &Pose,
    ) -> Result<Attached, Error> {
        if matches!(blueprint.kind(), ActorKind::Vehicle | ActorKind::Walker) {
            return Err(Error::new(ErrorCode::InvalidArgument, "the actor cannot be attached")
                .wanted("a sensor, a prop or a marker")
                .found(&blueprint.id));
        }
        let world_from_parent = match self.fixed_pose(to.parent) {
            Some(pose) => pose,
            None => self.pose_of_carrier(to.parent)?,
        };
        let world_from_actor =
            spring_arm::attached_at(to.kind, &world_from_parent, parent_from_actor);
        check::pose(&world_from_actor)?;
        Ok(Attached { to, parent_from_actor: *parent_from_actor, world_from_actor })
    }

    /// # Errors
    /// `UnknownActor`; `InvalidArgument` for the end of a long chain.
    fn pose_of_carrier(&self, parent: ActorId) -> Result<Pose, Error> {
        let carrier = &self.state.actors[self.state.index_of(parent)?];
        if !self.state.can_carry(carrier) {
            return Err(Error::new(ErrorCode::InvalidArgument, "too many actors hang in a row")
                .wanted("a parent nearer to what carries them all")
                .found(parent));
        }
        Ok(self.state.pose_of(carrier))
    }

    /// # Errors
    /// `SpawnBlocked` when an actor or scenery is where the box of a vehicle or walker would be.
    fn check_free(&self, blueprint: &Blueprint, world_from_actor: &Pose) -> Result<(), Error> {
        // As in CARLA, props stand wherever they are put.
        if matches!(blueprint.body, BodySpec::None(_) | BodySpec::Prop(_)) {
            return Ok(());
        }
        let wanted = OrientedBox::new(world_from_actor, blueprint);
        let blocked = |by: String| {
            Error::new(ErrorCode::SpawnBlocked, "something stands where the actor should be")
                .wanted("a free place")
                .found(by)
        };
        for actor in self.state.actors.iter().filter(|actor| actor.is_solid()) {
            let pose = self.state.pose_of(actor);
            if wanted.overlaps(&OrientedBox::new(&pose, actor.blueprint())) {
                return Err(blocked(format!("{}, {}", actor.id, actor.blueprint().id)));
            }
        }
        let mut near = Vec::new();
        let reach = Reach { centre_m: wanted.centre_m(), radius_m: wanted.radius_m() };
        self.town.scenery.find_shown(reach, &self.state.hidden, &mut near);
        let fixtures = near.into_iter().filter_map(|index| self.town.scenery.get(index));
        for fixture in fixtures {
            if wanted.overlaps(&OrientedBox::of(&fixture.world_from_box, fixture.half_m)) {
                return Err(blocked("scenery of the map".to_owned()));
            }
        }
        Ok(())
    }

    /// The id of a new actor.
    ///
    /// # Errors
    /// `InvalidArgument` for a wish that cannot be granted; `Capacity` when a world has used up all
    /// ids.
    fn check_id(&self, wish: &Wish<'_>) -> Result<ActorId, Error> {
        let Some(id) = wish.id else {
            let next = self.state.next_actor;
            return ActorId::new(next).filter(|_| next < u32::MAX).ok_or_else(ids_used_up);
        };
        let refuse = |wanted: String| {
            let error = Error::new(ErrorCode::InvalidArgument, "the actor cannot have this id");
            Err(error.wanted(wanted).found(id))
        };
        if id.get() > limits::WANTED_ACTOR_MAX {
            return refuse(format!("at most {}", limits::WANTED_ACTOR_MAX));
        }
        if self.state.actor(id).is_some() || self.is_fixed(id) {
            return refuse("an id that no living actor has".to_owned());
        }
        // What hangs on another comes after it.
        match wish.attachment {
            Some(to) if to.parent >= id => refuse(format!("an id above that of {}", to.parent)),
            _ => Ok(id),
        }
    }

    fn insert(&mut self, request: Request<'_>) {
        let Request { id, blueprint, .. } = request;
        let drawn_rgb = self.draw_colour(blueprint.kind());
        let (body, vehicle, walker) = self.embody(id, &request);
        if let Some(sensor) = request.sensor {
            self.state.sensors.insert(id, sensor);
        }
        let switches =
            Switches { physics: !matches!(blueprint.body, BodySpec::Prop(_)), ..Switches::ALL_ON };
        let actor = Actor {
            id,
            blueprint: request.blueprint_index,
            body,
            attributes: request.attributes.to_vec(),
            colour_rgb: request.colour_rgb.unwrap_or(drawn_rgb),
            lights: 0,
            doors: 0,
            switches,
            acceleration_mps2: Vec3::zeros(),
            last_mps: request.linear_mps,
            outside: Outside::default(),
            vehicle,
            walker,
        };
        let actors = &mut self.state.actors;
        let place = actors.partition_point(|other| other.id < id);
        actors.insert(place, actor);
    }

    /// A paint; 0 for what has no body.
    fn draw_colour(&mut self, kind: ActorKind) -> u32 {
        let palette: &[u32] = match kind {
            ActorKind::Vehicle => &PAINTS_RGB,
            ActorKind::Walker => &CLOTHES_RGB,
            _ => return 0,
        };
        self.state.rng.choose(palette).copied().unwrap_or(0)
    }

    fn embody(&mut self, id: ActorId, request: &Request<'_>) -> Embodied {
        let placed = match &request.place {
            Place::On(attached) => return (Body::Attached(attached.clone()), None, None),
            Place::Alone(placed) => placed,
        };
        let (pose, linear_mps) = (&placed.world_from_actor, request.linear_mps);
        let physics = &mut self.state.physics;
        match &request.blueprint.body {
            BodySpec::Vehicle(_) => {
                let forward_mps = linear_mps.dot(&(pose.rotation * Vec3::x()));
                let mut vehicle = Vehicle::rolling(request.blueprint_index, forward_mps)
                    .expect("a vehicle's blueprint has wheels");
                if linear_mps == Vec3::zeros() {
                    vehicle.state.lift();
                }
                if attributes::value(request.attributes, "sticky_control") == Some("false") {
                    vehicle = vehicle.without_sticky_control();
                }
                let body = physics.insert_vehicle(vehicle.tuning.fit(), pose, linear_mps, id);
                (Body::Rigid(body), Some(Box::new(vehicle)), None)
            }
            BodySpec::Walker(model) => {
                let still = placed.standing && linear_mps == Vec3::zeros();
                let body = physics.insert_walker(model, pose, linear_mps, still, id);
                (Body::Rigid(body), None, Some(Box::new(Walker::new(linear_mps))))
            }
            BodySpec::Prop(model) => {
                (Body::Rigid(physics.insert_prop(model, pose, id)), None, None)
            }
            BodySpec::None(_) => (Body::Fixed(*pose), None, None),
        }
    }
}

/// # Errors
/// `UnknownBlueprint`.
fn find_blueprint(id: &str) -> Result<(u16, &'static Blueprint), Error> {
    let found = blueprint::index_of(id).and_then(|index| Some((index, blueprint::get(index)?)));
    found.ok_or_else(|| {
        Error::new(ErrorCode::UnknownBlueprint, "no such blueprint")
            .wanted("an id such as vehicle.lincoln.mkz or walker.pedestrian.0001")
            .found(id)
    })
}

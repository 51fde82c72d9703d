//! What the world makes of a blueprint: whether and how it is embodied. Lengths in metres in the
//! actor's frame (x forward, y left, z up from the ground under the box centre).

use std::sync::LazyLock;

use blueprints::{Class, PropModel, VehicleModel, WalkerModel};
use schemas::{ActorKind, Vec3};

pub(crate) use blueprints::index_of;

/// One kind of thing that can be put into a world.
#[derive(Clone, Debug)]
pub(crate) struct Blueprint {
    /// CARLA's id, e.g. `vehicle.lincoln.mkz`.
    pub id: String,
    pub body: BodySpec,
}

/// What a blueprint's body is.
#[derive(Clone, Debug)]
pub(crate) enum BodySpec {
    Vehicle(&'static VehicleModel),
    Walker(WalkerModel),
    Prop(PropModel),
    /// Nothing that could touch or be touched.
    None(ActorKind),
}

/// Principal moments of inertia about x, y, z through a walker's centre, of a solid cylinder.
pub(crate) fn walker_inertia_kgm2(model: &WalkerModel) -> [f32; 3] {
    let square = |metres: f32| metres * metres;
    let across = (3.0 * square(model.radius_m) + square(model.height_m)) / 12.0;
    [across, across, square(model.radius_m) / 2.0].map(|square_m| model.mass_kg * square_m)
}

/// Principal moments of inertia about x, y, z through a prop's centre, of a solid box.
pub(crate) fn prop_inertia_kgm2(model: &PropModel) -> [f32; 3] {
    let square = model.size_m.component_mul(&model.size_m);
    [square.y + square.z, square.x + square.z, square.x + square.y]
        .map(|square_m| model.mass_kg * square_m / 12.0)
}

impl Blueprint {
    fn new(blueprint: &blueprints::Blueprint) -> Self {
        let body = match blueprint.class {
            Class::Vehicle(model) => BodySpec::Vehicle(model),
            Class::Walker(model) => BodySpec::Walker(model),
            Class::Prop(model) => BodySpec::Prop(model),
            Class::Sensor(_) => BodySpec::None(ActorKind::Sensor),
            Class::TrafficLight => BodySpec::None(ActorKind::TrafficLight),
            Class::TrafficSign => BodySpec::None(ActorKind::TrafficSign),
            Class::Controller | Class::Spectator | Class::Trigger | Class::Empty => {
                BodySpec::None(ActorKind::Marker)
            }
        };
        Self { id: blueprint.id.clone(), body }
    }

    pub(crate) fn kind(&self) -> ActorKind {
        match self.body {
            BodySpec::Vehicle(_) => ActorKind::Vehicle,
            BodySpec::Walker(_) => ActorKind::Walker,
            BodySpec::Prop(_) => ActorKind::Prop,
            BodySpec::None(kind) => kind,
        }
    }

    /// Centre of the bounding box in the actor's frame.
    pub(crate) fn box_centre_m(&self) -> Vec3 {
        match self.body {
            BodySpec::Vehicle(model) => Vec3::new(0.0, 0.0, model.height_m / 2.0),
            BodySpec::Prop(model) => Vec3::new(0.0, 0.0, model.size_m.z / 2.0),
            BodySpec::Walker(_) | BodySpec::None(_) => Vec3::zeros(),
        }
    }

    /// Half size of the bounding box.
    pub(crate) fn box_half_extent_m(&self) -> Vec3 {
        match &self.body {
            BodySpec::Vehicle(model) => {
                Vec3::new(model.length_m, model.width_m, model.height_m) / 2.0
            }
            BodySpec::Walker(model) => {
                Vec3::new(model.radius_m, model.radius_m, model.height_m / 2.0)
            }
            BodySpec::Prop(model) => model.size_m / 2.0,
            BodySpec::None(_) => Vec3::zeros(),
        }
    }
}

/// Every blueprint, in the order of [`blueprints::all`].
pub(crate) fn all() -> &'static [Blueprint] {
    static ALL: LazyLock<Vec<Blueprint>> =
        LazyLock::new(|| blueprints::all().iter().map(Blueprint::new).collect());
    &ALL
}

/// The blueprint at an index of [`index_of`].
pub(crate) fn get(index: u16) -> Option<&'static Blueprint> {
    all().get(usize::from(index))
}

//! Everything that can be in a world, as data: the blueprints of CARLA 0.9.16 with their
//! attributes, and what each of them is made of. No behaviour, no I/O.
//!
//! - [`all`] is every [`Blueprint`], ordered by id; [`find`] takes old spellings too.
//! - [`Attribute`]s are what CARLA's clients read and set; values are text that parses by its kind.
//! - [`Class`] says what a thing is: a [`VehicleModel`], a [`WalkerModel`], a [`PropModel`], …
//!
//! ```
//! let blueprint = blueprints::find("vehicle.lincoln.mkz").unwrap();
//! let blueprints::Class::Vehicle(model) = blueprint.class else { unreachable!() };
//! assert_eq!(model.physics.wheels.len(), 4);
//! ```
//!
//! **Units and frames:** SI, radians; lengths in the actor's frame, x forward, y left, z up.
//!
//! **Source:** ids, attributes and defaults as a running CARLA 0.9.16 lists them; dimensions,
//! masses and drivetrains as the manufacturers publish them.

mod alias;
mod attribute;
mod library;
mod prop;
mod sensor;
mod traffic;
mod vehicle;
mod walker;

pub use alias::{is_renamed_in_0_10, renamed_in_0_10};
pub use attribute::{Attribute, AttributeKind};
pub use library::{all, find, get, index_of};
pub use prop::{PropModel, PropSize};
pub use sensor::SensorClass;
pub use vehicle::{BaseType, Driven, VehicleModel};
pub use walker::{Age, Gender, WalkerModel};

/// One kind of thing that can be in a world.
#[derive(Clone, Debug)]
pub struct Blueprint {
    /// CARLA's id, e.g. `vehicle.lincoln.mkz`.
    pub id: String,
    /// What a client may filter by: the parts of the id.
    pub tags: Vec<String>,
    /// What a client reads and sets.
    pub attributes: Vec<Attribute>,
    /// What it is.
    pub class: Class,
    /// Whether CARLA's library lists it; the map places the others.
    pub listed: bool,
}

/// What a blueprint is.
#[derive(Clone, Copy, Debug)]
pub enum Class {
    /// Anything with wheels and a driver.
    Vehicle(&'static VehicleModel),
    /// A pedestrian.
    Walker(WalkerModel),
    /// A thing that only stands or lies.
    Prop(PropModel),
    /// Something that measures.
    Sensor(SensorClass),
    /// Walks a pedestrian.
    Controller,
    /// The camera of whoever watches the server.
    Spectator,
    /// A traffic light of the map.
    TrafficLight,
    /// A sign of the map.
    TrafficSign,
    /// A box that changes the friction of tyres.
    Trigger,
    /// A place without a body.
    Empty,
}

impl Blueprint {
    fn new(id: &str, class: Class, listed: bool, attributes: Vec<Attribute>) -> Self {
        let tags = id.split('.').map(str::to_owned).collect();
        Self { id: id.to_owned(), tags, attributes, class, listed }
    }

    /// The same under another id.
    fn renamed(&self, id: &str) -> Self {
        let mut attributes = self.attributes.clone();
        for attribute in attributes.iter_mut().filter(|attribute| attribute.id == "ros_name") {
            attribute.value = id.to_owned();
            attribute.recommended = vec![id.to_owned()];
        }
        Self::new(id, self.class, self.listed, attributes)
    }

    /// The attribute with this id.
    pub fn attribute(&self, id: &str) -> Option<&Attribute> {
        self.attributes.iter().find(|attribute| attribute.id == id)
    }
}

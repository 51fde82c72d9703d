//! Things that only stand or lie.

use crate::attribute::{Attribute, AttributeKind, common};
use crate::{Blueprint, Class};
use schemas::Vec3;

mod table;

/// CARLA's classes of size.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs, reason = "the names are CARLA's")]
pub enum PropSize {
    Tiny,
    Small,
    Medium,
    Big,
    Huge,
}

/// A thing as a box.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PropModel {
    /// Length, width and height of its bounding box, which stands on the actor's origin.
    pub size_m: Vec3,
    /// Of the whole thing.
    pub mass_kg: f32,
    /// How CARLA classes it.
    pub size: PropSize,
}

/// What is higher stands in the way of a car.
const FLAT_M: f32 = 0.12;

impl PropModel {
    /// Whether cars pass over it: dirt, planks, tiles and litter on the ground.
    pub fn lies_flat(&self) -> bool {
        self.size_m.z <= FLAT_M
    }
}

impl PropSize {
    /// CARLA's word.
    pub fn name(self) -> &'static str {
        match self {
            Self::Tiny => "tiny",
            Self::Small => "small",
            Self::Medium => "medium",
            Self::Big => "big",
            Self::Huge => "huge",
        }
    }
}

pub(crate) fn blueprints() -> impl Iterator<Item = Blueprint> {
    table::PROPS.into_iter().map(|(name, size, [length_m, width_m, height_m], mass_kg)| {
        let id = format!("static.prop.{name}");
        let size_m = Vec3::new(length_m, width_m, height_m);
        let model = PropModel { size_m, mass_kg, size };
        let attributes = if name == "mesh" {
            mesh_attributes(&id)
        } else {
            let mut attributes = common(&id, &["prop"]);
            attributes.push(Attribute::fixed("size", AttributeKind::String, size.name()));
            attributes
        };
        Blueprint::new(&id, Class::Prop(model), true, attributes)
    })
}

/// The prop that shows a mesh of the client's choice.
fn mesh_attributes(id: &str) -> Vec<Attribute> {
    let mut attributes = common(id, &["default"]);
    attributes.extend([
        Attribute::open("mesh_path", AttributeKind::String, &[""]),
        Attribute::open("scale", AttributeKind::Float, &["1.0"]),
        Attribute::open("mass", AttributeKind::Float, &["0.0"]),
    ]);
    attributes
}

//! Vehicles: what they are made of, and how they drive by default.

use std::sync::LazyLock;

use schemas::VehiclePhysics;

use crate::attribute::{Attribute, AttributeKind, common};
use crate::{Blueprint, Class};

mod cars;
mod design;
mod engine;
mod two_wheelers;
mod vans_trucks;

use design::Design;

/// CARLA's coarse classes of vehicles.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[allow(missing_docs, reason = "the names are CARLA's")]
pub enum BaseType {
    Car,
    Truck,
    Van,
    Bus,
    Motorcycle,
    Bicycle,
}

/// Which wheels the engine turns.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[allow(missing_docs, reason = "the names say it")]
pub enum Driven {
    Front,
    Rear,
    All,
}

/// A vehicle as data; lengths from the ground under the box centre.
#[derive(Clone, Debug)]
pub struct VehicleModel {
    /// What kind of vehicle.
    pub base: BaseType,
    /// Of the bounding box.
    pub length_m: f32,
    /// Of the bounding box, without mirrors.
    pub width_m: f32,
    /// Of the bounding box.
    pub height_m: f32,
    /// From the ground to the lower edge of the body.
    pub ground_clearance_m: f32,
    /// Between the front axle and the middle of the rear ones.
    pub wheelbase_m: f32,
    /// Between the wheels of an axle; 0 for two-wheelers.
    pub track_m: f32,
    /// Of the rolling wheels.
    pub wheel_radius_m: f32,
    /// Of one wheel with tyre and brake disc.
    pub wheel_inertia_kgm2: f32,
    /// What the air meets.
    pub frontal_area_m2: f32,
    /// Natural frequency of the body on its springs.
    pub ride_hz: f32,
    /// Of the body on its springs; 1 is critical.
    pub damping_ratio: f32,
    /// Load moved between the wheels of an axle per metre of difference in compression.
    pub anti_roll_n_per_m: f32,
    /// Which wheels the engine turns.
    pub driven: Driven,
    /// Revolutions per minute without throttle; 0 for motors that need no clutch.
    pub idle_rpm: f32,
    /// Turns of the gearbox's input for one of its output, in reverse.
    pub reverse_ratio: f32,
    /// Share of the engine's power that reaches the wheels.
    pub efficiency: f32,
    /// How it drives unless a client changes it.
    pub physics: VehiclePhysics,
}

impl VehicleModel {
    /// Whether it has to be balanced.
    pub fn is_two_wheeler(&self) -> bool {
        matches!(self.base, BaseType::Motorcycle | BaseType::Bicycle)
    }
}

impl BaseType {
    /// CARLA's word.
    pub fn name(self) -> &'static str {
        match self {
            Self::Car => "car",
            Self::Truck => "truck",
            Self::Van => "van",
            Self::Bus => "bus",
            Self::Motorcycle => "motorcycle",
            Self::Bicycle => "bicycle",
        }
    }
}

pub(crate) fn blueprints() -> impl Iterator<Item = Blueprint> {
    static MODELS: LazyLock<Vec<(&'static Design, VehicleModel)>> =
        LazyLock::new(|| designs().map(|design| (design, design.model())).collect());
    MODELS.iter().map(|(design, model)| {
        Blueprint::new(design.id, Class::Vehicle(model), true, attributes(design, model))
    })
}

fn designs() -> impl Iterator<Item = &'static Design> {
    cars::DESIGNS.iter().chain(vans_trucks::DESIGNS).chain(two_wheelers::DESIGNS)
}

fn attributes(design: &Design, model: &VehicleModel) -> Vec<Attribute> {
    use AttributeKind::{Bool, Colour, Int, String};
    let look = &design.look;
    let mut attributes = common(design.id, &["autopilot", "scenario", "ego_vehicle"]);
    if !look.paints.is_empty() {
        attributes.push(Attribute::open("color", Colour, look.paints));
    }
    if !look.drivers.is_empty() {
        attributes.push(Attribute::choice("driver_id", Int, look.drivers));
    }
    attributes.extend([
        Attribute::open("sticky_control", Bool, &["true"]),
        Attribute::open("terramechanics", Bool, &["false"]),
        Attribute::fixed("object_type", String, ""),
        Attribute::fixed("base_type", String, model.base.name()),
        Attribute::fixed("special_type", String, look.special),
        Attribute::fixed("number_of_wheels", Int, model.physics.wheels.len()),
        Attribute::fixed("generation", Int, look.generation),
        Attribute::fixed("has_dynamic_doors", Bool, look.doors),
        Attribute::fixed("has_lights", Bool, look.lights),
    ]);
    attributes
}

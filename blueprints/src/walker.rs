//! Pedestrians.

use crate::attribute::{Attribute, AttributeKind, common};
use crate::{Blueprint, Class};

/// How old a pedestrian is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs, reason = "the names are CARLA's")]
pub enum Age {
    Child,
    Teenager,
    Adult,
}

/// Which sex a pedestrian has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs, reason = "the names are CARLA's")]
pub enum Gender {
    Female,
    Male,
}

/// A pedestrian: an upright capsule with the mass and height of a person.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WalkerModel {
    /// Of the body with clothes.
    pub mass_kg: f32,
    /// From sole to crown.
    pub height_m: f32,
    /// Of a circle around chest and shoulders.
    pub radius_m: f32,
    /// At ease.
    pub walk_mps: f32,
    /// In haste.
    pub run_mps: f32,
    /// How old.
    pub age: Age,
    /// Which sex.
    pub gender: Gender,
}

/// Persons of CARLA's `walker.pedestrian.NNNN`, number 1 first, in runs of equals:
/// (how many, age, gender, generation, can use a wheelchair).
const PEOPLE: [(u32, Age, Gender, u8, bool); 22] = {
    use Age::{Adult, Child, Teenager};
    use Gender::{Female, Male};
    [
        (1, Adult, Female, 1, true),
        (3, Adult, Male, 1, true),
        (4, Adult, Female, 1, true),
        (3, Child, Female, 1, false),
        (3, Child, Male, 1, false),
        (1, Adult, Female, 2, true),
        (3, Adult, Male, 2, true),
        (5, Adult, Female, 2, true),
        (6, Adult, Male, 2, true),
        (1, Adult, Male, 2, false),
        (1, Adult, Female, 2, true),
        (1, Adult, Female, 2, false),
        (2, Adult, Male, 2, true),
        (3, Adult, Female, 2, true),
        (2, Adult, Male, 2, true),
        (2, Adult, Female, 2, true),
        (3, Adult, Female, 2, false),
        (3, Adult, Male, 2, true),
        (2, Child, Female, 2, false),
        (1, Teenager, Female, 3, false),
        (1, Teenager, Male, 3, false),
        (1, Adult, Male, 3, false),
    ]
};

/// **Source:** median heights and masses by age; the radius from a chest depth of 0.25 m and a
/// shoulder breadth of 0.45 m, taken as one circle of about the same area.
fn model(age: Age, gender: Gender) -> WalkerModel {
    let (mass_kg, height_m, radius_m, walk_mps, run_mps) = match age {
        Age::Child => (25.0, 1.25, 0.15, 1.1, 2.0),
        Age::Teenager => (55.0, 1.62, 0.18, 1.1, 2.0),
        Age::Adult => (75.0, 1.75, 0.2, 1.7, 4.0),
    };
    WalkerModel { mass_kg, height_m, radius_m, walk_mps, run_mps, age, gender }
}

pub(crate) fn blueprints() -> impl Iterator<Item = Blueprint> {
    let people = PEOPLE.into_iter().flat_map(|(count, age, gender, generation, wheelchair)| {
        std::iter::repeat_n((age, gender, generation, wheelchair), count as usize)
    });
    people.enumerate().map(|(index, (age, gender, generation, wheelchair))| {
        let id = format!("walker.pedestrian.{:04}", index + 1);
        let model = model(age, gender);
        let attributes = attributes(&id, &model, generation, wheelchair);
        Blueprint::new(&id, Class::Walker(model), true, attributes)
    })
}

fn attributes(id: &str, model: &WalkerModel, generation: u8, wheelchair: bool) -> Vec<Attribute> {
    use AttributeKind::{Bool, Float, Int, String};
    let age = match model.age {
        Age::Child => "child",
        Age::Teenager => "teenager",
        Age::Adult => "adult",
    };
    let gender = match model.gender {
        Gender::Female => "female",
        Gender::Male => "male",
    };
    let (walk, run) = (format!("{:.1}", model.walk_mps), format!("{:.1}", model.run_mps));
    let seats: &[&str] = if wheelchair { &["false", "true"] } else { &["false"] };
    let mut attributes = common(id, &["pedestrian"]);
    attributes.extend([
        Attribute::open("speed", Float, &["0.0", &walk, &run]),
        Attribute::open("is_invincible", Bool, &["true"]),
        Attribute::open("use_wheelchair", Bool, seats),
        Attribute::fixed("gender", String, gender),
        Attribute::fixed("generation", Int, generation),
        Attribute::fixed("age", String, age),
        Attribute::fixed("can_use_wheelchair", Bool, wheelchair),
    ]);
    attributes
}

//! What can be spawned: data only. Lengths in metres in the vehicle's frame (x forward, y left, z up
//! from the ground under the box centre).

mod bodyless;
mod props;
mod vehicles;
mod walkers;

use schemas::{ActorKind, Vec3};

use crate::vehicle::VehicleSpec;

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
    Vehicle(&'static VehicleSpec),
    Walker(&'static WalkerSpec),
    Prop(PropSpec),
    /// Nothing that could touch or be touched.
    None(ActorKind),
}

/// A pedestrian: a capsule with the mass and height of a person.
#[derive(Clone, Debug)]
pub(crate) struct WalkerSpec {
    pub mass_kg: f32,
    pub height_m: f32,
    pub radius_m: f32,
}

/// A thing that stands on its origin: a box.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PropSpec {
    pub half_m: Vec3,
    pub mass_kg: f32,
}

impl PropSpec {
    /// Principal moments of inertia about x, y, z through the centre, of a solid box.
    pub(crate) fn inertia_kgm2(&self) -> [f32; 3] {
        let square = self.half_m.component_mul(&self.half_m);
        [square.y + square.z, square.x + square.z, square.x + square.y]
            .map(|square_m| self.mass_kg * square_m / 3.0)
    }
}

impl WalkerSpec {
    /// Principal moments of inertia about x, y, z through the centre, of a solid cylinder.
    pub(crate) fn inertia_kgm2(&self) -> [f32; 3] {
        let square = |metres: f32| metres * metres;
        let across = (3.0 * square(self.radius_m) + square(self.height_m)) / 12.0;
        [across, across, square(self.radius_m) / 2.0].map(|square_m| self.mass_kg * square_m)
    }
}

impl Blueprint {
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
            BodySpec::Vehicle(spec) => Vec3::new(0.0, 0.0, spec.height_m / 2.0),
            BodySpec::Prop(spec) => Vec3::new(0.0, 0.0, spec.half_m.z),
            BodySpec::Walker(_) | BodySpec::None(_) => Vec3::zeros(),
        }
    }

    /// Half size of the bounding box.
    pub(crate) fn box_half_extent_m(&self) -> Vec3 {
        match self.body {
            BodySpec::Vehicle(spec) => Vec3::new(spec.length_m, spec.width_m, spec.height_m) / 2.0,
            BodySpec::Walker(spec) => Vec3::new(spec.radius_m, spec.radius_m, spec.height_m / 2.0),
            BodySpec::Prop(spec) => spec.half_m,
            BodySpec::None(_) => Vec3::zeros(),
        }
    }
}

/// Every blueprint, ordered by id; an index into it names a blueprint within one version.
pub(crate) fn all() -> &'static [Blueprint] {
    static ALL: std::sync::LazyLock<Vec<Blueprint>> = std::sync::LazyLock::new(|| {
        let mut all: Vec<Blueprint> = vehicles::all()
            .chain(walkers::all())
            .chain(props::all())
            .chain(bodyless::all())
            .collect();
        all.sort_by(|a, b| a.id.cmp(&b.id));
        all
    });
    &ALL
}

/// Index of the blueprint with this id.
pub(crate) fn index_of(id: &str) -> Option<u16> {
    let index = all().binary_search_by(|blueprint| blueprint.id.as_str().cmp(id)).ok()?;
    u16::try_from(index).ok()
}

/// The blueprint at an index of [`index_of`].
pub(crate) fn get(index: u16) -> Option<&'static Blueprint> {
    all().get(usize::from(index))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ids_are_unique_and_found() {
        for blueprint in all() {
            let index = index_of(&blueprint.id).expect("every id is found");
            assert_eq!(get(index).map(|found| &found.id), Some(&blueprint.id));
        }
        assert!(all().windows(2).all(|pair| pair[0].id < pair[1].id));
        assert_eq!(index_of("vehicle.nonexistent"), None);
    }

    #[test]
    fn every_walker_of_carla_exists() {
        for number in 1..=52 {
            assert!(index_of(&format!("walker.pedestrian.{number:04}")).is_some(), "{number}");
        }
    }
}

//! The shapes that actors are put together from: a fixed library, uploaded once per device.

use crate::material::Material;
use crate::mesh::Mesh;

mod prop;
mod signpost;
pub(crate) mod vehicle;
mod walker;

/// One shape of the library.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[repr(u8)]
#[allow(missing_docs, reason = "the names are the shapes")]
pub enum Shape {
    Sedan,
    Coupe,
    Hatchback,
    OffRoader,
    Wedge,
    Van,
    Truck,
    FireEngine,
    Bus,
    LightBar,
    DoorPanel,
    DoorWindow,
    MotorcycleFrame,
    BicycleFrame,
    Wheel,
    ThinWheel,
    WheelArch,
    Rider,
    Torso,
    Head,
    LongHair,
    Leg,
    Arm,
    UpperArm,
    Forearm,
    Thigh,
    Shin,
    Backpack,
    Block,
    Cone,
    Barrel,
    Barricade,
    Bench,
    Shelter,
    Placard,
    Post,
    LightHead,
    StopSign,
    YieldSign,
    RoundSign,
    SquareSign,
}

impl Shape {
    /// Every shape, at the place of its number.
    pub const ALL: [Self; 41] = [
        Self::Sedan,
        Self::Coupe,
        Self::Hatchback,
        Self::OffRoader,
        Self::Wedge,
        Self::Van,
        Self::Truck,
        Self::FireEngine,
        Self::Bus,
        Self::LightBar,
        Self::DoorPanel,
        Self::DoorWindow,
        Self::MotorcycleFrame,
        Self::BicycleFrame,
        Self::Wheel,
        Self::ThinWheel,
        Self::WheelArch,
        Self::Rider,
        Self::Torso,
        Self::Head,
        Self::LongHair,
        Self::Leg,
        Self::Arm,
        Self::UpperArm,
        Self::Forearm,
        Self::Thigh,
        Self::Shin,
        Self::Backpack,
        Self::Block,
        Self::Cone,
        Self::Barrel,
        Self::Barricade,
        Self::Bench,
        Self::Shelter,
        Self::Placard,
        Self::Post,
        Self::LightHead,
        Self::StopSign,
        Self::YieldSign,
        Self::RoundSign,
        Self::SquareSign,
    ];

    /// Its triangles in its own frame: vehicle bodies fill the box from -1 to 1, people's parts are
    /// in heights of the person from the joint, wheels have radius and half width 1; signs and
    /// lights face -x.
    pub fn mesh(self) -> Mesh {
        match self {
            Self::Sedan => vehicle::sedan(),
            Self::Coupe => vehicle::coupe(),
            Self::Hatchback => vehicle::hatchback(),
            Self::OffRoader => vehicle::off_roader(),
            Self::Wedge => vehicle::wedge(),
            Self::Van => vehicle::van(),
            Self::Truck => vehicle::truck(Material::PropBand),
            Self::FireEngine => vehicle::truck(Material::Paint),
            Self::Bus => vehicle::bus(),
            Self::LightBar => vehicle::light_bar(),
            Self::DoorPanel => vehicle::door_panel(),
            Self::DoorWindow => vehicle::door_window(),
            Self::MotorcycleFrame => vehicle::motorcycle(),
            Self::BicycleFrame => vehicle::bicycle(),
            Self::Wheel => vehicle::wheel(),
            Self::ThinWheel => vehicle::thin_wheel(),
            Self::WheelArch => vehicle::wheel_arch(),
            Self::Rider => walker::rider(),
            Self::Torso => walker::torso(),
            Self::Head => walker::head(),
            Self::LongHair => walker::long_hair(),
            Self::Leg => walker::leg(),
            Self::Arm => walker::arm(),
            Self::UpperArm => walker::upper_arm(),
            Self::Forearm => walker::forearm(),
            Self::Thigh => walker::thigh(),
            Self::Shin => walker::shin(),
            Self::Backpack => walker::backpack(),
            Self::Block => prop::block(),
            Self::Cone => prop::cone(),
            Self::Barrel => prop::barrel(),
            Self::Barricade => prop::barricade(),
            Self::Bench => prop::bench(),
            Self::Shelter => prop::shelter(),
            Self::Placard => prop::placard(),
            Self::Post => signpost::post(),
            Self::LightHead => signpost::light_head(),
            Self::StopSign => signpost::stop_sign(),
            Self::YieldSign => signpost::yield_sign(),
            Self::RoundSign => signpost::round_sign(),
            Self::SquareSign => signpost::square_sign(),
        }
    }
}

impl Shape {
    /// Side of the cells in which corners are drawn together far away, in the shape's own unit:
    /// thinner than its thinnest part that matters.
    pub fn coarse_cell(self) -> f32 {
        match self {
            Self::Torso | Self::Head => 0.06,
            Self::LongHair | Self::Leg | Self::Arm | Self::Backpack | Self::Rider => 0.045,
            Self::UpperArm | Self::Forearm | Self::Thigh | Self::Shin => 0.045,
            Self::Wheel | Self::ThinWheel | Self::WheelArch => 0.55,
            Self::MotorcycleFrame | Self::BicycleFrame => 0.08,
            Self::Block | Self::Cone | Self::Barrel | Self::DoorPanel | Self::DoorWindow => 0.3,
            Self::Barricade
            | Self::Bench
            | Self::Shelter
            | Self::Placard
            | Self::LightHead
            | Self::StopSign
            | Self::YieldSign
            | Self::RoundSign
            | Self::SquareSign => 0.02,
            Self::Post => 0.5,
            Self::Sedan
            | Self::Coupe
            | Self::Hatchback
            | Self::OffRoader
            | Self::Wedge
            | Self::Van
            | Self::Truck
            | Self::FireEngine
            | Self::Bus
            | Self::LightBar => 0.18,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_shape_is_at_the_place_of_its_number_and_has_a_moderate_count_of_triangles() {
        for (place, shape) in Shape::ALL.into_iter().enumerate() {
            assert_eq!(shape as usize, place, "{shape:?}");
            let mesh = shape.mesh();
            let triangles = mesh.indices.len() / 3;
            assert!((8..=1_500).contains(&triangles), "{shape:?} has {triangles} triangles");
            assert!(mesh.indices.iter().all(|index| (*index as usize) < mesh.vertices.len()));
        }
    }

    #[test]
    fn coarse_shapes_have_far_fewer_triangles_and_the_same_size() {
        let span = |mesh: &Mesh, axis: usize| {
            let parts = mesh.vertices.iter().map(|vertex| vertex.position[axis]);
            parts.clone().fold(f32::MIN, f32::max) - parts.fold(f32::MAX, f32::min)
        };
        for shape in [Shape::Sedan, Shape::Wheel, Shape::Torso, Shape::Leg, Shape::Head] {
            let (fine, coarse) = (shape.mesh(), shape.mesh().coarse(shape.coarse_cell()));
            assert!(
                coarse.indices.len() * 10 < fine.indices.len() * 7,
                "{shape:?} {} of {}",
                coarse.indices.len(),
                fine.indices.len()
            );
            for axis in 0..3 {
                let (was, is) = (span(&fine, axis), span(&coarse, axis));
                assert!(is > 0.75 * was, "{shape:?} axis {axis}: {is} of {was}");
            }
        }
    }

    #[test]
    fn vehicle_bodies_stay_inside_their_box() {
        for shape in [
            Shape::Sedan,
            Shape::Coupe,
            Shape::Hatchback,
            Shape::OffRoader,
            Shape::Wedge,
            Shape::Van,
            Shape::Truck,
            Shape::Bus,
        ] {
            for vertex in shape.mesh().vertices {
                // Mirrors and trim may stand out a little.
                assert!(
                    vertex.position.iter().all(|part| part.abs() <= 1.09),
                    "{shape:?} {vertex:?}"
                );
            }
        }
    }
}

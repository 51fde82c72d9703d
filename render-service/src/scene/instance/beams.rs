//! What the lamps of vehicles throw on the road and on what stands there.
//!
//! Brightness is chosen by eye for a picture by night, in the unit of [`raster::Lamp`]: real beams
//! span more steps than a picture has. Shapes are those of UN Regulations 112 (low beams end 1 %
//! below the level of the lamp) and 19 (fog lamps are wide and end lower).

use bodies::{Shine, Source};
use nalgebra::Vector3;
use raster::Lamp;
use schemas::{Pose, Vec3};

/// How far inside the body a lamp is, in metres, so that its own body turns away from it.
const INSIDE_M: f32 = 0.35;

const WHITE: [f32; 3] = [1.0, 0.98, 0.92];
const AMBER: [f32; 3] = [1.0, 0.36, 0.02];
const RED: [f32; 3] = [1.0, 0.010, 0.008];

/// How one kind of lamp shines.
struct Beam {
    colour: [f32; 3],
    brightness: f32,
    narrow: [f32; 2],
    cut: f32,
    reach_m: f32,
}

const LOW: Beam =
    Beam { colour: WHITE, brightness: 330.0, narrow: [2.4, 30.0], cut: -0.010, reach_m: 70.0 };
const HIGH: Beam =
    Beam { colour: WHITE, brightness: 420.0, narrow: [3.2, 9.0], cut: 1e3, reach_m: 120.0 };
const FRONT_FOG: Beam =
    Beam { colour: WHITE, brightness: 40.0, narrow: [0.7, 12.0], cut: -0.02, reach_m: 25.0 };
const POSITION: Beam =
    Beam { colour: WHITE, brightness: 0.8, narrow: [0.6, 0.6], cut: 1e3, reach_m: 6.0 };
const TAIL: Beam =
    Beam { colour: RED, brightness: 0.5, narrow: [0.6, 0.6], cut: 1e3, reach_m: 6.0 };
const BRAKE: Beam =
    Beam { colour: RED, brightness: 2.6, narrow: [0.6, 0.6], cut: 1e3, reach_m: 10.0 };
const REVERSE: Beam =
    Beam { colour: WHITE, brightness: 6.0, narrow: [0.9, 1.5], cut: 1e3, reach_m: 14.0 };
const BLINKER: Beam =
    Beam { colour: AMBER, brightness: 2.0, narrow: [0.3, 0.3], cut: 1e3, reach_m: 7.0 };
/// Of one beacon on a roof.
const BEACON: f32 = 9.0;
const BEACON_REACH_M: f32 = 28.0;

/// What a source at an actor throws into the world.
pub(super) fn lamp(world_from_actor: &Pose, source: &Source) -> Lamp {
    let beam = match source.shine {
        Shine::LowBeam => &LOW,
        Shine::HighBeam => &HIGH,
        Shine::FrontFog => &FRONT_FOG,
        Shine::Position => &POSITION,
        Shine::Tail => &TAIL,
        Shine::Brake => &BRAKE,
        Shine::Reverse => &REVERSE,
        Shine::Blinker => &BLINKER,
        Shine::Beacon(colour) => {
            let place = world_from_actor * nalgebra::Point3::from(source.at_m);
            let colour = colour.map(|part| part * BEACON);
            return Lamp::round(place.coords.into(), colour, BEACON_REACH_M);
        }
    };
    let at_m = source.at_m - source.ahead * INSIDE_M;
    let ahead = (world_from_actor * source.ahead).normalize();
    let left = Vector3::cross(&(world_from_actor * Vec3::z()), &ahead).normalize();
    let place = world_from_actor * nalgebra::Point3::from(at_m);
    Lamp {
        left: left.into(),
        narrow: beam.narrow,
        cut: beam.cut,
        ..Lamp::beam(
            place.coords.into(),
            ahead.into(),
            beam.colour.map(|part| part * beam.brightness),
            beam.reach_m,
        )
    }
}

//! What the lamps of vehicles throw on the road and on what stands there.
//!
//! Brightness is chosen by eye for a picture by night, in the unit of [`raster::Lamp`]: real beams
//! span more steps than a picture has. Shapes are those of UN Regulations 112 (low beams end 1 %
//! below the level of the lamp) and 19 (fog lamps are wide and end lower).

use nalgebra::{Point3, Vector3};
use raster::Lamp;
use schemas::{ActorState, Vec3};

use super::super::vehicle::LampPlaces;
use super::Placer;
use super::lamps::{AMBER, Lit, RED, WHITE, flag};

/// How far inside the body a lamp is, in metres, so that its own body turns away from it.
const INSIDE_M: f32 = 0.35;

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

/// Where a vehicle's lamps are, in its own frame: half of the distance between two of them, and
/// the places in the middle.
pub(super) struct Sources {
    head_m: Vec3,
    tail_m: Vec3,
    /// Of head lamps, tail lamps, fog lamps; 0 for a single one.
    aside_m: [f32; 3],
    fog_m: Vec3,
}

impl Sources {
    /// Of a body with lamps at its corners.
    pub(super) fn of_body(actor: &ActorState, places: &LampPlaces) -> Self {
        let ([front_x, rear_x], [front_z, rear_z]) = (places.end_x, places.top_z);
        let half = actor.box_half_extent_m;
        let at = |x: f32, z: f32| actor.box_centre_m + Vec3::new(x * half.x, 0.0, z * half.z);
        Self {
            head_m: at(front_x, front_z - 0.18),
            tail_m: at(rear_x, rear_z - 0.12),
            aside_m: [0.68, 0.74, 0.56].map(|part| part * half.y),
            fog_m: at(1.0, -0.565),
        }
    }

    /// Of what has one lamp ahead and one behind.
    pub(super) fn single(head_m: Vec3, tail_m: Vec3) -> Self {
        Self { head_m, tail_m, aside_m: [0.0; 3], fog_m: head_m }
    }
}

impl Lit {
    /// Adds what the lamps of a vehicle throw.
    pub(super) fn shine(self, placer: &mut Placer, sources: &Sources, blinks: bool) {
        let [head_m, tail_m, fog_m] = sources.aside_m;
        if self.has(flag::LOW_BEAM) {
            placer.shine_twice(&LOW, sources.head_m, head_m, Vec3::x());
        } else if self.has(flag::POSITION) && !self.has(flag::HIGH_BEAM) {
            placer.shine(&POSITION, sources.head_m, Vec3::x());
        }
        if self.has(flag::HIGH_BEAM) {
            placer.shine_twice(&HIGH, sources.head_m, head_m, Vec3::x());
        }
        if self.has(flag::FOG) {
            placer.shine_twice(&FRONT_FOG, sources.fog_m, fog_m, Vec3::x());
        }
        if self.has(flag::BRAKE) {
            placer.shine(&BRAKE, sources.tail_m, -Vec3::x());
        } else if self.has(flag::POSITION) {
            placer.shine(&TAIL, sources.tail_m, -Vec3::x());
        }
        if self.has(flag::REVERSE) {
            placer.shine(&REVERSE, sources.tail_m, -Vec3::x());
        }
        for (side, blinker) in [(1.0, flag::LEFT_BLINKER), (-1.0, flag::RIGHT_BLINKER)] {
            if blinks && self.has(blinker) {
                let aside = |at: Vec3, by: f32| at + Vec3::y() * (side * by);
                placer.shine(
                    &BLINKER,
                    aside(sources.head_m, head_m),
                    Vec3::new(0.7, 0.7 * side, 0.0),
                );
                placer.shine(
                    &BLINKER,
                    aside(sources.tail_m, tail_m),
                    Vec3::new(-0.7, 0.7 * side, 0.0),
                );
            }
        }
    }
}

impl Placer {
    fn shine_twice(&mut self, beam: &Beam, middle_m: Vec3, aside_m: f32, ahead: Vec3) {
        if aside_m == 0.0 {
            return self.shine(beam, middle_m, ahead);
        }
        for side in [-aside_m, aside_m] {
            self.shine(beam, middle_m + Vec3::y() * side, ahead);
        }
    }

    fn shine(&mut self, beam: &Beam, at_m: Vec3, ahead: Vec3) {
        let at_m = at_m - ahead * INSIDE_M;
        let turned = |axis: Vec3| -> Vec3 { self.world_from_actor.transform_vector(&axis) };
        let ahead = turned(ahead).normalize();
        let left = Vector3::cross(&turned(Vec3::z()), &ahead).normalize();
        let place: Vec3 = self.world_from_actor.transform_point(&Point3::from(at_m)).coords;
        self.lamps.push(Lamp {
            left: left.into(),
            narrow: beam.narrow,
            cut: beam.cut,
            ..Lamp::beam(
                place.into(),
                ahead.into(),
                beam.colour.map(|part| part * beam.brightness),
                beam.reach_m,
            )
        });
    }

    /// A beacon that is lit, at a place of the actor's frame.
    pub(super) fn shine_around(&mut self, at_m: Vec3, colour: [f32; 3]) {
        let place: Vec3 = self.world_from_actor.transform_point(&Point3::from(at_m)).coords;
        let colour = colour.map(|part| part * BEACON);
        self.lamps.push(Lamp::round(place.into(), colour, BEACON_REACH_M));
    }
}

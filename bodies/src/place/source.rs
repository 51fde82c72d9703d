//! Where the lamps of vehicles shine from; how bright is the renderer's business.

use schemas::{ActorState, Vec3};

use super::Placer;
use super::lamps::{Lit, flag};
use crate::shape::vehicle::LampPlaces;

/// How a lamp shines.
#[derive(Clone, Copy, Debug, PartialEq)]
#[allow(missing_docs, reason = "the names are the lamps")]
pub enum Shine {
    LowBeam,
    HighBeam,
    FrontFog,
    Position,
    Tail,
    Brake,
    Reverse,
    Blinker,
    /// On a roof, in a linear colour, all around.
    Beacon([f32; 3]),
}

/// A lamp that is lit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Source {
    /// How.
    pub shine: Shine,
    /// Where, in the actor's frame.
    pub at_m: Vec3,
    /// Direction in the actor's frame; of any length, and without meaning for a beacon.
    pub ahead: Vec3,
}

/// Where a vehicle's lamps are, in its own frame: half of the distance between two of them, and
/// the places in the middle.
pub(super) struct Lamps {
    head_m: Vec3,
    tail_m: Vec3,
    /// Of head lamps, tail lamps, fog lamps; 0 for a single one.
    aside_m: [f32; 3],
    fog_m: Vec3,
}

impl Lamps {
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
    pub(super) fn shine(self, placer: &mut Placer, lamps: &Lamps, blinks: bool) {
        let [head_m, tail_m, fog_m] = lamps.aside_m;
        if self.has(flag::LOW_BEAM) {
            placer.shine_twice(Shine::LowBeam, lamps.head_m, head_m);
        } else if self.has(flag::POSITION) && !self.has(flag::HIGH_BEAM) {
            placer.shine(Shine::Position, lamps.head_m, Vec3::x());
        }
        if self.has(flag::HIGH_BEAM) {
            placer.shine_twice(Shine::HighBeam, lamps.head_m, head_m);
        }
        if self.has(flag::FOG) {
            placer.shine_twice(Shine::FrontFog, lamps.fog_m, fog_m);
        }
        if self.has(flag::BRAKE) {
            placer.shine(Shine::Brake, lamps.tail_m, -Vec3::x());
        } else if self.has(flag::POSITION) {
            placer.shine(Shine::Tail, lamps.tail_m, -Vec3::x());
        }
        if self.has(flag::REVERSE) {
            placer.shine(Shine::Reverse, lamps.tail_m, -Vec3::x());
        }
        for (side, blinker) in [(1.0, flag::LEFT_BLINKER), (-1.0, flag::RIGHT_BLINKER)] {
            if blinks && self.has(blinker) {
                let mut put = |at_m: Vec3, by_m: f32, x: f32| {
                    let at_m = at_m + Vec3::y() * (side * by_m);
                    placer.shine(Shine::Blinker, at_m, Vec3::new(x, 0.7 * side, 0.0));
                };
                put(lamps.head_m, head_m, 0.7);
                put(lamps.tail_m, tail_m, -0.7);
            }
        }
    }
}

impl Placer {
    /// Two lamps that shine ahead, or one in the middle.
    fn shine_twice(&mut self, shine: Shine, middle_m: Vec3, aside_m: f32) {
        if aside_m == 0.0 {
            return self.shine(shine, middle_m, Vec3::x());
        }
        for side in [-aside_m, aside_m] {
            self.shine(shine, middle_m + Vec3::y() * side, Vec3::x());
        }
    }
}

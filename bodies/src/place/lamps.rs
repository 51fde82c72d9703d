//! Lamps of vehicles: what CARLA's light flags switch on, and nothing that they do not.

use nalgebra::Matrix4;
use schemas::{ActorState, Vec3};

use super::source::{Lamps, Shine};
use super::{Placer, box_scale, glowing, linear, opaque};
use crate::shape::Shape;
use crate::shape::vehicle::lamp_places;

/// CARLA's `VehicleLightState`.
pub(super) mod flag {
    pub(in super::super) const POSITION: u32 = 1;
    pub(in super::super) const LOW_BEAM: u32 = 1 << 1;
    pub(in super::super) const HIGH_BEAM: u32 = 1 << 2;
    pub(in super::super) const BRAKE: u32 = 1 << 3;
    pub(in super::super) const RIGHT_BLINKER: u32 = 1 << 4;
    pub(in super::super) const LEFT_BLINKER: u32 = 1 << 5;
    pub(in super::super) const REVERSE: u32 = 1 << 6;
    pub(in super::super) const FOG: u32 = 1 << 7;
    pub(in super::super) const INTERIOR: u32 = 1 << 8;
    pub(in super::super) const SPECIAL: u32 = 1 << 9 | 1 << 10;
}

/// Length of one flash of a blinker with the pause after it, in seconds: 86 a minute, of the 60 to
/// 120 that UN Regulation 48 allows.
const BLINK_SECS: f64 = 0.7;
/// Length of one flash of emergency lamps with the pause after it, in seconds.
const FLASH_SECS: f64 = 0.4;

const WHITE: [f32; 3] = [1.0, 0.98, 0.92];
const AMBER: [f32; 3] = [1.0, 0.36, 0.02];
const RED: [f32; 3] = [1.0, 0.010, 0.008];
/// Windows of a dark cabin.
const GLASS: [f32; 3] = [0.012, 0.015, 0.018];

/// Front and rear blinkers of a motorcycle in the box of its frame, on the left side.
const FRAME_BLINKERS: [Block; 2] =
    [[(0.42, 0.50), (0.55, 0.85), (-0.05, 0.05)], [(-0.86, -0.80), (0.35, 0.65), (-0.20, -0.11)]];

/// Which lamps of one vehicle are lit at one moment.
#[derive(Clone, Copy)]
pub(super) struct Lit {
    lights: u32,
    sim_secs: f64,
}

/// Ends of a lamp in the box from -1 to 1, on the left side: along, across, up.
type Block = [(f32, f32); 3];

impl Lit {
    pub(super) fn of(actor: &ActorState, sim_secs: f64) -> Self {
        Self { lights: actor.lights, sim_secs: if sim_secs.is_finite() { sim_secs } else { 0.0 } }
    }

    pub(super) fn has(self, flags: u32) -> bool {
        self.lights & flags != 0
    }

    /// Whether a lamp that is lit for the first half of every period is lit now.
    fn flashes(self, period_secs: f64) -> bool {
        self.sim_secs.rem_euclid(period_secs) < period_secs / 2.0
    }

    /// Paint, head lamps, tail lamps, windows.
    pub(super) fn tints(self, colour_rgb: u32) -> [[u8; 4]; 4] {
        let head = if self.has(flag::LOW_BEAM | flag::HIGH_BEAM) {
            glowing(WHITE, 1.0)
        } else if self.has(flag::POSITION) {
            glowing(WHITE, 0.12)
        } else {
            opaque([0.62, 0.64, 0.67])
        };
        let tail = if self.has(flag::BRAKE) {
            glowing(RED, 0.9)
        } else if self.has(flag::POSITION) {
            glowing([0.5, 0.008, 0.006], 0.16)
        } else {
            opaque([0.30, 0.010, 0.010])
        };
        let windows =
            if self.has(flag::INTERIOR) { glowing([0.34, 0.27, 0.17], 0.5) } else { opaque(GLASS) };
        [opaque(linear(colour_rgb)), head, tail, windows]
    }

    /// Puts the lamps that are no part of a body: they are there only while they are lit.
    pub(super) fn place(self, placer: &mut Placer, actor: &ActorState, shape: Shape) {
        let Some(places) = lamp_places(shape) else { return };
        let ([front_x, rear_x], [front, rear]) = (places.end_x, places.top_z);
        let blinks = self.flashes(BLINK_SECS);
        self.shine(placer, &Lamps::of_body(actor, &places), blinks);
        let actor_from_box = box_scale(actor);
        let corner = [
            ((0.86, front_x + 0.007), (0.84, 0.945), (front - 0.25, front - 0.11)),
            ((rear_x - 0.006, -0.86), (0.74, 0.935), (rear - 0.23, rear - 0.13)),
        ]
        .map(<[(f32, f32); 3]>::from);
        for (side, blinker) in [(1.0, flag::LEFT_BLINKER), (-1.0, flag::RIGHT_BLINKER)] {
            let mut put = |block: Block, colour: [f32; 3]| {
                put_lamp(placer, &actor_from_box, block, side, glowing(colour, 1.0));
            };
            if self.has(blinker) && blinks {
                corner.iter().for_each(|block| put(*block, AMBER));
            }
            if self.has(flag::REVERSE) {
                put([(rear_x - 0.006, -0.90), (0.46, 0.60), (rear - 0.20, rear - 0.06)], WHITE);
            }
            if self.has(flag::HIGH_BEAM) {
                put([(0.90, front_x + 0.007), (0.43, 0.53), (front - 0.25, front - 0.11)], WHITE);
            }
            if self.has(flag::FOG) {
                put([(0.93, 1.018), (0.48, 0.64), (-0.61, -0.52)], WHITE);
                put([(-1.018, -0.93), (0.50, 0.68), (-0.60, -0.51)], RED);
            }
        }
    }

    /// Puts the lamps of a two-wheeler, in the box of its frame: blinkers, and head and tail lamp
    /// of a bicycle, whose frame has none.
    pub(super) fn place_on_frame(
        self,
        placer: &mut Placer,
        actor_from_frame: &Matrix4<f32>,
        is_bicycle: bool,
    ) {
        let blinks = self.flashes(BLINK_SECS);
        let at = |x: f32, z: f32| {
            actor_from_frame.transform_point(&nalgebra::Point3::new(x, 0.0, z)).coords
        };
        self.shine(placer, &Lamps::single(at(0.56, -0.02), at(-0.86, -0.17)), blinks);
        for (side, blinker) in [(1.0, flag::LEFT_BLINKER), (-1.0, flag::RIGHT_BLINKER)] {
            if self.has(blinker) && blinks && !is_bicycle {
                for block in FRAME_BLINKERS {
                    put_lamp(placer, actor_from_frame, block, side, glowing(AMBER, 1.0));
                }
            }
        }
        if !is_bicycle {
            return;
        }
        let [_, head, tail, _] = self.tints(0);
        let lamps = flag::POSITION | flag::LOW_BEAM | flag::HIGH_BEAM;
        if self.has(lamps) {
            put_lamp(
                placer,
                actor_from_frame,
                [(0.44, 0.50), (-0.14, 0.14), (-0.04, 0.06)],
                1.0,
                head,
            );
        }
        if self.has(flag::POSITION | flag::BRAKE) {
            put_lamp(
                placer,
                actor_from_frame,
                [(-0.70, -0.66), (-0.12, 0.12), (-0.24, -0.16)],
                1.0,
                tail,
            );
        }
    }

    /// Colours of two lamps on a roof, the right one and the left one, that flash in turn, and
    /// what the one that is lit throws.
    pub(super) fn beacons(
        self,
        placer: &mut Placer,
        roof_m: Vec3,
        [right, left]: [[f32; 3]; 2],
    ) -> [[u8; 4]; 4] {
        let is_right = self.flashes(FLASH_SECS);
        if self.has(flag::SPECIAL) {
            let colour = if is_right { right } else { left };
            placer.shine(Shine::Beacon(colour), roof_m + Vec3::z() * 0.3, Vec3::x());
        }
        let lamp = |colour: [f32; 3], turn: bool| {
            if self.has(flag::SPECIAL) && turn { glowing(colour, 1.0) } else { opaque(colour) }
        };
        [lamp(right, is_right), [0; 4], lamp(left, !is_right), [0; 4]]
    }

    /// Colours of a lamp on a roof that does not flash.
    pub(super) fn roof_sign(self, colour: [f32; 3]) -> [[u8; 4]; 4] {
        let lamp = if self.has(flag::SPECIAL) { glowing(colour, 0.8) } else { opaque(colour) };
        [lamp, [0; 4], lamp, [0; 4]]
    }
}

/// A lamp on the left (1) or right (-1) side.
fn put_lamp(
    placer: &mut Placer,
    actor_from_box: &Matrix4<f32>,
    block: Block,
    side: f32,
    tint: [u8; 4],
) {
    let [along, across, up] = block;
    let middle = |(a, b): (f32, f32)| (a + b) / 2.0;
    let half = |(a, b): (f32, f32)| (b - a) / 2.0;
    let at = Vec3::new(middle(along), side * middle(across), middle(up));
    let size = Vec3::new(half(along), half(across), half(up));
    let lamp = Matrix4::new_translation(&at) * Matrix4::new_nonuniform_scaling(&size);
    placer.put(Shape::Block, actor_from_box * lamp, [tint; 4]);
}

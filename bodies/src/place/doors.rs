//! Open doors of vehicles: a leaf turned about its hinge, and the dark gap that it leaves. Closed
//! doors are part of the body.

use std::f32::consts::{FRAC_PI_2, PI};

use nalgebra::Matrix4;
use schemas::{ActorState, Vec3};

use super::{Placer, box_scale, opaque};
use crate::shape::Shape;

/// How far side doors open, in radians.
const SIDE_OPEN_RAD: f32 = 1.1;
/// Half thickness of a leaf, in metres.
const LEAF_HALF_M: f32 = 0.04;
/// What is seen through a door: seats and carpet in the shade.
const INSIDE: [f32; 3] = [0.006, 0.006, 0.007];

/// Where the doors of a body are, in the box from -1 to 1.
struct Doors {
    /// Hinge and rear edge of the front doors, and of the rear doors where there are any.
    sides: [Option<(f32, f32)>; 2],
    /// Lower edge, belt line, upper edge of the windows.
    up: [f32; 3],
    hood: Option<Lid>,
    trunk: Option<Lid>,
}

/// A leaf that opens upwards about a hinge across the body.
struct Lid {
    /// Along and up.
    hinge: [f32; 2],
    /// In box units along, or up if it hangs from the roof.
    length: f32,
    hangs: bool,
    /// Direction from the hinge to the free edge when open, upwards from straight ahead.
    open_rad: f32,
    /// From the axis that is left at the hinge to the painted side: a quarter turn.
    outside_rad: f32,
    /// Ends of the gap, along and up.
    gap: [(f32, f32); 2],
}

const HOOD: Lid = Lid {
    hinge: [0.46, 0.14],
    length: 0.48,
    hangs: false,
    open_rad: 0.95,
    outside_rad: FRAC_PI_2,
    gap: [(0.52, 0.92), (-0.10, 0.085)],
};
const BOOT: Lid = Lid {
    hinge: [-0.74, 0.24],
    length: 0.25,
    hangs: false,
    open_rad: 1.95,
    outside_rad: -FRAC_PI_2,
    gap: [(-0.975, -0.76), (-0.10, 0.235)],
};
const TAILGATE: Lid = Lid {
    hinge: [-0.84, 0.92],
    length: 1.1,
    hangs: true,
    open_rad: 2.9,
    outside_rad: -FRAC_PI_2,
    gap: [(-1.005, -0.90), (-0.30, 0.72)],
};

impl Doors {
    fn of(shape: Shape) -> Option<Self> {
        let car = |front: (f32, f32), rear: Option<(f32, f32)>, trunk: Lid| Self {
            sides: [Some(front), rear],
            up: [-0.64, 0.19, 0.88],
            hood: Some(HOOD),
            trunk: Some(trunk),
        };
        Some(match shape {
            Shape::Sedan => car((0.38, -0.16), Some((-0.18, -0.60)), BOOT),
            Shape::Coupe => car((0.30, -0.32), None, BOOT),
            Shape::Hatchback => car((0.40, -0.11), Some((-0.13, -0.56)), TAILGATE),
            Shape::OffRoader => car((0.38, -0.09), Some((-0.11, -0.56)), TAILGATE),
            Shape::Wedge => Self {
                up: [-0.62, 0.36, 0.78],
                hood: None,
                ..car((0.40, 0.02), Some((-0.02, -0.50)), BOOT)
            },
            Shape::Van => Self {
                up: [-0.72, 0.10, 0.78],
                hood: None,
                ..car((0.70, 0.22), Some((0.18, -0.40)), TAILGATE)
            },
            Shape::Truck | Shape::FireEngine => Self::front_only((0.88, 0.56), [-0.62, 0.04, 0.54]),
            Shape::Bus => Self::front_only((0.96, 0.80), [-0.76, -0.05, 0.66]),
            _ => return None,
        })
    }

    fn front_only(front: (f32, f32), up: [f32; 3]) -> Self {
        Self { sides: [Some(front), None], up, hood: None, trunk: None }
    }
}

/// Puts the open doors of a vehicle with this body.
pub(super) fn place(placer: &mut Placer, actor: &ActorState, shape: Shape, tints: [[u8; 4]; 4]) {
    if actor.doors == 0 {
        return;
    }
    let Some(doors) = Doors::of(shape) else { return };
    let is_open = |bit: u8| actor.doors & (1 << bit) != 0;
    for (row, ends) in doors.sides.iter().enumerate() {
        let Some(ends) = *ends else { continue };
        for (column, side) in [1.0, -1.0].into_iter().enumerate() {
            if is_open((2 * row + column) as u8) {
                put_side_door(placer, actor, (ends, doors.up), side, tints);
            }
        }
    }
    for (bit, lid) in [(4, &doors.hood), (5, &doors.trunk)] {
        if let Some(lid) = lid.as_ref().filter(|_| is_open(bit)) {
            put_lid(placer, actor, lid, tints);
        }
    }
}

fn put_side_door(
    placer: &mut Placer,
    actor: &ActorState,
    ((hinge, edge), [low, belt, top]): ((f32, f32), [f32; 3]),
    side: f32,
    tints: [[u8; 4]; 4],
) {
    put_gap(placer, actor, [(edge, hinge), (0.985 * side, 1.006 * side), (low, belt)]);
    let half = actor.box_half_extent_m;
    let width_m = (hinge - edge) * half.x;
    let mut put = |shape: Shape, low: f32, high: f32| {
        let middle = Vec3::new(hinge, side * 0.99, (low + high) / 2.0).component_mul(&half);
        let size = Vec3::new(width_m / 2.0, LEAF_HALF_M, (high - low) / 2.0 * half.z);
        let outside_rad = if side > 0.0 { 0.0 } else { PI };
        // The leaf reaches backwards from its hinge.
        let leaf = Matrix4::new_translation(&(actor.box_centre_m + middle))
            * Matrix4::from_axis_angle(&Vec3::z_axis(), -side * SIDE_OPEN_RAD)
            * Matrix4::from_axis_angle(&Vec3::x_axis(), outside_rad)
            * Matrix4::new_nonuniform_scaling(&size)
            * Matrix4::new_translation(&-Vec3::x());
        placer.put(shape, leaf, tints);
    };
    put(Shape::DoorPanel, low, belt);
    put(Shape::DoorWindow, belt, top);
}

fn put_lid(placer: &mut Placer, actor: &ActorState, lid: &Lid, tints: [[u8; 4]; 4]) {
    put_gap(placer, actor, [lid.gap[0], (-0.72, 0.72), lid.gap[1]]);
    let half = actor.box_half_extent_m;
    let length_m = lid.length * if lid.hangs { half.z } else { half.x };
    let hinge = Vec3::new(lid.hinge[0] * half.x, 0.0, lid.hinge[1] * half.z);
    let size = Vec3::new(length_m / 2.0, LEAF_HALF_M, 0.74 * half.y);
    let leaf = Matrix4::new_translation(&(actor.box_centre_m + hinge))
        * Matrix4::from_axis_angle(&Vec3::y_axis(), -lid.open_rad)
        * Matrix4::from_axis_angle(&Vec3::x_axis(), lid.outside_rad)
        * Matrix4::new_nonuniform_scaling(&size)
        * Matrix4::new_translation(&Vec3::x());
    placer.put(Shape::DoorPanel, leaf, tints);
}

/// A dark block between these ends along, across and up, in the box from -1 to 1.
fn put_gap(placer: &mut Placer, actor: &ActorState, ends: [(f32, f32); 3]) {
    let [along, across, up] = ends;
    let at = [along, across, up].map(|(a, b)| (a + b) / 2.0);
    let size = [along, across, up].map(|(a, b)| (b - a).abs() / 2.0);
    let block = Matrix4::new_translation(&Vec3::from(at))
        * Matrix4::new_nonuniform_scaling(&Vec3::from(size));
    placer.put(Shape::Block, box_scale(actor) * block, [opaque(INSIDE); 4]);
}

//! Vehicles: a body by blueprint and size, and wheels that steer.

use nalgebra::Matrix4;
use schemas::{ActorState, SemanticTag, TagId, Vec3};

use super::clothes::Clothes;
use super::lamps::Lit;
use super::{Placer, box_scale, doors};
use crate::shape::Shape;

/// Where the wheels of a class of vehicle are.
struct Wheels {
    radius_m: f32,
    half_width_m: f32,
    /// Axles as parts of the half length; the first one steers.
    axles: &'static [f32],
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Class {
    Car(Shape),
    Heavy(Shape),
    Motorcycle,
    Bicycle,
}

pub(super) fn place(placer: &mut Placer, actor: &ActorState, type_id: &str, sim_secs: f64) {
    let lit = Lit::of(actor, sim_secs);
    let tints = lit.tints(actor.colour_rgb);
    let half = actor.box_half_extent_m;
    place_on_roof(placer, actor, type_id, lit);
    match class_of(type_id, half) {
        Class::Car(shape) => {
            place_body(placer, actor, shape, (lit, tints));
            let radius_m = (0.23 * 2.0 * half.z).clamp(0.24, 0.42);
            place_wheels(
                placer,
                actor,
                &Wheels { radius_m, half_width_m: 0.11, axles: &[0.60, -0.60] },
                tints,
            );
        }
        Class::Heavy(shape) => {
            place_body(placer, actor, shape, (lit, tints));
            let axles: &[f32] = if has_box(shape) { &[0.74, -0.52, -0.76] } else { &[0.66, -0.60] };
            let radius_m = if shape == Shape::Van { 0.36 } else { 0.50 };
            place_wheels(placer, actor, &Wheels { radius_m, half_width_m: 0.14, axles }, tints);
        }
        Class::Motorcycle => {
            place_two_wheeler(placer, actor, (Shape::MotorcycleFrame, 0.065), (lit, tints));
        }
        Class::Bicycle => {
            place_two_wheeler(placer, actor, (Shape::BicycleFrame, 0.02), (lit, tints));
        }
    }
}

fn place_body(
    placer: &mut Placer,
    actor: &ActorState,
    shape: Shape,
    (lit, tints): (Lit, [[u8; 4]; 4]),
) {
    placer.put(shape, box_scale(actor), tints);
    lit.place(placer, actor, shape);
    doors::place(placer, actor, shape, tints);
}

fn has_box(shape: Shape) -> bool {
    matches!(shape, Shape::Truck | Shape::FireEngine)
}

/// By the words that CARLA's blueprint ids use, else by size.
fn class_of(type_id: &str, half_m: Vec3) -> Class {
    const BY_WORD: [(&[&str], Class); 10] = [
        (&["crossbike", "omafiets", "century", "bicycle"], Class::Bicycle),
        (&["harley", "kawasaki", "yamaha", "vespa", "motorcycle"], Class::Motorcycle),
        (&["cybertruck", "pickup"], Class::Car(Shape::Wedge)),
        (&["firetruck"], Class::Heavy(Shape::FireEngine)),
        (&["carlacola", "european_hgv", "truck"], Class::Heavy(Shape::Truck)),
        (&["fusorosa", "bus"], Class::Heavy(Shape::Bus)),
        (&["ambulance", "sprinter", "t2", "van"], Class::Heavy(Shape::Van)),
        (&["patrol", "wrangler", "etron", "suv"], Class::Car(Shape::OffRoader)),
        (&["audi.tt", "mustang", "coupe"], Class::Car(Shape::Coupe)),
        (
            &[
                "micro",
                "isetta",
                "mini",
                "cooper",
                "c3",
                "a2",
                "leon",
                "prius",
                "micra",
                "grandtourer",
                "hatch",
            ],
            Class::Car(Shape::Hatchback),
        ),
    ];
    let in_words = |words: &[&str]| words.iter().any(|word| type_id.contains(word));
    if let Some((_, class)) = BY_WORD.iter().find(|(words, _)| in_words(words)) {
        return *class;
    }
    match half_m {
        half if half.y < 0.5 => Class::Motorcycle,
        half if half.x > 4.5 => Class::Heavy(Shape::Bus),
        half if half.z > 1.15 => Class::Heavy(Shape::Van),
        half if half.z > 0.88 => Class::Car(Shape::OffRoader),
        half if half.x < 2.05 => Class::Car(Shape::Hatchback),
        _ => Class::Car(Shape::Sedan),
    }
}

/// Lamps on the roofs of those who may hurry, and a taxi's sign.
fn place_on_roof(placer: &mut Placer, actor: &ActorState, type_id: &str, lit: Lit) {
    const BLUE: [f32; 3] = [0.01, 0.03, 1.0];
    const RED: [f32; 3] = [1.0, 0.010, 0.008];
    let is = |words: &[&str]| words.iter().any(|word| type_id.contains(word));
    let (along, half_m, colours) = if is(&["police"]) {
        (-0.1, Vec3::new(0.12, 0.52, 0.06), Some([BLUE, RED]))
    } else if is(&["ambulance", "firetruck"]) {
        (0.45, Vec3::new(0.15, 0.70, 0.08), Some([BLUE, BLUE]))
    } else if is(&["ford.crown", "taxi"]) {
        (-0.15, Vec3::new(0.10, 0.25, 0.08), None)
    } else {
        return;
    };
    let half = actor.box_half_extent_m;
    let roof_m = actor.box_centre_m + Vec3::new(along * half.x, 0.0, half.z - 0.01);
    let tints = match colours {
        Some(colours) => lit.beacons(placer, roof_m, colours),
        None => lit.roof_sign([0.9, 0.6, 0.05]),
    };
    let bar = Matrix4::new_translation(&roof_m) * Matrix4::new_nonuniform_scaling(&half_m);
    placer.put(Shape::LightBar, bar, tints);
}

fn place_wheels(placer: &mut Placer, actor: &ActorState, wheels: &Wheels, tints: [[u8; 4]; 4]) {
    let half = actor.box_half_extent_m;
    let ground_z = actor.box_centre_m.z - half.z;
    for (axle, along) in wheels.axles.iter().enumerate() {
        let steer_rad = if axle == 0 { finite(actor.road_wheel_rad) } else { 0.0 };
        for side in [-1.0f32, 1.0] {
            let x = actor.box_centre_m.x + along * half.x;
            let body_side = actor.box_centre_m.y + side * half.y;
            let hub = |y: f32| Vec3::new(x, y, ground_z + wheels.radius_m);
            let size = Vec3::new(wheels.radius_m, wheels.half_width_m, wheels.radius_m);
            let wheel =
                Matrix4::new_translation(&hub(body_side - side * (wheels.half_width_m - 0.03)))
                    * Matrix4::from_axis_angle(&Vec3::z_axis(), steer_rad)
                    * Matrix4::new_nonuniform_scaling(&size);
            placer.put(Shape::Wheel, wheel, tints);
            let gap_m = wheels.radius_m * 1.17;
            let arch = Matrix4::new_translation(&hub(body_side))
                * Matrix4::new_nonuniform_scaling(&Vec3::new(gap_m, 0.012, gap_m));
            placer.put(Shape::WheelArch, arch, tints);
        }
    }
}

/// A frame, two wheels in line and the rider, whose height follows from a grown-up's.
fn place_two_wheeler(
    placer: &mut Placer,
    actor: &ActorState,
    (frame, half_width_m): (Shape, f32),
    (lit, tints): (Lit, [[u8; 4]; 4]),
) {
    let half = actor.box_half_extent_m;
    let ground_m = actor.box_centre_m - Vec3::z() * half.z;
    // The frame alone is 1.1 m high; what the box has above is the rider.
    let frame_half = Vec3::new(half.x, half.y.min(0.35), 0.6);
    let frame_box = Matrix4::new_translation(&(ground_m + Vec3::z() * frame_half.z))
        * Matrix4::new_nonuniform_scaling(&frame_half);
    placer.put(frame, frame_box, tints);
    lit.place_on_frame(placer, &frame_box, frame == Shape::BicycleFrame);
    let radius_m = 0.33;
    for (along, steer_rad) in [(0.64, finite(actor.road_wheel_rad)), (-0.64, 0.0)] {
        let hub = ground_m + Vec3::new(along * half.x, 0.0, radius_m);
        let wheel = Matrix4::new_translation(&hub)
            * Matrix4::from_axis_angle(&Vec3::z_axis(), steer_rad)
            * Matrix4::new_nonuniform_scaling(&Vec3::new(radius_m, half_width_m, radius_m));
        placer.put(Shape::ThinWheel, wheel, tints);
    }
    let saddle = ground_m + Vec3::new(-0.22 * half.x, 0.0, 0.60);
    let rider = Matrix4::new_translation(&(saddle + Vec3::z() * 0.05)) * Matrix4::new_scaling(1.72);
    placer.label = TagId::of_actor(SemanticTag::Rider, actor.id);
    placer.put(Shape::Rider, rider, Clothes::of(actor.id).tints);
}

fn finite(angle_rad: f32) -> f32 {
    if angle_rad.is_finite() { angle_rad } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blueprints_choose_the_body_and_size_decides_otherwise() {
        let half = Vec3::new(2.4, 0.95, 0.72);
        assert_eq!(class_of("vehicle.tesla.model3", half), Class::Car(Shape::Sedan));
        assert_eq!(class_of("vehicle.nissan.patrol", half), Class::Car(Shape::OffRoader));
        assert_eq!(class_of("vehicle.kawasaki.ninja", half), Class::Motorcycle);
        assert_eq!(class_of("vehicle.tesla.cybertruck", half), Class::Car(Shape::Wedge));
        assert_eq!(class_of("vehicle.audi.tt", half), Class::Car(Shape::Coupe));
        assert_eq!(
            class_of("vehicle.carlamotors.firetruck", half),
            Class::Heavy(Shape::FireEngine)
        );
        assert_eq!(
            class_of("vehicle.own.coach", Vec3::new(6.0, 1.3, 1.6)),
            Class::Heavy(Shape::Bus)
        );
    }
}

//! Published figures of real vehicles, and the manoeuvres that measure ours.
#![allow(
    dead_code,
    unreachable_pub,
    clippy::unwrap_used,
    reason = "test code; every test file uses its own part"
)]

use std::sync::{Arc, LazyLock};

use roads::Map;
use schemas::{ActorId, Command, Vec3, VehicleControl, level_pose};
use world::{Town, World};

use super::common::*;

/// What is known of a real vehicle.
pub struct Known {
    pub id: &'static str,
    /// Seconds from a stand to this speed, and its tolerance.
    pub start: (f32, f32, f32),
    /// Metres from this speed to a stand, and its tolerance.
    pub stop: (f32, f32, f32),
    /// Highest sideways acceleration over gravity, and its tolerance.
    pub corner: (f32, f32),
}

/// One measured value beside the published one.
#[derive(Debug)]
pub struct Row {
    pub what: String,
    pub measured: f32,
    pub published: f32,
    /// Share of the published value.
    pub tolerance: f32,
}

/// (km/h, seconds, tolerance), (km/h, metres, tolerance), (g, tolerance).
///
/// Sources: the makers' data sheets for the start of the cars; what road tests find in their class
/// for the rest (compact and sports car on summer tyres, 600 cm³ sports motorcycle, two-axle lorry
/// with air brakes and anti-lock).
pub const VEHICLES: &[Known] = &[
    Known {
        id: "vehicle.mini.cooper_s",
        start: (100.0, 7.1, 0.12),
        stop: (100.0, 39.0, 0.1),
        corner: (0.87, 0.12),
    },
    Known {
        id: "vehicle.audi.tt",
        start: (100.0, 5.3, 0.15),
        stop: (100.0, 36.5, 0.1),
        corner: (0.95, 0.12),
    },
    Known {
        id: "vehicle.carlamotors.firetruck",
        start: (65.0, 18.0, 0.3),
        stop: (65.0, 27.0, 0.25),
        corner: (0.6, 0.25),
    },
    Known {
        id: "vehicle.kawasaki.ninja",
        start: (100.0, 3.3, 0.2),
        stop: (100.0, 41.0, 0.15),
        corner: (0.85, 0.15),
    },
];

/// Asphalt of 3 km by 400 m, without anything on it.
const PAD: &str = r#"<?xml version="1.0"?>
<OpenDRIVE>
  <header revMajor="1" revMinor="4" name="pad" version="1" north="0" south="0" east="0" west="0"/>
  <road name="pad" length="3000" id="1" junction="-1">
    <planView><geometry s="0" x="-1000" y="0" hdg="0" length="3000"><line/></geometry></planView>
    <lanes><laneSection s="0">
      <left><lane id="1" type="driving" level="false">
        <width sOffset="0" a="200" b="0" c="0" d="0"/></lane></left>
      <center><lane id="0" type="none" level="false"/></center>
      <right><lane id="-1" type="driving" level="false">
        <width sOffset="0" a="200" b="0" c="0" d="0"/></lane></right>
    </laneSection></lanes>
  </road>
</OpenDRIVE>"#;

/// What all worlds on the pad share.
pub fn pad_town() -> Arc<Town> {
    static TOWN: LazyLock<Arc<Town>> = LazyLock::new(|| {
        let map = Map::parse("pad", PAD).expect("the pad is valid");
        Arc::new(Town::new(Arc::new(map)))
    });
    Arc::clone(&TOWN)
}

/// A vehicle on the pad that rolls at a speed along x.
pub fn rolling(id: &str, along_mps: f32) -> (World, ActorId) {
    let mut world = world_on(pad_town(), 0.05);
    let pose = level_pose(Vec3::new(-900.0, LANE_Y_M, 0.2), 0.0);
    let car = spawn_at(&mut world, id, pose, along_mps);
    (world, car)
}

/// A vehicle on the pad, at rest: what is spawned without a speed falls onto its wheels first.
pub fn standing(id: &str) -> (World, ActorId) {
    let (mut world, car) = rolling(id, 0.0);
    run(&mut world, 40);
    (world, car)
}

pub fn measure(known: &Known) -> [Row; 3] {
    let (start_kmh, start_secs, start_tolerance) = known.start;
    let (stop_kmh, stop_m, stop_tolerance) = known.stop;
    [
        Row {
            what: format!("0 to {start_kmh:.0} km/h, s"),
            measured: secs_to(known.id, start_kmh),
            published: start_secs,
            tolerance: start_tolerance,
        },
        Row {
            what: format!("{stop_kmh:.0} to 0 km/h, m"),
            measured: metres_from(known.id, stop_kmh),
            published: stop_m,
            tolerance: stop_tolerance,
        },
        Row {
            what: "steady circle, g".to_owned(),
            measured: highest_g(known.id),
            published: known.corner.0,
            tolerance: known.corner.1,
        },
    ]
}

fn secs_to(id: &str, kmh: f32) -> f32 {
    let (mut world, car) = standing(id);
    control(&mut world, car, VehicleControl { throttle: 1.0, ..Default::default() });
    for tick in 1..=1_200u16 {
        run(&mut world, 1);
        if speed_mps(&world, car) >= kmh / 3.6 {
            return f32::from(tick) * 0.05;
        }
    }
    f32::INFINITY
}

fn metres_from(id: &str, kmh: f32) -> f32 {
    let (mut world, car) = rolling(id, kmh / 3.6);
    run(&mut world, 10);
    set_speed(&mut world, car, kmh / 3.6);
    let start_m = position_m(&world, car).x;
    brake(&mut world, car);
    for _ in 0..600 {
        run(&mut world, 1);
        if speed_mps(&world, car) < 0.05 {
            break;
        }
    }
    position_m(&world, car).x - start_m
}

fn set_speed(world: &mut World, actor: ActorId, along_mps: f32) {
    let linear_mps = Some(Vec3::new(along_mps, 0.0, 0.0));
    world.apply(&Command::SetVelocity { actor, linear_mps, angular_radps: None }).unwrap();
}

/// Speed held by a light throttle while the steer grows slowly: the highest sideways acceleration.
fn highest_g(id: &str) -> f32 {
    let along_mps = 14.0;
    let (mut world, car) = rolling(id, along_mps);
    let (mut highest_mps2, mut held_mps2) = (0.0f32, 0.0f32);
    for tick in 0..240u16 {
        let steer = (f32::from(tick) / 200.0).min(1.0);
        let throttle = (0.3 * (along_mps - speed_mps(&world, car))).clamp(0.0, 0.6);
        control(&mut world, car, VehicleControl { throttle, steer, ..Default::default() });
        run(&mut world, 1);
        let now = state(&world, car);
        let sideways = now.angular_velocity_radps.z * now.linear_velocity_mps.norm();
        // A mean over about a second: what it holds, not what it touches on the way.
        held_mps2 += (sideways - held_mps2) * 0.05;
        highest_mps2 = highest_mps2.max(held_mps2);
    }
    highest_mps2 / 9.81
}

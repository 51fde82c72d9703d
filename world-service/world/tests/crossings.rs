//! People on pedestrian crossings, and who is counted that does not let them over.
#![allow(clippy::unwrap_used, reason = "helpers fail the test that calls them")]

mod common;

use std::sync::Arc;

use common::*;
use roads::Map;
use schemas::{ActorId, Vec3, VehicleControl, WorldId, level_pose};
use world::{Town, World, WorldConfig};

/// The crossing of the road, 4 m wide, begins here.
const CROSSING_X_M: f32 = 48.0;

/// A world with lights and signs, on the straight road with a crossing from kerb to kerb, or none.
fn world_with_crossing(has_crossing: bool) -> World {
    let corner = |(u, v): (i32, i32)| format!("<cornerLocal u=\"{u}\" v=\"{v}\" z=\"0\"/>");
    let corners: String = [(-2, -7), (2, -7), (2, 7), (-2, 7)].map(corner).concat();
    let crossing = format!(
        "<objects><object type=\"crosswalk\" id=\"3\" name=\"crossing\" s=\"1050\" t=\"0\" \
         zOffset=\"0\" hdg=\"0\" length=\"4\" width=\"14\"><outline>{corners}</outline></object>"
    );
    let text = ROAD.replace("SLOPE", "0");
    let text = if has_crossing { text.replace("<objects>", &crossing) } else { text };
    let map = Arc::new(Town::new(Arc::new(Map::parse("crossing", &text).unwrap())));
    let id = WorldId::new(1).unwrap();
    World::with_traffic(WorldConfig { id, epoch: 1, seed: 7, dt_secs: 0.05, map }).unwrap()
}

/// Somebody on the crossing, so far left of the middle of the car's lane.
fn stands(world: &mut World, beside_m: f32) -> ActorId {
    walker(world, CROSSING_X_M + 2.0, beside_m)
}

/// How often a car that a client drives over the crossing is counted.
fn counted(world: &mut World) -> u32 {
    let car = car(world, 5.0, 8.0);
    control(world, car, VehicleControl { throttle: 0.25, ..VehicleControl::default() });
    while position_m(world, car).x < CROSSING_X_M + 10.0 {
        assert!(run(world, 1).is_empty(), "nobody is hit");
    }
    world.frame().broken_by(car).map_or(0, |broken| broken.crossings)
}

#[test]
fn who_does_not_let_people_over_is_counted_also_where_nobody_looks_around() {
    let mut world = world_with_crossing(true);
    stands(&mut world, 2.2);
    assert_eq!(counted(&mut world), 1);
    let mut world = world_with_crossing(true);
    stands(&mut world, 4.5);
    assert_eq!(counted(&mut world), 0, "it is beside the way");
    let mut world = world_with_crossing(true);
    assert_eq!(counted(&mut world), 0, "nobody is there");
    let mut world = world_with_crossing(false);
    stands(&mut world, 2.2);
    assert_eq!(counted(&mut world), 0, "it is no crossing");
}

#[test]
fn whether_others_look_around_changes_nothing() {
    let mut world = world_with_crossing(true);
    stands(&mut world, 2.2);
    let pose = level_pose(Vec3::new(-200.0, 1.75, 0.0), std::f32::consts::PI);
    let other = spawn_at(&mut world, "vehicle.lincoln.mkz", pose, 8.0);
    let behaviour = schemas::AgentBehaviour::Normal;
    let join = schemas::TrafficCommand::Join { actor: other, behaviour };
    world.apply(&schemas::Command::Traffic(join)).unwrap();
    assert_eq!(counted(&mut world), 1);
}

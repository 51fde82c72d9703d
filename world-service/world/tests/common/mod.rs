//! A straight four-lane road, worlds on it, and what tests ask of them.
#![allow(
    dead_code,
    unreachable_pub,
    clippy::unwrap_used,
    reason = "test code; every test file uses its own part"
)]

use std::sync::{Arc, LazyLock};

use roads::Map;
use schemas::{
    ActorId, ActorState, Collision, Command, Pose, Vec3, VehicleCommand, VehicleControl, WorldId,
    level_pose,
};
use world::{Town, World, WorldConfig};

/// Two lanes of 3.5 m in each direction along x; traffic towards +x keeps to the right, at y < 0. A
/// house stands beside the road, a wall across it at x = 600.
pub const ROAD: &str = r#"<?xml version="1.0"?>
<OpenDRIVE>
  <header revMajor="1" revMinor="4" name="straight" version="1" north="0" south="0" east="0" west="0"/>
  <road name="main" length="2000" id="1" junction="-1">
    <planView><geometry s="0" x="-1000" y="0" hdg="0" length="2000"><line/></geometry></planView>
    <elevationProfile><elevation s="0" a="0" b="SLOPE" c="0" d="0"/></elevationProfile>
    <lanes><laneSection s="0">
      <left>
        <lane id="2" type="driving" level="false"><width sOffset="0" a="3.5" b="0" c="0" d="0"/></lane>
        <lane id="1" type="driving" level="false"><width sOffset="0" a="3.5" b="0" c="0" d="0"/></lane>
      </left>
      <center><lane id="0" type="none" level="false"/></center>
      <right>
        <lane id="-1" type="driving" level="false"><width sOffset="0" a="3.5" b="0" c="0" d="0"/></lane>
        <lane id="-2" type="driving" level="false"><width sOffset="0" a="3.5" b="0" c="0" d="0"/></lane>
      </right>
    </laneSection></lanes>
    <objects>
      <object type="building" id="1" s="1020" t="-20" zOffset="0" hdg="0" length="10" width="10" height="8"/>
      <object type="barrier" id="2" s="1600" t="0" zOffset="0" hdg="0" length="1" width="30" height="3"/>
    </objects>
  </road>
</OpenDRIVE>"#;

/// Middle of the left of the two lanes towards +x.
pub const LANE_Y_M: f32 = -1.75;
pub const KMH_40: f32 = 40.0 / 3.6;

fn town(slope: &str) -> Arc<Town> {
    let map = Map::parse("straight", &ROAD.replace("SLOPE", slope)).expect("the road is valid");
    Arc::new(Town::new(Arc::new(map)))
}

pub fn flat() -> Arc<Town> {
    static FLAT: LazyLock<Arc<Town>> = LazyLock::new(|| town("0"));
    Arc::clone(&FLAT)
}

pub fn slope_of_ten_percent() -> Arc<Town> {
    static SLOPE: LazyLock<Arc<Town>> = LazyLock::new(|| town("0.1"));
    Arc::clone(&SLOPE)
}

pub fn world_on(map: Arc<Town>, dt_secs: f64) -> World {
    let id = WorldId::new(1).unwrap();
    World::new(WorldConfig { id, epoch: 1, seed: 7, dt_secs, map }).unwrap()
}

pub fn world() -> World {
    world_on(flat(), 0.05)
}

pub fn spawn_at(world: &mut World, blueprint: &str, pose: Pose, forward_mps: f32) -> ActorId {
    let velocity_mps = pose.rotation * Vec3::new(forward_mps, 0.0, 0.0);
    let command = Command::spawn(blueprint, pose, velocity_mps);
    world.apply(&command).unwrap().unwrap()
}

/// Ids of everything with wheels.
pub fn vehicles() -> impl Iterator<Item = &'static str> {
    let all = blueprints::all().iter();
    all.filter(|it| matches!(it.class, blueprints::Class::Vehicle(_))).map(|it| it.id.as_str())
}

/// A saloon in the left lane at `x_m`, heading along +x.
pub fn car(world: &mut World, x_m: f32, forward_mps: f32) -> ActorId {
    let pose = level_pose(Vec3::new(x_m, LANE_Y_M, 0.0), 0.0);
    spawn_at(world, "vehicle.lincoln.mkz", pose, forward_mps)
}

/// A pedestrian beside the middle of the left lane, facing -x.
pub fn walker(world: &mut World, x_m: f32, beside_m: f32) -> ActorId {
    let pose = level_pose(Vec3::new(x_m, LANE_Y_M + beside_m, 0.9), std::f32::consts::PI);
    spawn_at(world, "walker.pedestrian.0001", pose, 0.0)
}

pub fn control(world: &mut World, actor: ActorId, control: VehicleControl) {
    world.apply(&Command::Vehicle(VehicleCommand::Control { actor, control })).unwrap();
}

pub fn brake(world: &mut World, actor: ActorId) {
    control(world, actor, VehicleControl { brake: 1.0, ..Default::default() });
}

pub fn state(world: &World, actor: ActorId) -> ActorState {
    world.frame().actor(actor).cloned().expect("the actor lives")
}

pub fn position_m(world: &World, actor: ActorId) -> Vec3 {
    state(world, actor).world_from_actor.translation.vector
}

pub fn speed_mps(world: &World, actor: ActorId) -> f32 {
    state(world, actor).linear_velocity_mps.norm()
}

/// Ticks and returns the collisions of all ticks.
pub fn run(world: &mut World, ticks: usize) -> Vec<Collision> {
    let mut collisions = Vec::new();
    for _ in 0..ticks {
        world.tick().unwrap();
        collisions.extend_from_slice(world.collisions());
    }
    collisions
}

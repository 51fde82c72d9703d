//! A wide level pad, and vehicles on it.
#![allow(
    dead_code,
    unreachable_pub,
    clippy::unwrap_used,
    reason = "test code; every test file uses its own part"
)]

use std::sync::{Arc, LazyLock};

use roads::Map;
use schemas::{ActorId, Vec3, level_pose};
use world::{Town, World};

use super::common::*;

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

//! Traffic on a ring road: flow and speed over density.

use std::sync::Arc;

use roads::Map;
use schemas::{
    ActorId, ActorKind, AgentBehaviour, Command, Error, ErrorCode, TrafficCommand, Vec3, WorldId,
    level_pose,
};
use world::{Town, World, WorldConfig};

use crate::Result;

/// Of the middle of the outer lane.
const LAP_M: f32 = 1_000.0;
const LANE_WIDTH_M: f32 = 3.5;
/// Roads of the ring.
const ARCS: u32 = 4;
pub(crate) const LIMIT_KMH: f32 = 50.0;
const DT_SECS: f64 = 0.05;
const TICKS_PER_SEC: u32 = 20;
/// Before speeds are measured, and how long they are.
const SETTLE_SECS: u32 = 120;
const MEASURE_SECS: u32 = 60;
/// At most this speed to begin with, so that nobody begins with a jolt.
const START_MPS: f32 = 5.0;

/// Who drives on a ring.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Ring {
    /// The vehicle of everybody.
    pub vehicle: &'static str,
    pub lane_count: u32,
    /// Handed out in turn.
    pub behaviours: &'static [AgentBehaviour],
}

/// What was found at one density.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Flow {
    /// Of each lane.
    pub vehicles_per_km: f32,
    /// Mean over vehicles and time.
    pub speed_kmh: f32,
    /// Of each lane.
    pub vehicles_per_hour: f32,
    /// Of everybody.
    pub lane_changes: u32,
    pub contacts: u32,
    pub vehicle_length_m: f32,
}

impl Ring {
    fn radius_m(lane: u32) -> f32 {
        LAP_M / std::f32::consts::TAU - LANE_WIDTH_M * lane as f32
    }

    /// Arcs of a circle, driven to the left.
    fn open_drive(self) -> String {
        let width_m = LANE_WIDTH_M * self.lane_count as f32;
        let radius_m = Self::radius_m(0) + LANE_WIDTH_M / 2.0 - width_m;
        let lanes: String = (1..=self.lane_count)
            .map(|lane| {
                format!(
                    r#"<lane id="-{lane}" type="driving" level="false">
        <link><predecessor id="-{lane}"/><successor id="-{lane}"/></link>
        <width sOffset="0" a="{LANE_WIDTH_M}" b="0" c="0" d="0"/>
        <roadMark sOffset="0" type="broken" width="0.15" laneChange="both"/></lane>"#
                )
            })
            .collect();
        let roads: String = (0..ARCS).map(|arc| road(arc, radius_m, &lanes)).collect();
        format!(
            r#"<?xml version="1.0"?>
<OpenDRIVE>
  <header revMajor="1" revMinor="4" name="ring" version="1" north="0" south="0" east="0" west="0"/>
  {roads}
</OpenDRIVE>"#
        )
    }

    /// A world with this many vehicles on every lane, evenly spaced.
    fn world(self, per_lane: u32) -> Result<World> {
        let internal = |text: String| Error::new(ErrorCode::Internal, text);
        let map = Map::parse("ring", &self.open_drive()).map_err(|e| internal(e.to_string()))?;
        let id = WorldId::new(1).ok_or_else(|| internal("no world has the id 0".to_owned()))?;
        let map = Arc::new(Town::new(Arc::new(map)));
        let config = WorldConfig { id, epoch: 1, seed: 7, dt_secs: DT_SECS, map };
        let mut world = World::new(config)?;
        let mut behaviours = self.behaviours.iter().copied().cycle();
        for index in 0..per_lane {
            for lane in 0..self.lane_count {
                // Neighbours are not abreast.
                let share = index as f32 + lane as f32 / self.lane_count as f32;
                let turn_rad = std::f32::consts::TAU * share / per_lane as f32;
                let outward = Vec3::new(turn_rad.sin(), -turn_rad.cos(), 0.0);
                let along = Vec3::new(turn_rad.cos(), turn_rad.sin(), 0.0);
                let pose = level_pose(outward * Self::radius_m(lane), turn_rad);
                let spawn = Command::spawn(self.vehicle, pose, along * START_MPS);
                let actor = world.apply(&spawn)?;
                let actor = actor.ok_or_else(|| internal("nothing was spawned".to_owned()))?;
                let behaviour = behaviours.next().unwrap_or(AgentBehaviour::Normal);
                world.apply(&Command::Traffic(TrafficCommand::Join { actor, behaviour }))?;
            }
        }
        Ok(world)
    }

    /// Drives with this many vehicles on every lane.
    pub(crate) fn drive(self, per_lane: u32) -> Result<Flow> {
        let mut world = self.world(per_lane)?;
        let (mut sum_mps, mut samples, mut contacts, mut lane_changes) = (0.0, 0u32, 0, 0);
        let mut lanes: Vec<(ActorId, u32)> = Vec::new();
        let mut vehicle_length_m = 0.0;
        for tick in 1..=(SETTLE_SECS + MEASURE_SECS) * TICKS_PER_SEC {
            world.tick()?;
            contacts += world.collisions().iter().filter(|hit| hit.started).count() as u32;
            if tick <= SETTLE_SECS * TICKS_PER_SEC || !tick.is_multiple_of(TICKS_PER_SEC) {
                continue;
            }
            let frame = world.frame();
            let vehicles = || frame.actors.iter().filter(|it| it.kind == ActorKind::Vehicle);
            for vehicle in vehicles() {
                sum_mps += vehicle.linear_velocity_mps.norm();
                samples += 1;
                vehicle_length_m = 2.0 * vehicle.box_half_extent_m.x;
            }
            let now: Vec<(ActorId, u32)> = vehicles()
                .map(|it| (it.id, self.lane_of(&it.world_from_actor.translation.vector)))
                .collect();
            lane_changes += lanes.iter().zip(&now).filter(|(before, now)| before != now).count();
            lanes = now;
        }
        let laps_km =
            (0..self.lane_count).map(Self::radius_m).sum::<f32>() * std::f32::consts::TAU / 1_000.0;
        let vehicles_per_km = (per_lane * self.lane_count) as f32 / laps_km;
        let speed_kmh = 3.6 * sum_mps / samples.max(1) as f32;
        Ok(Flow {
            vehicles_per_km,
            speed_kmh,
            vehicles_per_hour: vehicles_per_km * speed_kmh,
            lane_changes: lane_changes as u32,
            contacts,
            vehicle_length_m,
        })
    }

    /// The lane whose middle is nearest, from the outer one.
    fn lane_of(self, position_m: &Vec3) -> u32 {
        let inward_m = Self::radius_m(0) - position_m.xy().norm();
        ((inward_m / LANE_WIDTH_M).round().max(0.0) as u32).min(self.lane_count - 1)
    }
}

/// One arc of the reference line, which the lanes lie to the right of.
fn road(arc: u32, radius_m: f32, lanes: &str) -> String {
    let turn_rad = std::f32::consts::TAU / ARCS as f32;
    let heading_rad = turn_rad * arc as f32;
    let length_m = turn_rad * radius_m;
    let (x_m, y_m) = (radius_m * heading_rad.sin(), -radius_m * heading_rad.cos());
    let (before, after) = ((arc + ARCS - 1) % ARCS, (arc + 1) % ARCS);
    let curvature_per_m = 1.0 / radius_m;
    format!(
        r#"<road name="arc" length="{length_m}" id="{arc}" junction="-1">
    <link><predecessor elementType="road" elementId="{before}" contactPoint="end"/>
      <successor elementType="road" elementId="{after}" contactPoint="start"/></link>
    <type s="0" type="town"><speed max="{LIMIT_KMH}" unit="km/h"/></type>
    <planView><geometry s="0" x="{x_m}" y="{y_m}" hdg="{heading_rad}" length="{length_m}">
      <arc curvature="{curvature_per_m}"/></geometry></planView>
    <lanes><laneSection s="0">
      <center><lane id="0" type="none" level="false"/></center>
      <right>{lanes}</right>
    </laneSection></lanes>
  </road>"#
    )
}

//! A track with one vehicle on it.

use std::sync::Arc;

use roads::Map;
use schemas::{
    ActorId, ActorState, BodyCommand, Command, Error, ErrorCode, Vec3, VehicleCommand,
    VehicleControl, VehiclePhysics, VehicleReport, WorldId, level_pose,
};
use world::{Town, World, WorldConfig};

use crate::Result;

/// Length of a tick: one physics step.
pub(crate) const DT_SECS: f32 = 0.01;
/// Middle of the track.
const LANE_Y_M: f32 = -100.0;
/// Where vehicles begin.
const START_X_M: f32 = -900.0;

/// The shape of the track along x; asphalt of 3 km by 400 m.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Shape {
    Level,
    /// Rises by this share of the way.
    Slope(f32),
    /// Rises by this at x = -850, as a kerb does.
    Kerb(f32),
}

/// One vehicle on a track.
pub(crate) struct Rig {
    world: World,
    car: ActorId,
}

impl Shape {
    fn open_drive(self) -> String {
        let elevation = match self {
            Self::Level => String::new(),
            Self::Slope(share) => format!(r#"<elevation s="0" a="0" b="{share}" c="0" d="0"/>"#),
            Self::Kerb(rise_m) => {
                // Steeper would be a wall.
                let long_m = rise_m / 2.5;
                format!(
                    r#"<elevation s="0" a="0" b="0" c="0" d="0"/>
                       <elevation s="150" a="0" b="2.5" c="0" d="0"/>
                       <elevation s="{}" a="{rise_m}" b="0" c="0" d="0"/>"#,
                    150.0 + long_m
                )
            }
        };
        format!(
            r#"<?xml version="1.0"?>
<OpenDRIVE>
  <header revMajor="1" revMinor="4" name="track" version="1" north="0" south="0" east="0" west="0"/>
  <road name="track" length="3000" id="1" junction="-1">
    <planView><geometry s="0" x="-1000" y="0" hdg="0" length="3000"><line/></geometry></planView>
    <elevationProfile>{elevation}</elevationProfile>
    <lanes><laneSection s="0">
      <left><lane id="1" type="driving" level="false">
        <width sOffset="0" a="200" b="0" c="0" d="0"/></lane></left>
      <center><lane id="0" type="none" level="false"/></center>
      <right><lane id="-1" type="driving" level="false">
        <width sOffset="0" a="200" b="0" c="0" d="0"/></lane></right>
    </laneSection></lanes>
  </road>
</OpenDRIVE>"#
        )
    }

    fn height_m(self) -> f32 {
        match self {
            Self::Level | Self::Kerb(_) => 0.0,
            Self::Slope(share) => share * (START_X_M + 1_000.0),
        }
    }
}

impl Rig {
    /// A vehicle at its start, `above_m` over the track, rolling at `along_mps`.
    pub(crate) fn new(id: &str, shape: Shape, above_m: f32, along_mps: f32) -> Result<Self> {
        let map = Map::parse("track", &shape.open_drive())
            .map_err(|error| Error::new(ErrorCode::Internal, error.to_string()))?;
        let world = WorldId::new(1)
            .ok_or_else(|| Error::new(ErrorCode::Internal, "no world has the id 0"))?;
        let map = Arc::new(Town::new(Arc::new(map)));
        let dt_secs = f64::from(DT_SECS);
        let mut world = World::new(WorldConfig { id: world, epoch: 1, seed: 7, dt_secs, map })?;
        let start_m = Vec3::new(START_X_M, LANE_Y_M, shape.height_m() + above_m);
        let velocity_mps = Vec3::new(along_mps, 0.0, 0.0);
        let spawn = Command::spawn(id, level_pose(start_m, 0.0), velocity_mps);
        let car = world.apply(&spawn)?;
        let car = car.ok_or_else(|| Error::new(ErrorCode::Internal, "nothing was spawned"))?;
        Ok(Self { world, car })
    }

    /// On the level track, at rest on its wheels.
    pub(crate) fn standing(id: &str) -> Result<Self> {
        let mut rig = Self::new(id, Shape::Level, 0.05, 0.0)?;
        rig.run(2.0)?;
        Ok(rig)
    }

    /// On the level track, rolling and settled on its wheels.
    pub(crate) fn rolling(id: &str, along_mps: f32) -> Result<Self> {
        let mut rig = Self::new(id, Shape::Level, 0.0, along_mps)?;
        rig.run(0.5)?;
        rig.set_speed(along_mps)?;
        Ok(rig)
    }

    pub(crate) fn set_speed(&mut self, along_mps: f32) -> Result<()> {
        let linear_mps = Some(Vec3::new(along_mps, 0.0, 0.0));
        self.apply(&Command::Body(BodyCommand::SetVelocity {
            actor: self.car,
            linear_mps,
            angular_radps: None,
        }))
    }

    pub(crate) fn control(&mut self, control: VehicleControl) -> Result<()> {
        self.apply(&Command::Vehicle(VehicleCommand::Control { actor: self.car, control }))
    }

    pub(crate) fn brake(&mut self) -> Result<()> {
        self.control(VehicleControl { brake: 1.0, ..VehicleControl::default() })
    }

    pub(crate) fn step(&mut self) -> Result<()> {
        self.world.tick()
    }

    pub(crate) fn run(&mut self, secs: f32) -> Result<()> {
        (0..steps(secs)).try_for_each(|_| self.step())
    }

    pub(crate) fn state(&self) -> Result<ActorState> {
        let gone = || Error::new(ErrorCode::Internal, "the vehicle is gone");
        self.world.frame().actor(self.car).cloned().ok_or_else(gone)
    }

    pub(crate) fn position_m(&self) -> Result<Vec3> {
        Ok(self.state()?.world_from_actor.translation.vector)
    }

    pub(crate) fn speed_mps(&self) -> Result<f32> {
        Ok(self.state()?.linear_velocity_mps.norm())
    }

    pub(crate) fn report(&self) -> Result<VehicleReport> {
        self.world.vehicle_report(self.car)
    }

    pub(crate) fn change(&mut self, change: impl FnOnce(&mut VehiclePhysics)) -> Result<()> {
        let mut physics = Box::new(self.report()?.physics);
        change(&mut physics);
        self.apply(&Command::Vehicle(VehicleCommand::Physics { actor: self.car, physics }))
    }

    fn apply(&mut self, command: &Command) -> Result<()> {
        self.world.apply(command).map(drop)
    }
}

/// Ticks in a time.
pub(crate) fn steps(secs: f32) -> u32 {
    (secs / DT_SECS).round() as u32
}

/// Between the mean of the front wheels and that of the rear ones.
pub(crate) fn wheelbase_m(physics: &VehiclePhysics) -> f32 {
    let (front_m, rear_m) = axles_x_m(physics);
    front_m - rear_m
}

/// Where the axles are: the mean of the wheels before and behind the middle.
pub(crate) fn axles_x_m(physics: &VehiclePhysics) -> (f32, f32) {
    let xs = || physics.wheels.iter().map(|wheel| wheel.position_m.x);
    let middle_m = f32::midpoint(xs().fold(f32::MIN, f32::max), xs().fold(f32::MAX, f32::min));
    let mean = |front: bool| {
        let chosen: Vec<f32> = xs().filter(|&x_m| (x_m > middle_m) == front).collect();
        chosen.iter().sum::<f32>() / chosen.len().max(1) as f32
    };
    (mean(true), mean(false))
}

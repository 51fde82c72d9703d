//! How a car answers its pedals and wheels, as the tier of rigid bodies does.
//!
//! Accelerations are measured there, once for each grip of a road in a process: a car rolls on a
//! straight level road at one speed, and gets one pedal. What is between is interpolated.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, PoisonError};

use roads::Map;
use schemas::{
    ActorId, Command, Error, ErrorCode, Vec3, VehicleCommand, VehiclePhysics, Weather, WorldId,
    level_pose,
};
use world::{Town, World, WorldConfig};

use crate::action::Action;
use crate::limits::TICK_SECS;
use crate::motion::Shape;
use crate::physics;

/// Pedals and speeds at which is measured.
const PEDALS: [f32; 9] = [-1.0, -0.5, -0.25, -0.1, 0.0, 0.25, 0.5, 0.75, 1.0];
const SPEEDS_MPS: [f32; 8] = [0.0, 3.0, 6.0, 10.0, 15.0, 20.0, 30.0, 45.0];
/// Ticks before and during the measurement: brakes and engine take time to answer.
const BEFORE: usize = 6;
const DURING: usize = 10;
/// As the tier of rigid bodies turns its wheels.
const STEER_RADPS: f32 = 1.0;
const GRAVITY_MPS2: f32 = 9.81;
/// Share of the tyres' friction that a car corners with when it slides.
const GRIP: f32 = 0.9;

/// A straight level road of 2 km.
const ROAD: &str = r#"<?xml version="1.0"?>
<OpenDRIVE>
  <header revMajor="1" revMinor="4" name="straight" version="1" north="0" south="0" east="0" west="0"/>
  <road name="main" length="2000" id="1" junction="-1">
    <planView><geometry s="0" x="-1000" y="0" hdg="0" length="2000"><line/></geometry></planView>
    <lanes><laneSection s="0">
      <center><lane id="0" type="none" level="false"/></center>
      <right><lane id="-1" type="driving" level="false"><width sOffset="0" a="20" b="0" c="0" d="0"/></lane></right>
    </laneSection></lanes>
  </road>
</OpenDRIVE>"#;

/// One kind of car.
#[derive(Clone, Debug)]
pub(super) struct Plant {
    pub shape: Shape,
    /// Friction of the road over that of a dry one.
    pub grip: f32,
    /// How fast the road wheels turn.
    pub steer_radps: f32,
    /// By pedal, then by speed.
    accelerations_mps2: [[f32; SPEEDS_MPS.len()]; PEDALS.len()],
    /// (metres per second, road-wheel angle at full control), ascending.
    full_lock: Vec<(f32, f32)>,
    wheelbase_m: f32,
    /// Extra road-wheel angle per sideways acceleration.
    understeer_rad_per_mps2: f32,
    sideways_mps2_max: f32,
}

impl Plant {
    /// The grip of a dry road.
    pub(super) const DRY: f32 = 1.0;

    /// The car that agents drive, on a road in some weather.
    ///
    /// - **Cost:** 72 short drives for each grip that has not been asked for before.
    ///
    /// # Errors
    /// What of the tier of rigid bodies does not work.
    pub(super) fn measured(weather: &Weather) -> Result<Self, Error> {
        static MEASURED: Mutex<BTreeMap<u32, Plant>> = Mutex::new(BTreeMap::new());
        let mut measured = MEASURED.lock().unwrap_or_else(PoisonError::into_inner);
        let key = world::grip(weather).to_bits();
        if let Some(plant) = measured.get(&key) {
            return Ok(plant.clone());
        }
        let plant = Self::measure(weather)?;
        measured.insert(key, plant.clone());
        Ok(plant)
    }

    fn measure(weather: &Weather) -> Result<Self, Error> {
        let model = physics::model()?;
        let parameters = &model.physics;
        let lock_rad =
            parameters.wheels.iter().map(|wheel| wheel.steer_rad_max).fold(0.0, f32::max);
        let curve = parameters.steering_curve.iter();
        let friction = parameters.wheels.first().map_or(1.0, |wheel| wheel.tyre_friction);
        let grip = world::grip(weather);
        Ok(Self {
            shape: physics::shape(model),
            grip,
            steer_radps: STEER_RADPS,
            accelerations_mps2: table(weather)?,
            full_lock: curve.map(|(speed, share)| (*speed, share * lock_rad)).collect(),
            wheelbase_m: model.wheelbase_m,
            understeer_rad_per_mps2: softness(parameters) / GRAVITY_MPS2,
            sideways_mps2_max: GRIP * grip * friction.min(1.0) * GRAVITY_MPS2,
        })
    }

    /// What a pedal does at a speed, in the end.
    pub(super) fn acceleration_mps2(&self, pedal: f32, speed_mps: f32) -> f32 {
        let (low, share) = place(&PEDALS, pedal);
        let (from, along) = place(&SPEEDS_MPS, speed_mps);
        let at = |row: &[f32; SPEEDS_MPS.len()]| row[from] + (row[from + 1] - row[from]) * along;
        let [below, above] = [low, low + 1].map(|row| at(&self.accelerations_mps2[row]));
        below + (above - below) * share
    }

    /// Road-wheel angle at full control.
    pub(super) fn full_lock_rad(&self, speed_mps: f32) -> f32 {
        let Some((first, last)) = self.full_lock.first().zip(self.full_lock.last()) else {
            return 0.0;
        };
        if speed_mps <= first.0 {
            return first.1;
        }
        let beyond = self.full_lock.windows(2).find(|pair| speed_mps <= pair[1].0);
        beyond.map_or(last.1, |pair| {
            let [(x0, y0), (x1, y1)] = [pair[0], pair[1]];
            if x1 > x0 { y0 + (y1 - y0) * (speed_mps - x0) / (x1 - x0) } else { y1 }
        })
    }

    /// Of the rear axle's path in the end; what tyres cannot hold is a wider one.
    pub(super) fn curvature_per_m(&self, road_wheel_rad: f32, speed_mps: f32) -> f32 {
        let square = road_wheel_rad * road_wheel_rad;
        // Series of the tangent: off by less than a thousandth up to 0.7.
        let series = 1.0 + square * (1.0 / 3.0 + square * (2.0 / 15.0 + square * (17.0 / 315.0)));
        let square_mps = speed_mps * speed_mps;
        let path = self.wheelbase_m + self.understeer_rad_per_mps2 * square_mps;
        let most = self.sideways_mps2_max / square_mps.max(0.01);
        (road_wheel_rad * series / path).clamp(-most, most)
    }
}

/// Difference of the axles' softness sideways over their load, in radians.
fn softness(parameters: &VehiclePhysics) -> f32 {
    let mean = |front: bool| {
        let wheels = parameters.wheels.iter().filter(|wheel| (wheel.position_m.x > 0.0) == front);
        let (count, sum) = wheels
            .fold((0.0, 0.0), |(count, sum), wheel| (count + 1.0, sum + wheel.lateral_stiffness));
        if count > 0.0 { sum / count } else { 1.0 }
    };
    1.0 / mean(true) - 1.0 / mean(false)
}

/// The last place before a value, and its share of the way to the next one.
fn place(places: &[f32], value: f32) -> (usize, f32) {
    let most = places.len() - 2;
    let index = places.partition_point(|place| *place <= value).saturating_sub(1).min(most);
    let (from, to) = (places[index], places[index + 1]);
    (index, ((value - from) / (to - from)).clamp(0.0, 1.0))
}

/// # Errors
/// Why a car cannot be driven.
fn table(weather: &Weather) -> Result<[[f32; SPEEDS_MPS.len()]; PEDALS.len()], Error> {
    let unreadable = |error: roads::MapError| Error::new(ErrorCode::Internal, error.to_string());
    let map = Map::parse("straight", ROAD).map_err(unreadable)?;
    let town = Arc::new(Town::new(Arc::new(map)));
    let mut table = [[0.0; SPEEDS_MPS.len()]; PEDALS.len()];
    for (row, pedal) in table.iter_mut().zip(PEDALS) {
        for (value, speed_mps) in row.iter_mut().zip(SPEEDS_MPS).rev() {
            *value = acceleration(&town, weather, (pedal, speed_mps))?;
        }
        // A car that stands cannot brake: there it counts as at the first speed.
        if pedal <= 0.0 {
            row[0] = row[1];
        }
    }
    Ok(table)
}

/// Mean acceleration a while after a pedal was pressed, while the car rolls.
fn acceleration(
    town: &Arc<Town>,
    weather: &Weather,
    (pedal, speed_mps): (f32, f32),
) -> Result<f32, Error> {
    let id = WorldId::new(1)
        .ok_or_else(|| Error::new(ErrorCode::Internal, "1 should be the id of a world"))?;
    let map = Arc::clone(town);
    let mut world = World::new(WorldConfig { id, epoch: 0, seed: 0, dt_secs: TICK_SECS, map })?;
    world.apply(&Command::SetWeather { weather: *weather })?;
    let pose = level_pose(Vec3::new(-900.0, -10.0, 0.0), 0.0);
    let spawned = world.apply(&Command::spawn(physics::BLUEPRINT, pose, Vec3::x() * speed_mps))?;
    let actor = spawned.ok_or_else(|| Error::new(ErrorCode::Internal, "a car was not spawned"))?;
    let control = Action { steer: 0.0, pedal }.control();
    world.apply(&Command::Vehicle(VehicleCommand::Control { actor, control }))?;
    let mut samples: Vec<f32> = Vec::new();
    let mut before_mps = speed_mps;
    for tick in 0..BEFORE + DURING {
        world.tick()?;
        let now_mps = forward_mps(&world, actor);
        let rolls = now_mps > 0.2 || pedal > 0.0;
        if rolls && (tick >= BEFORE || samples.is_empty()) {
            if tick == BEFORE {
                samples.clear();
            }
            samples.push((now_mps - before_mps) / TICK_SECS as f32);
        } else if !rolls {
            break;
        }
        before_mps = now_mps;
    }
    let count = samples.len().max(1) as f32;
    Ok(samples.iter().sum::<f32>() / count)
}

fn forward_mps(world: &World, actor: ActorId) -> f32 {
    world.actor(actor).map_or(0.0, |car| car.linear_velocity_mps.x)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_car_speeds_up_with_throttle_and_slows_down_with_the_brake() {
        let plant = Plant::measured(&Weather::CLEAR_NOON).unwrap();
        println!("{:#?}", plant.accelerations_mps2);
        for speed_mps in [1.0, 5.0, 12.0, 25.0] {
            let at = |pedal| plant.acceleration_mps2(pedal, speed_mps);
            assert!(at(1.0) > at(0.5) && at(0.5) > at(0.0), "{speed_mps} m/s");
            assert!(at(0.0) <= 0.0 && at(-0.5) < at(0.0) - 1.0, "{speed_mps} m/s");
            assert!((-12.0..-6.0).contains(&at(-1.0)), "{speed_mps} m/s: {}", at(-1.0));
        }
    }

    #[test]
    fn wheels_turn_less_at_speed_and_tyres_hold_so_much() {
        let plant = Plant::measured(&Weather::CLEAR_NOON).unwrap();
        assert!(plant.full_lock_rad(0.0) > plant.full_lock_rad(30.0));
        let slow = plant.curvature_per_m(0.3, 1.0);
        assert!((slow - 0.309 / plant.wheelbase_m).abs() < 0.003, "{slow}");
        let fast = plant.curvature_per_m(-0.3, 25.0);
        assert!((fast * 625.0 + plant.sideways_mps2_max).abs() < 1.0e-3, "{fast}");
    }

    #[test]
    fn a_wet_road_holds_less() {
        let [dry, wet] = ["ClearNoon", "HardRainNoon"]
            .map(|name| Plant::measured(&Weather::preset(name).unwrap()).unwrap());
        for speed_mps in [5.0, 12.0, 25.0] {
            let share =
                wet.acceleration_mps2(-1.0, speed_mps) / dry.acceleration_mps2(-1.0, speed_mps);
            println!("{speed_mps} m/s: {share}, grip {}", wet.grip);
            assert!((share - wet.grip).abs() < 0.1, "{speed_mps} m/s: {share}");
            let gentle = wet.acceleration_mps2(-0.1, speed_mps);
            assert!((gentle - dry.acceleration_mps2(-0.1, speed_mps)).abs() < 0.1, "{gentle}");
        }
        let [dry, wet] = [dry, wet].map(|plant| plant.curvature_per_m(0.3, 25.0));
        assert!((wet / dry - 0.685).abs() < 1.0e-3, "{wet} and {dry}");
    }
}

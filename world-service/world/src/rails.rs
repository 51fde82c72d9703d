//! Hybrid physics: traffic far from everybody else moves along its way without dynamics.

use agents::Glide;
use schemas::{Error, Vec3, limits};

use crate::actor::{Actor, Vehicle};
use crate::check;
use crate::world::{State, World};

/// How much farther away than the radius a vehicle must be to lose its dynamics.
const MARGIN_M: f32 = 10.0;

impl World {
    pub(crate) fn set_hybrid_traffic(&mut self, radius_m: Option<f32>) -> Result<(), Error> {
        if let Some(radius_m) = radius_m {
            check::range("radius", radius_m, 0.0, limits::COORDINATE_M_MAX, "m")?;
        }
        self.state.hybrid_m = radius_m;
        Ok(())
    }
}

impl State {
    /// Where those are near whom traffic has dynamics: vehicles that do not belong to it.
    pub(crate) fn witnesses(&self) -> Vec<Vec3> {
        let others = self.actors.iter().filter(|actor| {
            actor.vehicle.as_deref().is_some_and(|vehicle| vehicle.wheel.traffic().is_none())
        });
        others.map(|actor| self.pose_of(actor).translation.vector).collect()
    }

    /// Whether a vehicle of traffic is to move without dynamics.
    pub(crate) fn belongs_on_rails(&self, actor: &Actor, witnesses: &[Vec3]) -> bool {
        let Some(vehicle) = actor.vehicle.as_deref() else { return false };
        let Some((traffic, radius_m)) = vehicle.wheel.traffic().zip(self.hybrid_m) else {
            return false;
        };
        let radius_m = if traffic.on_rails { radius_m } else { radius_m + MARGIN_M };
        let here_m = self.pose_of(actor).translation.vector;
        witnesses.iter().all(|witness_m| (witness_m - here_m).norm() > radius_m)
    }

    /// Takes a vehicle's dynamics away, or gives them back at its present speed.
    pub(crate) fn set_rails(&mut self, index: usize, on: bool) {
        let motion = self.motion_of(&self.actors[index]);
        let actor = &mut self.actors[index];
        let Some(handle) = actor.rigid() else { return };
        let id = actor.id;
        actor.switches.physics = !on;
        actor.outside.told_mps = if on { motion.linear_mps } else { Vec3::zeros() };
        self.physics.set_simulated(handle, !on);
        self.halted.retain(|halt| halt.actor != id);
        let Some(vehicle) = actor.vehicle_mut() else { return };
        if let Some(traffic) = vehicle.wheel.traffic_mut() {
            traffic.on_rails = on;
        }
        if !on {
            let Vehicle { state, tuning, .. } = vehicle;
            state.set_rolling(tuning.fit(), motion.forward_mps());
            self.physics.set_velocity(handle, motion.linear_mps, Vec3::zeros());
        }
    }

    pub(crate) fn glide(&mut self, index: usize, glide: &Glide) {
        let actor = &mut self.actors[index];
        let Some(handle) = actor.rigid() else { return };
        actor.outside.told_mps = glide.velocity_mps;
        self.physics.set_pose(handle, &glide.world_from_vehicle);
    }
}

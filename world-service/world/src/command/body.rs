//! Commands for anything with a body.

use schemas::{ActorId, BodyCommand, BodySwitch, Error, Pose, PushKind, Vec3, limits};

use super::rigid;
use crate::actor::Vehicle;
use crate::body::Body;
use crate::check;
use crate::place;
use crate::spring_arm;
use crate::vehicle::Impulse;
use crate::world::World;

impl World {
    pub(super) fn change_body(&mut self, command: &BodyCommand) -> Result<(), Error> {
        match command {
            BodyCommand::SetVelocity { actor, linear_mps, angular_radps } => {
                self.set_velocity(*actor, *linear_mps, *angular_radps)
            }
            BodyCommand::SetConstantVelocity { actor, velocity_mps } => {
                self.set_constant_velocity(*actor, *velocity_mps)
            }
            BodyCommand::Push { actor, kind, amount } => self.push(*actor, *kind, *amount),
            BodyCommand::SetPose { actor, reference_from_actor } => {
                self.set_pose(*actor, reference_from_actor)
            }
            BodyCommand::SetSwitch { actor, switch, on } => self.set_switch(*actor, *switch, *on),
        }
    }

    /// An actor whose physics is off keeps the velocity as what it is said to have.
    fn set_velocity(
        &mut self,
        id: ActorId,
        linear_mps: Option<Vec3>,
        angular_radps: Option<Vec3>,
    ) -> Result<(), Error> {
        let index = self.state.index_of(id)?;
        let body = self.state.motion_of(&self.state.actors[index]);
        let actor = &mut self.state.actors[index];
        let handle = rigid(actor)?;
        let linear_mps = linear_mps.unwrap_or(body.linear_mps);
        let angular_radps = angular_radps.unwrap_or(body.angular_radps);
        check::vector("velocity", linear_mps, limits::SPEED_MPS_MAX, "m/s")?;
        check::vector("angular velocity", angular_radps, check::SPIN_RADPS_MAX, "rad/s")?;
        let forward = body.world_from_body.rotation * Vec3::x();
        if let Some(Vehicle { state, tuning, .. }) = actor.vehicle_mut() {
            state.set_rolling(tuning.fit(), forward.dot(&linear_mps));
        }
        if let Some((_, walker)) = actor.walker_mut() {
            walker.own_mps = linear_mps;
            walker.untold_ticks = 0;
        }
        if actor.switches.physics {
            self.state.physics.set_velocity(handle, linear_mps, angular_radps);
        } else {
            actor.outside.told_mps = linear_mps;
        }
        Ok(())
    }

    fn set_constant_velocity(
        &mut self,
        id: ActorId,
        velocity_mps: Option<Vec3>,
    ) -> Result<(), Error> {
        let wanted_mps = velocity_mps.unwrap_or_else(Vec3::zeros);
        check::vector("velocity", wanted_mps, limits::SPEED_MPS_MAX, "m/s")?;
        let index = self.state.index_of(id)?;
        let actor = &mut self.state.actors[index];
        let handle = rigid(actor)?;
        actor.outside.held_mps = velocity_mps;
        let vehicle = actor.vehicle_mut().zip(velocity_mps);
        if let Some((Vehicle { state, tuning, .. }, held_mps)) = vehicle {
            state.set_rolling(tuning.fit(), held_mps.x);
        }
        self.state.physics.wake(handle);
        Ok(())
    }

    /// Nothing comes of it for a body whose physics is off.
    fn push(&mut self, id: ActorId, kind: PushKind, amount: Vec3) -> Result<(), Error> {
        let index = self.state.index_of(id)?;
        let actor = &mut self.state.actors[index];
        let handle = rigid(actor)?;
        let (mut force_n, mut torque_nm) = (actor.outside.force_n, actor.outside.torque_nm);
        let dt_secs = self.state.step.dt_secs as f32;
        let none = Vec3::zeros();
        let impulse = match kind {
            PushKind::Impulse => Impulse { linear_ns: amount, angular_nms: none },
            PushKind::AngularImpulse => Impulse { linear_ns: none, angular_nms: amount },
            PushKind::Force => {
                force_n += amount;
                Impulse { linear_ns: force_n * dt_secs, angular_nms: none }
            }
            PushKind::Torque => {
                torque_nm += amount;
                Impulse { linear_ns: none, angular_nms: torque_nm * dt_secs }
            }
        };
        check::vector("push", amount, f32::MAX, "")?;
        let response = self.state.physics.response(handle);
        let speed_mps = impulse.linear_ns * response.inverse_mass_per_kg;
        check::vector("speed by the push", speed_mps, limits::SPEED_MPS_MAX, "m/s")?;
        let spin_radps = response.inverse_inertia * impulse.angular_nms;
        check::vector("spin by the push", spin_radps, check::SPIN_RADPS_MAX, "rad/s")?;
        if !actor.switches.physics {
            return Ok(());
        }
        match kind {
            PushKind::Force | PushKind::Torque => {
                (actor.outside.force_n, actor.outside.torque_nm) = (force_n, torque_nm);
                self.state.physics.wake(handle);
            }
            PushKind::Impulse | PushKind::AngularImpulse => {
                let pushed = response.pushed(&self.state.physics.state(handle), &impulse);
                let linear_mps = pushed.linear_mps.cap_magnitude(limits::SPEED_MPS_MAX);
                let angular_radps = pushed.angular_radps.cap_magnitude(check::SPIN_RADPS_MAX);
                self.state.physics.set_velocity(handle, linear_mps, angular_radps);
            }
        }
        Ok(())
    }

    /// A walker stands up.
    fn set_pose(&mut self, id: ActorId, reference_from_actor: &Pose) -> Result<(), Error> {
        check::pose(reference_from_actor)?;
        let index = self.state.index_of(id)?;
        let parent = self.state.actors[index].body.attachment().map(|to| to.parent);
        let world_from_fixed = parent.and_then(|parent| self.fixed_pose(parent));
        let physics = &mut self.state.physics;
        let actor = &mut self.state.actors[index];
        let blueprint = actor.blueprint();
        let at_will = actor.switches.physics;
        let handle = match &mut actor.body {
            Body::Rigid(handle) => *handle,
            Body::Fixed(pose) => {
                *pose = *reference_from_actor;
                return Ok(());
            }
            Body::Attached(attached) => {
                // Others are carried there with the next tick.
                if let Some(world_from_parent) = world_from_fixed {
                    let kind = attached.to.kind;
                    let world_from_actor =
                        spring_arm::attached_at(kind, &world_from_parent, reference_from_actor);
                    check::pose(&world_from_actor)?;
                    attached.world_from_actor = world_from_actor;
                }
                attached.parent_from_actor = *reference_from_actor;
                return Ok(());
            }
        };
        let pose = if at_will {
            place::exactly(blueprint, reference_from_actor, &self.town.ground).world_from_actor
        } else {
            *reference_from_actor
        };
        if let Some(vehicle) = actor.vehicle_mut() {
            vehicle.state.lift();
            vehicle.rules.put();
        }
        if let Some((_, walker)) = actor.walker_mut() {
            walker.place(physics.linear_mps(handle));
        }
        physics.set_pose(handle, &pose);
        Ok(())
    }

    fn set_switch(&mut self, id: ActorId, switch: BodySwitch, on: bool) -> Result<(), Error> {
        let index = self.state.index_of(id)?;
        let physics = &mut self.state.physics;
        let actor = &mut self.state.actors[index];
        let handle = rigid(actor)?;
        let place = match switch {
            BodySwitch::Physics => &mut actor.switches.physics,
            BodySwitch::Gravity => &mut actor.switches.gravity,
            BodySwitch::Collisions => &mut actor.switches.collisions,
        };
        if std::mem::replace(place, on) == on {
            return Ok(());
        }
        match switch {
            BodySwitch::Physics => {
                self.state.halted.retain(|halt| halt.actor != id);
                physics.set_simulated(handle, on);
                actor.outside.told_mps = Vec3::zeros();
                if let Some(Vehicle { state, tuning, .. }) = actor.vehicle_mut() {
                    state.set_rolling(tuning.fit(), 0.0);
                }
                if let Some((_, walker)) = actor.walker_mut() {
                    walker.place(Vec3::zeros());
                }
            }
            BodySwitch::Gravity => physics.set_gravity(handle, on),
            BodySwitch::Collisions => {
                physics.set_collisions(handle, on);
                self.state.contacts.forget(id);
            }
        }
        Ok(())
    }
}

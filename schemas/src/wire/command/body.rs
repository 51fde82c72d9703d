//! Body commands.

use flatbuffers::FlatBufferBuilder;

use super::{Body, table};
use crate::generated as fb;
use crate::wire::needed;
use crate::wire::parts::{
    actor_in, pose_in, pose_out, push_in, push_out, switch_in, switch_out, vec3_in, vec3_out,
};
use crate::{BodyCommand, Command, Error};

pub(super) fn command_out(b: &mut FlatBufferBuilder<'_>, command: &BodyCommand) -> Body {
    match command {
        BodyCommand::SetVelocity { actor, linear_mps, angular_radps } => {
            let linear = linear_mps.as_ref().map(vec3_out);
            let angular = angular_radps.as_ref().map(vec3_out);
            let args = fb::SetVelocityArgs {
                actor: actor.get(),
                linear_in_world_mps: linear.as_ref(),
                angular_in_world_radps: angular.as_ref(),
            };
            table!(b, SetVelocity, args)
        }
        BodyCommand::SetConstantVelocity { actor, velocity_mps } => {
            let velocity = velocity_mps.as_ref().map(vec3_out);
            let args = fb::SetConstantVelocityArgs {
                actor: actor.get(),
                velocity_in_actor_mps: velocity.as_ref(),
            };
            table!(b, SetConstantVelocity, args)
        }
        BodyCommand::Push { actor, kind, amount } => {
            let amount = vec3_out(amount);
            let args = fb::PushArgs {
                actor: actor.get(),
                kind: push_out(*kind),
                amount_in_world: Some(&amount),
            };
            table!(b, Push, args)
        }
        BodyCommand::SetPose { actor, reference_from_actor } => {
            let pose = pose_out(reference_from_actor);
            let args = fb::SetPoseArgs { actor: actor.get(), reference_from_actor: Some(&pose) };
            table!(b, SetPose, args)
        }
        BodyCommand::SetSwitch { actor, switch, on } => {
            let (actor, body_switch, on) = (actor.get(), switch_out(*switch), *on);
            table!(b, SetSwitch, fb::SetSwitchArgs { actor, body_switch, on })
        }
    }
}

pub(super) fn command_in(raw: &fb::Command<'_>) -> Result<Command, Error> {
    let vector = |raw: Option<&fb::Vec3>, field| raw.map(|raw| vec3_in(raw, field)).transpose();
    if let Some(set) = raw.body_as_set_velocity() {
        return Ok(Command::Body(BodyCommand::SetVelocity {
            actor: actor_in(set.actor())?,
            linear_mps: vector(set.linear_in_world_mps(), "linear velocity")?,
            angular_radps: vector(set.angular_in_world_radps(), "angular velocity")?,
        }));
    }
    if let Some(set) = raw.body_as_set_constant_velocity() {
        let velocity_mps = vector(set.velocity_in_actor_mps(), "velocity")?;
        return Ok(Command::Body(BodyCommand::SetConstantVelocity {
            actor: actor_in(set.actor())?,
            velocity_mps,
        }));
    }
    if let Some(push) = raw.body_as_push() {
        return Ok(Command::Body(BodyCommand::Push {
            actor: actor_in(push.actor())?,
            kind: push_in(push.kind())?,
            amount: vec3_in(push.amount_in_world(), "amount")?,
        }));
    }
    if let Some(set) = raw.body_as_set_pose() {
        return Ok(Command::Body(BodyCommand::SetPose {
            actor: actor_in(set.actor())?,
            reference_from_actor: pose_in(set.reference_from_actor(), "reference_from_actor")?,
        }));
    }
    let set = needed(raw.body_as_set_switch(), "a known command")?;
    let switch = switch_in(set.body_switch())?;
    Ok(Command::Body(BodyCommand::SetSwitch {
        actor: actor_in(set.actor())?,
        switch,
        on: set.on(),
    }))
}

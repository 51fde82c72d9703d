//! Walker commands.

use flatbuffers::FlatBufferBuilder;

use super::{Body, table};
use crate::generated as fb;
use crate::limits::WALKER_STAGES_MAX;
use crate::wire::frame::{walker_in, walker_out};
use crate::wire::parts::{actor_in, finite, pose_in, pose_out, vec3_in, vec3_out};
use crate::wire::walker_pose::{bones_in, bones_out};
use crate::wire::{check_count, needed};
use crate::{ActorId, BonesChange, Command, Error, Proximity, Vec3, WalkerCommand, WalkerStage};

pub(super) fn command_out(b: &mut FlatBufferBuilder<'_>, command: &WalkerCommand) -> Body {
    match command {
        WalkerCommand::Control { actor, control } => {
            let control = walker_out(control);
            let args = fb::SetWalkerControlArgs { actor: actor.get(), control: Some(&control) };
            table!(b, SetWalkerControl, args)
        }
        WalkerCommand::State { actor, world_from_actor, speed_mps } => {
            let pose = pose_out(world_from_actor);
            let args = fb::SetWalkerStateArgs {
                actor: actor.get(),
                world_from_actor: Some(&pose),
                speed_mps: *speed_mps,
            };
            table!(b, SetWalkerState, args)
        }
        WalkerCommand::Agent { actor, goal_m, speed_mps, crossing_share } => {
            agent_out(b, *actor, goal_m.as_ref(), *speed_mps, *crossing_share)
        }
        WalkerCommand::Trajectory { actor, stages, trigger } => {
            trajectory_out(b, *actor, stages, trigger.as_ref())
        }
        WalkerCommand::Bones { actor, change } => {
            let bones = (!change.bones.is_empty()).then(|| bones_out(b, &change.bones));
            let args = fb::SetWalkerBonesArgs {
                actor: actor.get(),
                afresh: change.afresh,
                bones,
                share: change.share,
            };
            table!(b, SetWalkerBones, args)
        }
    }
}

fn agent_out(
    b: &mut FlatBufferBuilder<'_>,
    actor: ActorId,
    goal_m: Option<&Vec3>,
    speed_mps: Option<f32>,
    crossing_share: f32,
) -> Body {
    let goal = goal_m.map(vec3_out);
    let args = fb::SetWalkerAgentArgs {
        actor: actor.get(),
        goal_in_world_m: goal.as_ref(),
        speed_mps,
        crossing_share,
    };
    (fb::CommandBody::SetWalkerAgent, fb::SetWalkerAgent::create(b, &args).as_union_value())
}

fn trajectory_out(
    b: &mut FlatBufferBuilder<'_>,
    actor: ActorId,
    stages: &[WalkerStage],
    trigger: Option<&Proximity>,
) -> Body {
    let stage = |stage: &WalkerStage| {
        fb::WalkerStage::new(&vec3_out(&stage.to_m), stage.speed_mps, stage.wait_secs)
    };
    let stages: Vec<fb::WalkerStage> = stages.iter().map(stage).collect();
    let stages = b.create_vector(&stages);
    let args = fb::SetWalkerTrajectoryArgs {
        actor: actor.get(),
        stages: Some(stages),
        vehicle: trigger.map_or(0, |trigger| trigger.actor.get()),
        within_m: trigger.map_or(0.0, |trigger| trigger.within_m),
    };
    table!(b, SetWalkerTrajectory, args)
}

fn trajectory_in(set: &fb::SetWalkerTrajectory<'_>) -> Result<WalkerCommand, Error> {
    check_count("stages", set.stages().len(), WALKER_STAGES_MAX)?;
    let stage = |stage: &fb::WalkerStage| {
        Ok(WalkerStage {
            to_m: vec3_in(stage.to_in_world_m(), "place")?,
            speed_mps: finite(stage.speed_mps(), "speed")?,
            wait_secs: finite(stage.wait_secs(), "wait")?,
        })
    };
    let within_m = finite(set.within_m(), "distance")?;
    Ok(WalkerCommand::Trajectory {
        actor: actor_in(set.actor())?,
        stages: set.stages().iter().map(stage).collect::<Result<_, Error>>()?,
        trigger: ActorId::new(set.vehicle()).map(|actor| Proximity { actor, within_m }),
    })
}

pub(super) fn command_in(raw: &fb::Command<'_>) -> Result<Command, Error> {
    if let Some(set) = raw.body_as_set_walker_control() {
        let control = walker_in(set.control())?;
        return Ok(Command::Walker(WalkerCommand::Control {
            actor: actor_in(set.actor())?,
            control,
        }));
    }
    if let Some(set) = raw.body_as_set_walker_agent() {
        let goal = set.goal_in_world_m();
        return Ok(Command::Walker(WalkerCommand::Agent {
            actor: actor_in(set.actor())?,
            goal_m: goal.map(|goal| vec3_in(goal, "goal")).transpose()?,
            speed_mps: set.speed_mps().map(|speed| finite(speed, "speed")).transpose()?,
            crossing_share: finite(set.crossing_share(), "crossing share")?,
        }));
    }
    if let Some(set) = raw.body_as_set_walker_trajectory() {
        return Ok(Command::Walker(trajectory_in(&set)?));
    }
    if let Some(set) = raw.body_as_set_walker_bones() {
        let change = BonesChange {
            afresh: set.afresh(),
            bones: set.bones().map_or(Ok(Vec::new()), bones_in)?,
            share: set.share().map(|share| finite(share, "share")).transpose()?,
        };
        return Ok(Command::Walker(WalkerCommand::Bones { actor: actor_in(set.actor())?, change }));
    }
    let set = needed(raw.body_as_set_walker_state(), "a known command")?;
    Ok(Command::Walker(WalkerCommand::State {
        actor: actor_in(set.actor())?,
        world_from_actor: pose_in(set.world_from_actor(), "world_from_actor")?,
        speed_mps: finite(set.speed_mps(), "speed")?,
    }))
}

//! Walker commands.

use flatbuffers::FlatBufferBuilder;

use super::{Body, table};
use crate::generated as fb;
use crate::wire::frame::{walker_in, walker_out};
use crate::wire::needed;
use crate::wire::parts::{actor_in, finite, pose_in, pose_out, vec3_in, vec3_out};
use crate::{ActorId, Command, Error, Vec3, WalkerCommand};

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
    let set = needed(raw.body_as_set_walker_state(), "a known command")?;
    Ok(Command::Walker(WalkerCommand::State {
        actor: actor_in(set.actor())?,
        world_from_actor: pose_in(set.world_from_actor(), "world_from_actor")?,
        speed_mps: finite(set.speed_mps(), "speed")?,
    }))
}

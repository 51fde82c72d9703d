//! Drivers inside the tick: their commands and what frames tell of them.

use flatbuffers::{FlatBufferBuilder, UnionWIPOffset, WIPOffset};

use super::parts::{
    actor_in, behaviour_in, behaviour_out, finite, status_in, status_out, vec3_in, vec3_out,
};
use super::{check_count, needed};
use crate::generated as fb;
use crate::limits::ROUTE_PLACES_MAX;
use crate::{
    ActorId, AgentBehaviour, AgentCommand, AgentOptions, AgentState, Command, Error,
    TrafficCommand, Vec3,
};

type Body = (fb::CommandBody, WIPOffset<UnionWIPOffset>);

pub(super) fn command_out(b: &mut FlatBufferBuilder<'_>, command: &AgentCommand) -> Body {
    match command {
        AgentCommand::Set { actor, options, keep_route } => {
            set_out(b, *actor, options, *keep_route)
        }
        AgentCommand::SetRoute { actor, places_m } => route_out(b, *actor, places_m),
        AgentCommand::Drive { actor, on } => drive_out(b, *actor, *on),
    }
}

pub(super) fn traffic_command_out(b: &mut FlatBufferBuilder<'_>, command: &TrafficCommand) -> Body {
    match command {
        TrafficCommand::Join { actor, behaviour } => traffic_out(b, *actor, *behaviour),
        TrafficCommand::Spawn { count, behaviour } => spawn_out(b, *count, *behaviour),
        TrafficCommand::SetHybrid { radius_m } => hybrid_out(b, *radius_m),
    }
}

fn set_out(
    b: &mut FlatBufferBuilder<'_>,
    actor: ActorId,
    options: &AgentOptions,
    keep_route: bool,
) -> Body {
    let args = fb::SetAgentArgs {
        actor: actor.get(),
        behaviour: behaviour_out(options.behaviour),
        target_speed_mps: options.target_speed_mps,
        follow_speed_limits: options.follow_speed_limits,
        ignore_lights: options.ignore_lights,
        ignore_stop_signs: options.ignore_stop_signs,
        ignore_vehicles: options.ignore_vehicles,
        light_distance_m: options.light_distance_m,
        vehicle_distance_m: options.vehicle_distance_m,
        keep_route,
    };
    (fb::CommandBody::SetAgent, fb::SetAgent::create(b, &args).as_union_value())
}

fn route_out(b: &mut FlatBufferBuilder<'_>, actor: ActorId, places_m: &[Vec3]) -> Body {
    let places: Vec<fb::Vec3> = places_m.iter().map(vec3_out).collect();
    let places = Some(b.create_vector(&places));
    let args = fb::SetAgentRouteArgs { actor: actor.get(), places_in_world_m: places };
    (fb::CommandBody::SetAgentRoute, fb::SetAgentRoute::create(b, &args).as_union_value())
}

fn drive_out(b: &mut FlatBufferBuilder<'_>, actor: ActorId, on: bool) -> Body {
    let args = fb::DriveAgentArgs { actor: actor.get(), on };
    (fb::CommandBody::DriveAgent, fb::DriveAgent::create(b, &args).as_union_value())
}

fn traffic_out(b: &mut FlatBufferBuilder<'_>, actor: ActorId, behaviour: AgentBehaviour) -> Body {
    let args = fb::SetTrafficArgs { actor: actor.get(), behaviour: behaviour_out(behaviour) };
    (fb::CommandBody::SetTraffic, fb::SetTraffic::create(b, &args).as_union_value())
}

fn spawn_out(b: &mut FlatBufferBuilder<'_>, count: u32, behaviour: Option<AgentBehaviour>) -> Body {
    let args = fb::SpawnTrafficArgs { count, behaviour: behaviour.map(behaviour_out) };
    (fb::CommandBody::SpawnTraffic, fb::SpawnTraffic::create(b, &args).as_union_value())
}

fn hybrid_out(b: &mut FlatBufferBuilder<'_>, radius_m: Option<f32>) -> Body {
    let args = fb::SetHybridTrafficArgs { radius_m };
    (fb::CommandBody::SetHybridTraffic, fb::SetHybridTraffic::create(b, &args).as_union_value())
}

pub(super) fn command_in(raw: &fb::Command<'_>) -> Result<Command, Error> {
    let metres = |value: Option<f32>, field| value.map(|value| finite(value, field)).transpose();
    if let Some(set) = raw.body_as_set_agent() {
        let options = AgentOptions {
            behaviour: behaviour_in(set.behaviour())?,
            target_speed_mps: metres(set.target_speed_mps(), "target speed")?,
            follow_speed_limits: set.follow_speed_limits(),
            ignore_lights: set.ignore_lights(),
            ignore_stop_signs: set.ignore_stop_signs(),
            ignore_vehicles: set.ignore_vehicles(),
            light_distance_m: metres(set.light_distance_m(), "light distance")?,
            vehicle_distance_m: metres(set.vehicle_distance_m(), "vehicle distance")?,
        };
        let (actor, keep_route) = (actor_in(set.actor())?, set.keep_route());
        return Ok(Command::Agent(AgentCommand::Set { actor, options, keep_route }));
    }
    if let Some(set) = raw.body_as_set_agent_route() {
        let places = set.places_in_world_m();
        check_count("places", places.map_or(0, |places| places.len()), ROUTE_PLACES_MAX)?;
        let places = places.iter().flatten().map(|place| vec3_in(place, "place"));
        let (actor, places_m) = (actor_in(set.actor())?, places.collect::<Result<_, _>>()?);
        return Ok(Command::Agent(AgentCommand::SetRoute { actor, places_m }));
    }
    if let Some(set) = raw.body_as_set_traffic() {
        let behaviour = behaviour_in(set.behaviour())?;
        return Ok(Command::Traffic(TrafficCommand::Join {
            actor: actor_in(set.actor())?,
            behaviour,
        }));
    }
    if let Some(set) = raw.body_as_set_hybrid_traffic() {
        return Ok(Command::Traffic(TrafficCommand::SetHybrid {
            radius_m: metres(set.radius_m(), "radius")?,
        }));
    }
    if let Some(spawn) = raw.body_as_spawn_traffic() {
        let behaviour = spawn.behaviour().map(behaviour_in).transpose()?;
        return Ok(Command::Traffic(TrafficCommand::Spawn { count: spawn.count(), behaviour }));
    }
    let set = needed(raw.body_as_drive_agent(), "a known command")?;
    Ok(Command::Agent(AgentCommand::Drive { actor: actor_in(set.actor())?, on: set.on() }))
}

pub(super) fn state_out(agent: &AgentState) -> fb::AgentState {
    fb::AgentState::new(
        agent.actor.get(),
        status_out(agent.status),
        agent.driving,
        agent.distance_left_m,
        &vec3_out(&agent.target_m),
    )
}

pub(super) fn state_in(raw: &fb::AgentState) -> Result<AgentState, Error> {
    Ok(AgentState {
        actor: actor_in(raw.actor())?,
        status: status_in(raw.status())?,
        driving: raw.driving(),
        distance_left_m: finite(raw.distance_left_m(), "distance left")?,
        target_m: vec3_in(raw.target_in_world_m(), "target")?,
    })
}

//! Commands.

mod body;
mod light;
mod vehicle;
mod walker;

use flatbuffers::{FlatBufferBuilder, ForwardsUOffset, UnionWIPOffset, Vector, WIPOffset};

use super::frame::{weather_in, weather_out};
use super::parts::{
    actor_in, attachment_in, attachment_out, attributes_in, attributes_out, finite_double, pose_in,
    pose_out, vec3_in, vec3_out,
};
use super::{agent, check_count, needed, scenery, sensor};
use crate::generated as fb;
use crate::limits::COMMANDS_PER_REQUEST_MAX;
use crate::{ActorId, Attachment, Command, Error, Vec3};

type Commands<'a> = Vector<'a, ForwardsUOffset<fb::Command<'a>>>;
type Body = (fb::CommandBody, WIPOffset<UnionWIPOffset>);

pub(super) fn commands_out<'a>(
    b: &mut FlatBufferBuilder<'a>,
    commands: &[Command],
) -> WIPOffset<Commands<'a>> {
    let mut raw = Vec::with_capacity(commands.len());
    for command in commands {
        let (body_type, body) = command_out(b, command);
        raw.push(fb::Command::create(b, &fb::CommandArgs { body_type, body: Some(body) }));
    }
    b.create_vector(&raw)
}

pub(super) fn commands_in(raw: Option<Commands<'_>>) -> Result<Vec<Command>, Error> {
    let Some(raw) = raw else { return Ok(Vec::new()) };
    check_count("commands", raw.len(), COMMANDS_PER_REQUEST_MAX)?;
    raw.iter().map(|command| command_in(&command)).collect()
}

/// The union member that a table is, finished.
macro_rules! table {
    ($b:expr, $table:ident, $args:expr) => {
        (fb::CommandBody::$table, fb::$table::create($b, &$args).as_union_value())
    };
}
use table;

fn command_out(b: &mut FlatBufferBuilder<'_>, command: &Command) -> Body {
    match command {
        Command::SpawnActor {
            blueprint,
            reference_from_actor,
            linear_velocity_mps,
            attributes,
            attachment,
            id,
        } => {
            let attributes =
                if attributes.is_empty() { None } else { Some(attributes_out(b, attributes)) };
            let args = fb::SpawnActorArgs {
                blueprint: Some(b.create_string(blueprint)),
                reference_from_actor: Some(&pose_out(reference_from_actor)),
                linear_velocity_in_world_mps: Some(&vec3_out(linear_velocity_mps)),
                attributes,
                parent: attachment.map_or(0, |attachment| attachment.parent.get()),
                attachment: attachment.map_or(fb::AttachmentKind::Rigid, |attachment| {
                    attachment_out(attachment.kind)
                }),
                id: id.map_or(0, ActorId::get),
            };
            table!(b, SpawnActor, args)
        }
        Command::DestroyActor { actor } => {
            table!(b, DestroyActor, fb::DestroyActorArgs { actor: actor.get() })
        }
        Command::Body(command) => body::command_out(b, command),
        Command::Vehicle(command) => vehicle::command_out(b, command),
        Command::Agent(command) => agent::command_out(b, command),
        Command::Traffic(command) => agent::traffic_command_out(b, command),
        Command::Walker(command) => walker::command_out(b, command),
        Command::TrafficLight(command) => light::command_out(b, command),
        Command::Scenery(command) => scenery::command_out(b, command),
        Command::Sensor(command) => sensor::command_out(b, command),
        Command::SetWeather { weather } => {
            let weather = weather_out(weather);
            table!(b, SetWeather, fb::SetWeatherArgs { weather: Some(&weather) })
        }
        Command::SetTimeStep { dt_secs, substep_secs_max, substeps_max } => {
            let args = fb::SetTimeStepArgs {
                dt_secs: *dt_secs,
                substep_secs_max: *substep_secs_max,
                substeps_max: *substeps_max,
            };
            table!(b, SetTimeStep, args)
        }
    }
}

fn command_in(raw: &fb::Command<'_>) -> Result<Command, Error> {
    use fb::CommandBody as Body;
    match raw.body_type() {
        Body::SpawnActor => spawn_in(&needed(raw.body_as_spawn_actor(), "a spawn")?),
        Body::DestroyActor => {
            let destroy = needed(raw.body_as_destroy_actor(), "an actor")?;
            Ok(Command::DestroyActor { actor: actor_in(destroy.actor())? })
        }
        Body::SetControl
        | Body::SetAckermann
        | Body::SetAckermannGains
        | Body::SetPilot
        | Body::SetVehiclePhysics
        | Body::SetVehicleLights
        | Body::SetDoors => vehicle::command_in(raw),
        Body::SetAgent
        | Body::SetAgentRoute
        | Body::DriveAgent
        | Body::SetTraffic
        | Body::SpawnTraffic
        | Body::SetHybridTraffic => agent::command_in(raw),
        Body::SetWalkerControl
        | Body::SetWalkerState
        | Body::SetWalkerAgent
        | Body::SetWalkerTrajectory
        | Body::SetWalkerBones => walker::command_in(raw),
        Body::SetTrafficLight | Body::FreezeTrafficLights | Body::ResetTrafficLights => {
            light::command_in(raw)
        }
        Body::SetVelocity
        | Body::SetConstantVelocity
        | Body::Push
        | Body::SetPose
        | Body::SetSwitch => body::command_in(raw),
        Body::SetMapLayers | Body::SetEnvironmentObjects | Body::PaintEnvironmentObjects => {
            scenery::command_in(raw)
        }
        Body::Listen | Body::IgnoreVehicles | Body::SendV2x => sensor::command_in(raw),
        _ => setting_in(raw),
    }
}

fn spawn_in(spawn: &fb::SpawnActor<'_>) -> Result<Command, Error> {
    let velocity = spawn.linear_velocity_in_world_mps();
    let kind = attachment_in(spawn.attachment())?;
    Ok(Command::SpawnActor {
        blueprint: spawn.blueprint().to_owned(),
        reference_from_actor: pose_in(spawn.reference_from_actor(), "reference_from_actor")?,
        linear_velocity_mps: velocity
            .map_or(Ok(Vec3::zeros()), |raw| vec3_in(raw, "linear velocity"))?,
        attributes: attributes_in(spawn.attributes())?,
        attachment: ActorId::new(spawn.parent()).map(|parent| Attachment { parent, kind }),
        id: ActorId::new(spawn.id()),
    })
}

fn setting_in(raw: &fb::Command<'_>) -> Result<Command, Error> {
    if let Some(set) = raw.body_as_set_time_step() {
        let substep = set.substep_secs_max();
        return Ok(Command::SetTimeStep {
            dt_secs: finite_double(set.dt_secs(), "dt_secs")?,
            substep_secs_max: substep
                .map(|secs| finite_double(secs, "substep_secs_max"))
                .transpose()?,
            substeps_max: set.substeps_max(),
        });
    }
    let set = needed(raw.body_as_set_weather(), "a known command")?;
    Ok(Command::SetWeather { weather: weather_in(set.weather())? })
}

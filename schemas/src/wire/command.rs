//! Commands.

use flatbuffers::{FlatBufferBuilder, ForwardsUOffset, UnionWIPOffset, Vector, WIPOffset};

use super::frame::{control_in, control_out, walker_in, walker_out, weather_in, weather_out};
use super::parts::{
    actor_in, attachment_in, attachment_out, attributes_in, attributes_out, colour_in, colour_out,
    finite, finite_double, pilot_in, pilot_out, pose_in, pose_out, push_in, push_out, switch_in,
    switch_out, vec3_in, vec3_out,
};
use super::vehicle::{ackermann_in, ackermann_out, gains_in, gains_out, physics_in, physics_out};
use super::{agent, check_count, needed, scenery, sensor};
use crate::generated as fb;
use crate::limits::COMMANDS_PER_REQUEST_MAX;
use crate::{ActorId, Attachment, Attribute, Command, Error, Pose, Vec3};

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
macro_rules! body {
    ($b:expr, $table:ident, $args:expr) => {
        (fb::CommandBody::$table, fb::$table::create($b, &$args).as_union_value())
    };
}

fn command_out(b: &mut FlatBufferBuilder<'_>, command: &Command) -> Body {
    match command {
        Command::SpawnActor {
            blueprint,
            world_from_actor,
            linear_velocity_mps,
            attributes,
            attachment,
        } => {
            spawn_out(b, blueprint, world_from_actor, linear_velocity_mps, attributes, *attachment)
        }
        Command::DestroyActor { actor } => {
            body!(b, DestroyActor, fb::DestroyActorArgs { actor: actor.get() })
        }
        Command::SetControl { .. }
        | Command::SetAckermann { .. }
        | Command::SetAckermannGains { .. }
        | Command::SetPilot { .. }
        | Command::SetVehiclePhysics { .. }
        | Command::SetVehicleLights { .. }
        | Command::SetDoors { .. } => vehicle_command_out(b, command),
        Command::SetAgent { .. }
        | Command::SetAgentRoute { .. }
        | Command::DriveAgent { .. }
        | Command::SetTraffic { .. }
        | Command::SpawnTraffic { .. }
        | Command::SetHybridTraffic { .. }
        | Command::SetWalkerAgent { .. } => agent::command_out(b, command),
        Command::SetWalkerControl { actor, control } => {
            let control = walker_out(control);
            let args = fb::SetWalkerControlArgs { actor: actor.get(), control: Some(&control) };
            body!(b, SetWalkerControl, args)
        }
        Command::SetWalkerState { actor, world_from_actor, speed_mps } => {
            let pose = pose_out(world_from_actor);
            let args = fb::SetWalkerStateArgs {
                actor: actor.get(),
                world_from_actor: Some(&pose),
                speed_mps: *speed_mps,
            };
            body!(b, SetWalkerState, args)
        }
        Command::SetVelocity { .. }
        | Command::SetConstantVelocity { .. }
        | Command::Push { .. }
        | Command::SetPose { .. }
        | Command::SetSwitch { .. } => motion_command_out(b, command),
        Command::SetMapLayers { .. } | Command::SetEnvironmentObjects { .. } => {
            scenery::command_out(b, command)
        }
        Command::SetTrafficLight { .. }
        | Command::FreezeTrafficLights { .. }
        | Command::ResetTrafficLights { .. }
        | Command::SetWeather { .. }
        | Command::SetTimeStep { .. } => scene_command_out(b, command),
        Command::Listen { .. } | Command::IgnoreVehicles { .. } | Command::SendV2x { .. } => {
            sensor::command_out(b, command)
        }
    }
}

fn spawn_out(
    b: &mut FlatBufferBuilder<'_>,
    blueprint: &str,
    world_from_actor: &Pose,
    linear_velocity_mps: &Vec3,
    attributes: &[Attribute],
    attachment: Option<Attachment>,
) -> Body {
    let blueprint = Some(b.create_string(blueprint));
    let attributes = if attributes.is_empty() { None } else { Some(attributes_out(b, attributes)) };
    let args = fb::SpawnActorArgs {
        blueprint,
        world_from_actor: Some(&pose_out(world_from_actor)),
        linear_velocity_in_world_mps: Some(&vec3_out(linear_velocity_mps)),
        attributes,
        parent: attachment.map_or(0, |attachment| attachment.parent.get()),
        attachment: attachment
            .map_or(fb::AttachmentKind::Rigid, |attachment| attachment_out(attachment.kind)),
    };
    body!(b, SpawnActor, args)
}

/// Only for what [`command_out`] sends here.
fn vehicle_command_out(b: &mut FlatBufferBuilder<'_>, command: &Command) -> Body {
    match command {
        Command::SetControl { actor, control } => {
            let control = control_out(control);
            let args = fb::SetControlArgs { actor: actor.get(), control: Some(&control) };
            body!(b, SetControl, args)
        }
        Command::SetAckermann { actor, control } => {
            let control = ackermann_out(control);
            let args = fb::SetAckermannArgs { actor: actor.get(), control: Some(&control) };
            body!(b, SetAckermann, args)
        }
        Command::SetAckermannGains { actor, gains } => {
            let gains = gains_out(gains);
            let args = fb::SetAckermannGainsArgs { actor: actor.get(), gains: Some(&gains) };
            body!(b, SetAckermannGains, args)
        }
        Command::SetPilot { actor, mode, target_speed_mps } => {
            let (mode, target_speed_mps) = (pilot_out(*mode), *target_speed_mps);
            body!(b, SetPilot, fb::SetPilotArgs { actor: actor.get(), mode, target_speed_mps })
        }
        Command::SetVehiclePhysics { actor, physics } => {
            let physics = Some(physics_out(b, physics));
            let args = fb::SetVehiclePhysicsArgs { actor: actor.get(), physics };
            body!(b, SetVehiclePhysics, args)
        }
        Command::SetVehicleLights { actor, lights } => {
            let args = fb::SetVehicleLightsArgs { actor: actor.get(), lights: *lights };
            body!(b, SetVehicleLights, args)
        }
        Command::SetDoors { actor, doors, open } => {
            let args = fb::SetDoorsArgs { actor: actor.get(), doors: *doors, open: *open };
            body!(b, SetDoors, args)
        }
        other => unreachable!("{other:?} is no vehicle command"),
    }
}

/// Only for what [`command_out`] sends here.
fn motion_command_out(b: &mut FlatBufferBuilder<'_>, command: &Command) -> Body {
    match command {
        Command::SetVelocity { actor, linear_mps, angular_radps } => {
            let linear = linear_mps.as_ref().map(vec3_out);
            let angular = angular_radps.as_ref().map(vec3_out);
            let args = fb::SetVelocityArgs {
                actor: actor.get(),
                linear_in_world_mps: linear.as_ref(),
                angular_in_world_radps: angular.as_ref(),
            };
            body!(b, SetVelocity, args)
        }
        Command::SetConstantVelocity { actor, velocity_mps } => {
            let velocity = velocity_mps.as_ref().map(vec3_out);
            let args = fb::SetConstantVelocityArgs {
                actor: actor.get(),
                velocity_in_actor_mps: velocity.as_ref(),
            };
            body!(b, SetConstantVelocity, args)
        }
        Command::Push { actor, kind, amount } => {
            let amount = vec3_out(amount);
            let args = fb::PushArgs {
                actor: actor.get(),
                kind: push_out(*kind),
                amount_in_world: Some(&amount),
            };
            body!(b, Push, args)
        }
        Command::SetPose { actor, world_from_actor } => {
            let pose = pose_out(world_from_actor);
            let args = fb::SetPoseArgs { actor: actor.get(), world_from_actor: Some(&pose) };
            body!(b, SetPose, args)
        }
        Command::SetSwitch { actor, switch, on } => {
            let (actor, body_switch, on) = (actor.get(), switch_out(*switch), *on);
            body!(b, SetSwitch, fb::SetSwitchArgs { actor, body_switch, on })
        }
        other => unreachable!("{other:?} moves no actor"),
    }
}

/// Only for what [`command_out`] sends here.
fn scene_command_out(b: &mut FlatBufferBuilder<'_>, command: &Command) -> Body {
    match command {
        Command::SetTrafficLight { actor, colour, green_secs, yellow_secs, red_secs } => {
            let args = fb::SetTrafficLightArgs {
                actor: actor.get(),
                colour: colour.map(colour_out),
                green_secs: *green_secs,
                yellow_secs: *yellow_secs,
                red_secs: *red_secs,
            };
            body!(b, SetTrafficLight, args)
        }
        Command::FreezeTrafficLights { frozen } => {
            body!(b, FreezeTrafficLights, fb::FreezeTrafficLightsArgs { frozen: *frozen })
        }
        Command::ResetTrafficLights { actor } => {
            let actor = actor.map_or(0, ActorId::get);
            body!(b, ResetTrafficLights, fb::ResetTrafficLightsArgs { actor })
        }
        Command::SetWeather { weather } => {
            let weather = weather_out(weather);
            body!(b, SetWeather, fb::SetWeatherArgs { weather: Some(&weather) })
        }
        Command::SetTimeStep { dt_secs, substep_secs_max, substeps_max } => {
            let args = fb::SetTimeStepArgs {
                dt_secs: *dt_secs,
                substep_secs_max: *substep_secs_max,
                substeps_max: *substeps_max,
            };
            body!(b, SetTimeStep, args)
        }
        other => unreachable!("{other:?} changes no scene"),
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
        | Body::SetDoors => vehicle_command_in(raw),
        Body::SetAgent
        | Body::SetAgentRoute
        | Body::DriveAgent
        | Body::SetTraffic
        | Body::SpawnTraffic
        | Body::SetHybridTraffic
        | Body::SetWalkerAgent => agent::command_in(raw),
        Body::SetWalkerControl => {
            let set = needed(raw.body_as_set_walker_control(), "a walker's control")?;
            let control = walker_in(set.control())?;
            Ok(Command::SetWalkerControl { actor: actor_in(set.actor())?, control })
        }
        Body::SetWalkerState => {
            let set = needed(raw.body_as_set_walker_state(), "a walker's state")?;
            Ok(Command::SetWalkerState {
                actor: actor_in(set.actor())?,
                world_from_actor: pose_in(set.world_from_actor(), "world_from_actor")?,
                speed_mps: finite(set.speed_mps(), "speed")?,
            })
        }
        Body::SetVelocity
        | Body::SetConstantVelocity
        | Body::Push
        | Body::SetPose
        | Body::SetSwitch => motion_command_in(raw),
        Body::SetMapLayers | Body::SetEnvironmentObjects => scenery::command_in(raw),
        Body::Listen | Body::IgnoreVehicles | Body::SendV2x => sensor::command_in(raw),
        _ => scene_command_in(raw),
    }
}

fn spawn_in(spawn: &fb::SpawnActor<'_>) -> Result<Command, Error> {
    let velocity = spawn.linear_velocity_in_world_mps();
    let kind = attachment_in(spawn.attachment())?;
    Ok(Command::SpawnActor {
        blueprint: spawn.blueprint().to_owned(),
        world_from_actor: pose_in(spawn.world_from_actor(), "world_from_actor")?,
        linear_velocity_mps: velocity
            .map_or(Ok(Vec3::zeros()), |raw| vec3_in(raw, "linear velocity"))?,
        attributes: attributes_in(spawn.attributes())?,
        attachment: ActorId::new(spawn.parent()).map(|parent| Attachment { parent, kind }),
    })
}

fn vehicle_command_in(raw: &fb::Command<'_>) -> Result<Command, Error> {
    if let Some(set) = raw.body_as_set_control() {
        let control = control_in(set.control())?;
        return Ok(Command::SetControl { actor: actor_in(set.actor())?, control });
    }
    if let Some(set) = raw.body_as_set_pilot() {
        let target = set.target_speed_mps();
        return Ok(Command::SetPilot {
            actor: actor_in(set.actor())?,
            mode: pilot_in(set.mode())?,
            target_speed_mps: target.map(|speed| finite(speed, "target speed")).transpose()?,
        });
    }
    if let Some(set) = raw.body_as_set_ackermann() {
        let control = ackermann_in(set.control())?;
        return Ok(Command::SetAckermann { actor: actor_in(set.actor())?, control });
    }
    if let Some(set) = raw.body_as_set_ackermann_gains() {
        let gains = gains_in(set.gains())?;
        return Ok(Command::SetAckermannGains { actor: actor_in(set.actor())?, gains });
    }
    if let Some(set) = raw.body_as_set_vehicle_physics() {
        let physics = Box::new(physics_in(&set.physics())?);
        return Ok(Command::SetVehiclePhysics { actor: actor_in(set.actor())?, physics });
    }
    if let Some(set) = raw.body_as_set_vehicle_lights() {
        let actor = actor_in(set.actor())?;
        return Ok(Command::SetVehicleLights { actor, lights: set.lights() });
    }
    let set = needed(raw.body_as_set_doors(), "a known command")?;
    let (doors, open) = (set.doors(), set.open());
    Ok(Command::SetDoors { actor: actor_in(set.actor())?, doors, open })
}

fn motion_command_in(raw: &fb::Command<'_>) -> Result<Command, Error> {
    let vector = |raw: Option<&fb::Vec3>, field| raw.map(|raw| vec3_in(raw, field)).transpose();
    if let Some(set) = raw.body_as_set_velocity() {
        return Ok(Command::SetVelocity {
            actor: actor_in(set.actor())?,
            linear_mps: vector(set.linear_in_world_mps(), "linear velocity")?,
            angular_radps: vector(set.angular_in_world_radps(), "angular velocity")?,
        });
    }
    if let Some(set) = raw.body_as_set_constant_velocity() {
        let velocity_mps = vector(set.velocity_in_actor_mps(), "velocity")?;
        return Ok(Command::SetConstantVelocity { actor: actor_in(set.actor())?, velocity_mps });
    }
    if let Some(push) = raw.body_as_push() {
        return Ok(Command::Push {
            actor: actor_in(push.actor())?,
            kind: push_in(push.kind())?,
            amount: vec3_in(push.amount_in_world(), "amount")?,
        });
    }
    if let Some(set) = raw.body_as_set_pose() {
        let world_from_actor = pose_in(set.world_from_actor(), "world_from_actor")?;
        return Ok(Command::SetPose { actor: actor_in(set.actor())?, world_from_actor });
    }
    let set = needed(raw.body_as_set_switch(), "a known command")?;
    let switch = switch_in(set.body_switch())?;
    Ok(Command::SetSwitch { actor: actor_in(set.actor())?, switch, on: set.on() })
}

fn scene_command_in(raw: &fb::Command<'_>) -> Result<Command, Error> {
    let secs = |value: Option<f32>, field| value.map(|value| finite(value, field)).transpose();
    if let Some(set) = raw.body_as_set_traffic_light() {
        return Ok(Command::SetTrafficLight {
            actor: actor_in(set.actor())?,
            colour: set.colour().map(colour_in).transpose()?,
            green_secs: secs(set.green_secs(), "green_secs")?,
            yellow_secs: secs(set.yellow_secs(), "yellow_secs")?,
            red_secs: secs(set.red_secs(), "red_secs")?,
        });
    }
    if let Some(freeze) = raw.body_as_freeze_traffic_lights() {
        return Ok(Command::FreezeTrafficLights { frozen: freeze.frozen() });
    }
    if let Some(reset) = raw.body_as_reset_traffic_lights() {
        return Ok(Command::ResetTrafficLights { actor: ActorId::new(reset.actor()) });
    }
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

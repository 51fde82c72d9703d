//! Requests and the commands in them.

use flatbuffers::{FlatBufferBuilder, ForwardsUOffset, UnionWIPOffset, Vector, WIPOffset};

use super::camera::{cameras_in, cameras_out};
use super::frame::{control_in, control_out, weather_in, weather_out};
use super::parts::{
    actor_in, finite, pilot_in, pilot_out, pose_in, pose_out, vec3_in, vec3_out, world_in,
};
use super::{Kind, check_count, needed, root};
use crate::generated as fb;
use crate::limits::{COMMANDS_PER_REQUEST_MAX, REQUEST_BYTES_MAX, WORLDS_PER_BATCH_MAX};
use crate::{Command, Error, ErrorCode, Lease, Request, Tick, TickItem, Vec3};

const REQUEST: Kind =
    Kind { name: "request", identifier: fb::REQUEST_IDENTIFIER, bytes_max: REQUEST_BYTES_MAX };

type Commands<'a> = Vector<'a, ForwardsUOffset<fb::Command<'a>>>;

/// A request as bytes.
pub fn encode_request(request: &Request) -> Vec<u8> {
    let mut builder = FlatBufferBuilder::with_capacity(1024);
    let (body_type, body) = body_out(&mut builder, request);
    let root = fb::Request::create(&mut builder, &fb::RequestArgs { body_type, body: Some(body) });
    builder.finish(root, Some(REQUEST.identifier));
    builder.finished_data().to_vec()
}

/// The request in these bytes.
///
/// # Errors
/// [`ErrorCode::TooLarge`] and [`ErrorCode::InvalidMessage`].
pub fn decode_request(bytes: &[u8]) -> Result<Request, Error> {
    let raw = root::<fb::Request>(&REQUEST, bytes)?;
    body_in(&raw)
}

fn body_out(
    b: &mut FlatBufferBuilder<'_>,
    request: &Request,
) -> (fb::RequestBody, WIPOffset<UnionWIPOffset>) {
    use fb::RequestBody as Body;
    match request {
        Request::CreateWorld { map, seed, dt_secs, commands, lease } => {
            let map = b.create_string(map);
            let commands = commands_out(b, commands);
            let (owner, lease_millis) = lease_out(b, lease.as_ref());
            let args = fb::CreateWorldArgs {
                map: Some(map),
                seed: *seed,
                dt_secs: *dt_secs,
                commands: Some(commands),
                owner,
                lease_millis,
            };
            (Body::CreateWorld, fb::CreateWorld::create(b, &args).as_union_value())
        }
        Request::ListWorlds => {
            (Body::ListWorlds, fb::ListWorlds::create(b, &fb::ListWorldsArgs {}).as_union_value())
        }
        Request::ListMaps => {
            (Body::ListMaps, fb::ListMaps::create(b, &fb::ListMapsArgs {}).as_union_value())
        }
        Request::DestroyWorld { world } => {
            let args = fb::DestroyWorldArgs { world: world.get() };
            (Body::DestroyWorld, fb::DestroyWorld::create(b, &args).as_union_value())
        }
        Request::SnapshotWorld { world } => {
            let args = fb::SnapshotWorldArgs { world: world.get() };
            (Body::SnapshotWorld, fb::SnapshotWorld::create(b, &args).as_union_value())
        }
        Request::RestoreWorld { snapshot, lease } => {
            let snapshot = Some(b.create_vector(snapshot));
            let (owner, lease_millis) = lease_out(b, lease.as_ref());
            let args = fb::RestoreWorldArgs { snapshot, owner, lease_millis };
            (Body::RestoreWorld, fb::RestoreWorld::create(b, &args).as_union_value())
        }
        Request::ForkWorld { world, count, lease } => {
            let (owner, lease_millis) = lease_out(b, lease.as_ref());
            let args = fb::ForkWorldArgs { world: world.get(), count: *count, owner, lease_millis };
            (Body::ForkWorld, fb::ForkWorld::create(b, &args).as_union_value())
        }
        Request::RunCommands { world, commands } => {
            let commands = Some(commands_out(b, commands));
            let args = fb::RunCommandsArgs { world: world.get(), commands };
            (Body::RunCommands, fb::RunCommands::create(b, &args).as_union_value())
        }
        Request::TickWorlds(items) => (Body::TickWorlds, tick_out(b, items)),
        Request::Capture { world, cameras } => {
            let cameras = Some(cameras_out(b, cameras));
            let args = fb::CaptureArgs { world: world.get(), cameras };
            (Body::Capture, fb::Capture::create(b, &args).as_union_value())
        }
    }
}

fn body_in(raw: &fb::Request<'_>) -> Result<Request, Error> {
    use fb::RequestBody as Body;
    let kind = raw.body_type();
    if let Some(create) = raw.body_as_create_world() {
        return create_in(&create);
    }
    if let Some(restore) = raw.body_as_restore_world() {
        return Ok(Request::RestoreWorld {
            snapshot: restore.snapshot().bytes().to_vec(),
            lease: lease_in(restore.owner(), restore.lease_millis())?,
        });
    }
    if let Some(fork) = raw.body_as_fork_world() {
        return Ok(Request::ForkWorld {
            world: world_in(fork.world())?,
            count: fork.count(),
            lease: lease_in(fork.owner(), fork.lease_millis())?,
        });
    }
    if let Some(run) = raw.body_as_run_commands() {
        let commands = commands_in(Some(run.commands()))?;
        return Ok(Request::RunCommands { world: world_in(run.world())?, commands });
    }
    if let Some(ticks) = raw.body_as_tick_worlds() {
        check_count("worlds in one batch", ticks.items().len(), WORLDS_PER_BATCH_MAX)?;
        let items = ticks.items().iter().map(|item| tick_in(&item));
        return Ok(Request::TickWorlds(items.collect::<Result<_, _>>()?));
    }
    if let Some(capture) = raw.body_as_capture() {
        let cameras = cameras_in(capture.cameras())?;
        return Ok(Request::Capture { world: world_in(capture.world())?, cameras });
    }
    if let Some(destroy) = raw.body_as_destroy_world() {
        return Ok(Request::DestroyWorld { world: world_in(destroy.world())? });
    }
    if let Some(snapshot) = raw.body_as_snapshot_world() {
        return Ok(Request::SnapshotWorld { world: world_in(snapshot.world())? });
    }
    match kind {
        Body::ListWorlds => Ok(Request::ListWorlds),
        Body::ListMaps => Ok(Request::ListMaps),
        other => Err(super::parts::unknown_variant("request", other.0)),
    }
}

fn create_in(raw: &fb::CreateWorld<'_>) -> Result<Request, Error> {
    if !raw.dt_secs().is_finite() {
        return Err(Error::new(ErrorCode::InvalidMessage, "dt_secs is not finite")
            .wanted("a finite number of seconds"));
    }
    Ok(Request::CreateWorld {
        map: raw.map().to_owned(),
        seed: raw.seed(),
        dt_secs: raw.dt_secs(),
        commands: commands_in(raw.commands())?,
        lease: lease_in(raw.owner(), raw.lease_millis())?,
    })
}

fn lease_out<'a>(
    b: &mut FlatBufferBuilder<'a>,
    lease: Option<&Lease>,
) -> (Option<WIPOffset<&'a str>>, u32) {
    match lease {
        Some(lease) => (Some(b.create_string(lease.owner.as_str())), lease.millis),
        None => (None, 0),
    }
}

fn lease_in(owner: Option<&str>, millis: u32) -> Result<Option<Lease>, Error> {
    let Some(owner) = owner else { return Ok(None) };
    let owner = owner
        .parse()
        .map_err(|cause| Error::new(ErrorCode::InvalidMessage, format!("owner: {cause}")))?;
    Ok(Some(Lease { owner, millis }))
}

fn tick_out(b: &mut FlatBufferBuilder<'_>, items: &[TickItem]) -> WIPOffset<UnionWIPOffset> {
    let mut raw = Vec::with_capacity(items.len());
    for item in items {
        let commands =
            if item.commands.is_empty() { None } else { Some(commands_out(b, &item.commands)) };
        let args = fb::TickItemArgs {
            world: item.world.get(),
            tick_count: item.tick_count,
            commands,
            expected_tick: item.expected_tick.map(|tick| tick.0),
        };
        raw.push(fb::TickItem::create(b, &args));
    }
    let items = Some(b.create_vector(&raw));
    fb::TickWorlds::create(b, &fb::TickWorldsArgs { items }).as_union_value()
}

fn tick_in(raw: &fb::TickItem<'_>) -> Result<TickItem, Error> {
    Ok(TickItem {
        world: world_in(raw.world())?,
        tick_count: raw.tick_count(),
        commands: commands_in(raw.commands())?,
        expected_tick: raw.expected_tick().map(Tick),
    })
}

fn commands_out<'a>(
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

fn commands_in(raw: Option<Commands<'_>>) -> Result<Vec<Command>, Error> {
    let Some(raw) = raw else { return Ok(Vec::new()) };
    check_count("commands", raw.len(), COMMANDS_PER_REQUEST_MAX)?;
    raw.iter().map(|command| command_in(&command)).collect()
}

fn command_out(
    b: &mut FlatBufferBuilder<'_>,
    command: &Command,
) -> (fb::CommandBody, WIPOffset<UnionWIPOffset>) {
    use fb::CommandBody as Body;
    match command {
        Command::SpawnActor { blueprint, world_from_actor, linear_velocity_mps } => {
            let blueprint = Some(b.create_string(blueprint));
            let args = fb::SpawnActorArgs {
                blueprint,
                world_from_actor: Some(&pose_out(world_from_actor)),
                linear_velocity_in_world_mps: Some(&vec3_out(linear_velocity_mps)),
            };
            (Body::SpawnActor, fb::SpawnActor::create(b, &args).as_union_value())
        }
        Command::DestroyActor { actor } => {
            let args = fb::DestroyActorArgs { actor: actor.get() };
            (Body::DestroyActor, fb::DestroyActor::create(b, &args).as_union_value())
        }
        Command::SetControl { actor, control } => {
            let control = control_out(control);
            let args = fb::SetControlArgs { actor: actor.get(), control: Some(&control) };
            (Body::SetControl, fb::SetControl::create(b, &args).as_union_value())
        }
        Command::SetPilot { actor, mode, target_speed_mps } => {
            let args = fb::SetPilotArgs {
                actor: actor.get(),
                mode: pilot_out(*mode),
                target_speed_mps: *target_speed_mps,
            };
            (Body::SetPilot, fb::SetPilot::create(b, &args).as_union_value())
        }
        Command::SetVelocity { actor, linear_mps, angular_radps } => {
            let args = fb::SetVelocityArgs {
                actor: actor.get(),
                linear_in_world_mps: Some(&vec3_out(linear_mps)),
                angular_in_world_radps: Some(&vec3_out(angular_radps)),
            };
            (Body::SetVelocity, fb::SetVelocity::create(b, &args).as_union_value())
        }
        Command::SetPose { actor, world_from_actor } => {
            let pose = pose_out(world_from_actor);
            let args = fb::SetPoseArgs { actor: actor.get(), world_from_actor: Some(&pose) };
            (Body::SetPose, fb::SetPose::create(b, &args).as_union_value())
        }
        Command::SetWeather { weather } => {
            let weather = weather_out(weather);
            let args = fb::SetWeatherArgs { weather: Some(&weather) };
            (Body::SetWeather, fb::SetWeather::create(b, &args).as_union_value())
        }
    }
}

fn command_in(raw: &fb::Command<'_>) -> Result<Command, Error> {
    if let Some(set) = raw.body_as_set_control() {
        let control = control_in(set.control())?;
        return Ok(Command::SetControl { actor: actor_in(set.actor())?, control });
    }
    if let Some(spawn) = raw.body_as_spawn_actor() {
        let velocity = spawn.linear_velocity_in_world_mps();
        return Ok(Command::SpawnActor {
            blueprint: spawn.blueprint().to_owned(),
            world_from_actor: pose_in(spawn.world_from_actor(), "world_from_actor")?,
            linear_velocity_mps: velocity
                .map_or(Ok(Vec3::zeros()), |raw| vec3_in(raw, "linear velocity"))?,
        });
    }
    if let Some(set) = raw.body_as_set_pilot() {
        let target = set.target_speed_mps();
        return Ok(Command::SetPilot {
            actor: actor_in(set.actor())?,
            mode: pilot_in(set.mode())?,
            target_speed_mps: target.map(|speed| finite(speed, "target speed")).transpose()?,
        });
    }
    if let Some(set) = raw.body_as_set_velocity() {
        return Ok(Command::SetVelocity {
            actor: actor_in(set.actor())?,
            linear_mps: vec3_in(set.linear_in_world_mps(), "linear velocity")?,
            angular_radps: vec3_in(set.angular_in_world_radps(), "angular velocity")?,
        });
    }
    if let Some(set) = raw.body_as_set_pose() {
        let world_from_actor = pose_in(set.world_from_actor(), "world_from_actor")?;
        return Ok(Command::SetPose { actor: actor_in(set.actor())?, world_from_actor });
    }
    if let Some(destroy) = raw.body_as_destroy_actor() {
        return Ok(Command::DestroyActor { actor: actor_in(destroy.actor())? });
    }
    let set = needed(raw.body_as_set_weather(), "a known command")?;
    Ok(Command::SetWeather { weather: weather_in(set.weather())? })
}

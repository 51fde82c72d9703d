//! Requests.

use flatbuffers::{FlatBufferBuilder, UnionWIPOffset, WIPOffset};

use super::command::{commands_in, commands_out};
use super::parts::{actor_in, name_in, vec3_in, vec3_out, world_in};
use super::{Kind, check_count, root};
use crate::generated as fb;
use crate::generated::RequestBody as Table;
use crate::limits::{
    ACTORS_PER_WORLD_MAX, FORKS_PER_REQUEST_MAX, RAYS_PER_REQUEST_MAX, REQUEST_BYTES_MAX,
    TICKS_PER_REQUEST_MAX, VEHICLES_PER_REQUEST_MAX, WORLDS_PER_BATCH_MAX,
};
use crate::{
    ActorId, Command, Error, ErrorCode, Lease, Request, ServiceId, Tick, TickItem, Vec3,
    VehicleCommand, WorldId,
};

type Body = (Table, WIPOffset<UnionWIPOffset>);

const REQUEST: Kind =
    Kind { name: "request", identifier: fb::REQUEST_IDENTIFIER, bytes_max: REQUEST_BYTES_MAX };

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

/// Whether a request may hold a command: one that has too much of something would have all commands
/// of its request refused.
///
/// # Errors
/// What [`decode_request`] says of it.
pub fn check_command(command: &Command) -> Result<(), Error> {
    let is_small = match command {
        Command::SpawnActor { .. } | Command::Sensor(_) | Command::Scenery(_) => false,
        Command::Vehicle(command) => !matches!(command, VehicleCommand::Physics { .. }),
        _ => true,
    };
    if is_small {
        return Ok(());
    }
    let Some(world) = WorldId::new(1) else { return Ok(()) };
    let item = TickItem { commands: vec![command.clone()], ..TickItem::new(world, 0) };
    decode_request(&encode_request(&Request::TickWorlds(vec![item]))).map(drop)
}

fn body_out(b: &mut FlatBufferBuilder<'_>, request: &Request) -> Body {
    match request {
        Request::CreateWorld { map, seed, dt_secs, commands, lease, traffic, first_actor } => {
            let (map, commands) = (Some(b.create_string(map)), Some(commands_out(b, commands)));
            let (owner, lease_millis) = lease_out(b, lease.as_ref());
            let args = fb::CreateWorldArgs {
                map,
                seed: *seed,
                dt_secs: *dt_secs,
                commands,
                owner,
                lease_millis,
                traffic: *traffic,
                first_actor: first_actor.get(),
            };
            (Table::CreateWorld, fb::CreateWorld::create(b, &args).as_union_value())
        }
        Request::ListWorlds => {
            (Table::ListWorlds, fb::ListWorlds::create(b, &fb::ListWorldsArgs {}).as_union_value())
        }
        Request::ListMaps => {
            (Table::ListMaps, fb::ListMaps::create(b, &fb::ListMapsArgs {}).as_union_value())
        }
        Request::DestroyWorld { world } => {
            let args = fb::DestroyWorldArgs { world: world.get() };
            (Table::DestroyWorld, fb::DestroyWorld::create(b, &args).as_union_value())
        }
        Request::SnapshotWorld { world } => {
            let args = fb::SnapshotWorldArgs { world: world.get() };
            (Table::SnapshotWorld, fb::SnapshotWorld::create(b, &args).as_union_value())
        }
        Request::RestoreWorld { snapshot, lease } => restore_out(b, snapshot, lease.as_ref()),
        Request::ForkWorld { world, count, lease } => {
            let (owner, lease_millis) = lease_out(b, lease.as_ref());
            let args = fb::ForkWorldArgs { world: world.get(), count: *count, owner, lease_millis };
            (Table::ForkWorld, fb::ForkWorld::create(b, &args).as_union_value())
        }
        Request::RunCommands { world, commands } => {
            let commands = Some(commands_out(b, commands));
            let args = fb::RunCommandsArgs { world: world.get(), commands };
            (Table::RunCommands, fb::RunCommands::create(b, &args).as_union_value())
        }
        Request::TickWorlds(items) => (Table::TickWorlds, tick_out(b, items)),
        Request::DescribeActors { world, actors } => describe_out(b, *world, actors),
        Request::InspectVehicles { world, actors } => inspect_out(b, *world, actors),
        Request::CastRays { world, rays } => rays_out(b, *world, rays),
        Request::PutMap { name, text } => {
            let (name, text) = (Some(b.create_string(name)), Some(b.create_string(text)));
            (Table::PutMap, fb::PutMap::create(b, &fb::PutMapArgs { name, text }).as_union_value())
        }
        Request::ShareClock { world, participant, lease_millis, stands_for } => {
            share_out(b, *world, participant, (*lease_millis, *stands_for))
        }
        Request::RecordWorld { world, on, name } => record_out(b, *world, *on, name.as_deref()),
        Request::BranchJournal { name, tick, lease } => branch_out(b, name, *tick, lease.as_ref()),
    }
}

fn restore_out(b: &mut FlatBufferBuilder<'_>, snapshot: &[u8], lease: Option<&Lease>) -> Body {
    let snapshot = Some(b.create_vector(snapshot));
    let (owner, lease_millis) = lease_out(b, lease);
    let args = fb::RestoreWorldArgs { snapshot, owner, lease_millis };
    (Table::RestoreWorld, fb::RestoreWorld::create(b, &args).as_union_value())
}

fn record_out(b: &mut FlatBufferBuilder<'_>, world: WorldId, on: bool, name: Option<&str>) -> Body {
    let name = name.map(|name| b.create_string(name));
    let args = fb::RecordWorldArgs { world: world.get(), on, name };
    (Table::RecordWorld, fb::RecordWorld::create(b, &args).as_union_value())
}

fn branch_out(
    b: &mut FlatBufferBuilder<'_>,
    name: &str,
    tick: Option<Tick>,
    lease: Option<&Lease>,
) -> Body {
    let name = Some(b.create_string(name));
    let (owner, lease_millis) = lease_out(b, lease);
    let args = fb::BranchJournalArgs { name, tick: tick.map(|tick| tick.0), owner, lease_millis };
    (Table::BranchJournal, fb::BranchJournal::create(b, &args).as_union_value())
}

fn share_out(
    b: &mut FlatBufferBuilder<'_>,
    world: WorldId,
    participant: &ServiceId,
    (lease_millis, stands_for): (u32, Option<WorldId>),
) -> Body {
    let participant = Some(b.create_string(participant.as_str()));
    let stands_for = stands_for.map_or(0, WorldId::get);
    let args = fb::ShareClockArgs { world: world.get(), participant, lease_millis, stands_for };
    (Table::ShareClock, fb::ShareClock::create(b, &args).as_union_value())
}

fn describe_out(b: &mut FlatBufferBuilder<'_>, world: WorldId, actors: &[ActorId]) -> Body {
    let ids: Vec<u32> = actors.iter().map(|actor| actor.get()).collect();
    let actors = Some(b.create_vector(&ids));
    let args = fb::DescribeActorsArgs { world: world.get(), actors };
    (Table::DescribeActors, fb::DescribeActors::create(b, &args).as_union_value())
}

fn inspect_out(b: &mut FlatBufferBuilder<'_>, world: WorldId, actors: &[ActorId]) -> Body {
    let ids: Vec<u32> = actors.iter().map(|actor| actor.get()).collect();
    let actors = Some(b.create_vector(&ids));
    let args = fb::InspectVehiclesArgs { world: world.get(), actors };
    (Table::InspectVehicles, fb::InspectVehicles::create(b, &args).as_union_value())
}

fn rays_out(b: &mut FlatBufferBuilder<'_>, world: WorldId, rays: &[(Vec3, Vec3)]) -> Body {
    let ray = |(from_m, to_m): &_| fb::Ray::new(&vec3_out(from_m), &vec3_out(to_m));
    let raw: Vec<fb::Ray> = rays.iter().map(ray).collect();
    let rays = Some(b.create_vector(&raw));
    let args = fb::CastRaysArgs { world: world.get(), rays };
    (Table::CastRays, fb::CastRays::create(b, &args).as_union_value())
}

fn body_in(raw: &fb::Request<'_>) -> Result<Request, Error> {
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
        check_count("copies", fork.count() as usize, FORKS_PER_REQUEST_MAX as usize)?;
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
        return ticks_in(&ticks);
    }
    if let Some(destroy) = raw.body_as_destroy_world() {
        return Ok(Request::DestroyWorld { world: world_in(destroy.world())? });
    }
    if let Some(snapshot) = raw.body_as_snapshot_world() {
        return Ok(Request::SnapshotWorld { world: world_in(snapshot.world())? });
    }
    if let Some(describe) = raw.body_as_describe_actors() {
        return describe_in(&describe);
    }
    if let Some(inspect) = raw.body_as_inspect_vehicles() {
        return inspect_in(&inspect);
    }
    if let Some(cast) = raw.body_as_cast_rays() {
        return rays_in(&cast);
    }
    if let Some(put) = raw.body_as_put_map() {
        return Ok(Request::PutMap { name: put.name().to_owned(), text: put.text().to_owned() });
    }
    if let Some(share) = raw.body_as_share_clock() {
        let (world, participant) = (world_in(share.world())?, name_in(share.participant())?);
        let (lease_millis, stands_for) = (share.lease_millis(), WorldId::new(share.stands_for()));
        return Ok(Request::ShareClock { world, participant, lease_millis, stands_for });
    }
    if let Some(record) = raw.body_as_record_world() {
        return record_in(&record);
    }
    if let Some(branch) = raw.body_as_branch_journal() {
        return branch_in(&branch);
    }
    match kind {
        Table::ListWorlds => Ok(Request::ListWorlds),
        Table::ListMaps => Ok(Request::ListMaps),
        other => Err(super::parts::unknown_variant("request", other.0)),
    }
}

fn record_in(raw: &fb::RecordWorld<'_>) -> Result<Request, Error> {
    let (world, name) = (world_in(raw.world())?, raw.name().map(str::to_owned));
    Ok(Request::RecordWorld { world, on: raw.on(), name })
}

fn branch_in(raw: &fb::BranchJournal<'_>) -> Result<Request, Error> {
    let (name, tick) = (raw.name().to_owned(), raw.tick().map(Tick));
    let lease = lease_in(raw.owner(), raw.lease_millis())?;
    Ok(Request::BranchJournal { name, tick, lease })
}

fn ticks_in(raw: &fb::TickWorlds<'_>) -> Result<Request, Error> {
    check_count("worlds in one batch", raw.items().len(), WORLDS_PER_BATCH_MAX)?;
    let items = raw.items().iter().map(|item| tick_in(&item));
    Ok(Request::TickWorlds(items.collect::<Result<_, _>>()?))
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
        traffic: raw.traffic(),
        first_actor: actor_in(raw.first_actor())?,
    })
}

fn describe_in(raw: &fb::DescribeActors<'_>) -> Result<Request, Error> {
    let actors = match raw.actors() {
        Some(ids) => {
            check_count("actors", ids.len(), ACTORS_PER_WORLD_MAX)?;
            ids.iter().map(actor_in).collect::<Result<Vec<ActorId>, _>>()?
        }
        None => Vec::new(),
    };
    Ok(Request::DescribeActors { world: world_in(raw.world())?, actors })
}

fn inspect_in(raw: &fb::InspectVehicles<'_>) -> Result<Request, Error> {
    check_count("vehicles", raw.actors().len(), VEHICLES_PER_REQUEST_MAX)?;
    let actors = raw.actors().iter().map(actor_in).collect::<Result<_, _>>()?;
    Ok(Request::InspectVehicles { world: world_in(raw.world())?, actors })
}

fn rays_in(raw: &fb::CastRays<'_>) -> Result<Request, Error> {
    check_count("rays", raw.rays().len(), RAYS_PER_REQUEST_MAX)?;
    let ray = |ray: &fb::Ray| -> Result<_, Error> {
        Ok((vec3_in(ray.from_in_world_m(), "ray")?, vec3_in(ray.to_in_world_m(), "ray")?))
    };
    let rays = raw.rays().iter().map(ray).collect::<Result<_, _>>()?;
    Ok(Request::CastRays { world: world_in(raw.world())?, rays })
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
    Ok(Some(Lease { owner: name_in(owner)?, millis }))
}

fn tick_out(b: &mut FlatBufferBuilder<'_>, items: &[TickItem]) -> WIPOffset<UnionWIPOffset> {
    let mut raw = Vec::with_capacity(items.len());
    for item in items {
        let commands =
            if item.commands.is_empty() { None } else { Some(commands_out(b, &item.commands)) };
        let participant = item.participant.as_ref().map(|name| b.create_string(name.as_str()));
        let args = fb::TickItemArgs {
            world: item.world.get(),
            tick_count: item.tick_count,
            commands,
            expected_tick: item.expected_tick.map(|tick| tick.0),
            dt_secs: item.dt_secs,
            participant,
        };
        raw.push(fb::TickItem::create(b, &args));
    }
    let items = Some(b.create_vector(&raw));
    fb::TickWorlds::create(b, &fb::TickWorldsArgs { items }).as_union_value()
}

fn tick_in(raw: &fb::TickItem<'_>) -> Result<TickItem, Error> {
    let dt_secs = raw.dt_secs();
    if dt_secs.is_some_and(|secs| !secs.is_finite()) {
        return Err(Error::new(ErrorCode::InvalidMessage, "dt_secs is not finite")
            .wanted("a finite number of seconds"));
    }
    check_count("ticks of a world", raw.tick_count() as usize, TICKS_PER_REQUEST_MAX as usize)?;
    Ok(TickItem {
        world: world_in(raw.world())?,
        tick_count: raw.tick_count(),
        commands: commands_in(raw.commands())?,
        expected_tick: raw.expected_tick().map(Tick),
        dt_secs,
        participant: raw.participant().map(name_in).transpose()?,
    })
}

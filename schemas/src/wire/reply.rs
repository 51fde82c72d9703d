//! Replies.

use flatbuffers::{FlatBufferBuilder, ForwardsUOffset, UnionWIPOffset, Vector, WIPOffset};

use super::camera::{images_in, images_out};
use super::description::{actors_in, actors_out, hits_in, hits_out, vehicles_in, vehicles_out};
use super::frame::{collisions_in, collisions_out, map_in};
use super::parts::{actor_in, error_code_in, error_code_out, name_in, unknown_variant, world_in};
use super::sensor::{sensors_in, sensors_out};
use super::{Kind, needed, root};
use crate::generated as fb;
use crate::limits::REPLY_BYTES_MAX;
use crate::{
    ActorId, CommandReply, EncodedFrame, Error, Images, Reply, Tick, TickOutcome, TickResult,
    WorldId, WorldInfo,
};

const REPLY: Kind =
    Kind { name: "reply", identifier: fb::REPLY_IDENTIFIER, bytes_max: REPLY_BYTES_MAX };

/// What most replies have beside their content.
const ENVELOPE_BYTES: usize = 1024;

/// What most results of a tick have beside their frame.
const TICKED_BYTES: usize = 128;

type CommandReplies<'a> = Vector<'a, ForwardsUOffset<fb::CommandReply<'a>>>;

/// A reply as bytes.
pub fn encode_reply(reply: &Reply) -> Vec<u8> {
    let mut builder = FlatBufferBuilder::with_capacity(ENVELOPE_BYTES + content_bytes(reply));
    let (body_type, body) = body_out(&mut builder, reply);
    let root = fb::Reply::create(&mut builder, &fb::ReplyArgs { body_type, body: Some(body) });
    builder.finish(root, Some(REPLY.identifier));
    // The message is at the end of the buffer.
    let (mut bytes, start) = builder.collapse();
    bytes.drain(..start);
    bytes
}

/// Of the parts that can be large; for these the buffer should not have to grow.
fn content_bytes(reply: &Reply) -> usize {
    match reply {
        Reply::Images(images) => images.images.iter().map(|image| image.data.len()).sum(),
        Reply::Ticked(results) => results
            .iter()
            .flat_map(|result| &result.outcome)
            .map(|ticked| TICKED_BYTES + ticked.frame.0.len())
            .sum(),
        Reply::WorldCreated { frame, .. } => frame.0.len(),
        Reply::Snapshot(snapshot) => snapshot.len(),
        _ => 0,
    }
}

/// The reply in these bytes.
///
/// # Errors
/// [`TooLarge`](crate::ErrorCode::TooLarge) and
/// [`InvalidMessage`](crate::ErrorCode::InvalidMessage).
pub fn decode_reply(bytes: &[u8]) -> Result<Reply, Error> {
    let raw = root::<fb::Reply>(&REPLY, bytes)?;
    body_in(&raw)
}

fn body_out(
    b: &mut FlatBufferBuilder<'_>,
    reply: &Reply,
) -> (fb::ReplyBody, WIPOffset<UnionWIPOffset>) {
    use fb::ReplyBody as Body;
    match reply {
        Reply::Error(error) => (Body::Error, error_out(b, error).as_union_value()),
        Reply::Done => (Body::Done, fb::Done::create(b, &fb::DoneArgs {}).as_union_value()),
        Reply::CommandReplies(replies) => {
            let replies = Some(command_replies_out(b, replies));
            let args = fb::CommandRepliesArgs { replies };
            (Body::CommandReplies, fb::CommandReplies::create(b, &args).as_union_value())
        }
        Reply::WorldCreated { world, frame, replies } => {
            let frame = Some(b.create_vector(&frame.0));
            let replies = Some(command_replies_out(b, replies));
            let args = fb::WorldCreatedArgs { world: world.get(), frame, replies };
            (Body::WorldCreated, fb::WorldCreated::create(b, &args).as_union_value())
        }
        Reply::Worlds(worlds) => (Body::Worlds, worlds_out(b, worlds)),
        Reply::Maps(maps) => (Body::Maps, maps_out(b, maps)),
        Reply::Snapshot(snapshot) => {
            let snapshot = Some(b.create_vector(snapshot));
            let args = fb::SnapshotArgs { snapshot };
            (Body::Snapshot, fb::Snapshot::create(b, &args).as_union_value())
        }
        Reply::Forked(worlds) => {
            let ids: Vec<u64> = worlds.iter().map(|world| world.get()).collect();
            let worlds = Some(b.create_vector(&ids));
            (Body::Forked, fb::Forked::create(b, &fb::ForkedArgs { worlds }).as_union_value())
        }
        Reply::Ticked(results) => {
            let raw: Vec<_> = results.iter().map(|result| tick_result_out(b, result)).collect();
            let results = Some(b.create_vector(&raw));
            (Body::Ticked, fb::Ticked::create(b, &fb::TickedArgs { results }).as_union_value())
        }
        Reply::Images(images) => {
            let raw = Some(images_out(b, &images.images));
            let args =
                fb::ImagesArgs { tick: images.tick.0, state_hash: images.state_hash, images: raw };
            (Body::Images, fb::Images::create(b, &args).as_union_value())
        }
        Reply::Actors(actors) => (Body::Actors, actors_out(b, actors)),
        Reply::Vehicles(reports) => (Body::Vehicles, vehicles_out(b, reports)),
        Reply::RayHits(hits) => (Body::RayHits, hits_out(b, hits)),
        Reply::JournalBegun { name, digest, tick, state_hash } => {
            let name = Some(b.create_string(name));
            let (digest, tick, state_hash) = (*digest, tick.0, *state_hash);
            let args = fb::JournalBegunArgs { name, digest, tick, state_hash };
            (Body::JournalBegun, fb::JournalBegun::create(b, &args).as_union_value())
        }
    }
}

fn body_in(raw: &fb::Reply<'_>) -> Result<Reply, Error> {
    if let Some(ticked) = raw.body_as_ticked() {
        let results = ticked.results().iter().map(|result| tick_result_in(&result));
        return Ok(Reply::Ticked(results.collect::<Result<_, _>>()?));
    }
    if let Some(error) = raw.body_as_error() {
        return Ok(Reply::Error(error_in(&error)?));
    }
    if let Some(replies) = raw.body_as_command_replies() {
        return Ok(Reply::CommandReplies(command_replies_in(Some(replies.replies()))?));
    }
    if let Some(created) = raw.body_as_world_created() {
        return Ok(Reply::WorldCreated {
            world: world_in(created.world())?,
            frame: EncodedFrame(created.frame().bytes().to_vec()),
            replies: command_replies_in(Some(created.replies()))?,
        });
    }
    if let Some(worlds) = raw.body_as_worlds() {
        let worlds = worlds.worlds().iter().map(|world| world_info_in(&world));
        return Ok(Reply::Worlds(worlds.collect::<Result<_, _>>()?));
    }
    if let Some(maps) = raw.body_as_maps() {
        return Ok(Reply::Maps(maps.maps().iter().map(|map| map_in(&map)).collect()));
    }
    if let Some(snapshot) = raw.body_as_snapshot() {
        return Ok(Reply::Snapshot(snapshot.snapshot().bytes().to_vec()));
    }
    if let Some(forked) = raw.body_as_forked() {
        let worlds = forked.worlds().iter().map(world_in);
        return Ok(Reply::Forked(worlds.collect::<Result<_, _>>()?));
    }
    if let Some(begun) = raw.body_as_journal_begun() {
        return Ok(Reply::JournalBegun {
            name: begun.name().to_owned(),
            digest: begun.digest(),
            tick: Tick(begun.tick()),
            state_hash: begun.state_hash(),
        });
    }
    if let Some(images) = raw.body_as_images() {
        return Ok(Reply::Images(Images {
            tick: Tick(images.tick()),
            state_hash: images.state_hash(),
            images: images_in(images.images())?,
        }));
    }
    if let Some(actors) = raw.body_as_actors() {
        return Ok(Reply::Actors(actors_in(&actors)?));
    }
    if let Some(vehicles) = raw.body_as_vehicles() {
        return Ok(Reply::Vehicles(vehicles_in(&vehicles)?));
    }
    if let Some(hits) = raw.body_as_ray_hits() {
        return Ok(Reply::RayHits(hits_in(&hits)?));
    }
    match raw.body_type() {
        fb::ReplyBody::Done => Ok(Reply::Done),
        other => Err(unknown_variant("reply", other.0)),
    }
}

fn error_out<'a>(b: &mut FlatBufferBuilder<'a>, error: &Error) -> WIPOffset<fb::Error<'a>> {
    let message = Some(b.create_string(&error.message));
    let wanted = Some(b.create_string(&error.wanted));
    let found = Some(b.create_string(&error.found));
    let code = error_code_out(error.code);
    fb::Error::create(b, &fb::ErrorArgs { code, message, wanted, found })
}

fn error_in(raw: &fb::Error<'_>) -> Result<Error, Error> {
    Ok(Error {
        code: error_code_in(raw.code())?,
        message: raw.message().to_owned(),
        wanted: raw.wanted().unwrap_or_default().to_owned(),
        found: raw.found().unwrap_or_default().to_owned(),
    })
}

fn command_replies_out<'a>(
    b: &mut FlatBufferBuilder<'a>,
    replies: &[CommandReply],
) -> WIPOffset<CommandReplies<'a>> {
    let mut raw = Vec::with_capacity(replies.len());
    for reply in replies {
        let args = match reply {
            Ok(actor) => fb::CommandReplyArgs { actor: actor.map_or(0, ActorId::get), error: None },
            Err(error) => fb::CommandReplyArgs { actor: 0, error: Some(error_out(b, error)) },
        };
        raw.push(fb::CommandReply::create(b, &args));
    }
    b.create_vector(&raw)
}

fn command_replies_in(raw: Option<CommandReplies<'_>>) -> Result<Vec<CommandReply>, Error> {
    let Some(raw) = raw else { return Ok(Vec::new()) };
    raw.iter()
        .map(|reply| match reply.error() {
            Some(error) => Ok(Err(error_in(&error)?)),
            None => Ok(Ok(ActorId::new(reply.actor()))),
        })
        .collect()
}

fn worlds_out(b: &mut FlatBufferBuilder<'_>, worlds: &[WorldInfo]) -> WIPOffset<UnionWIPOffset> {
    let mut raw = Vec::with_capacity(worlds.len());
    for world in worlds {
        let map = Some(b.create_string(&world.map));
        let owner = world.owner.as_ref().map(|owner| b.create_string(owner.as_str()));
        let quarantined = world.quarantined.as_ref().map(|reason| b.create_string(reason));
        let args = fb::WorldInfoArgs {
            world: world.world.get(),
            map,
            tick: world.tick.0,
            actor_count: world.actor_count,
            owner,
            quarantined,
            stands_for: world.stands_for.map_or(0, WorldId::get),
        };
        raw.push(fb::WorldInfo::create(b, &args));
    }
    let worlds = Some(b.create_vector(&raw));
    fb::Worlds::create(b, &fb::WorldsArgs { worlds }).as_union_value()
}

fn world_info_in(raw: &fb::WorldInfo<'_>) -> Result<WorldInfo, Error> {
    Ok(WorldInfo {
        world: world_in(raw.world())?,
        map: raw.map().to_owned(),
        tick: Tick(raw.tick()),
        actor_count: raw.actor_count(),
        owner: raw.owner().map(name_in).transpose()?,
        quarantined: raw.quarantined().map(str::to_owned),
        stands_for: WorldId::new(raw.stands_for()),
    })
}

fn maps_out(b: &mut FlatBufferBuilder<'_>, maps: &[crate::MapRef]) -> WIPOffset<UnionWIPOffset> {
    let mut raw = Vec::with_capacity(maps.len());
    for map in maps {
        let name = Some(b.create_string(&map.name));
        let digest = Some(b.create_string(&map.digest));
        raw.push(fb::MapRef::create(b, &fb::MapRefArgs { name, digest }));
    }
    let maps = Some(b.create_vector(&raw));
    fb::Maps::create(b, &fb::MapsArgs { maps }).as_union_value()
}

fn tick_result_out<'a>(
    b: &mut FlatBufferBuilder<'a>,
    result: &TickResult,
) -> WIPOffset<fb::TickResult<'a>> {
    let world = result.world.get();
    let args = match &result.outcome {
        Ok(outcome) => fb::TickResultArgs {
            world,
            frame: Some(b.create_vector(&outcome.frame.0)),
            replies: Some(command_replies_out(b, &outcome.replies)),
            collisions: Some(collisions_out(b, &outcome.collisions)),
            error: None,
            sensors: if outcome.sensors.is_empty() {
                None
            } else {
                Some(sensors_out(b, &outcome.sensors))
            },
            cameras_due: if outcome.cameras_due.is_empty() {
                None
            } else {
                let ids: Vec<u32> = outcome.cameras_due.iter().map(|id| id.get()).collect();
                Some(b.create_vector(&ids))
            },
            guests: if outcome.guests.is_empty() {
                None
            } else {
                let names = outcome.guests.iter().map(|name| b.create_string(name.as_str()));
                let names: Vec<_> = names.collect();
                Some(b.create_vector(&names))
            },
            is_changed_by_others: outcome.is_changed_by_others,
        },
        Err(error) => {
            fb::TickResultArgs { world, error: Some(error_out(b, error)), ..Default::default() }
        }
    };
    fb::TickResult::create(b, &args)
}

fn tick_result_in(raw: &fb::TickResult<'_>) -> Result<TickResult, Error> {
    let outcome = match raw.error() {
        Some(error) => Err(error_in(&error)?),
        None => Ok(TickOutcome {
            frame: EncodedFrame(needed(raw.frame(), "frame")?.bytes().to_vec()),
            replies: command_replies_in(raw.replies())?,
            collisions: raw.collisions().map_or(Ok(Vec::new()), collisions_in)?,
            sensors: sensors_in(raw.sensors())?,
            cameras_due: raw
                .cameras_due()
                .map(|ids| ids.iter().map(actor_in).collect::<Result<_, _>>())
                .transpose()?
                .unwrap_or_default(),
            guests: raw
                .guests()
                .map(|names| names.iter().map(name_in).collect::<Result<_, _>>())
                .transpose()?
                .unwrap_or_default(),
            is_changed_by_others: raw.is_changed_by_others(),
        }),
    };
    Ok(TickResult { world: world_in(raw.world())?, outcome })
}

//! What stands in the map: its boxes, and what of it is there.

use std::collections::{BTreeMap, BTreeSet};

use roads::Post;
use schemas::{
    ActorKind, ActorState, Command, Pose, SceneryCommand, SemanticTag, Translation3, Vec3, limits,
};

use super::lights;
use crate::dialect::{ActorRef, BoundingBox, EnvironmentObject, Transform, Vector3D};
use crate::endpoint::Endpoint;
use crate::episode::Episode;
use crate::maps;
use crate::rpc::Refusal;

/// Everything, whatever its tag.
pub(super) const ANY_TAG: u8 = 255;

/// Boxes of what belongs to the map and of the actors in it, with a semantic tag.
pub(super) fn boxes(endpoint: &mut Endpoint, tag: u8) -> Result<Vec<BoundingBox>, Refusal> {
    let objects = objects(endpoint, tag)?;
    let mut boxes = boxes_of_actors(endpoint, tag)?;
    boxes.extend(objects.into_iter().map(|object| object.bounding_box));
    Ok(boxes)
}

pub(super) fn names(endpoint: &mut Endpoint) -> Result<Vec<String>, Refusal> {
    let objects = objects(endpoint, ANY_TAG)?;
    Ok(objects.into_iter().map(|object| object.name).collect())
}

pub(super) async fn load_layers(endpoint: &mut Endpoint, layers: u16) -> Result<(), Refusal> {
    set_layers(endpoint, layers, true).await
}

pub(super) async fn unload_layers(endpoint: &mut Endpoint, layers: u16) -> Result<(), Refusal> {
    set_layers(endpoint, layers, false).await
}

async fn set_layers(endpoint: &mut Endpoint, layers: u16, loaded: bool) -> Result<(), Refusal> {
    if maps::is_layered(&endpoint.episode()?.map_name) {
        let command = Command::Scenery(SceneryCommand::Layers { layers, loaded });
        endpoint.run_now(vec![command]).await?;
    }
    Ok(())
}

/// Shows or hides things of the map; as in CARLA, ids that nothing has are left out.
pub(super) async fn enable(
    endpoint: &mut Endpoint,
    ids: Vec<u64>,
    enabled: bool,
) -> Result<(), Refusal> {
    let objects = endpoint.episode()?.map.environment_objects();
    let is_known = |id: &u64| objects.binary_search_by_key(id, |object| object.id).is_ok();
    let mut known: Vec<u64> = ids.into_iter().filter(is_known).collect();
    known.sort_unstable();
    known.dedup();
    for objects in known.chunks(limits::OBJECTS_PER_COMMAND_MAX) {
        let objects = objects.to_vec();
        endpoint.queue(Command::Scenery(SceneryCommand::Objects { objects, enabled })).await?;
    }
    Ok(())
}

/// What belongs to the map and its loaded layers, with a semantic tag. What was hidden by itself is
/// among it, so that it can be shown again; lights and signs that were destroyed are not.
pub(super) fn objects(endpoint: &mut Endpoint, tag: u8) -> Result<Vec<EnvironmentObject>, Refusal> {
    let episode = endpoint.known_episode()?;
    let unloaded = episode.frame.hidden.layers;
    let objects = episode.map.environment_objects().iter();
    let gone = gone_posts(episode);
    let is_there = |object: &&roads::EnvironmentObject| {
        !object.goes_with(unloaded) && !object.post.is_some_and(|post| gone.contains(&post))
    };
    let loaded = objects.filter(is_there);
    let wanted = loaded.filter(|object| tag == ANY_TAG || object.label.number() == tag);
    let standing = posts_with_actors(episode);
    let told = wanted.map(|object| {
        let standing = object.post.and_then(|place| standing.get(&place));
        told(object, standing.copied())
    });
    Ok(told.collect())
}

/// The posts of lights and signs with those whose they are, by their places.
fn posts_with_actors(episode: &Episode) -> BTreeMap<u32, (&Post, ActorRef)> {
    let landmarks = episode.map.landmarks();
    let actor = |state: &ActorState| Some((episode.signal(state.id)?, state.id.into()));
    let actors: BTreeMap<&str, ActorRef> = episode.states().filter_map(actor).collect();
    let posts = episode.map.posts_with_places().map(|(place, post)| {
        let signal = landmarks.get(post.landmark).map(|landmark| landmark.id.as_str());
        let actor = signal.and_then(|signal| actors.get(signal));
        (place, (post, actor.copied().unwrap_or(ActorRef::NOBODY)))
    });
    posts.collect()
}

/// Places of the posts of lights and signs that were destroyed.
fn gone_posts(episode: &Episode) -> BTreeSet<u32> {
    let hidden = &episode.frame.hidden;
    let posts = episode.map.posts_with_places().filter(|(place, _)| hidden.contains(*place));
    let posts: Vec<_> = posts.collect();
    if posts.is_empty() {
        return BTreeSet::new();
    }
    let lights = episode.map.traffic_lights().lights.into_iter().map(|light| light.id);
    let signs = episode.map.traffic_signs().into_iter();
    let signs = signs.filter(|sign| sign.kind.blueprint().is_some()).map(|sign| sign.id);
    let mut gone: BTreeSet<String> = lights.chain(signs).collect();
    for signal in episode.states().filter_map(|state| episode.signal(state.id)) {
        gone.remove(signal);
    }
    let is_gone = |post: &Post| {
        let signal = episode.map.landmarks().get(post.landmark);
        signal.is_some_and(|signal| gone.contains(&signal.id))
    };
    posts.into_iter().filter(|(_, post)| is_gone(post)).map(|(place, _)| place).collect()
}

/// Vehicles, walkers and props that are in the world now: CARLA lists their boxes with those of the
/// map.
fn boxes_of_actors(endpoint: &mut Endpoint, tag: u8) -> Result<Vec<BoundingBox>, Refusal> {
    let episode = endpoint.known_episode()?;
    let in_world = episode.states().filter_map(|state| {
        let known = episode.actor(state.id)?;
        let is_wanted = tag == ANY_TAG || known.semantic_tags.contains(&tag);
        let has_box =
            matches!(state.kind, ActorKind::Vehicle | ActorKind::Walker | ActorKind::Prop);
        if !is_wanted || !has_box {
            return None;
        }
        let BoundingBox { location, rotation, .. } = known.bounding_box;
        let placed =
            Transform::of(&(state.world_from_actor * Transform { location, rotation }.ours()));
        let Transform { location, rotation } = placed;
        Some(BoundingBox { location, rotation, ..known.bounding_box })
    });
    Ok(in_world.collect())
}

/// As in CARLA a post is a pole and not part of its light or sign, whose box is at its top.
fn told(
    object: &roads::EnvironmentObject,
    standing: Option<(&Post, ActorRef)>,
) -> EnvironmentObject {
    let pose: Pose = object.pose.cast();
    let half_m: Vec3 = object.half_extent_m.cast();
    let placed = Transform::of(&pose);
    let foot = pose * Translation3::new(0.0, 0.0, -half_m.z);
    let own_box = |actor_id| BoundingBox {
        location: placed.location,
        extent: Vector3D::size(half_m),
        rotation: placed.rotation,
        actor_id,
    };
    EnvironmentObject {
        transform: Transform::of(&foot),
        bounding_box: match standing {
            Some((_, actor)) if object.label == SemanticTag::Poles => own_box(actor),
            Some((post, actor)) => lights::box_at_top(post, actor),
            None => own_box(ActorRef::NOBODY),
        },
        id: object.id,
        name: object.name.clone(),
        tag: object.label.number(),
    }
}

//! Calls about pedestrians.

use blueprints::Class;
use schemas::{
    ActorId, ActorKind, ActorState, BodyCommand, BonesChange, Command, PushKind, Vec3,
    WalkerCommand,
};
use serde::{Deserialize, Serialize};

use crate::dialect::{ActorRef, Transform};
use crate::endpoint::Endpoint;
use crate::rpc::Refusal;
use crate::skeleton;

/// A push that nobody stays upright under, as a change of speed.
const FELLING_MPS: f32 = 2.0;

/// Name and transforms of a bone: in the world, the component, its parent.
type Bone = (&'static str, Transform, Transform, Transform);

#[derive(Serialize)]
pub(super) struct Bones {
    bones: Vec<Bone>,
}

/// Bones as a client wants them, each relative to its parent.
#[derive(Deserialize)]
pub(super) struct Wanted {
    bones: Vec<(String, Transform)>,
}

pub(super) fn bones(endpoint: &mut Endpoint, id: ActorRef) -> Result<Bones, Refusal> {
    let state = walker(endpoint, id)?;
    let posed = schemas::skeleton::posed(&state, endpoint.episode()?.walker_pose(state.id));
    let told = posed.iter().map(|bone| {
        let [world, component, relative] =
            [bone.in_world, bone.in_component, bone.in_parent].map(|pose| Transform::of(&pose));
        (bone.name, world, component, relative)
    });
    Ok(Bones { bones: told.collect() })
}

pub(super) async fn set_bones(
    endpoint: &mut Endpoint,
    id: ActorRef,
    wanted: Wanted,
) -> Result<(), Refusal> {
    let walker = walker(endpoint, id)?.id;
    let wanted = wanted.bones.into_iter().map(|(name, transform)| (name, transform.ours()));
    let bones = skeleton::named(wanted);
    change_bones(endpoint, walker, BonesChange { bones, ..BonesChange::default() }).await
}

pub(super) async fn blend_pose(
    endpoint: &mut Endpoint,
    id: ActorRef,
    share: f32,
) -> Result<(), Refusal> {
    let walker = walker(endpoint, id)?.id;
    let share = Some(share.clamp(0.0, 1.0));
    change_bones(endpoint, walker, BonesChange { share, ..BonesChange::default() }).await
}

/// The pose of the walk becomes the one that a client changes.
pub(super) async fn take_pose(endpoint: &mut Endpoint, id: ActorRef) -> Result<(), Refusal> {
    let state = walker(endpoint, id)?;
    let bones = skeleton::walked(&state);
    change_bones(endpoint, state.id, BonesChange { afresh: true, bones, share: None }).await
}

async fn change_bones(
    endpoint: &mut Endpoint,
    actor: ActorId,
    change: BonesChange,
) -> Result<(), Refusal> {
    endpoint.episode()?.note_bones(actor, &change);
    endpoint.queue(Command::Walker(WalkerCommand::Bones { actor, change })).await
}

/// Knocks a walker over backwards: it lies until it is put elsewhere.
pub(super) async fn fell(endpoint: &mut Endpoint, id: ActorRef) -> Result<(), Refusal> {
    let state = walker(endpoint, id)?;
    let type_id = endpoint.episode()?.frame.type_of(&state).to_owned();
    let mass_kg = match blueprints::find(&type_id).map(|blueprint| blueprint.class) {
        Some(Class::Walker(model)) => model.mass_kg,
        _ => 0.0,
    };
    let back = state.world_from_actor.rotation * -Vec3::x();
    let actor = state.id;
    let control = schemas::WalkerControl::default();
    endpoint.queue(Command::Walker(WalkerCommand::Control { actor, control })).await?;
    let amount = back * (FELLING_MPS * mass_kg);
    let push = BodyCommand::Push { actor, kind: PushKind::Impulse, amount };
    endpoint.queue(Command::Body(push)).await
}

/// # Errors
/// CARLA's words for what is no walker.
fn walker(endpoint: &mut Endpoint, id: ActorRef) -> Result<ActorState, Refusal> {
    endpoint.episode()?.found_as(id, ActorKind::Walker).cloned()
}

//! Calls about pedestrians.

use blueprints::Class;
use schemas::{ActorKind, ActorState, Command, PushKind, Vec3};
use serde::{Deserialize, Serialize};

use super::orders::{self, queue};
use super::{astray, wrong_kind};
use crate::dialect::{BatchCommand, Transform, WalkerControl};
use crate::endpoint::{Endpoint, unknown_actor};
use crate::rpc::{Answer, Meta, Payload, Refusal, Request};
use crate::skeleton;

/// A push that nobody stays upright under, as a change of speed.
const FELLING_MPS: f32 = 2.0;

/// Name and transforms of a bone: in the world, the component, its parent.
type Bone = (&'static str, Transform, Transform, Transform);

#[derive(Serialize)]
struct Bones {
    bones: Vec<Bone>,
}

/// Bones as a client wants them, each relative to its parent.
#[derive(Deserialize)]
struct Wanted {
    bones: Vec<(String, Transform)>,
}

pub(super) async fn answer(endpoint: &mut Endpoint, request: &Request) -> Answer {
    match request.method.as_str() {
        "apply_control_to_walker" => {
            let (_, id, control): (Meta, u32, WalkerControl) = request.args()?;
            queue(endpoint, &BatchCommand::WalkerControl(id, control)).await
        }
        "get_bones_transform" => {
            let (_, id): (Meta, u32) = request.args()?;
            let state = walker(endpoint, id)?;
            let posed = skeleton::posed(&state, endpoint.episode()?.custom_pose(id));
            let told = posed.iter().map(|bone| {
                let [world, component, relative] =
                    [bone.in_world, bone.in_component, bone.in_parent]
                        .map(|pose| Transform::of(&pose));
                (bone.name, world, component, relative)
            });
            Payload::value(&Bones { bones: told.collect() })
        }
        "set_bones_transform" => {
            let (_, id, wanted): (Meta, u32, Wanted) = request.args()?;
            walker(endpoint, id)?;
            if !wanted.bones.iter().all(|(_, transform)| transform.is_finite()) {
                return Err(Refusal("bones need finite transforms".to_owned()));
            }
            let bones = wanted.bones.into_iter().map(|(name, transform)| (name, transform.ours()));
            endpoint.episode()?.custom_pose_mut(id).set(bones);
            Ok(Payload::Void)
        }
        "blend_pose" => {
            let (_, id, share): (Meta, u32, f32) = request.args()?;
            walker(endpoint, id)?;
            endpoint.episode()?.custom_pose_mut(id).blend(share);
            Ok(Payload::Void)
        }
        "get_pose_from_animation" => {
            let (_, id): (Meta, u32) = request.args()?;
            let state = walker(endpoint, id)?;
            endpoint.episode()?.custom_pose_mut(id).copy(&state);
            Ok(Payload::Void)
        }
        "set_actor_dead" => {
            let (_, id): (Meta, u32) = request.args()?;
            fell(endpoint, id).await
        }
        _ => astray(request),
    }
}

/// Knocks a walker over backwards: it lies until it is put elsewhere.
async fn fell(endpoint: &mut Endpoint, id: u32) -> Answer {
    let state = walker(endpoint, id)?;
    let type_id = endpoint.episode()?.frame.type_of(&state).to_owned();
    let mass_kg = match blueprints::find(&type_id).map(|blueprint| blueprint.class) {
        Some(Class::Walker(model)) => model.mass_kg,
        _ => 0.0,
    };
    let back = state.world_from_actor.rotation * -Vec3::x();
    let actor = orders::actor(id)?;
    let control = schemas::WalkerControl::default();
    endpoint.queue(Command::SetWalkerControl { actor, control }).await?;
    let amount = back * (FELLING_MPS * mass_kg);
    endpoint.queue(Command::Push { actor, kind: PushKind::Impulse, amount }).await?;
    Ok(Payload::Void)
}

/// # Errors
/// CARLA's words for what is no walker.
fn walker(endpoint: &mut Endpoint, id: u32) -> Result<ActorState, Refusal> {
    let state = endpoint.episode()?.state(id).ok_or_else(|| unknown_actor(id))?;
    if state.kind == ActorKind::Walker {
        return Ok(state.clone());
    }
    Err(wrong_kind(id))
}

//! Calls about pedestrians.

use schemas::{ActorKind, Command};
use serde::Serialize;

use super::astray;
use super::orders::{self, queue};
use crate::dialect::{BatchCommand, Transform, WalkerControl};
use crate::endpoint::{Endpoint, unknown_actor};
use crate::rpc::{Answer, Meta, Payload, Refusal, Request};

/// Name and transforms of a bone: in the world, the component, its parent.
type Bone = (String, Transform, Transform, Transform);

#[derive(Serialize)]
struct Bones {
    bones: Vec<Bone>,
}

pub(super) async fn answer(endpoint: &mut Endpoint, request: &Request) -> Answer {
    match request.method.as_str() {
        "apply_control_to_walker" => {
            let (_, id, control): (Meta, u32, WalkerControl) = request.args()?;
            queue(endpoint, &BatchCommand::WalkerControl(id, control)).await
        }
        "get_bones_transform" => {
            let (_, id): (Meta, u32) = request.args()?;
            let state = endpoint.episode()?.state(id).ok_or_else(|| unknown_actor(id))?;
            if state.kind != ActorKind::Walker {
                return Err(Refusal(format!("Actor is not a Walker. Actor Id: {id}")));
            }
            let in_world = Transform::of(&state.world_from_actor);
            let own = Transform::default();
            Payload::value(&Bones { bones: vec![("crl_root".to_owned(), in_world, own, own)] })
        }
        "set_actor_dead" => {
            let (_, id): (Meta, u32) = request.args()?;
            let control = schemas::WalkerControl::default();
            let actor = orders::actor(id)?;
            endpoint.queue(Command::SetWalkerControl { actor, control }).await?;
            Ok(Payload::Void)
        }
        // Without effect, and nobody waits: the compatibility page says so.
        "set_bones_transform" | "blend_pose" | "get_pose_from_animation" => Ok(Payload::Void),
        _ => astray(request),
    }
}

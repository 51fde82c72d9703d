//! Calls about traffic lights.

use roads::LIGHT_HEAD_HALF_M;
use schemas::{ActorKind, Command, Vec3};

use super::astray;
use super::orders::{self, queue};
use crate::dialect::{BatchCommand, BoundingBox, Transform, Vector3D};
use crate::endpoint::{Endpoint, unknown_actor};
use crate::rpc::{Answer, Meta, Payload, Refusal, Request};

pub(super) async fn answer(endpoint: &mut Endpoint, request: &Request) -> Answer {
    match request.method.as_str() {
        "set_traffic_light_state" => {
            let (_, id, colour): (Meta, u32, u8) = request.args()?;
            queue(endpoint, &BatchCommand::TrafficLight(id, colour)).await
        }
        "set_traffic_light_green_time"
        | "set_traffic_light_yellow_time"
        | "set_traffic_light_red_time" => set_time(endpoint, request).await,
        "freeze_all_traffic_lights" => {
            let (_, frozen): (Meta, bool) = request.args()?;
            endpoint.queue(Command::FreezeTrafficLights { frozen }).await?;
            Ok(Payload::Void)
        }
        // One alone cannot be stopped: its group would go on around it.
        "freeze_traffic_light" => {
            let (_, _id, frozen): (Meta, u32, bool) = request.args()?;
            endpoint.queue(Command::FreezeTrafficLights { frozen }).await?;
            Ok(Payload::Void)
        }
        "reset_traffic_light_group" => {
            let (_, id): (Meta, u32) = request.args()?;
            let actor = Some(orders::actor(id)?);
            endpoint.queue(Command::ResetTrafficLights { actor }).await?;
            Ok(Payload::Void)
        }
        "reset_all_traffic_lights" => {
            endpoint.queue(Command::ResetTrafficLights { actor: None }).await?;
            endpoint.flush().await?;
            Ok(Payload::Void)
        }
        "get_group_traffic_lights" => {
            let (_, id): (Meta, u32) = request.args()?;
            Payload::value(&group(endpoint, id)?)
        }
        "get_light_boxes" => {
            let (_, id): (Meta, u32) = request.args()?;
            Payload::value(&boxes(endpoint, id)?)
        }
        _ => astray(request),
    }
}

async fn set_time(endpoint: &mut Endpoint, request: &Request) -> Answer {
    let (_, id, secs): (Meta, u32, f32) = request.args()?;
    if !(secs.is_finite() && secs >= 0.0) {
        return Err(Refusal("a light shows a colour for a positive time".to_owned()));
    }
    let of = |name: &str| request.method.contains(name).then_some(secs);
    let command = Command::SetTrafficLight {
        actor: orders::actor(id)?,
        colour: None,
        green_secs: of("green"),
        yellow_secs: of("yellow"),
        red_secs: of("red"),
    };
    endpoint.queue(command).await?;
    Ok(Payload::Void)
}

/// The lights that take turns with one, itself included.
fn group(endpoint: &mut Endpoint, id: u32) -> Result<Vec<u32>, Refusal> {
    let lights = &endpoint.episode()?.frame.traffic_lights;
    let own = lights.iter().find(|light| light.actor.get() == id);
    let own = own.ok_or_else(|| no_light(id))?;
    let same = lights.iter().filter(|light| light.group == own.group);
    Ok(same.map(|light| light.actor.get()).collect())
}

/// The housing of the lamps, in the world; a light has one.
fn boxes(endpoint: &mut Endpoint, id: u32) -> Result<Vec<BoundingBox>, Refusal> {
    let episode = endpoint.episode()?;
    let state = episode.state(id).ok_or_else(|| unknown_actor(id))?;
    if state.kind != ActorKind::TrafficLight {
        return Err(no_light(id));
    }
    let signal = episode.signal(id);
    let mut landmarks = episode.map.landmarks().iter();
    let found = landmarks.find(|landmark| Some(landmark.id.as_str()) == signal);
    let housing = found.map(|landmark| {
        let Transform { location, rotation } = Transform::of(&landmark.light_head().cast());
        let half_m = Vec3::from(LIGHT_HEAD_HALF_M.map(|metres| metres as f32));
        BoundingBox { location, extent: Vector3D::size(half_m), rotation, actor_id: id }
    });
    Ok(housing.into_iter().collect())
}

fn no_light(id: u32) -> Refusal {
    Refusal(format!("Actor is not a traffic light.  Actor Id: {id}"))
}

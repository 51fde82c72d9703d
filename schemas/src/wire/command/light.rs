//! Traffic light commands.

use flatbuffers::FlatBufferBuilder;

use super::{Body, table};
use crate::generated as fb;
use crate::wire::needed;
use crate::wire::parts::{actor_in, colour_in, colour_out, finite};
use crate::{ActorId, Command, Error, TrafficLightCommand};

pub(super) fn command_out(b: &mut FlatBufferBuilder<'_>, command: &TrafficLightCommand) -> Body {
    match command {
        TrafficLightCommand::Set { actor, colour, green_secs, yellow_secs, red_secs } => {
            let args = fb::SetTrafficLightArgs {
                actor: actor.get(),
                colour: colour.map(colour_out),
                green_secs: *green_secs,
                yellow_secs: *yellow_secs,
                red_secs: *red_secs,
            };
            table!(b, SetTrafficLight, args)
        }
        TrafficLightCommand::Freeze { frozen } => {
            table!(b, FreezeTrafficLights, fb::FreezeTrafficLightsArgs { frozen: *frozen })
        }
        TrafficLightCommand::Reset { actor } => {
            let actor = actor.map_or(0, ActorId::get);
            table!(b, ResetTrafficLights, fb::ResetTrafficLightsArgs { actor })
        }
    }
}

pub(super) fn command_in(raw: &fb::Command<'_>) -> Result<Command, Error> {
    let secs = |value: Option<f32>, field| value.map(|value| finite(value, field)).transpose();
    if let Some(set) = raw.body_as_set_traffic_light() {
        return Ok(Command::TrafficLight(TrafficLightCommand::Set {
            actor: actor_in(set.actor())?,
            colour: set.colour().map(colour_in).transpose()?,
            green_secs: secs(set.green_secs(), "green_secs")?,
            yellow_secs: secs(set.yellow_secs(), "yellow_secs")?,
            red_secs: secs(set.red_secs(), "red_secs")?,
        }));
    }
    if let Some(freeze) = raw.body_as_freeze_traffic_lights() {
        return Ok(Command::TrafficLight(TrafficLightCommand::Freeze { frozen: freeze.frozen() }));
    }
    let reset = needed(raw.body_as_reset_traffic_lights(), "a known command")?;
    Ok(Command::TrafficLight(TrafficLightCommand::Reset { actor: ActorId::new(reset.actor()) }))
}

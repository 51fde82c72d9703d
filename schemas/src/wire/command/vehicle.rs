//! Vehicle commands.

use flatbuffers::FlatBufferBuilder;

use super::{Body, table};
use crate::generated as fb;
use crate::wire::frame::{control_in, control_out};
use crate::wire::needed;
use crate::wire::parts::{actor_in, finite, pilot_in, pilot_out};
use crate::wire::vehicle::{
    ackermann_in, ackermann_out, gains_in, gains_out, physics_in, physics_out,
};
use crate::{Command, Error, VehicleCommand};

pub(super) fn command_out(b: &mut FlatBufferBuilder<'_>, command: &VehicleCommand) -> Body {
    match command {
        VehicleCommand::Control { actor, control } => {
            let control = control_out(control);
            let args = fb::SetControlArgs { actor: actor.get(), control: Some(&control) };
            table!(b, SetControl, args)
        }
        VehicleCommand::Ackermann { actor, control } => {
            let control = ackermann_out(control);
            let args = fb::SetAckermannArgs { actor: actor.get(), control: Some(&control) };
            table!(b, SetAckermann, args)
        }
        VehicleCommand::AckermannGains { actor, gains } => {
            let gains = gains_out(gains);
            let args = fb::SetAckermannGainsArgs { actor: actor.get(), gains: Some(&gains) };
            table!(b, SetAckermannGains, args)
        }
        VehicleCommand::Pilot { actor, mode, target_speed_mps } => {
            let (mode, target_speed_mps) = (pilot_out(*mode), *target_speed_mps);
            table!(b, SetPilot, fb::SetPilotArgs { actor: actor.get(), mode, target_speed_mps })
        }
        VehicleCommand::Physics { actor, physics } => {
            let physics = Some(physics_out(b, physics));
            let args = fb::SetVehiclePhysicsArgs { actor: actor.get(), physics };
            table!(b, SetVehiclePhysics, args)
        }
        VehicleCommand::Lights { actor, lights } => {
            let args = fb::SetVehicleLightsArgs { actor: actor.get(), lights: *lights };
            table!(b, SetVehicleLights, args)
        }
        VehicleCommand::Doors { actor, doors, open } => {
            let args = fb::SetDoorsArgs { actor: actor.get(), doors: *doors, open: *open };
            table!(b, SetDoors, args)
        }
    }
}

pub(super) fn command_in(raw: &fb::Command<'_>) -> Result<Command, Error> {
    if let Some(set) = raw.body_as_set_control() {
        let control = control_in(set.control())?;
        return Ok(Command::Vehicle(VehicleCommand::Control {
            actor: actor_in(set.actor())?,
            control,
        }));
    }
    if let Some(set) = raw.body_as_set_pilot() {
        let target = set.target_speed_mps();
        return Ok(Command::Vehicle(VehicleCommand::Pilot {
            actor: actor_in(set.actor())?,
            mode: pilot_in(set.mode())?,
            target_speed_mps: target.map(|speed| finite(speed, "target speed")).transpose()?,
        }));
    }
    if let Some(set) = raw.body_as_set_ackermann() {
        let control = ackermann_in(set.control())?;
        return Ok(Command::Vehicle(VehicleCommand::Ackermann {
            actor: actor_in(set.actor())?,
            control,
        }));
    }
    if let Some(set) = raw.body_as_set_ackermann_gains() {
        let gains = gains_in(set.gains())?;
        return Ok(Command::Vehicle(VehicleCommand::AckermannGains {
            actor: actor_in(set.actor())?,
            gains,
        }));
    }
    if let Some(set) = raw.body_as_set_vehicle_physics() {
        let physics = Box::new(physics_in(&set.physics())?);
        return Ok(Command::Vehicle(VehicleCommand::Physics {
            actor: actor_in(set.actor())?,
            physics,
        }));
    }
    if let Some(set) = raw.body_as_set_vehicle_lights() {
        let actor = actor_in(set.actor())?;
        return Ok(Command::Vehicle(VehicleCommand::Lights { actor, lights: set.lights() }));
    }
    let set = needed(raw.body_as_set_doors(), "a known command")?;
    let (doors, open) = (set.doors(), set.open());
    Ok(Command::Vehicle(VehicleCommand::Doors { actor: actor_in(set.actor())?, doors, open }))
}

//! What is said by radio.

use flatbuffers::{FlatBufferBuilder, UnionWIPOffset, WIPOffset};

use super::check_count;
use super::parts::{actor_in, finite, finite_double, unknown_variant, vec3_in, vec3_out};
use crate::StationMotion;
use crate::generated as fb;
use crate::limits::V2X_TEXT_BYTES_MAX;
use crate::{AwarenessMessage, CustomMessage, Error, Received, StationKind};

pub(super) fn awareness_out(
    b: &mut FlatBufferBuilder<'_>,
    received: &[Received<AwarenessMessage>],
) -> WIPOffset<UnionWIPOffset> {
    let mut raw = Vec::with_capacity(received.len());
    for Received { power_dbm, message } in received {
        let message = Some(message_out(b, message));
        let args = fb::AwarenessReceivedArgs { power_dbm: *power_dbm, message };
        raw.push(fb::AwarenessReceived::create(b, &args));
    }
    let received = Some(b.create_vector(&raw));
    fb::V2x::create(b, &fb::V2xArgs { received }).as_union_value()
}

pub(super) fn awareness_in(raw: &fb::V2x<'_>) -> Result<Vec<Received<AwarenessMessage>>, Error> {
    let received = raw.received().iter().map(|received| {
        Ok(Received {
            power_dbm: finite(received.power_dbm(), "power_dbm")?,
            message: message_in(&received.message())?,
        })
    });
    received.collect()
}

pub(super) fn custom_out(
    b: &mut FlatBufferBuilder<'_>,
    received: &[Received<CustomMessage>],
) -> WIPOffset<UnionWIPOffset> {
    let mut raw = Vec::with_capacity(received.len());
    for Received { power_dbm, message } in received {
        let text = Some(b.create_string(&message.text));
        let args = fb::CustomMessageArgs { station: message.station.get(), text };
        let message = Some(fb::CustomMessage::create(b, &args));
        let args = fb::CustomReceivedArgs { power_dbm: *power_dbm, message };
        raw.push(fb::CustomReceived::create(b, &args));
    }
    let received = Some(b.create_vector(&raw));
    fb::V2xCustom::create(b, &fb::V2xCustomArgs { received }).as_union_value()
}

pub(super) fn custom_in(raw: &fb::V2xCustom<'_>) -> Result<Vec<Received<CustomMessage>>, Error> {
    let received = raw.received().iter().map(|received| {
        let message = received.message();
        check_count("bytes of a text", message.text().len(), V2X_TEXT_BYTES_MAX)?;
        let station = actor_in(message.station())?;
        Ok(Received {
            power_dbm: finite(received.power_dbm(), "power_dbm")?,
            message: CustomMessage { station, text: message.text().to_owned() },
        })
    });
    received.collect()
}

fn message_out<'b>(
    b: &mut FlatBufferBuilder<'b>,
    message: &AwarenessMessage,
) -> WIPOffset<fb::AwarenessMessage<'b>> {
    let motion = message.motion.as_ref().map(|motion| {
        let args = fb::StationMotionArgs {
            heading_deg: motion.heading_deg,
            speed_mps: motion.speed_mps,
            forward: motion.forward,
            length_m: motion.length_m,
            width_m: motion.width_m,
            acceleration_mps2: Some(&vec3_out(&motion.acceleration_mps2)),
            yaw_rate_radps: motion.yaw_rate_radps,
        };
        fb::StationMotion::create(b, &args)
    });
    let args = fb::AwarenessMessageArgs {
        station: message.station.get(),
        kind: fb::StationKind(message.kind as u8),
        sim_secs: message.sim_secs,
        latitude_deg: message.latitude_deg,
        longitude_deg: message.longitude_deg,
        altitude_m: message.altitude_m,
        motion,
        lights: message.lights,
    };
    fb::AwarenessMessage::create(b, &args)
}

fn message_in(raw: &fb::AwarenessMessage<'_>) -> Result<AwarenessMessage, Error> {
    Ok(AwarenessMessage {
        station: actor_in(raw.station())?,
        kind: kind_in(raw.kind())?,
        sim_secs: finite_double(raw.sim_secs(), "sim_secs")?,
        latitude_deg: finite_double(raw.latitude_deg(), "latitude_deg")?,
        longitude_deg: finite_double(raw.longitude_deg(), "longitude_deg")?,
        altitude_m: finite_double(raw.altitude_m(), "altitude_m")?,
        motion: raw.motion().map(|motion| motion_in(&motion)).transpose()?,
        lights: raw.lights(),
    })
}

fn motion_in(raw: &fb::StationMotion<'_>) -> Result<StationMotion, Error> {
    Ok(StationMotion {
        heading_deg: finite(raw.heading_deg(), "heading_deg")?,
        speed_mps: finite(raw.speed_mps(), "speed_mps")?,
        forward: raw.forward(),
        length_m: finite(raw.length_m(), "length_m")?,
        width_m: finite(raw.width_m(), "width_m")?,
        acceleration_mps2: vec3_in(raw.acceleration_mps2(), "acceleration")?,
        yaw_rate_radps: finite(raw.yaw_rate_radps(), "yaw_rate_radps")?,
    })
}

fn kind_in(raw: fb::StationKind) -> Result<StationKind, Error> {
    match raw {
        fb::StationKind::Unknown => Ok(StationKind::Unknown),
        fb::StationKind::Pedestrian => Ok(StationKind::Pedestrian),
        fb::StationKind::Cyclist => Ok(StationKind::Cyclist),
        fb::StationKind::Motorcycle => Ok(StationKind::Motorcycle),
        fb::StationKind::PassengerCar => Ok(StationKind::PassengerCar),
        fb::StationKind::Bus => Ok(StationKind::Bus),
        fb::StationKind::LightTruck => Ok(StationKind::LightTruck),
        fb::StationKind::SpecialVehicle => Ok(StationKind::SpecialVehicle),
        fb::StationKind::Tram => Ok(StationKind::Tram),
        fb::StationKind::RoadSideUnit => Ok(StationKind::RoadSideUnit),
        other => Err(unknown_variant("station", other.0)),
    }
}

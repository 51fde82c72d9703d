//! What does not change from tick to tick, and what rays meet.

use flatbuffers::{FlatBufferBuilder, UnionWIPOffset, WIPOffset};

use super::check_count;
use super::parts::{
    actor_in, actor_kind_in, actor_kind_out, attachment_in, attachment_out, attributes_in,
    attributes_out, vec3_in, vec3_out,
};
use super::vehicle::{gains_in, gains_out, physics_in, physics_out, telemetry_in, telemetry_out};
use crate::generated as fb;
use crate::limits::ACTORS_PER_WORLD_MAX;
use crate::{ActorDescription, ActorId, Attachment, Error, RayHit, VehicleReport};

pub(super) fn actors_out(
    b: &mut FlatBufferBuilder<'_>,
    actors: &[ActorDescription],
) -> WIPOffset<UnionWIPOffset> {
    let raw: Vec<_> = actors.iter().map(|actor| actor_out(b, actor)).collect();
    let actors = Some(b.create_vector(&raw));
    fb::Actors::create(b, &fb::ActorsArgs { actors }).as_union_value()
}

pub(super) fn actors_in(raw: &fb::Actors<'_>) -> Result<Vec<ActorDescription>, Error> {
    check_count("actors", raw.actors().len(), ACTORS_PER_WORLD_MAX)?;
    raw.actors().iter().map(|actor| description_in(&actor)).collect()
}

fn actor_out<'a>(
    b: &mut FlatBufferBuilder<'a>,
    actor: &ActorDescription,
) -> WIPOffset<fb::ActorDescription<'a>> {
    let blueprint = Some(b.create_string(&actor.blueprint));
    let attributes = Some(attributes_out(b, &actor.attributes));
    let signal = actor.signal.as_ref().map(|signal| b.create_string(signal));
    let args = fb::ActorDescriptionArgs {
        actor: actor.id.get(),
        parent: actor.attachment.map_or(0, |attachment| attachment.parent.get()),
        attachment: actor
            .attachment
            .map_or(fb::AttachmentKind::Rigid, |attachment| attachment_out(attachment.kind)),
        kind: actor_kind_out(actor.kind),
        blueprint,
        attributes,
        box_centre_in_actor_m: Some(&vec3_out(&actor.box_centre_m)),
        box_half_extent_m: Some(&vec3_out(&actor.box_half_extent_m)),
        tag: actor.tag,
        signal,
    };
    fb::ActorDescription::create(b, &args)
}

fn description_in(raw: &fb::ActorDescription<'_>) -> Result<ActorDescription, Error> {
    let kind = attachment_in(raw.attachment())?;
    Ok(ActorDescription {
        id: actor_in(raw.actor())?,
        attachment: ActorId::new(raw.parent()).map(|parent| Attachment { parent, kind }),
        kind: actor_kind_in(raw.kind())?,
        blueprint: raw.blueprint().to_owned(),
        attributes: attributes_in(Some(raw.attributes()))?,
        box_centre_m: vec3_in(raw.box_centre_in_actor_m(), "box centre")?,
        box_half_extent_m: vec3_in(raw.box_half_extent_m(), "box half extent")?,
        tag: raw.tag(),
        signal: raw.signal().map(str::to_owned),
    })
}

pub(super) fn vehicles_out(
    b: &mut FlatBufferBuilder<'_>,
    reports: &[VehicleReport],
) -> WIPOffset<UnionWIPOffset> {
    let mut raw = Vec::with_capacity(reports.len());
    for report in reports {
        let physics = Some(physics_out(b, &report.physics));
        let telemetry = Some(telemetry_out(b, &report.telemetry));
        let gains = gains_out(&report.gains);
        let args = fb::VehicleReportArgs { physics, telemetry, gains: Some(&gains) };
        raw.push(fb::VehicleReport::create(b, &args));
    }
    let vehicles = Some(b.create_vector(&raw));
    fb::Vehicles::create(b, &fb::VehiclesArgs { vehicles }).as_union_value()
}

pub(super) fn vehicles_in(raw: &fb::Vehicles<'_>) -> Result<Vec<VehicleReport>, Error> {
    let report = |raw: fb::VehicleReport<'_>| -> Result<VehicleReport, Error> {
        Ok(VehicleReport {
            physics: physics_in(&raw.physics())?,
            telemetry: telemetry_in(&raw.telemetry())?,
            gains: gains_in(raw.gains())?,
        })
    };
    raw.vehicles().iter().map(report).collect()
}

pub(super) fn hits_out(
    b: &mut FlatBufferBuilder<'_>,
    hits: &[RayHit],
) -> WIPOffset<UnionWIPOffset> {
    let hit = |hit: &RayHit| {
        let actor = hit.actor.map_or(0, ActorId::get);
        fb::RayHit::new(hit.ray, actor, hit.tag, &vec3_out(&hit.position_m))
    };
    let raw: Vec<fb::RayHit> = hits.iter().map(hit).collect();
    let hits = Some(b.create_vector(&raw));
    fb::RayHits::create(b, &fb::RayHitsArgs { hits }).as_union_value()
}

pub(super) fn hits_in(raw: &fb::RayHits<'_>) -> Result<Vec<RayHit>, Error> {
    raw.hits()
        .iter()
        .map(|hit| {
            Ok(RayHit {
                ray: hit.ray(),
                actor: ActorId::new(hit.actor()),
                tag: hit.tag(),
                position_m: vec3_in(hit.position_in_world_m(), "hit")?,
            })
        })
        .collect()
}

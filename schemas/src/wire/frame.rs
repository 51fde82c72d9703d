//! Frames.

use flatbuffers::{FlatBufferBuilder, Vector, WIPOffset};

use super::parts::{
    actor_in, actor_kind_in, actor_kind_out, colour_in, colour_out, failure_in, failure_out,
    finite, finite_double, halt_reason_in, halt_reason_out, pose_in, pose_out, vec3_in, vec3_out,
    world_in,
};
use super::walker_pose::{poses_in, poses_out};
use super::{Kind, agent, check_count, paint, root, scenery};
use crate::generated as fb;
use crate::limits::{ACTORS_PER_WORLD_MAX, REPLY_BYTES_MAX};
use crate::{
    ActorId, ActorState, Collision, EncodedFrame, Error, ErrorCode, Frame, Halt, MapRef,
    RulesBroken, Tick, TrafficLightState, VehicleControl, WalkerControl, Weather,
};

pub(super) const FRAME: Kind =
    Kind { name: "frame", identifier: fb::FRAME_IDENTIFIER, bytes_max: REPLY_BYTES_MAX };

/// A frame as bytes.
pub fn encode_frame(frame: &Frame) -> EncodedFrame {
    // A buffer that is too small is copied.
    let actor_bytes = size_of::<fb::ActorState>();
    let light_bytes = size_of::<fb::TrafficLightState>();
    let capacity = 4096
        + frame.actors.len() * actor_bytes
        + frame.traffic_lights.len() * light_bytes
        + frame.collisions.len() * 64;
    let mut builder = FlatBufferBuilder::with_capacity(capacity);
    let name = builder.create_string(&frame.map.name);
    let digest = builder.create_string(&frame.map.digest);
    let map = fb::MapRef::create(
        &mut builder,
        &fb::MapRefArgs { name: Some(name), digest: Some(digest) },
    );
    let types = {
        let texts: Vec<_> = frame.types.iter().map(|text| builder.create_string(text)).collect();
        builder.create_vector(&texts)
    };
    let actors: Vec<fb::ActorState> = frame.actors.iter().map(actor_out).collect();
    let actors = builder.create_vector(&actors);
    let collisions = collisions_out(&mut builder, &frame.collisions);
    let lights: Vec<fb::TrafficLightState> = frame.traffic_lights.iter().map(light_out).collect();
    let traffic_lights = builder.create_vector(&lights);
    let agents: Vec<fb::AgentState> = frame.agents.iter().map(agent::state_out).collect();
    let agents = (!agents.is_empty()).then(|| builder.create_vector(&agents));
    let hidden_scenery = scenery::hidden_out(&mut builder, &frame.hidden);
    let halted: Vec<fb::Halt> = frame.halted.iter().map(halt_out).collect();
    let halted = (!halted.is_empty()).then(|| builder.create_vector(&halted));
    let broken: Vec<fb::RulesBroken> = frame.rules_broken.iter().map(broken_out).collect();
    let rules_broken = (!broken.is_empty()).then(|| builder.create_vector(&broken));
    let walker_poses = poses_out(&mut builder, &frame.walker_poses);
    let (textures, coats) = paint::paint_out(&mut builder, &frame.paint);
    let weather = weather_out(&frame.weather);
    let root = fb::Frame::create(
        &mut builder,
        &fb::FrameArgs {
            world: frame.world.get(),
            tick: frame.tick.0,
            epoch: frame.epoch,
            dt_secs: frame.dt_secs,
            state_hash: frame.state_hash,
            seed: frame.seed,
            map: Some(map),
            weather: Some(&weather),
            types: Some(types),
            actors: Some(actors),
            collisions: Some(collisions),
            traffic_lights: Some(traffic_lights),
            sim_secs: frame.sim_secs,
            agents,
            unloaded_layers: frame.hidden.layers,
            hidden_scenery,
            halted,
            rules_broken,
            walker_poses,
            textures,
            coats,
        },
    );
    builder.finish(root, Some(FRAME.identifier));
    EncodedFrame(builder.finished_data().to_vec())
}

/// The frame in these bytes.
///
/// # Errors
/// [`ErrorCode::TooLarge`] and [`ErrorCode::InvalidMessage`].
pub fn decode_frame(bytes: &[u8]) -> Result<Frame, Error> {
    let raw = root::<fb::Frame>(&FRAME, bytes)?;
    check_count("actors", raw.actors().len(), ACTORS_PER_WORLD_MAX)?;
    let types: Vec<String> = raw.types().iter().map(str::to_owned).collect();
    let actors = raw
        .actors()
        .iter()
        .map(|actor| actor_state_in(actor, types.len()))
        .collect::<Result<Vec<_>, Error>>()?;
    check_count("traffic lights", raw.traffic_lights().len(), ACTORS_PER_WORLD_MAX)?;
    check_count("agents", raw.agents().map_or(0, |agents| agents.len()), ACTORS_PER_WORLD_MAX)?;
    check_count("halts", raw.halted().map_or(0, |halts| halts.len()), ACTORS_PER_WORLD_MAX)?;
    let broken = raw.rules_broken();
    check_count("broken rules", broken.map_or(0, |all| all.len()), ACTORS_PER_WORLD_MAX)?;
    Ok(Frame {
        world: world_in(raw.world())?,
        tick: Tick(raw.tick()),
        epoch: raw.epoch(),
        dt_secs: finite_double(raw.dt_secs(), "dt_secs")?,
        sim_secs: finite_double(raw.sim_secs(), "sim_secs")?,
        state_hash: raw.state_hash(),
        seed: raw.seed(),
        map: map_in(&raw.map()),
        weather: weather_in(raw.weather())?,
        types,
        actors,
        collisions: collisions_in(raw.collisions())?,
        traffic_lights: raw.traffic_lights().iter().map(light_in).collect::<Result<_, _>>()?,
        agents: raw.agents().iter().flatten().map(agent::state_in).collect::<Result<_, _>>()?,
        hidden: scenery::hidden_in(&raw)?,
        paint: paint::paint_in(&raw)?,
        halted: raw.halted().iter().flatten().map(halt_in).collect::<Result<_, _>>()?,
        rules_broken: broken.iter().flatten().map(broken_in).collect::<Result<_, _>>()?,
        walker_poses: poses_in(raw.walker_poses())?,
    })
}

pub(super) fn map_in(raw: &fb::MapRef<'_>) -> MapRef {
    MapRef { name: raw.name().to_owned(), digest: raw.digest().to_owned() }
}

pub(super) fn control_out(value: &VehicleControl) -> fb::VehicleControl {
    fb::VehicleControl::new(
        value.throttle,
        value.steer,
        value.brake,
        value.hand_brake,
        value.reverse,
        value.manual_gear,
        value.gear,
    )
}

pub(super) fn control_in(raw: &fb::VehicleControl) -> Result<VehicleControl, Error> {
    Ok(VehicleControl {
        throttle: finite(raw.throttle(), "throttle")?,
        steer: finite(raw.steer(), "steer")?,
        brake: finite(raw.brake(), "brake")?,
        hand_brake: raw.hand_brake(),
        reverse: raw.reverse(),
        manual_gear: raw.manual_gear(),
        gear: raw.gear(),
    })
}

pub(super) fn walker_out(value: &WalkerControl) -> fb::WalkerControl {
    fb::WalkerControl::new(&vec3_out(&value.direction), value.speed_mps, value.jump)
}

pub(super) fn walker_in(raw: &fb::WalkerControl) -> Result<WalkerControl, Error> {
    Ok(WalkerControl {
        direction: vec3_in(raw.direction_in_world(), "direction")?,
        speed_mps: finite(raw.speed_mps(), "speed")?,
        jump: raw.jump(),
    })
}

fn halt_out(halt: &Halt) -> fb::Halt {
    fb::Halt::new(halt.tick.0, halt.actor.get(), halt_reason_out(halt.reason))
}

fn halt_in(raw: &fb::Halt) -> Result<Halt, Error> {
    Ok(Halt {
        tick: Tick(raw.tick()),
        actor: actor_in(raw.actor())?,
        reason: halt_reason_in(raw.reason())?,
    })
}

fn broken_out(broken: &RulesBroken) -> fb::RulesBroken {
    let RulesBroken { actor, red_lights, stop_signs, right_of_way, crossings } = *broken;
    fb::RulesBroken::new(actor.get(), red_lights, stop_signs, right_of_way, crossings)
}

fn broken_in(raw: &fb::RulesBroken) -> Result<RulesBroken, Error> {
    Ok(RulesBroken {
        actor: actor_in(raw.actor())?,
        red_lights: raw.red_lights(),
        stop_signs: raw.stop_signs(),
        right_of_way: raw.right_of_way(),
        crossings: raw.crossings(),
    })
}

fn light_out(light: &TrafficLightState) -> fb::TrafficLightState {
    fb::TrafficLightState::new(
        light.actor.get(),
        colour_out(light.colour),
        light.group,
        light.frozen,
        light.elapsed_secs,
        light.green_secs,
        light.yellow_secs,
        light.red_secs,
    )
}

fn light_in(raw: &fb::TrafficLightState) -> Result<TrafficLightState, Error> {
    Ok(TrafficLightState {
        actor: actor_in(raw.actor())?,
        colour: colour_in(raw.colour())?,
        group: raw.group(),
        frozen: raw.frozen(),
        elapsed_secs: finite(raw.elapsed_secs(), "elapsed_secs")?,
        green_secs: finite(raw.green_secs(), "green_secs")?,
        yellow_secs: finite(raw.yellow_secs(), "yellow_secs")?,
        red_secs: finite(raw.red_secs(), "red_secs")?,
    })
}

fn actor_out(actor: &ActorState) -> fb::ActorState {
    fb::ActorState::new(
        actor.id.get(),
        actor_kind_out(actor.kind),
        actor.gear,
        actor.type_index,
        &pose_out(&actor.world_from_actor),
        &vec3_out(&actor.linear_velocity_mps),
        &vec3_out(&actor.angular_velocity_radps),
        &vec3_out(&actor.linear_acceleration_mps2),
        &vec3_out(&actor.box_centre_m),
        &vec3_out(&actor.box_half_extent_m),
        &control_out(&actor.control),
        actor.road_wheel_rad,
        actor.colour_rgb,
        actor.parent.map_or(0, ActorId::get),
        actor.lights,
        actor.doors,
        failure_out(actor.failure),
        actor.speed_limit_mps,
        actor.traffic_light.map_or(0, ActorId::get),
        &walker_out(&actor.walker),
        actor.gait_rad,
    )
}

fn actor_state_in(raw: &fb::ActorState, types_count: usize) -> Result<ActorState, Error> {
    if usize::from(raw.type_index()) >= types_count {
        return Err(Error::new(ErrorCode::InvalidMessage, "an actor's type is not in the frame")
            .wanted(format!("an index below {types_count}"))
            .found(raw.type_index()));
    }
    Ok(ActorState {
        id: actor_in(raw.id())?,
        kind: actor_kind_in(raw.kind())?,
        gear: raw.gear(),
        type_index: raw.type_index(),
        world_from_actor: pose_in(raw.world_from_actor(), "world_from_actor")?,
        linear_velocity_mps: vec3_in(raw.linear_velocity_in_world_mps(), "linear velocity")?,
        angular_velocity_radps: vec3_in(raw.angular_velocity_in_world_radps(), "angular velocity")?,
        linear_acceleration_mps2: vec3_in(
            raw.linear_acceleration_in_world_mps2(),
            "linear acceleration",
        )?,
        box_centre_m: vec3_in(raw.box_centre_in_actor_m(), "box centre")?,
        box_half_extent_m: vec3_in(raw.box_half_extent_m(), "box half extent")?,
        control: control_in(raw.control())?,
        road_wheel_rad: finite(raw.road_wheel_rad(), "road_wheel_rad")?,
        colour_rgb: raw.colour_rgb(),
        parent: ActorId::new(raw.parent()),
        lights: raw.lights(),
        doors: raw.doors(),
        failure: failure_in(raw.failure())?,
        speed_limit_mps: finite(raw.speed_limit_mps(), "speed_limit_mps")?,
        traffic_light: ActorId::new(raw.traffic_light()),
        walker: walker_in(raw.walker())?,
        gait_rad: finite(raw.gait_rad(), "gait_rad")?,
    })
}

pub(super) fn collisions_out<'a>(
    builder: &mut FlatBufferBuilder<'a>,
    collisions: &[Collision],
) -> WIPOffset<Vector<'a, fb::Collision>> {
    let raw: Vec<fb::Collision> = collisions
        .iter()
        .map(|collision| {
            fb::Collision::new(
                collision.actor.get(),
                collision.other.map_or(0, ActorId::get),
                collision.started,
                &vec3_out(&collision.position_m),
                &vec3_out(&collision.impulse_ns),
                collision.closing_speed_mps,
            )
        })
        .collect();
    builder.create_vector(&raw)
}

pub(super) fn collisions_in(raw: Vector<'_, fb::Collision>) -> Result<Vec<Collision>, Error> {
    raw.iter()
        .map(|raw| {
            Ok(Collision {
                actor: actor_in(raw.actor())?,
                other: ActorId::new(raw.other()),
                started: raw.started(),
                position_m: vec3_in(raw.position_in_world_m(), "collision position")?,
                impulse_ns: vec3_in(raw.impulse_in_world_ns(), "impulse")?,
                closing_speed_mps: finite(raw.closing_speed_mps(), "closing speed")?,
            })
        })
        .collect()
}

pub(super) fn weather_out(weather: &Weather) -> fb::Weather {
    fb::Weather::new(
        weather.cloudiness_percent,
        weather.precipitation_percent,
        weather.precipitation_deposits_percent,
        weather.wind_intensity_percent,
        weather.sun_azimuth_rad,
        weather.sun_altitude_rad,
        weather.fog_density_percent,
        weather.fog_distance_m,
        weather.wetness_percent,
        weather.fog_falloff,
        weather.scattering_intensity,
        weather.mie_scattering_scale,
        weather.rayleigh_scattering_scale,
        weather.dust_storm_percent,
    )
}

pub(super) fn weather_in(raw: &fb::Weather) -> Result<Weather, Error> {
    Ok(Weather {
        cloudiness_percent: finite(raw.cloudiness_percent(), "cloudiness")?,
        precipitation_percent: finite(raw.precipitation_percent(), "precipitation")?,
        precipitation_deposits_percent: finite(
            raw.precipitation_deposits_percent(),
            "precipitation deposits",
        )?,
        wind_intensity_percent: finite(raw.wind_intensity_percent(), "wind intensity")?,
        sun_azimuth_rad: finite(raw.sun_azimuth_rad(), "sun azimuth")?,
        sun_altitude_rad: finite(raw.sun_altitude_rad(), "sun altitude")?,
        fog_density_percent: finite(raw.fog_density_percent(), "fog density")?,
        fog_distance_m: finite(raw.fog_distance_m(), "fog distance")?,
        wetness_percent: finite(raw.wetness_percent(), "wetness")?,
        fog_falloff: finite(raw.fog_falloff(), "fog falloff")?,
        scattering_intensity: finite(raw.scattering_intensity(), "scattering intensity")?,
        mie_scattering_scale: finite(raw.mie_scattering_scale(), "mie scattering")?,
        rayleigh_scattering_scale: finite(raw.rayleigh_scattering_scale(), "rayleigh scattering")?,
        dust_storm_percent: finite(raw.dust_storm_percent(), "dust storm")?,
    })
}

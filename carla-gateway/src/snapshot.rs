//! What the world observer tells: the state of every actor after a tick.

use schemas::carla;
use schemas::{
    ActorId, ActorKind, ActorState, Frame, TrafficLightColour, TrafficLightState, VehicleFailure,
};

use crate::dialect::{Transform, Vector3D, spin_deg};

/// Type of the world observer in the header.
const WORLD_OBSERVER_TYPE: u64 = 17;
/// The next `get_map` asks again.
pub(crate) const MAP_CHANGED: u32 = 1;
/// Clients ask for the lights again.
pub(crate) const LIGHTS_CHANGED: u32 = 2;
/// Bytes of one actor.
const RECORD_BYTES: usize = 119;
/// Bytes of the part that depends on the kind of actor.
const STATE_BYTES: usize = 54;
/// Bytes of the id of a signal.
const SIGN_ID_BYTES: usize = 32;
/// Where no sign was passed, as in CARLA, which does not look at the types of roads.
const SPEED_LIMIT_UNPOSTED_KMH: f32 = 30.0;
/// `ActorState::Active`.
const ACTIVE: u8 = 1;

/// What a frame does not say.
pub(crate) struct Moment {
    pub(crate) frame_number: u64,
    pub(crate) episode_id: u64,
    pub(crate) delta_secs: f64,
    /// Wall clock since the server started.
    pub(crate) platform_secs: f64,
    pub(crate) flags: u32,
    /// Whether the map has signs that tell speed limits.
    pub(crate) has_limit_signs: bool,
}

/// What a replay says of a traffic light, which stands still in the world meanwhile.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ReplayedLight {
    pub(crate) elapsed_secs: f32,
    pub(crate) is_frozen: bool,
}

/// What a frame does not say of a light or sign.
#[derive(Clone, Copy, Default)]
pub(crate) struct Signal<'a> {
    /// In the OpenDRIVE text.
    pub(crate) id: Option<&'a str>,
    pub(crate) replayed: Option<ReplayedLight>,
}

/// The 48 bytes in front of every payload.
pub(crate) fn header(
    sensor_type: u64,
    frame: u64,
    sim_secs: f64,
    transform: &Transform,
) -> Vec<u8> {
    let mut out = Vec::with_capacity(256);
    out.extend_from_slice(&sensor_type.to_le_bytes());
    out.extend_from_slice(&frame.to_le_bytes());
    out.extend_from_slice(&sim_secs.to_le_bytes());
    put_transform(&mut out, transform);
    out
}

/// The whole payload.
pub(crate) fn encode<'a>(
    frame: &Frame,
    moment: &Moment,
    signal_of: impl Fn(ActorId) -> Signal<'a>,
) -> Vec<u8> {
    let mut out =
        header(WORLD_OBSERVER_TYPE, moment.frame_number, frame.sim_secs, &Transform::default());
    out.reserve(36 + frame.actors.len() * RECORD_BYTES);
    out.extend_from_slice(&moment.episode_id.to_le_bytes());
    out.extend_from_slice(&moment.platform_secs.to_le_bytes());
    out.extend_from_slice(&(moment.delta_secs as f32).to_le_bytes());
    // The origin of large maps, which ours do not move.
    out.extend_from_slice(&[0; 12]);
    out.extend_from_slice(&moment.flags.to_le_bytes());
    for actor in &frame.actors {
        put_actor(&mut out, frame, actor, moment.has_limit_signs, &signal_of);
    }
    out
}

fn put_actor<'a>(
    out: &mut Vec<u8>,
    frame: &Frame,
    actor: &ActorState,
    has_limit_signs: bool,
    signal_of: &impl Fn(ActorId) -> Signal<'a>,
) {
    out.extend_from_slice(&actor.id.get().to_le_bytes());
    out.push(ACTIVE);
    put_transform(out, &Transform::of(&actor.world_from_actor));
    put_vector(out, Vector3D::of(actor.linear_velocity_mps));
    put_vector(out, spin_deg(actor.angular_velocity_radps));
    put_vector(out, Vector3D::of(actor.linear_acceleration_mps2));
    let end = out.len() + STATE_BYTES;
    match actor.kind {
        ActorKind::Vehicle => put_vehicle(out, frame, actor, has_limit_signs),
        ActorKind::Walker => {
            put_vector(out, Vector3D::of(actor.walker.direction));
            out.extend_from_slice(&actor.walker.speed_mps.to_le_bytes());
            out.push(u8::from(actor.walker.jump));
        }
        ActorKind::TrafficLight => {
            let signal = signal_of(actor.id);
            put_signal(out, signal.id);
            if let Some(light) = light_of(frame, actor) {
                put_light(out, light, signal.replayed, pole_index(frame, light));
            }
        }
        ActorKind::TrafficSign => put_signal(out, signal_of(actor.id).id),
        ActorKind::Prop | ActorKind::Sensor | ActorKind::Marker => {}
    }
    out.resize(end, 0);
}

fn light_of<'a>(frame: &'a Frame, actor: &ActorState) -> Option<&'a TrafficLightState> {
    let at = frame.traffic_lights.binary_search_by_key(&actor.id, |light| light.actor).ok()?;
    frame.traffic_lights.get(at)
}

/// Which of the lights of its group it is.
fn pole_index(frame: &Frame, light: &TrafficLightState) -> u32 {
    let before = frame.traffic_lights.iter().take_while(|other| other.actor != light.actor);
    before.map(|other| u32::from(other.group == light.group)).sum()
}

fn put_vehicle(out: &mut Vec<u8>, frame: &Frame, actor: &ActorState, has_limit_signs: bool) {
    let control = &actor.control;
    for number in [control.throttle, -control.steer, control.brake] {
        out.extend_from_slice(&number.to_le_bytes());
    }
    out.extend([control.hand_brake, control.reverse, control.manual_gear].map(u8::from));
    out.extend_from_slice(&i32::from(actor.gear).to_le_bytes());
    out.extend_from_slice(&limit_kmh(actor, has_limit_signs).to_le_bytes());
    let holder = actor.traffic_light.and_then(|id| frame.actor(id));
    let light = holder.and_then(|holder| light_of(frame, holder));
    // As CARLA does: red at a stop sign, without a light.
    let colour = match (light, holder) {
        (Some(light), _) => light.colour,
        (None, Some(_)) => TrafficLightColour::Red,
        (None, None) => TrafficLightColour::Green,
    };
    out.push(colour_index(colour));
    out.push(u8::from(light.is_some()));
    out.extend_from_slice(&light.map_or(0, |light| light.actor.get()).to_le_bytes());
    out.push(match actor.failure {
        VehicleFailure::None => 0,
        VehicleFailure::Rollover => 1,
        VehicleFailure::Engine => 2,
        VehicleFailure::TyrePuncture => 3,
    });
}

fn limit_kmh(vehicle: &ActorState, has_limit_signs: bool) -> f32 {
    // Programs cut off what is behind the point, and 30 km/h are not quite 8.33 m/s.
    let posted_kmh = (carla::kmh(vehicle.speed_limit_mps) * 100.0).round() / 100.0;
    if has_limit_signs && posted_kmh > 0.0 { posted_kmh } else { SPEED_LIMIT_UNPOSTED_KMH }
}

fn put_signal(out: &mut Vec<u8>, signal: Option<&str>) {
    let mut id = [0; SIGN_ID_BYTES];
    let bytes = signal.unwrap_or_default().as_bytes();
    // The last byte stays zero: clients read a C string.
    let length = bytes.len().min(SIGN_ID_BYTES - 1);
    id[..length].copy_from_slice(&bytes[..length]);
    out.extend_from_slice(&id);
}

fn put_light(
    out: &mut Vec<u8>,
    light: &TrafficLightState,
    replayed: Option<ReplayedLight>,
    pole_index: u32,
) {
    let (elapsed_secs, is_frozen) = replayed
        .map_or((light.elapsed_secs, light.frozen), |light| (light.elapsed_secs, light.is_frozen));
    for secs in [light.green_secs, light.yellow_secs, light.red_secs, elapsed_secs] {
        out.extend_from_slice(&secs.to_le_bytes());
    }
    out.extend_from_slice(&pole_index.to_le_bytes());
    out.push(u8::from(is_frozen));
    out.push(colour_index(light.colour));
}

/// CARLA's number of a colour.
pub(crate) fn colour_index(colour: TrafficLightColour) -> u8 {
    match colour {
        TrafficLightColour::Red => 0,
        TrafficLightColour::Yellow => 1,
        TrafficLightColour::Green => 2,
        TrafficLightColour::Off => 3,
        TrafficLightColour::Unknown => 4,
    }
}

/// The inverse of [`colour_index`].
pub(crate) fn colour_of(index: u8) -> TrafficLightColour {
    match index {
        0 => TrafficLightColour::Red,
        1 => TrafficLightColour::Yellow,
        2 => TrafficLightColour::Green,
        3 => TrafficLightColour::Off,
        _ => TrafficLightColour::Unknown,
    }
}

fn put_transform(out: &mut Vec<u8>, transform: &Transform) {
    put_vector(out, transform.location);
    let rotation = transform.rotation;
    for degrees in [rotation.pitch, rotation.yaw, rotation.roll] {
        out.extend_from_slice(&degrees.to_le_bytes());
    }
}

fn put_vector(out: &mut Vec<u8>, vector: Vector3D) {
    for number in [vector.x, vector.y, vector.z] {
        out.extend_from_slice(&number.to_le_bytes());
    }
}

#[cfg(test)]
mod tests {
    use schemas::{MapRef, Tick, Vec3, WorldId, level_pose};

    use super::*;

    fn frame(actors: Vec<ActorState>) -> Frame {
        let map = MapRef { name: "Town".to_owned(), digest: "0".repeat(64) };
        Frame {
            tick: Tick(3),
            sim_secs: 0.15,
            types: vec!["vehicle.lincoln.mkz".to_owned()],
            actors,
            ..Frame::empty(WorldId::new(1).unwrap(), map)
        }
    }

    fn number(bytes: &[u8], at: usize) -> f32 {
        f32::from_le_bytes(bytes[at..at + 4].try_into().unwrap())
    }

    #[test]
    fn records_lie_where_clients_read_them() {
        let pose = level_pose(Vec3::new(1.0, 2.0, 3.0), 0.5);
        let mut car = ActorState::at_rest(ActorId::new(24).unwrap(), ActorKind::Vehicle, 0, pose);
        car.control.steer = 0.25;
        car.speed_limit_mps = carla::mps(30.0);
        car.gear = -1;
        let moment = Moment {
            frame_number: 77,
            episode_id: 5,
            delta_secs: 0.05,
            platform_secs: 9.0,
            flags: MAP_CHANGED,
            has_limit_signs: true,
        };
        let bytes = encode(&frame(vec![car]), &moment, |_| Signal::default());
        assert_eq!(bytes.len(), 48 + 36 + RECORD_BYTES);
        assert_eq!(bytes[..16], [17, 0, 0, 0, 0, 0, 0, 0, 77, 0, 0, 0, 0, 0, 0, 0]);
        assert_eq!(bytes[48], 5);
        assert_eq!(number(&bytes, 48 + 16), 0.05);
        assert_eq!(bytes[48 + 32], 1);
        let record = &bytes[84..];
        assert_eq!(record[..5], [24, 0, 0, 0, 1]);
        assert_eq!([5, 9, 13].map(|at| number(record, at)), [1.0, -2.0, 3.0]);
        assert!((number(record, 21) + 0.5f32.to_degrees()).abs() < 1e-4);
        let state = &record[65..];
        assert_eq!(number(state, 4), -0.25);
        assert_eq!(state[15..19], (-1i32).to_le_bytes());
        assert_eq!(number(state, 19), 30.0);
        assert_eq!(state[23..25], [2, 0]);
    }

    #[test]
    fn a_vehicle_at_a_stop_sign_sees_red_without_a_light() {
        let id = |number| ActorId::new(number).unwrap();
        let pose = level_pose(Vec3::zeros(), 0.0);
        let sign = ActorState::at_rest(id(1), ActorKind::TrafficSign, 0, pose);
        let mut car = ActorState::at_rest(id(24), ActorKind::Vehicle, 0, pose);
        car.traffic_light = Some(sign.id);
        let moment = Moment {
            frame_number: 1,
            episode_id: 1,
            delta_secs: 0.05,
            platform_secs: 0.0,
            flags: 0,
            has_limit_signs: true,
        };
        let bytes = encode(&frame(vec![sign, car]), &moment, |_| Signal::default());
        let state = &bytes[84 + RECORD_BYTES + 65..];
        assert_eq!(state[23..29], [0, 0, 0, 0, 0, 0]);
    }

    #[test]
    fn a_limit_is_what_signs_tell_or_30() {
        let pose = level_pose(Vec3::zeros(), 0.0);
        let mut car = ActorState::at_rest(ActorId::new(24).unwrap(), ActorKind::Vehicle, 0, pose);
        assert_eq!([true, false].map(|signs| limit_kmh(&car, signs)), [30.0, 30.0]);
        car.speed_limit_mps = carla::mps(90.0);
        assert_eq!([true, false].map(|signs| limit_kmh(&car, signs)), [90.0, 30.0]);
    }
}

//! Messages by radio, as the client's records hold them: numbers in the units of ETSI TS 102 894-2.

use schemas::{AwarenessMessage, CustomMessage, Received, StationKind, StationMotion};

/// Power, padding, and the message.
const AWARENESS_BYTES: usize = 464;
/// Power, padding, header, and a text of at most 100 bytes with padding.
const CUSTOM_BYTES: usize = 136;
const PROTOCOL_VERSION: i64 = 2;
/// Kinds of messages.
const CUSTOM: i64 = 0;
const AWARENESS: i64 = 2;

/// Numbers that say that there is none.
mod unavailable {
    pub(super) const SEMI_AXIS: i64 = 4_095;
    pub(super) const HEADING: i64 = 3_601;
    pub(super) const ALTITUDE_CONFIDENCE: i64 = 15;
    pub(super) const SPEED: i64 = 16_383;
    pub(super) const LENGTH_CONFIDENCE: i64 = 4;
    pub(super) const ACCELERATION: i64 = 161;
    pub(super) const ACCELERATION_CONFIDENCE: i64 = 102;
    pub(super) const CURVATURE: i64 = 30_001;
    pub(super) const CURVATURE_CONFIDENCE: i64 = 7;
    pub(super) const YAW_RATE: i64 = 32_767;
    pub(super) const YAW_RATE_CONFIDENCE: i64 = 8;
}

/// One record; fields by their places in it. The client copies two lists in it as they are: their
/// bytes stay zero, which is an empty list.
struct Record<const BYTES: usize>([u8; BYTES]);

impl<const BYTES: usize> Record<BYTES> {
    fn new(power_dbm: f32, message: i64, station: u32) -> Self {
        let mut record = Self([0; BYTES]);
        record.0[..4].copy_from_slice(&power_dbm.to_le_bytes());
        record.put(8, PROTOCOL_VERSION);
        record.put(16, message);
        record.put(24, station.into());
        record
    }

    fn put(&mut self, at: usize, number: i64) {
        self.0[at..at + 8].copy_from_slice(&number.to_le_bytes());
    }
}

/// Texts one after the other.
pub(super) fn custom(mut out: Vec<u8>, received: &[Received<CustomMessage>]) -> Vec<u8> {
    for Received { power_dbm, message } in received {
        let mut record = Record::<CUSTOM_BYTES>::new(*power_dbm, CUSTOM, message.station.get());
        for (place, byte) in record.0[32..132].iter_mut().zip(message.text.bytes()) {
            *place = byte;
        }
        out.extend_from_slice(&record.0);
    }
    out
}

/// Cooperative awareness messages one after the other.
pub(super) fn awareness(mut out: Vec<u8>, received: &[Received<AwarenessMessage>]) -> Vec<u8> {
    for Received { power_dbm, message } in received {
        let station = message.station.get();
        let mut record = Record::<AWARENESS_BYTES>::new(*power_dbm, AWARENESS, station);
        basics(&mut record, message);
        if let Some(motion) = &message.motion {
            vehicle(&mut record, motion);
        } else if message.kind == StationKind::RoadSideUnit {
            record.put(104, 2);
        }
        if let Some(lights) = message.lights {
            record.put(408, 1);
            record.put(416, role(message.kind));
            record.0[424] = exterior_lights(lights);
        }
        out.extend_from_slice(&record.0);
    }
    out
}

fn basics(record: &mut Record<AWARENESS_BYTES>, message: &AwarenessMessage) {
    // Counted from the start of the world, so that runs repeat; CARLA counts from 2004.
    let millis = (message.sim_secs * 1_000.0).round() as i64;
    record.put(32, millis % 65_536);
    record.put(40, message.kind as i64);
    record.put(48, rounded(message.latitude_deg * 1.0e7));
    record.put(56, rounded(message.longitude_deg * 1.0e7));
    record.put(64, unavailable::SEMI_AXIS);
    record.put(72, unavailable::SEMI_AXIS);
    record.put(80, unavailable::HEADING);
    record.put(88, rounded(message.altitude_m * 100.0));
    record.put(96, unavailable::ALTITUDE_CONFIDENCE);
}

/// The container of vehicles that is in every message.
fn vehicle(record: &mut Record<AWARENESS_BYTES>, motion: &StationMotion) {
    record.put(104, 1);
    record.put(112, rounded(f64::from(motion.heading_deg) * 10.0).rem_euclid(3_600));
    // Within one degree.
    record.put(120, 10);
    record.put(128, speed(motion.speed_mps));
    // Within three centimetres per second, as CARLA says.
    record.put(136, 3);
    record.put(144, i64::from(!motion.forward));
    record.put(152, rounded(f64::from(motion.length_m) * 10.0).min(1_022));
    record.put(160, unavailable::LENGTH_CONFIDENCE);
    record.put(168, rounded(f64::from(motion.width_m) * 10.0).min(61));
    record.put(176, acceleration(motion.acceleration_mps2.x));
    record.put(184, unavailable::ACCELERATION_CONFIDENCE);
    record.put(192, unavailable::CURVATURE);
    record.put(200, unavailable::CURVATURE_CONFIDENCE);
    record.put(216, yaw_rate(motion.yaw_rate_radps));
    record.put(224, unavailable::YAW_RATE_CONFIDENCE);
    // Two optional numbers, each after a byte that says that it is there.
    for (at, mps2) in [(272, motion.acceleration_mps2.y), (296, motion.acceleration_mps2.z)] {
        record.0[at] = 1;
        record.put(at + 8, acceleration(mps2));
        record.put(at + 16, unavailable::ACCELERATION_CONFIDENCE);
    }
}

fn rounded(value: f64) -> i64 {
    value.round() as i64
}

/// Centimetres per second.
fn speed(mps: f32) -> i64 {
    if mps >= 0.0 { rounded(f64::from(mps) * 100.0).min(16_382) } else { unavailable::SPEED }
}

/// Tenths of a metre per second squared.
fn acceleration(mps2: f32) -> i64 {
    let tenths = rounded(f64::from(mps2) * 10.0);
    if (-160..=160).contains(&tenths) { tenths } else { unavailable::ACCELERATION }
}

/// Hundredths of a degree per second.
fn yaw_rate(radps: f32) -> i64 {
    let hundredths = rounded(f64::from(radps).to_degrees() * 100.0);
    if (-32_766..=32_766).contains(&hundredths) { hundredths } else { unavailable::YAW_RATE }
}

/// DE_VehicleRole.
fn role(kind: StationKind) -> i64 {
    match kind {
        StationKind::Bus | StationKind::Tram => 1,
        StationKind::SpecialVehicle => 6,
        _ => 0,
    }
}

/// DE_ExteriorLights, its first bit the highest, from CARLA's flags.
fn exterior_lights(flags: u32) -> u8 {
    const BITS: [(u32, u8); 7] = [
        (0x02, 0x80),
        (0x04, 0x40),
        (0x20, 0x20),
        (0x10, 0x10),
        (0x40, 0x04),
        (0x80, 0x02),
        (0x01, 0x01),
    ];
    BITS.iter().filter(|(flag, _)| flags & flag != 0).map(|(_, bit)| bit).sum()
}

#[cfg(test)]
mod tests {
    use schemas::{ActorId, Vec3};

    use super::*;

    fn message() -> AwarenessMessage {
        AwarenessMessage {
            station: ActorId::new(7).unwrap(),
            kind: StationKind::SpecialVehicle,
            sim_secs: 70.0,
            latitude_deg: -0.000_123_4,
            longitude_deg: 8.5,
            altitude_m: 1.234,
            motion: Some(StationMotion {
                heading_deg: 359.99,
                speed_mps: 13.89,
                forward: false,
                length_m: 4.9,
                width_m: 7.0,
                acceleration_mps2: Vec3::new(-1.5, 0.26, 9.81),
                yaw_rate_radps: -0.1,
            }),
            lights: Some(0x01 | 0x20),
        }
    }

    fn record(message: AwarenessMessage) -> impl Fn(usize) -> i64 {
        let bytes = awareness(Vec::new(), &[Received { power_dbm: -60.5, message }]);
        assert_eq!(bytes.len(), AWARENESS_BYTES);
        assert_eq!(bytes[..4], (-60.5f32).to_le_bytes());
        move |at| i64::from_le_bytes(bytes[at..at + 8].try_into().unwrap())
    }

    #[test]
    fn an_awareness_message_is_in_etsi_units() {
        let at = record(message());
        assert_eq!([at(8), at(16), at(24), at(32), at(40)], [2, 2, 7, 70_000 % 65_536, 10]);
        assert_eq!([at(48), at(56), at(88)], [-1_234, 85_000_000, 123]);
        // The heading is a circle; a width has a largest number.
        assert_eq!([at(104), at(112), at(128), at(144)], [1, 0, 1_389, 1]);
        assert_eq!([at(152), at(168), at(176), at(216)], [49, 61, -15, -573]);
        assert_eq!([at(272) & 0xff, at(280), at(296) & 0xff, at(304)], [1, 3, 1, 98]);
        assert_eq!([at(408), at(416), at(424) & 0xff], [1, 6, 0x21]);
    }

    /// Numbers of ETSI TS 102 894-2.
    #[test]
    fn what_nobody_knows_is_said_to_be_unavailable() {
        let at = record(message());
        assert_eq!([at(64), at(72), at(80), at(96)], [4_095, 4_095, 3_601, 15], "of the place");
        assert_eq!([at(160), at(184), at(192), at(200), at(224)], [4, 102, 30_001, 7, 8]);
        assert_eq!([at(288), at(312)], [102, 102], "of accelerations to the left and up");
    }

    #[test]
    fn what_a_number_cannot_hold_is_said_to_be_unavailable_or_its_end() {
        let numbers = |speed_mps: f32, mps2: f32, yaw_rate_radps: f32| {
            let acceleration_mps2 = Vec3::new(mps2, -mps2, mps2);
            let known = message().motion.unwrap();
            let motion = StationMotion { speed_mps, acceleration_mps2, yaw_rate_radps, ..known };
            let at = record(AwarenessMessage { motion: Some(motion), ..message() });
            [at(128), at(176), at(280), at(304), at(216)]
        };
        assert_eq!(numbers(163.82, 16.0, 5.718), [16_382, 160, -160, 160, 32_762], "the last");
        assert_eq!(numbers(200.0, 16.1, 5.72), [16_382, 161, 161, 161, 32_767]);
        let unknown = f32::NAN;
        assert_eq!(numbers(unknown, -16.1, -5.72), [16_383, 161, 161, 161, 32_767]);
    }

    #[test]
    fn a_road_side_unit_tells_no_motion() {
        let kind = StationKind::RoadSideUnit;
        let at = record(AwarenessMessage { kind, motion: None, lights: None, ..message() });
        assert_eq!([at(40), at(104), at(112), at(408)], [15, 2, 0, 0]);
    }

    #[test]
    fn a_text_fills_at_most_its_hundred_bytes() {
        let text: String = ('a'..='z').cycle().take(120).collect();
        let message = CustomMessage { station: ActorId::new(7).unwrap(), text: text.clone() };
        let bytes = custom(Vec::new(), &[Received { power_dbm: 0.0, message }]);
        assert_eq!(bytes.len(), CUSTOM_BYTES);
        assert_eq!(bytes[24..32], 7_u64.to_le_bytes());
        assert_eq!(bytes[32..132], text.as_bytes()[..100]);
        assert_eq!(bytes[132..], [0; 4]);
    }
}

//! Writing a log frame by frame.

use std::io::{self, Write};

use crate::header::Header;
use crate::packet::Packet;
use crate::physics::PhysicsControl;
use crate::record::{
    Add, Biker, Bones, Box3, Collision, Destroy, Door, FrameStart, Kinematics, LightState,
    LightTimes, Parent, Position, SceneLight, VehicleControl, VehicleLights, WalkerSpeed, Weather,
    Wheels,
};

/// The duration that the last frame of a log has.
pub const UNKNOWN_DURATION: f64 = -1.0;
/// Where the duration stands in a frame: after the head of its first packet and the number.
const DURATION_AT: usize = 5 + 8;

/// What one frame has.
#[derive(Clone, Debug, Default, PartialEq)]
#[allow(missing_docs, reason = "each field is one packet, and documented there")]
pub struct FrameContent {
    /// Since the recording began.
    pub elapsed_secs: f64,
    pub visual_secs: f64,
    pub adds: Vec<Add>,
    pub destroys: Vec<Destroy>,
    pub parents: Vec<Parent>,
    pub collisions: Vec<Collision>,
    pub doors: Vec<Door>,
    pub positions: Vec<Position>,
    pub light_states: Vec<LightState>,
    pub vehicle_controls: Vec<VehicleControl>,
    pub walker_speeds: Vec<WalkerSpeed>,
    pub vehicle_lights: Vec<VehicleLights>,
    pub scene_lights: Vec<SceneLight>,
    pub wheels: Vec<Wheels>,
    pub bikers: Vec<Biker>,
    pub weather: Option<Weather>,
    /// Packets that are not of CARLA; they come last.
    pub foreign: Vec<Packet>,
    /// What only recordings with additional data have.
    pub additional: Option<Additional>,
}

/// What only recordings with additional data have of a frame.
#[derive(Clone, Debug, Default, PartialEq)]
#[allow(missing_docs, reason = "each field is one packet, and documented there")]
pub struct Additional {
    pub kinematics: Vec<Kinematics>,
    pub bounding_boxes: Vec<Box3>,
    pub trigger_volumes: Vec<Box3>,
    pub platform_secs: f64,
    pub physics: Vec<PhysicsControl>,
    pub light_times: Vec<LightTimes>,
    pub bones: Vec<Bones>,
}

impl FrameContent {
    /// Its packets in CARLA's order. Some are there in every frame, others only with content.
    fn into_packets(self, number: u64) -> Vec<Packet> {
        let start =
            FrameStart { number, duration_secs: UNKNOWN_DURATION, elapsed_secs: self.elapsed_secs };
        let mut packets = vec![
            Packet::FrameStart(start),
            Packet::VisualTime(self.visual_secs),
            Packet::Adds(self.adds),
            Packet::Destroys(self.destroys),
            Packet::Parents(self.parents),
            Packet::Collisions(self.collisions),
            Packet::Doors(self.doors),
            Packet::Positions(self.positions),
            Packet::LightStates(self.light_states),
            Packet::VehicleControls(self.vehicle_controls),
            Packet::WalkerSpeeds(self.walker_speeds),
            Packet::VehicleLights(self.vehicle_lights),
        ];
        packets.extend(filled(self.scene_lights).map(Packet::SceneLights));
        packets.extend([Packet::Wheels(self.wheels), Packet::Bikers(self.bikers)]);
        packets.extend(self.weather.map(Packet::Weather));
        if let Some(additional) = self.additional {
            packets.extend(additional.into_packets());
        }
        packets.extend(self.foreign);
        packets.push(Packet::FrameEnd(()));
        packets
    }
}

impl Additional {
    fn into_packets(self) -> impl Iterator<Item = Packet> {
        let kinematics = filled(self.kinematics).map(Packet::Kinematics);
        let boxes = Packet::BoundingBoxes(self.bounding_boxes);
        let triggers = filled(self.trigger_volumes).map(Packet::TriggerVolumes);
        let platform = Packet::PlatformTime(self.platform_secs);
        let physics = filled(self.physics).map(Packet::Physics);
        let light_times = filled(self.light_times).map(Packet::LightTimes);
        let bones = Packet::Bones(self.bones);
        let first = kinematics.into_iter().chain([boxes]).chain(triggers).chain([platform]);
        first.chain(physics).chain(light_times).chain([bones])
    }
}

fn filled<T>(records: Vec<T>) -> Option<Vec<T>> {
    (!records.is_empty()).then_some(records)
}

/// Writes a log.
///
/// One frame is held back: only the next one tells its duration. So the file grows at its end, one
/// write for each frame, and whoever dies leaves all frames but that one.
pub struct Writer<W> {
    sink: W,
    held: Vec<u8>,
    held_elapsed_secs: f64,
    frames: u64,
}

impl<W: Write> Writer<W> {
    /// Writes the head of a log.
    ///
    /// # Errors
    /// Those of the sink.
    pub fn begin(mut sink: W, header: &Header) -> io::Result<Self> {
        let mut head = Vec::new();
        header.put(&mut head);
        sink.write_all(&head)?;
        Ok(Self::after_head(sink))
    }

    /// Writes frames only: to a sink that has the head already.
    pub fn after_head(sink: W) -> Self {
        Self { sink, held: Vec::new(), held_elapsed_secs: 0.0, frames: 0 }
    }

    /// How many frames it was given.
    pub fn frames(&self) -> u64 {
        self.frames
    }

    /// What it writes to.
    pub fn sink(&self) -> &W {
        &self.sink
    }

    /// Writes the frame before this one, and holds this one.
    ///
    /// # Errors
    /// Those of the sink; the frame before this one is then not whole.
    pub fn frame(&mut self, content: FrameContent) -> io::Result<()> {
        let elapsed_secs = content.elapsed_secs;
        if !self.held.is_empty() {
            let duration = (elapsed_secs - self.held_elapsed_secs).to_le_bytes();
            self.held[DURATION_AT..][..duration.len()].copy_from_slice(&duration);
            self.sink.write_all(&self.held)?;
            self.held.clear();
        }
        self.frames += 1;
        self.held_elapsed_secs = elapsed_secs;
        for packet in content.into_packets(self.frames) {
            packet.put(&mut self.held);
        }
        Ok(())
    }

    /// Writes the last frame, whose duration nobody knows.
    ///
    /// # Errors
    /// Those of the sink.
    pub fn finish(mut self) -> io::Result<W> {
        self.sink.write_all(&self.held)?;
        self.sink.flush()?;
        Ok(self.sink)
    }
}

//! A replay as a state machine: time goes in, what is to be done comes out.
//!
//! It speaks in ids of the log; who plays finds actors for them.

use std::collections::BTreeSet;
use std::io::{self, Read, Seek};
use std::sync::Arc;

use crate::bytes::Malformed;
use crate::index::{Cast, Event, Index, Span};
use crate::packet::Packet;
use crate::reader::Reader;
use crate::record::{FrameStart, Kinematics, Position, Rotation, Vector};

/// From this factor on frames are shown as they are, without interpolation.
pub const FACTOR_WITHOUT_INTERPOLATION: f64 = 2.0;
/// Times that differ by less are the same.
const EPSILON_SECS: f64 = 1e-6;

/// What is to be done at one time of a replay.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Step {
    /// First of all.
    pub events: Vec<Event>,
    /// What else the frames say that were reached: nothing if none was.
    pub said: Vec<Packet>,
    /// Where all are, by id.
    pub poses: Vec<Position>,
    /// How they move, by id: as the log says, else from pose to pose.
    pub velocities: Vec<Kinematics>,
    /// Whether the replay is over.
    pub has_ended: bool,
}

impl Step {
    /// How an actor moves, if that is known.
    pub fn velocity(&self, id: u32) -> Option<&Kinematics> {
        let at = self.velocities.binary_search_by_key(&id, |velocity| velocity.id).ok()?;
        self.velocities.get(at)
    }
}

/// One replay.
pub struct Player<R> {
    reader: Reader<R>,
    span: Span,
    time_secs: f64,
    current: Still,
    next: Option<Still>,
    living: BTreeSet<u32>,
}

/// One frame of the log, read.
struct Still {
    start: FrameStart,
    events: Vec<Event>,
    said: Vec<Packet>,
    /// By id.
    poses: Vec<Position>,
    kinematics: Option<Vec<Kinematics>>,
}

impl<R: Read + Seek> Player<R> {
    /// Begins a replay, and says what holds there: who lives, where, and all that was said before
    /// and lasts. `None` for a log without frames.
    ///
    /// # Errors
    /// Those of the source.
    pub fn begin(
        mut reader: Reader<R>,
        index: &Index,
        span: Span,
    ) -> io::Result<Option<(Self, Step)>> {
        let Some(frame) = index.frame_at(span.from_secs + EPSILON_SECS) else { return Ok(None) };
        let Some((at, offset, mut cast)) = index.keyframe(frame) else { return Ok(None) };
        reader.go_to(offset)?;
        for _ in at..frame {
            let Some(frame) = reader.next_frame()? else { return Ok(None) };
            for packet in frame.packets().filter(|packet| Cast::heeds(packet.kind)) {
                packet.decode().ok().iter().for_each(|packet| cast.note(packet));
            }
        }
        let Some(mut current) = Still::read(&mut reader)? else { return Ok(None) };
        current.events.iter().for_each(|event| cast.happen(event));
        current.said.iter().for_each(|packet| cast.note(packet));
        current.said.retain(|packet| !Cast::heeds(packet.kind()));
        let next = Still::read(&mut reader)?;
        let (time_secs, living) = (span.from_secs, cast.actors.keys().copied().collect());
        let player = Self { reader, span, time_secs, current, next, living };
        let adds = cast.actors.values().map(|add| Event::Add(Arc::clone(add)));
        let events = adds.chain(cast.attachments().map(Event::Parent)).collect();
        let mut said = cast.said();
        said.extend_from_slice(&player.current.said);
        let step = Step { events, said, ..player.step(true) };
        Ok(Some((player, step)))
    }

    /// Which part is replayed.
    pub fn span(&self) -> Span {
        self.span
    }

    /// Where the replay is.
    pub fn time_secs(&self) -> f64 {
        self.time_secs
    }

    /// Goes on by a tick. A factor of 0 stands still, and so does a negative one.
    ///
    /// # Errors
    /// Those of the source.
    pub fn advance(&mut self, tick_secs: f64, factor: f64) -> io::Result<Step> {
        // The larger of a number and of what is none is the number.
        self.time_secs += (tick_secs * factor).max(0.0);
        let until_secs = self.time_secs.min(self.span.to_secs) + EPSILON_SECS;
        let (mut events, mut said) = (Vec::new(), Vec::new());
        while let Some(next) = self.next.take_if(|next| next.start.elapsed_secs <= until_secs) {
            // Of a frame that is passed over only what lasts.
            said.retain(|packet: &Packet| Cast::heeds(packet.kind()));
            next.events.iter().for_each(|event| self.note(event));
            events.extend_from_slice(&next.events);
            said.extend_from_slice(&next.said);
            self.current = next;
            self.next = Still::read(&mut self.reader)?;
        }
        let step = self.step(factor < FACTOR_WITHOUT_INTERPOLATION);
        Ok(Step { events, said, ..step })
    }

    /// What is still to happen to actors until the end of the log; who comes and goes again in
    /// between is left out.
    pub fn remaining(&self, index: &Index) -> Vec<Event> {
        index.events_to_end(&self.living)
    }

    fn note(&mut self, event: &Event) {
        match event {
            Event::Add(add) => drop(self.living.insert(add.id)),
            Event::Destroy(id) => drop(self.living.remove(id)),
            Event::Parent(_) => {}
        }
    }

    /// Poses and velocities of the present time.
    fn step(&self, interpolates: bool) -> Step {
        let (current, next) = (&self.current, self.next.as_ref());
        let velocities = match (&current.kinematics, next) {
            (Some(kinematics), _) => kinematics.clone(),
            (None, Some(next)) => differences(current, next),
            (None, None) => Vec::new(),
        };
        let since_secs = self.time_secs.min(self.span.to_secs) - current.start.elapsed_secs;
        let poses = match next {
            Some(next) if interpolates && since_secs > EPSILON_SECS => {
                let lasts_secs = next.start.elapsed_secs - current.start.elapsed_secs;
                between(current, next, (since_secs / lasts_secs).min(1.0) as f32)
            }
            _ => current.poses.clone(),
        };
        let has_ended = self.time_secs + EPSILON_SECS >= self.span.to_secs;
        Step { poses, velocities, has_ended, ..Step::default() }
    }
}

impl Cast {
    fn happen(&mut self, event: &Event) {
        match event {
            Event::Add(add) => self.enter(Arc::clone(add)),
            Event::Destroy(id) => self.note(&Packet::Destroys(vec![crate::Destroy { id: *id }])),
            Event::Parent(parent) => self.note(&Packet::Parents(vec![parent.clone()])),
        }
    }
}

impl Still {
    /// The next frame of a log; a damaged one ends it.
    fn read(reader: &mut Reader<impl Read>) -> io::Result<Option<Self>> {
        let Some(frame) = reader.next_frame()? else { return Ok(None) };
        let (start, offset) = (frame.start.clone(), frame.offset);
        let packets: Result<Vec<Packet>, Malformed> =
            frame.packets().map(|packet| packet.decode()).collect();
        match packets {
            Ok(packets) => Ok(Some(Self::of(start, packets))),
            Err(malformed) => {
                reader.end_at(offset, &malformed);
                Ok(None)
            }
        }
    }

    fn of(start: FrameStart, packets: Vec<Packet>) -> Self {
        let (events, said, poses, kinematics) = (Vec::new(), Vec::new(), Vec::new(), None);
        let mut still = Self { start, events, said, poses, kinematics };
        for packet in packets {
            match packet {
                Packet::Adds(adds) => {
                    still.events.extend(adds.into_iter().map(|add| Event::Add(Arc::new(add))));
                }
                Packet::Destroys(gone) => {
                    still.events.extend(gone.into_iter().map(|one| Event::Destroy(one.id)));
                }
                Packet::Parents(parents) => {
                    still.events.extend(parents.into_iter().map(Event::Parent));
                }
                Packet::Positions(poses) => still.poses.extend(poses),
                Packet::Kinematics(all) => still.kinematics.get_or_insert_default().extend(all),
                Packet::FrameStart(_) | Packet::FrameEnd(()) => {}
                packet => still.said.push(packet),
            }
        }
        still.poses.sort_by_key(|pose| pose.id);
        if let Some(kinematics) = &mut still.kinematics {
            kinematics.sort_by_key(|one| one.id);
        }
        still
    }

    fn pose(&self, id: u32) -> Option<&Position> {
        let at = self.poses.binary_search_by_key(&id, |pose| pose.id).ok()?;
        self.poses.get(at)
    }
}

/// Poses at a share of the way from one frame to the next; who is in one only stays there.
fn between(current: &Still, next: &Still, share: f32) -> Vec<Position> {
    let blend = |from: f32, to: f32| from + (to - from) * share;
    let turn = |from: f32, to: f32| from + shorter_way(from, to) * share;
    let one = |from: &Position| {
        let Some(to) = next.pose(from.id) else { return from.clone() };
        let (a, b) = (from.location, to.location);
        let location = Vector { x: blend(a.x, b.x), y: blend(a.y, b.y), z: blend(a.z, b.z) };
        let (a, b) = (from.rotation, to.rotation);
        let rotation = Rotation {
            roll: turn(a.roll, b.roll),
            pitch: turn(a.pitch, b.pitch),
            yaw: turn(a.yaw, b.yaw),
        };
        Position { id: from.id, location, rotation }
    };
    current.poses.iter().map(one).collect()
}

/// From one angle to another, −180° to 180°.
fn shorter_way(from: f32, to: f32) -> f32 {
    (to - from + 180.0).rem_euclid(360.0) - 180.0
}

/// Velocities from one frame to the next.
fn differences(current: &Still, next: &Still) -> Vec<Kinematics> {
    let lasts_secs = (next.start.elapsed_secs - current.start.elapsed_secs) as f32;
    if lasts_secs < EPSILON_SECS as f32 {
        return Vec::new();
    }
    let one = |from: &Position| {
        let to = next.pose(from.id)?;
        let metres = |from: f32, to: f32| (to - from) / 100.0 / lasts_secs;
        let (a, b) = (from.location, to.location);
        let linear_velocity =
            Vector { x: metres(a.x, b.x), y: metres(a.y, b.y), z: metres(a.z, b.z) };
        let yaw = shorter_way(from.rotation.yaw, to.rotation.yaw) / lasts_secs;
        let angular_velocity = Vector { z: yaw, ..Vector::default() };
        Some(Kinematics { id: from.id, linear_velocity, angular_velocity })
    };
    current.poses.iter().filter_map(one).collect()
}

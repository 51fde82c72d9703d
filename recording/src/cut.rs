//! A piece of a log.

use std::collections::BTreeMap;
use std::io::{self, Read, Write};

use crate::header::Header;
use crate::index::Cast;
use crate::journal::JournalLink;
use crate::packet::{Kind, Packet};
use crate::physics::PhysicsControl;
use crate::reader::{Frame, Reader};
use crate::record::{Add, Box3, FrameStart, LightTimes, Position};
use crate::writer::UNKNOWN_DURATION;

/// Times are sums of lengths that binary fractions do not have.
const EPSILON_SECS: f64 = 1e-6;

/// Writes the frames of a log from one time to another, both since its first frame, as a log of
/// version 2 of its own: its first frame tells all that was said before and lasts. Gives how many
/// frames it has; `progress` hears the time of each frame that is read.
///
/// Physics of UE5, which nobody else reads, is left out.
///
/// # Errors
/// Those of source and sink.
pub fn cut(
    reader: &mut Reader<impl Read>,
    (from_secs, to_secs): (f64, f64),
    sink: &mut impl Write,
    mut progress: impl FnMut(f64),
) -> io::Result<u64> {
    let header = Header { version: Header::VERSION, ..reader.header().clone() };
    let mut head = Vec::new();
    header.put(&mut head);
    sink.write_all(&head)?;
    let mut lasting = Lasting::default();
    let mut piece = Piece { sink, held: Vec::new(), held_start: FrameStart::default(), frames: 0 };
    let mut first_secs = 0.0;
    let mut damage = None;
    while let Some(frame) = reader.next_frame()? {
        let elapsed_secs = frame.start.elapsed_secs;
        progress(elapsed_secs);
        if elapsed_secs > to_secs + EPSILON_SECS {
            break;
        }
        let packets = match decoded(&frame) {
            Ok(packets) => packets,
            Err(malformed) => {
                damage = Some((frame.offset, malformed));
                break;
            }
        };
        let is_wanted = elapsed_secs >= from_secs - EPSILON_SECS;
        let is_first = is_wanted && piece.frames == 0;
        if !is_wanted || is_first {
            lasting.note(&frame, &packets);
        }
        if is_first {
            first_secs = elapsed_secs;
            piece.put(elapsed_secs - first_secs, lasting.first_frame(packets))?;
        } else if is_wanted {
            piece.put(elapsed_secs - first_secs, packets)?;
        }
    }
    if let Some((offset, malformed)) = damage {
        reader.end_at(offset, &malformed);
    }
    piece.finish()
}

/// What a frame says but for its begin and end.
fn decoded(frame: &Frame<'_>) -> Result<Vec<Packet>, crate::bytes::Malformed> {
    let content = frame
        .packets()
        .filter(|packet| !matches!(packet.kind, Kind::FrameStart | Kind::FrameEnd))
        .map(|packet| Ok((packet.kind, packet.decode()?)));
    let content: Vec<(Kind, Packet)> = content.collect::<Result<_, _>>()?;
    let is_read =
        |(kind, packet): &(Kind, Packet)| *kind == packet.kind() || *kind != Kind::Physics;
    Ok(content.into_iter().filter(is_read).map(|(_, packet)| packet).collect())
}

/// One frame is held back, as only the next one tells how long it lasts.
struct Piece<'a, W> {
    sink: &'a mut W,
    held: Vec<Packet>,
    held_start: FrameStart,
    frames: u64,
}

impl<W: Write> Piece<'_, W> {
    fn put(&mut self, elapsed_secs: f64, packets: Vec<Packet>) -> io::Result<()> {
        if self.frames > 0 {
            self.held_start.duration_secs = elapsed_secs - self.held_start.elapsed_secs;
            self.write_held()?;
        }
        self.frames += 1;
        let (number, duration_secs) = (self.frames, UNKNOWN_DURATION);
        self.held_start = FrameStart { number, duration_secs, elapsed_secs };
        self.held = packets;
        Ok(())
    }

    fn write_held(&mut self) -> io::Result<()> {
        let mut bytes = Vec::new();
        Packet::FrameStart(self.held_start.clone()).put(&mut bytes);
        self.held.iter().for_each(|packet| packet.put(&mut bytes));
        Packet::FrameEnd(()).put(&mut bytes);
        self.sink.write_all(&bytes)
    }

    fn finish(mut self) -> io::Result<u64> {
        if self.frames > 0 {
            self.write_held()?;
        }
        self.sink.flush()?;
        Ok(self.frames)
    }
}

/// What frames say once, and what holds until something else is said.
#[derive(Default)]
struct Lasting {
    cast: Cast,
    journal: Option<JournalLink>,
    boxes: BTreeMap<u32, Box3>,
    volumes: BTreeMap<u32, Box3>,
    physics: BTreeMap<u32, PhysicsControl>,
    light_times: BTreeMap<u32, LightTimes>,
}

impl Lasting {
    fn note(&mut self, frame: &Frame<'_>, packets: &[Packet]) {
        self.journal = JournalLink::of(frame).or(self.journal.take());
        for packet in packets {
            self.cast.note(packet);
            match packet {
                Packet::BoundingBoxes(all) => {
                    self.boxes.extend(all.iter().map(|one| (one.id, one.clone())));
                }
                Packet::TriggerVolumes(all) => {
                    self.volumes.extend(all.iter().map(|one| (one.id, one.clone())));
                }
                Packet::Physics(all) => {
                    self.physics.extend(all.iter().map(|one| (one.id, one.clone())));
                }
                Packet::LightTimes(all) => {
                    self.light_times.extend(all.iter().map(|one| (one.id, one.clone())));
                }
                _ => {}
            }
        }
    }

    /// The packets of a frame as the first one of a log: with all that lasts, in CARLA's order.
    fn first_frame(&mut self, packets: Vec<Packet>) -> Vec<Packet> {
        let is_additional = packets.iter().any(|packet| matches!(packet, Packet::PlatformTime(_)));
        let positions = packets.iter().find_map(|packet| match packet {
            Packet::Positions(positions) => Some(positions.clone()),
            _ => None,
        });
        let link = self.journal.as_ref().map(JournalLink::packet);
        let mut first = vec![
            Packet::Adds(self.adds(&positions.unwrap_or_default())),
            Packet::Destroys(Vec::new()),
            Packet::Parents(self.cast.attachments().collect()),
        ];
        first.extend(self.cast.said());
        if is_additional {
            let lives = |id: &u32| self.cast.actors.contains_key(id);
            self.boxes.retain(|id, _| lives(id));
            self.volumes.retain(|id, _| lives(id));
            self.physics.retain(|id, _| lives(id));
            first.push(Packet::BoundingBoxes(self.boxes.values().cloned().collect()));
            first.push(Packet::TriggerVolumes(self.volumes.values().cloned().collect()));
            first.push(Packet::Physics(self.physics.values().cloned().collect()));
            first.push(Packet::LightTimes(self.light_times.values().cloned().collect()));
        }
        let is_told = |packet: &Packet| {
            first.iter().any(|told| told.kind() == packet.kind())
                || link.as_ref().is_some_and(|link| link.kind() == packet.kind())
        };
        let mut rest: Vec<Packet> = packets.into_iter().filter(|packet| !is_told(packet)).collect();
        rest.extend(first);
        rest.extend(link);
        rest.sort_by_key(|packet| place(packet.kind()));
        rest
    }

    /// Who lives: each where the frame has it, in the world, as all have it who are there when a
    /// recording begins.
    fn adds(&self, positions: &[Position]) -> Vec<Add> {
        let places: BTreeMap<u32, &Position> = positions.iter().map(|one| (one.id, one)).collect();
        let add = |add: &std::sync::Arc<Add>| match places.get(&add.id) {
            Some(Position { location, rotation, .. }) => {
                Add { location: *location, rotation: *rotation, ..Add::clone(add) }
            }
            None => Add::clone(add),
        };
        self.cast.actors.values().map(add).collect()
    }
}

/// Where a packet stands in a frame of CARLA's.
fn place(kind: Kind) -> u8 {
    const ORDER: [u8; 23] =
        [0, 20, 2, 3, 4, 5, 23, 6, 7, 8, 9, 10, 11, 21, 22, 24, 12, 13, 17, 14, 15, 16, 19];
    let id = kind.id();
    let at = ORDER.iter().position(|one| *one == id);
    at.map_or(u8::MAX, |at| at as u8)
}

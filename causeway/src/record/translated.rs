//! What a journal says in CARLA's format, frame by frame, so that it can be asked as a log: who is
//! there, who met whom, and where all are. Unlike a recording it has the contacts of all actors.

use std::collections::{BTreeSet, VecDeque};
use std::fs::File;
use std::io::{self, BufReader, Read, Write};

use recording::{
    Add, Attribute, Class, Collision, Destroy, FrameContent, Header, Position, Rotation, Vector,
    Writer,
};
use schemas::carla::mirror_y;
use schemas::{ActorId, ActorKind, ActorState, Frame, Tick};
use world_service::journal::Reader as JournalReader;

/// Logs have lengths in centimetres.
const CM_PER_M: f32 = 100.0;

/// A log that is made while it is read; memory is bounded by one frame.
pub(super) struct Translated {
    journal: JournalReader<BufReader<File>>,
    /// Of the next frame.
    next: Tick,
    first_secs: Option<f64>,
    known: BTreeSet<ActorId>,
    /// Who has the role of the ego.
    heroes: BTreeSet<ActorId>,
    collisions: u32,
    /// `None` after the last frame.
    writer: Option<Writer<Made>>,
    made: Made,
}

/// Bytes that are made and not read yet, of one who writes and one who reads in turns.
#[derive(Clone, Default)]
struct Made(std::rc::Rc<std::cell::RefCell<VecDeque<u8>>>);

impl Write for Made {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.0.borrow_mut().extend(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl Translated {
    /// From the beginning of a journal that was written at this date, in seconds since 1970.
    ///
    /// # Errors
    /// None: what is made is kept in memory.
    pub(super) fn begin(
        journal: JournalReader<BufReader<File>>,
        date: i64,
        heroes: BTreeSet<ActorId>,
    ) -> io::Result<Self> {
        let map = journal.head().map_name.clone();
        let made = Made::default();
        let header = Header { version: Header::VERSION, date, map };
        let writer = Some(Writer::begin(made.clone(), &header)?);
        let (next, known) = (Tick(journal.index().first().0 + 1), BTreeSet::new());
        Ok(Self { journal, next, first_secs: None, known, heroes, collisions: 0, writer, made })
    }

    /// Makes the next frame, or the end.
    fn make(&mut self) -> io::Result<()> {
        let Some(mut writer) = self.writer.take() else { return Ok(()) };
        if self.next > self.journal.index().last() {
            return writer.finish().map(drop);
        }
        let frame = self.journal.frame(self.next).map_err(io::Error::other)?;
        let frame = schemas::wire::decode_frame(&frame.0).map_err(io::Error::other)?;
        writer.frame(self.content(&frame))?;
        self.next = Tick(self.next.0 + 1);
        self.writer = Some(writer);
        Ok(())
    }

    fn content(&mut self, frame: &Frame) -> FrameContent {
        let first_secs = *self.first_secs.get_or_insert(frame.sim_secs);
        let new = frame.actors.iter().filter(|actor| !self.known.contains(&actor.id));
        let adds = new.map(|actor| add(frame, actor, self.heroes.contains(&actor.id))).collect();
        let living: BTreeSet<ActorId> = frame.actors.iter().map(|actor| actor.id).collect();
        let gone = self.known.difference(&living).map(|id| Destroy { id: id.get() }).collect();
        self.known = living;
        FrameContent {
            elapsed_secs: frame.sim_secs - first_secs,
            visual_secs: frame.sim_secs,
            adds,
            destroys: gone,
            collisions: self.collisions(frame),
            positions: frame.actors.iter().filter_map(position).collect(),
            ..FrameContent::default()
        }
    }

    /// Each contact from the side of every actor in it.
    fn collisions(&mut self, frame: &Frame) -> Vec<Collision> {
        let mut told = Vec::new();
        for contact in &frame.collisions {
            let (one, other) = (Some(contact.actor), contact.other);
            for (id, met) in [(one, other), (other, one)] {
                let Some(id) = id else { continue };
                told.push(Collision {
                    serial: self.collisions,
                    id1: id.get(),
                    id2: met.map_or(Collision::NO_ACTOR, ActorId::get),
                    is_hero1: self.heroes.contains(&id),
                    is_hero2: met.is_some_and(|met| self.heroes.contains(&met)),
                });
                self.collisions = self.collisions.wrapping_add(1);
            }
        }
        told
    }
}

impl Read for Translated {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        while self.writer.is_some() && self.made.0.borrow().is_empty() {
            self.make()?;
        }
        self.made.0.borrow_mut().read(buffer)
    }
}

fn add(frame: &Frame, actor: &ActorState, is_hero: bool) -> Add {
    let class = match actor.kind {
        ActorKind::Vehicle => Class::VEHICLE,
        ActorKind::Walker => Class::WALKER,
        ActorKind::TrafficLight => Class::TRAFFIC_LIGHT,
        ActorKind::TrafficSign => Class::TRAFFIC_SIGN,
        ActorKind::Sensor => Class::SENSOR,
        ActorKind::Prop | ActorKind::Marker => Class::OTHER,
    };
    let role = is_hero.then(|| Attribute {
        kind: recording::attribute::STRING,
        name: "role_name".to_owned(),
        value: "hero".to_owned(),
    });
    Add {
        id: actor.id.get(),
        class,
        location: location(actor),
        rotation: Rotation::default(),
        uid: 0,
        blueprint: frame.type_of(actor).to_owned(),
        attributes: role.into_iter().collect(),
    }
}

/// Of those who move.
fn position(actor: &ActorState) -> Option<Position> {
    let moves = matches!(actor.kind, ActorKind::Vehicle | ActorKind::Walker);
    let (location, rotation) = (location(actor), Rotation::default());
    moves.then(|| Position { id: actor.id.get(), location, rotation })
}

fn location(actor: &ActorState) -> Vector {
    let [x, y, z] = (mirror_y(actor.world_from_actor.translation.vector) * CM_PER_M).into();
    Vector { x, y, z }
}

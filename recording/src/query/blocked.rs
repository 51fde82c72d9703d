//! Who stood still, and for how long.

use std::collections::BTreeMap;
use std::io::{Read, Write};

use super::names::Names;
use super::{Last, LocalDate, QueryError, write_foot, write_head};
use crate::bytes::Malformed;
use crate::packet::{Kind, Packet};
use crate::reader::{Frame, Reader};
use crate::record::{Position, Vector};

/// Rows of one answer.
const ROWS_MAX: usize = 1_000_000;

/// Where an actor stands and since when.
#[derive(Default)]
struct Stand {
    place: Vector,
    since_secs: f64,
    lasted_secs: f64,
}

/// One row: who stood from when for how long.
struct Row {
    since_secs: f64,
    id: u32,
    lasted_secs: f64,
}

struct Blocked {
    min_secs: f64,
    min_cm: f64,
    names: Names,
    stands: BTreeMap<u32, Stand>,
    rows: Vec<Row>,
}

/// Every stretch of at least `min_secs` in which an actor stayed within `min_cm` of where it was,
/// longest first.
///
/// An actor's place is noted anew only when it leaves it; the last frame of a log lasts no time.
///
/// # Errors
/// Those of the log and of the sink, and a log with too many actors or rows.
pub fn actors_blocked(
    reader: &mut Reader<impl Read>,
    min_secs: f64,
    min_cm: f64,
    date: LocalDate<'_>,
    out: &mut impl Write,
) -> Result<(), QueryError> {
    write_head(out, reader.header(), date)?;
    let [time, id, actor, duration] = ["Time", "Id", "Actor", "Duration"];
    writeln!(out, "{time:>8} {id:>6} {actor:<35} {duration:>10}")?;
    let (names, stands, rows) = (Names::default(), BTreeMap::new(), Vec::new());
    let mut blocked = Blocked { min_secs, min_cm, names, stands, rows };
    let mut last = Last::default();
    let mut damage = None;
    while let Some(frame) = reader.next_frame()? {
        match read(&frame) {
            Ok(packets) => blocked.note(&frame, packets)?,
            Err(malformed) => {
                damage = Some((frame.offset, malformed));
                break;
            }
        }
        last.note(&frame.start);
    }
    if let Some((offset, malformed)) = damage {
        reader.end_at(offset, &malformed);
    }
    blocked.end()?;
    for Row { since_secs, id, lasted_secs } in &blocked.rows {
        let name = blocked.names.blueprint(*id);
        writeln!(out, "{since_secs:8.0} {id:>6} {name:<35} {lasted_secs:10.0}")?;
    }
    Ok(write_foot(out, &last, false)?)
}

/// Who is there and where, if all of the frame can be read.
fn read(frame: &Frame<'_>) -> Result<Vec<Packet>, Malformed> {
    let is_wanted = |kind| matches!(kind, Kind::Adds | Kind::Positions);
    frame.packets().filter(|packet| is_wanted(packet.kind)).map(|packet| packet.decode()).collect()
}

impl Blocked {
    fn note(&mut self, frame: &Frame<'_>, packets: Vec<Packet>) -> Result<(), QueryError> {
        let lasts_secs = frame.start.duration_secs.max(0.0);
        for packet in packets {
            match packet {
                Packet::Adds(adds) => self.names.note(adds)?,
                Packet::Positions(positions) => {
                    for position in positions {
                        self.place(&position, frame.start.elapsed_secs, lasts_secs)?;
                    }
                }
                _ => {}
            }
        }
        Ok(())
    }

    fn place(
        &mut self,
        position: &Position,
        now_secs: f64,
        lasts_secs: f64,
    ) -> Result<(), QueryError> {
        let stand = self.stands.entry(position.id).or_default();
        if distance(stand.place, position.location) < self.min_cm {
            if stand.lasted_secs == 0.0 {
                stand.since_secs = now_secs;
            }
            stand.lasted_secs += lasts_secs;
            return Ok(());
        }
        let Stand { since_secs, lasted_secs, .. } = *stand;
        *stand = Stand { place: position.location, ..Stand::default() };
        if lasted_secs >= self.min_secs {
            self.list(Row { since_secs, id: position.id, lasted_secs })?;
        }
        Ok(())
    }

    fn list(&mut self, row: Row) -> Result<(), QueryError> {
        if self.rows.len() >= ROWS_MAX {
            return Err(QueryError::TooLarge { what: "blocked actors", limit: ROWS_MAX });
        }
        self.rows.push(row);
        Ok(())
    }

    /// Lists who stands to the end, and sorts.
    fn end(&mut self) -> Result<(), QueryError> {
        for (id, Stand { since_secs, lasted_secs, .. }) in std::mem::take(&mut self.stands) {
            if lasted_secs >= self.min_secs {
                self.list(Row { since_secs, id, lasted_secs })?;
            }
        }
        self.rows.sort_by(|a, b| b.lasted_secs.total_cmp(&a.lasted_secs));
        Ok(())
    }
}

/// In cm.
fn distance(a: Vector, b: Vector) -> f64 {
    let [x, y, z] = [a.x - b.x, a.y - b.y, a.z - b.z].map(f64::from);
    (x * x + y * y + z * z).sqrt()
}

//! Who met whom.

use std::collections::BTreeSet;
use std::io::{Read, Write};

use super::names::Names;
use super::{Last, LocalDate, QueryError, write_foot, write_head};
use crate::packet::{Kind, Packet};
use crate::reader::Reader;
use crate::record::{Class, Collision};

/// What kind of actor a side of a collision is wanted to be, as CARLA's clients name it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Letter(pub char);

impl Letter {
    /// Whether an actor of this letter is wanted.
    fn accepts(self, found: char, is_hero: bool) -> bool {
        match self.0 {
            'a' => true,
            'h' => is_hero,
            wanted => wanted == found,
        }
    }
}

/// The letter of an actor in a table. Signs and sensors are others; CARLA has `h` and `a` for them,
/// which mean something else.
fn letter_of(class: Option<Class>) -> char {
    match class {
        Some(Class::VEHICLE) => 'v',
        Some(Class::WALKER) => 'w',
        Some(Class::TRAFFIC_LIGHT) => 't',
        _ => 'o',
    }
}

/// The collisions of a log between actors of two kinds, each when it begins: a pair that touches in
/// the next frame too is the same collision.
///
/// # Errors
/// Those of the log and of the sink, and a log with too many actors.
pub fn collisions(
    reader: &mut Reader<impl Read>,
    wanted: [Letter; 2],
    date: LocalDate<'_>,
    out: &mut impl Write,
) -> Result<(), QueryError> {
    write_head(out, reader.header(), date)?;
    let [time, types, id, first, second] = ["Time", "Types", "Id", "Actor 1", "Actor 2"];
    writeln!(out, "{time:>8} {types:>6} {id:>6} {first:<35} {id:>6} {second:<35}")?;
    let (mut names, mut last, mut touching, mut rows) =
        (Names::default(), Last::default(), BTreeSet::new(), 0u64);
    let mut damage = None;
    'frames: while let Some(frame) = reader.next_frame()? {
        let mut met = Vec::new();
        for packet in frame.packets() {
            if !matches!(packet.kind, Kind::Adds | Kind::Collisions) {
                continue;
            }
            match packet.decode() {
                Ok(Packet::Adds(adds)) => names.note(adds)?,
                Ok(Packet::Collisions(collisions)) => met.extend(collisions),
                Ok(_) => {}
                Err(malformed) => {
                    damage = Some((frame.offset, malformed));
                    break 'frames;
                }
            }
        }
        last.note(&frame.start);
        let before = std::mem::take(&mut touching);
        for collision in &met {
            let Some(letters) = passes(collision, wanted, &names) else { continue };
            let pair = (collision.id1, collision.id2);
            if !before.contains(&pair) {
                write_row(out, last.elapsed_secs, letters, collision, &names)?;
                rows += 1;
            }
            touching.insert(pair);
        }
    }
    if let Some((offset, malformed)) = damage {
        reader.end_at(offset, &malformed);
    }
    Ok(write_foot(out, &last, rows > 0)?)
}

/// The letters of both sides, if both are wanted.
fn passes(collision: &Collision, [first, second]: [Letter; 2], names: &Names) -> Option<[char; 2]> {
    let letters = [collision.id1, collision.id2].map(|id| letter_of(names.class(id)));
    let is_wanted = first.accepts(letters[0], collision.is_hero1)
        && second.accepts(letters[1], collision.is_hero2);
    is_wanted.then_some(letters)
}

fn write_row(
    out: &mut impl Write,
    elapsed_secs: f64,
    [letter1, letter2]: [char; 2],
    &Collision { id1, id2, .. }: &Collision,
    names: &Names,
) -> std::io::Result<()> {
    let [name1, name2] = [id1, id2].map(|id| names.blueprint(id));
    writeln!(
        out,
        "{elapsed_secs:8.0}   {letter1} {letter2}  {id1:>6} {name1:<35} {id2:>6} {name2:<35}"
    )
}

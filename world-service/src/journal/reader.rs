//! Reading a journal, from its beginning or anywhere.

use std::io::{self, Read, Seek, SeekFrom};

use schemas::wire::decode_request;
use schemas::{EncodedFrame, Error, ErrorCode, Request, Tick};

use super::chunk::{self, CHUNK_HEAD_BYTES, ChunkHead, HEAD, Kind, damaged};
use super::entry::{Entry, Head, Moment, Step, TickEntry};
use super::index::{Index, Keyframe, Place};
use super::replay::JournalError;

/// Bytes of a moment, and of the wanted length before it in a tick.
const MOMENT_BYTES: usize = 24;
const WANTED_BYTES: usize = 8;
/// The last chunk of a journal that was ended: the offset of the index.
const END_CONTENT_BYTES: u64 = 8;

/// A journal whose ticks can be had in any order.
pub struct Reader<R> {
    source: R,
    head: Head,
    index: Index,
    body_at: u64,
    is_ended: bool,
}

/// How to come to a state: from a snapshot, by doing again what was done.
#[derive(Clone, Debug, PartialEq)]
pub struct Way {
    /// From where.
    pub snapshot: Vec<u8>,
    /// What is to be done, in order.
    pub steps: Vec<Step>,
    /// Where it leads.
    pub to: Moment,
}

impl<R: Read + Seek> Reader<R> {
    /// Reads the head and the index; a journal that is cut is read once to find its ticks.
    ///
    /// # Errors
    /// [`JournalError::Read`] for a file that is no journal or damaged.
    pub fn open(mut source: R) -> Result<Self, JournalError> {
        source.rewind()?;
        let head = read_front(&mut source)?;
        let body_at = source.stream_position()?;
        let end = source.seek(SeekFrom::End(0))?;
        let told = told_index(&mut source, end, head.first.tick).unwrap_or_default();
        let (index, is_ended) = match told {
            Some(index) => (index, true),
            None => scan(&mut source, &head, body_at, end)?,
        };
        Ok(Self { source, head, index, body_at, is_ended })
    }

    /// From where it goes on.
    pub fn head(&self) -> &Head {
        &self.head
    }

    /// Where its ticks are.
    pub fn index(&self) -> &Index {
        &self.index
    }

    /// Whether it was ended in order, and not cut off with its process.
    pub fn is_ended(&self) -> bool {
        self.is_ended
    }

    /// What came of a tick.
    ///
    /// # Errors
    /// A tick that is not in the journal, or the first moment, of which it has no frame.
    pub fn tick(&mut self, tick: Tick) -> Result<TickEntry, JournalError> {
        let number = self.index.number(tick).and_then(|number| number.checked_sub(1));
        let place = number.and_then(|number| self.index.ticks.get(number));
        let offset = place.ok_or_else(|| self.unknown(tick))?.offset;
        self.source.seek(SeekFrom::Start(offset))?;
        match chunk::read(&mut self.source)? {
            Some((Kind::Tick, content)) => Ok(tick_in(&content)?),
            _ => Err(damaged("its index leads to something else than a tick").into()),
        }
    }

    /// The frame after a tick.
    ///
    /// # Errors
    /// As for [`tick`](Self::tick).
    pub fn frame(&mut self, tick: Tick) -> Result<EncodedFrame, JournalError> {
        Ok(self.tick(tick)?.frame)
    }

    /// The way to the state after a tick, from the last keyframe before it.
    ///
    /// # Errors
    /// A tick that is not in the journal, and what is damaged on the way.
    pub fn way_to(&mut self, tick: Tick) -> Result<Way, JournalError> {
        let number = self.index.number(tick).ok_or_else(|| self.unknown(tick))?;
        let (mut snapshot, mut to) = (None, self.head.first);
        let mut left = number;
        match self.index.keyframe(number) {
            None => drop(self.source.seek(SeekFrom::Start(self.body_at))?),
            Some(Keyframe { offset, ticks_before }) => {
                self.source.seek(SeekFrom::Start(offset))?;
                let Some((Kind::Keyframe, content)) = chunk::read(&mut self.source)? else {
                    return Err(damaged("its index leads to something else than a keyframe").into());
                };
                let (moment, packed) = moment_in(&content)?;
                (snapshot, to) = (Some(chunk::unpack(packed)?), moment);
                left -= usize::try_from(ticks_before).map_err(|_| self.unknown(tick))?;
            }
        }
        let mut steps = Vec::new();
        while left > 0 {
            match chunk::read(&mut self.source)? {
                Some((Kind::Commands, content)) => steps.push(commands_in(&content)?),
                Some((Kind::Tick, content)) => {
                    let tick = tick_in(&content)?;
                    to = tick.moment;
                    steps.push(Step::Tick(tick));
                    left -= 1;
                }
                Some((Kind::Keyframe, _)) => {}
                _ => return Err(damaged("it ends before its index says").into()),
            }
        }
        let snapshot = snapshot.unwrap_or_else(|| self.head.snapshot.clone());
        Ok(Way { snapshot, steps, to })
    }

    /// All entries after the state of a tick, in order, up to the state of another.
    ///
    /// # Errors
    /// Ticks that are not in the journal, what is damaged on the way, and what `take` says.
    pub fn entries(
        &mut self,
        from: Tick,
        to: Tick,
        mut take: impl FnMut(Entry) -> Result<(), JournalError>,
    ) -> Result<(), JournalError> {
        let first = self.index.number(from).ok_or_else(|| self.unknown(from))?;
        let last = self.index.number(to).ok_or_else(|| self.unknown(to))?;
        let at = match first.checked_sub(1).and_then(|number| self.index.ticks.get(number)) {
            None => self.body_at,
            Some(place) => place.offset,
        };
        self.source.seek(SeekFrom::Start(at))?;
        if first > 0 {
            chunk::read(&mut self.source)?;
        }
        let mut left = last.saturating_sub(first);
        while left > 0 {
            match chunk::read(&mut self.source)? {
                Some((Kind::Commands, request)) => take(Entry::Commands(request))?,
                Some((Kind::Tick, content)) => {
                    take(Entry::Tick(tick_in(&content)?))?;
                    left -= 1;
                }
                Some((Kind::Keyframe, content)) => {
                    let (moment, packed) = moment_in(&content)?;
                    take(Entry::Keyframe { moment, snapshot: chunk::unpack(packed)? })?;
                }
                _ => return Err(damaged("it ends before its index says").into()),
            }
        }
        Ok(())
    }

    /// What was done from the state before a tick to the state after it, in order.
    ///
    /// # Errors
    /// As for [`entries`](Self::entries).
    pub fn steps_to(&mut self, tick: Tick) -> Result<Vec<Step>, JournalError> {
        let before = Tick(tick.0.checked_sub(1).ok_or_else(|| self.unknown(tick))?);
        let mut steps = Vec::new();
        self.entries(before, tick, |entry| {
            match entry {
                Entry::Commands(request) => steps.push(commands_in(&request)?),
                Entry::Tick(tick) => steps.push(Step::Tick(tick)),
                Entry::Keyframe { .. } => {}
            }
            Ok(())
        })?;
        Ok(steps)
    }

    fn unknown(&self, tick: Tick) -> JournalError {
        let (first, last) = (self.index.first(), self.index.last());
        let error = Error::new(ErrorCode::WrongTick, "the journal does not have this tick");
        JournalError::Part(error.wanted(format_args!("{first} to {last}")).found(tick))
    }
}

/// Reads the magic and the head.
pub(super) fn read_front(source: &mut dyn Read) -> io::Result<Head> {
    chunk::read_magic(source)?;
    let map_name = text(part(source, Kind::MapName)?)?;
    let map_text = text(chunk::unpack(&part(source, Kind::MapText)?)?)?;
    let content = part(source, Kind::Snapshot)?;
    let (first, packed) = moment_in(&content)?;
    Ok(Head { map_name, map_text, snapshot: chunk::unpack(packed)?, first })
}

fn part(from: &mut dyn Read, wanted: Kind) -> io::Result<Vec<u8>> {
    match chunk::read(from)? {
        Some((kind, content)) if kind == wanted => Ok(content),
        _ => Err(damaged(&format!("its {wanted:?} is missing"))),
    }
}

fn text(bytes: Vec<u8>) -> io::Result<String> {
    String::from_utf8(bytes).map_err(|_| damaged("a text that is no UTF-8"))
}

/// The index that the end of a journal tells; `None` where there is no such end.
fn told_index(source: &mut (impl Read + Seek), end: u64, first: Tick) -> io::Result<Option<Index>> {
    let Some(end_at) = end.checked_sub(CHUNK_HEAD_BYTES + END_CONTENT_BYTES) else {
        return Ok(None);
    };
    source.seek(SeekFrom::Start(end_at))?;
    let Some((Kind::End, content)) = chunk::read(source)? else { return Ok(None) };
    let Some(index_at) = content.first_chunk::<8>() else { return Ok(None) };
    let index_at = u64::from_le_bytes(*index_at);
    if index_at < HEAD.len() as u64 || index_at >= end_at {
        return Ok(None);
    }
    source.seek(SeekFrom::Start(index_at))?;
    let Some((Kind::Index, content)) = chunk::read(source)? else { return Ok(None) };
    Index::decode(first, &content).map(Some)
}

/// Goes over the heads of all chunks, up to the first that is not whole. Says also whether there is
/// an end.
fn scan(
    source: &mut (impl Read + Seek),
    head: &Head,
    body_at: u64,
    end: u64,
) -> io::Result<(Index, bool)> {
    let mut index = Index::after(head.first.tick);
    let mut offset = body_at;
    source.seek(SeekFrom::Start(offset))?;
    while let Some(ChunkHead { kind, length, .. }) = chunk::read_head(source)? {
        let length = u64::from(length);
        if offset + CHUNK_HEAD_BYTES + length > end {
            break;
        }
        let mut read_bytes = 0;
        match kind {
            Kind::Tick => {
                let mut begin = [0; WANTED_BYTES + MOMENT_BYTES];
                if length < begin.len() as u64 || !chunk::fill(source, &mut begin)? {
                    return Err(damaged("a tick without its moment"));
                }
                read_bytes = begin.len() as u64;
                let (moment, _) = moment_in(&begin[WANTED_BYTES..])?;
                let elapsed_secs = moment.sim_secs - head.first.sim_secs;
                index.ticks.push(Place { offset, elapsed_secs });
            }
            Kind::Keyframe => {
                let ticks_before = index.ticks.len() as u64;
                index.keyframes.push(Keyframe { offset, ticks_before });
            }
            Kind::Commands | Kind::Index => {}
            Kind::End => return Ok((index, true)),
            other => return Err(damaged(&format!("{other:?} in the middle of it"))),
        }
        source.seek_relative((length - read_bytes) as i64)?;
        offset += CHUNK_HEAD_BYTES + length;
    }
    Ok((index, false))
}

/// A moment and what follows it.
pub(super) fn moment_in(content: &[u8]) -> io::Result<(Moment, &[u8])> {
    let (bytes, rest) = content
        .split_first_chunk::<MOMENT_BYTES>()
        .ok_or_else(|| damaged("a state without its moment"))?;
    let (parts, _) = bytes.as_chunks::<8>();
    let moment = Moment {
        tick: Tick(u64::from_le_bytes(parts[0])),
        sim_secs: f64::from_le_bytes(parts[1]),
        state_hash: u64::from_le_bytes(parts[2]),
    };
    Ok((moment, rest))
}

pub(super) fn tick_in(content: &[u8]) -> io::Result<TickEntry> {
    let (wanted, rest) = content
        .split_first_chunk::<WANTED_BYTES>()
        .ok_or_else(|| damaged("a tick without its length"))?;
    let wanted_secs = Some(f64::from_le_bytes(*wanted)).filter(|secs| !secs.is_nan());
    let (moment, packed) = moment_in(rest)?;
    Ok(TickEntry { wanted_secs, moment, frame: EncodedFrame(chunk::unpack(packed)?) })
}

pub(super) fn commands_in(content: &[u8]) -> Result<Step, JournalError> {
    match decode_request(content)? {
        Request::RunCommands { commands, .. } => Ok(Step::Commands(commands)),
        _ => Err(damaged("a request that is no commands").into()),
    }
}

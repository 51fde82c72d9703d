//! What a log says of the journal beside it, in packets that readers of CARLA skip: CARLA leaves
//! ids above 100 to others.

use crate::bytes::{Cursor, Field, Layout, Malformed};
use crate::packet::{Kind, Packet};
use crate::reader::Frame;

/// Ids of the packets.
const LINK: u8 = 101;
const STATE: u8 = 102;
/// What they begin with: others may have packets of these ids, too.
const MARK: u32 = u32::from_le_bytes(*b"CWJL");

/// The journal of the same world, from which it can be replayed to the bit; in the first frame, and
/// in a later one from which on another journal has it.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct JournalLink {
    /// Its file, in the folder of journals.
    pub name: String,
    /// What tells it from journals that began otherwise.
    pub digest: u64,
    /// The tick of the world from which it goes on.
    pub tick: u64,
    /// Of the world at that tick.
    pub state_hash: u64,
}

/// Which state of the world a frame shows.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct WorldState {
    /// Of the world.
    pub tick: u64,
    /// Of the world.
    pub state_hash: u64,
}

impl JournalLink {
    /// The packet that says so.
    pub fn packet(&self) -> Packet {
        let mut body = Vec::new();
        MARK.put(&mut body);
        self.name.put(&mut body);
        [self.digest, self.tick, self.state_hash].iter().for_each(|number| number.put(&mut body));
        Packet::Foreign(LINK, body)
    }

    /// Of several journals the one that has a tick: the last one that began before.
    pub fn that_has(links: &[Self], tick: u64) -> Option<&Self> {
        links.iter().rev().find(|link| link.tick <= tick)
    }

    /// What a frame says, if it does.
    pub fn of(frame: &Frame<'_>) -> Option<Self> {
        let packet = frame.packets().find(|packet| packet.kind == Kind::Foreign(LINK))?;
        Self::read(packet.body).ok()?
    }

    fn read(body: &[u8]) -> Result<Option<Self>, Malformed> {
        let mut cursor = Cursor::new(body, Layout::default());
        if u32::take(&mut cursor)? != MARK {
            return Ok(None);
        }
        let name = String::take(&mut cursor)?;
        let [digest, tick, state_hash] = three(&mut cursor)?;
        Ok(Some(Self { name, digest, tick, state_hash }))
    }
}

impl WorldState {
    /// The packet that says so.
    pub fn packet(&self) -> Packet {
        let mut body = Vec::new();
        MARK.put(&mut body);
        self.tick.put(&mut body);
        self.state_hash.put(&mut body);
        Packet::Foreign(STATE, body)
    }

    /// What a frame says, if it does.
    pub fn of(frame: &Frame<'_>) -> Option<Self> {
        frame.packets().find_map(|packet| Self::read(packet.kind, packet.body))
    }

    /// What packets say last.
    pub fn last(packets: &[Packet]) -> Option<Self> {
        packets.iter().rev().find_map(|packet| match packet {
            Packet::Foreign(id, body) => Self::read(Kind::Foreign(*id), body),
            _ => None,
        })
    }

    fn read(kind: Kind, body: &[u8]) -> Option<Self> {
        let mut cursor = Cursor::new(body, Layout::default());
        let is_ours =
            kind == Kind::Foreign(STATE) && u32::take(&mut cursor).is_ok_and(|mark| mark == MARK);
        if !is_ours {
            return None;
        }
        let (tick, state_hash) = (u64::take(&mut cursor).ok()?, u64::take(&mut cursor).ok()?);
        Some(Self { tick, state_hash })
    }
}

fn three(cursor: &mut Cursor<'_>) -> Result<[u64; 3], Malformed> {
    Ok([u64::take(cursor)?, u64::take(cursor)?, u64::take(cursor)?])
}

#[cfg(test)]
mod tests {
    use crate::{FrameContent, Header, Reader, Writer};

    use super::*;

    #[test]
    fn of_several_journals_the_last_one_that_began_before_a_tick_has_it() {
        let link = |tick| JournalLink { tick, ..JournalLink::default() };
        let links = [link(5), link(90)];
        let found = |tick| JournalLink::that_has(&links, tick).map(|link| link.tick);
        assert_eq!([4, 5, 89, 90, 1_000].map(found), [None, Some(5), Some(5), Some(90), Some(90)]);
    }

    #[test]
    fn a_log_says_what_it_was_told_of_its_journal() {
        let link = JournalLink {
            name: "runs/a.log.journal".to_owned(),
            digest: u64::MAX,
            tick: 7,
            state_hash: 3,
        };
        let state = WorldState { tick: 8, state_hash: 9 };
        let header = Header { version: Header::VERSION, date: 0, map: "Town01".to_owned() };
        let mut writer = Writer::begin(Vec::new(), &header).unwrap();
        let foreign = vec![link.packet(), state.packet()];
        assert_eq!(WorldState::last(&foreign), Some(state));
        writer.frame(FrameContent { foreign, ..FrameContent::default() }).unwrap();
        let foreign = vec![Packet::Foreign(LINK, vec![1, 2]), Packet::Foreign(STATE, vec![0; 40])];
        writer.frame(FrameContent { foreign, ..FrameContent::default() }).unwrap();
        let log = writer.finish().unwrap();
        let mut reader = Reader::open(&log[..]).unwrap();
        let frame = reader.next_frame().unwrap().unwrap();
        assert_eq!((JournalLink::of(&frame), WorldState::of(&frame)), (Some(link), Some(state)));
        let frame = reader.next_frame().unwrap().unwrap();
        assert_eq!((JournalLink::of(&frame), WorldState::of(&frame)), (None, None));
    }
}

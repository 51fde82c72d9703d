//! Recordings of more than 4 GiB: places in them do not fit into 32 bits.
#![allow(clippy::unwrap_used, reason = "a panic is a failed test")]

mod common;

use std::io::{self, Read, Seek, SeekFrom};

use recording::{Class, FrameContent, Index, Packet, Player, Reader, Step, check};

use common::{add, at, header, vector};

/// Bytes in each frame that nobody reads, in a packet that is not of CARLA.
const FILLING: usize = 5 * 1024 * 1024;
/// More than from one keyframe of an index to the next.
const FRAMES: usize = 1_200;
const STEP_SECS: f64 = 0.05;

/// A log that takes no room: frames are made as they are read.
struct Virtual {
    head: Vec<u8>,
    at: u64,
}

impl Virtual {
    fn new() -> Self {
        let head = recording::Writer::begin(Vec::new(), &header("Town01")).unwrap();
        Self { head: head.finish().unwrap(), at: 0 }
    }

    /// What is not filling in a frame: before it, and after it.
    fn frame(number: usize) -> (Vec<u8>, Vec<u8>) {
        let first = || vec![add(24, Class::VEHICLE, "vehicle.audi.tt", vector(0.0, 0.0, 0.0))];
        let content = FrameContent {
            elapsed_secs: STEP_SECS * number as f64,
            adds: if number == 0 { first() } else { Vec::new() },
            positions: vec![at(24, number as f32)],
            foreign: vec![Packet::Foreign(200, Vec::new())],
            ..FrameContent::default()
        };
        let mut writer = recording::Writer::after_head(Vec::new());
        writer.frame(content).unwrap();
        let mut before = writer.finish().unwrap();
        // Frames are numbered, and last until the next one.
        before[5..13].copy_from_slice(&(number as u64 + 1).to_le_bytes());
        before[13..21].copy_from_slice(&STEP_SECS.to_le_bytes());
        // The end of the frame is a packet without content.
        let after = before.split_off(before.len() - 5);
        let size_at = before.len() - 4;
        before[size_at..].copy_from_slice(&(FILLING as u32).to_le_bytes());
        (before, after)
    }

    fn frame_bytes(number: usize) -> usize {
        let (before, after) = Self::frame(number);
        before.len() + FILLING + after.len()
    }

    /// Which frame a place lies in, and how far behind its beginning.
    fn frame_at(&self, at: u64) -> (usize, usize) {
        let behind_head = at as usize - self.head.len();
        match behind_head.checked_sub(Self::frame_bytes(0)) {
            None => (0, behind_head),
            Some(rest) => (1 + rest / Self::frame_bytes(1), rest % Self::frame_bytes(1)),
        }
    }

    /// Where the last frame begins.
    fn last_frame(&self) -> u64 {
        let bytes = self.head.len() + Self::frame_bytes(0) + (FRAMES - 2) * Self::frame_bytes(1);
        bytes as u64
    }
}

impl Read for Virtual {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let count =
            if let Some(rest) = self.head.get(self.at as usize..).filter(|it| !it.is_empty()) {
                copy(rest, buffer)
            } else {
                let (number, behind) = self.frame_at(self.at);
                if number == FRAMES {
                    return Ok(0);
                }
                let (before, after) = Self::frame(number);
                match behind.checked_sub(before.len()) {
                    None => copy(&before[behind..], buffer),
                    Some(filled) if filled < FILLING => {
                        let count = buffer.len().min(FILLING - filled);
                        buffer[..count].fill(0);
                        count
                    }
                    Some(filled) => copy(&after[filled - FILLING..], buffer),
                }
            };
        self.at += count as u64;
        Ok(count)
    }
}

fn copy(bytes: &[u8], buffer: &mut [u8]) -> usize {
    let count = buffer.len().min(bytes.len());
    buffer[..count].copy_from_slice(&bytes[..count]);
    count
}

impl Seek for Virtual {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        let SeekFrom::Start(at) = to else { panic!("nobody seeks from elsewhere") };
        self.at = at;
        Ok(at)
    }
}

#[test]
fn a_recording_of_more_than_five_gigabytes_is_read_and_replayed_to_its_end() {
    let mut reader = Reader::open(Virtual::new()).unwrap();
    let index = Index::build(&mut reader).unwrap();
    assert_eq!((index.frame_count(), reader.cut()), (FRAMES, None));
    let total_secs = STEP_SECS * (FRAMES - 1) as f64;
    assert!((index.total_secs() - total_secs).abs() < 1e-9);

    let reader = Reader::open(Virtual::new()).unwrap();
    // Two frames before the last one.
    let span = index.span(-2.0 * STEP_SECS, 0.0);
    let (mut player, step) = Player::begin(reader, &index, span).unwrap().unwrap();
    let x = |step: &Step| step.poses[0].location.x;
    assert_eq!(x(&step), (FRAMES - 3) as f32);
    assert_eq!(x(&player.advance(STEP_SECS, 1.0).unwrap()), (FRAMES - 2) as f32);
    let last = player.advance(STEP_SECS, 1.0).unwrap();
    assert_eq!((x(&last), last.has_ended), ((FRAMES - 1) as f32, true));
}

#[test]
fn damage_behind_five_gigabytes_has_its_place() {
    let last = Virtual::new().last_frame();
    assert!(last > 5_000_000_000, "{last}");
    let mut reader = Reader::open(Virtual::new().take(last + 100)).unwrap();
    let whole = check(&mut reader).unwrap().unwrap();
    assert_eq!(whole.number, FRAMES as u64 - 1);
    assert_eq!(reader.cut().unwrap().offset, last);
}

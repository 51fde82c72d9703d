//! Logs that are cut, damaged or no logs at all: no panic, bounded memory, and what is whole is
//! told.
#![allow(clippy::unwrap_used, reason = "a panic is a failed test")]

mod common;

use std::io::Cursor;

use recording::query::{Letter, actors_blocked, collisions, file_info};
use recording::{Add, FrameContent, Index, Kind, NotARecording, Player, Reader, SceneLight, check};

use common::{date, everything, genuine, header, log_of};

/// Everything that can be asked of a log; the first answer.
fn ask(log: &[u8]) -> Option<String> {
    let mut out = Vec::new();
    let open = || Reader::open(log).ok();
    file_info(&mut open()?, true, &date, &mut out).unwrap();
    let mut rest = Vec::new();
    collisions(&mut open()?, [Letter('a'); 2], &date, &mut rest).unwrap();
    actors_blocked(&mut open()?, 0.0, 1.0, &date, &mut rest).unwrap();
    replay(log);
    Some(String::from_utf8_lossy(&out).into_owned())
}

/// Replays a log from somewhere on, at several factors.
fn replay(log: &[u8]) {
    let index = Index::build(&mut Reader::open(log).unwrap()).unwrap();
    let reader = Reader::open(Cursor::new(log)).unwrap();
    let span = index.span(0.04, 0.0);
    let Some((mut player, _)) = Player::begin(reader, &index, span).unwrap() else { return };
    for factor in [0.5, 1.0, 3.0, 1.0] {
        player.advance(0.05, factor).unwrap();
        player.remaining(&index);
    }
}

/// How many damaged logs a test reads, in thousands, unless CAUSEWAY_MUTATIONS says another number,
/// as `./test fuzz` does.
fn mutations(thousands: usize) -> usize {
    let wanted = std::env::var("CAUSEWAY_MUTATIONS").ok().and_then(|text| text.parse().ok());
    wanted.unwrap_or(thousands) * 1_000
}

/// The most memory that this process had so far, where the system tells.
fn peak_mib() -> Option<usize> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find(|line| line.starts_with("VmHWM:"))?;
    let kib: usize = line.split_whitespace().nth(1)?.parse().ok()?;
    Some(kib / 1024)
}

/// Frames of a log, and whether it ends in the midst of one.
fn frames_of(log: &[u8]) -> (usize, bool) {
    let mut reader = Reader::open(log).unwrap();
    let mut frames = 0;
    while reader.next_frame().unwrap().is_some() {
        frames += 1;
    }
    (frames, reader.cut().is_some())
}

#[test]
fn a_log_that_is_cut_anywhere_is_told_up_to_the_last_whole_frame() {
    let log = log_of(everything());
    let ends: Vec<usize> = {
        let mut reader = Reader::open(&log[..]).unwrap();
        let mut begins = Vec::new();
        while let Some(frame) = reader.next_frame().unwrap() {
            begins.push(frame.offset as usize);
        }
        begins.into_iter().skip(1).chain([log.len()]).collect()
    };
    let head = first_frame_at(&log);
    for length in 0..log.len() {
        let cut = &log[..length];
        if length < head {
            assert!(matches!(Reader::open(cut), Err(NotARecording::Foreign)), "{length}");
            continue;
        }
        let whole = ends.iter().filter(|end| **end <= length).count();
        let ends_with_a_frame = length == head || ends.contains(&length);
        assert_eq!(frames_of(cut), (whole, !ends_with_a_frame), "{length}");
        assert!(ask(cut).unwrap().contains(&format!("Frames: {whole}\n")), "{length}");
    }
}

fn first_frame_at(log: &[u8]) -> usize {
    Reader::open(log).unwrap().next_frame().unwrap().unwrap().offset as usize
}

/// Where a log is damaged, as its check says.
fn damage_at(log: &[u8]) -> Option<u64> {
    let mut reader = Reader::open(log).unwrap();
    check(&mut reader).unwrap();
    reader.cut().map(|cut| cut.offset)
}

#[test]
fn a_check_finds_every_count_size_and_number_that_is_changed() {
    let log = log_of(everything());
    assert_eq!(damage_at(&log), None);
    let mut reader = Reader::open(&log[..]).unwrap();
    let mut changed = 0;
    while let Some(frame) = reader.next_frame().unwrap() {
        for packet in frame.packets() {
            let at = packet.offset as usize;
            assert_eq!(log[at], packet.kind.id());
            let has_count =
                !matches!(packet.kind, Kind::VisualTime | Kind::PlatformTime | Kind::Weather);
            let counts = if has_count && !packet.body.is_empty() { &[5, 6][..] } else { &[] };
            // The frame's number and times lie where a count does elsewhere.
            for (byte, bit) in counts.iter().flat_map(|byte| (0..8).map(move |bit| (byte, bit))) {
                let mut other = log.clone();
                other[at + byte] ^= 1 << bit;
                assert_eq!(damage_at(&other), Some(packet.offset), "{:?}", packet.kind);
                changed += 1;
            }
            // A packet that is longer or shorter takes from the next one, or leaves it a rest.
            for bit in 0..32 {
                let mut other = log.clone();
                other[at + 1 + bit / 8] ^= 1 << (bit % 8);
                assert!(damage_at(&other).is_some(), "{:?}: size, bit {bit}", packet.kind);
            }
        }
    }
    assert!(changed > 500, "{changed}");
    // The first character of the first blueprint has its length before it.
    let name = log.windows(9).position(|bytes| bytes == b"spectator").unwrap();
    let mut other = log.clone();
    other[name - 2] ^= 4;
    assert!(damage_at(&other).is_some());
}

#[test]
fn a_check_finds_every_place_where_a_log_is_cut_within_a_frame() {
    let log = log_of(everything());
    for length in first_frame_at(&log)..log.len() {
        let (_, is_cut) = frames_of(&log[..length]);
        assert_eq!(damage_at(&log[..length]).is_some(), is_cut, "{length}");
    }
}

#[test]
fn genuine_logs_are_not_damaged() {
    for (name, log) in genuine() {
        assert_eq!(damage_at(&log), None, "{name}");
    }
}

#[test]
fn a_writer_that_dies_leaves_all_frames_but_the_one_it_holds() {
    let mut sink = Vec::new();
    let mut writer = recording::Writer::begin(&mut sink, &header("Town01")).unwrap();
    for number in 0..10 {
        let elapsed_secs = f64::from(number) * 0.05;
        writer.frame(FrameContent { elapsed_secs, ..FrameContent::default() }).unwrap();
    }
    drop(writer);
    assert_eq!(frames_of(&sink), (9, false));
}

#[test]
fn what_is_no_log_is_refused() {
    let log = log_of(everything());
    let mut other_magic = log.clone();
    other_magic[5] ^= 1;
    for foreign in [&b""[..], b"PNG", &[0; 100], &[255; 100], &other_magic] {
        assert!(matches!(Reader::open(foreign), Err(NotARecording::Foreign)));
    }
}

#[test]
fn a_packet_that_promises_more_than_there_is_takes_no_memory() {
    let log = log_of(everything());
    let first = first_frame_at(&log);
    for size in [u32::MAX, 60 * 1024 * 1024] {
        let mut lying = log.clone();
        lying[first + 1..first + 5].copy_from_slice(&size.to_le_bytes());
        assert_eq!(frames_of(&lying), (0, true), "{size}");
    }
}

#[test]
fn a_log_in_which_more_lasts_than_can_be_kept_is_not_replayed() {
    let lamps = |frame: i32| {
        let lamps = (0..60_000).map(|at| SceneLight { id: frame * 60_000 + at, ..lamp() });
        FrameContent { scene_lights: lamps.collect(), ..FrameContent::default() }
    };
    let log = log_of((0..5).map(lamps));
    let refusal = Index::build(&mut Reader::open(&log[..]).unwrap()).unwrap_err();
    assert!(refusal.to_string().contains("actors, lamps and doors"), "{refusal}");
    let long = |id| Add { id, blueprint: "x".repeat(60_000), ..Add::default() };
    let names = |frame: u32| FrameContent {
        adds: (0..100).map(|at| long(frame * 100 + at)).collect(),
        ..FrameContent::default()
    };
    let log = log_of((0..12).map(names));
    let refusal = Index::build(&mut Reader::open(&log[..]).unwrap()).unwrap_err();
    assert!(refusal.to_string().contains("bytes of attributes"), "{refusal}");
}

fn lamp() -> SceneLight {
    SceneLight { intensity: 1.0, ..SceneLight::default() }
}

/// Ten gigabytes that take no room on the disk: whatever follows the frames is no frame.
#[test]
fn a_large_file_with_little_in_it_is_told_at_once() {
    let path = std::env::temp_dir().join(format!("causeway-sparse-{}.log", std::process::id()));
    std::fs::write(&path, log_of(everything())).unwrap();
    let file = std::fs::File::options().write(true).open(&path).unwrap();
    file.set_len(10_000_000_000).unwrap();
    let source = std::io::BufReader::new(std::fs::File::open(&path).unwrap());
    let mut reader = Reader::open(source).unwrap();
    let index = Index::build(&mut reader).unwrap();
    assert_eq!((index.frame_count(), reader.cut().is_some()), (3, true));
    std::fs::remove_file(path).unwrap();
}

/// Of all that a damaged log may promise, whatever its size is.
const PEAK_MIB_MAX: usize = 200;

/// Seeded, so that a failure can be repeated.
struct Dice(u64);

impl Dice {
    fn below(&mut self, limit: usize) -> usize {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 % limit as u64) as usize
    }
}

/// Changes some bytes, cuts, doubles or inserts.
fn damage(log: &[u8], dice: &mut Dice) -> Vec<u8> {
    let mut log = log.to_vec();
    for _ in 0..=dice.below(4) {
        let at = dice.below(log.len());
        match dice.below(8) {
            0 => log.truncate(at.max(1)),
            1 => log.insert(at, dice.below(256) as u8),
            2 => drop(log.remove(at)),
            3 => log[at] = [0, 1, 127, 128, 255][dice.below(5)],
            4 => {
                let end = (at + dice.below(64)).min(log.len());
                log.extend_from_within(at..end);
            }
            _ => log[at] ^= 1 << dice.below(8),
        }
        if log.is_empty() {
            log.push(0);
        }
    }
    log
}

#[test]
fn damaged_logs_never_cause_a_panic() {
    let mut dice = Dice(7);
    let (mut whole, mut old) = (log_of(everything()), log_of(everything()));
    // An old version has its own ways to guess what packets are.
    old[0] = 1;
    whole.shrink_to_fit();
    for _ in 0..mutations(10) {
        ask(&damage(&whole, &mut dice));
        ask(&damage(&old, &mut dice));
    }
    assert!(peak_mib().is_none_or(|mib| mib <= PEAK_MIB_MAX), "{:?} MiB", peak_mib());
}

#[test]
fn damaged_genuine_logs_never_cause_a_panic() {
    let mut dice = Dice(11);
    for (_, log) in genuine() {
        // The first frame has all kinds of packets; a whole log would only take longer.
        let log = &log[..40_000];
        for _ in 0..mutations(1) {
            ask(&damage(log, &mut dice));
        }
    }
    assert!(peak_mib().is_none_or(|mib| mib <= PEAK_MIB_MAX), "{:?} MiB", peak_mib());
}

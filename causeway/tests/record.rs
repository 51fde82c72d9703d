//! Goal: `causeway record verify` ends with 0 for a log that is whole, and names the place of one
//! that is not; who is not in a recording is not shown.

#![allow(clippy::unwrap_used, reason = "a panic is a failed test")]

use std::path::PathBuf;
use std::process::Command;

use recording::{Add, Class, FrameContent, Header, Kind, Position, Reader, Writer};

/// A log that goes away with the test.
struct Log(PathBuf);

impl Log {
    fn new(name: &str, bytes: &[u8]) -> Self {
        let name = format!("causeway-verify-{name}-{}.log", std::process::id());
        let path = std::env::temp_dir().join(name);
        std::fs::write(&path, bytes).unwrap();
        Self(path)
    }

    /// The exit code of a check, and what it says.
    fn verified(&self) -> (Option<i32>, String) {
        self.asked(&["verify"])
    }

    /// The same of any question.
    fn asked(&self, words: &[&str]) -> (Option<i32>, String) {
        let mut command = Command::new(env!("CARGO_BIN_EXE_causeway"));
        let output = command.arg("record").args(words).arg(&self.0).output().unwrap();
        let said = [output.stdout, output.stderr].concat();
        (output.status.code(), String::from_utf8_lossy(&said).into_owned())
    }
}

impl Drop for Log {
    fn drop(&mut self) {
        let _ = std::fs::remove_file(&self.0);
    }
}

/// A car that stands for three frames.
fn standing_car() -> Vec<u8> {
    let header = Header { version: Header::VERSION, date: 0, map: "Town01".to_owned() };
    let mut writer = Writer::begin(Vec::new(), &header).unwrap();
    for number in 0..3 {
        let blueprint = "vehicle.audi.tt".to_owned();
        let car = Add { id: 24, class: Class::VEHICLE, blueprint, ..Add::default() };
        let adds = if number == 0 { vec![car] } else { Vec::new() };
        let positions = vec![Position { id: 24, ..Position::default() }];
        let elapsed_secs = f64::from(number) * 0.05;
        writer
            .frame(FrameContent { elapsed_secs, adds, positions, ..FrameContent::default() })
            .unwrap();
    }
    writer.finish().unwrap()
}

/// Where the second frame tells where the car is.
fn second_positions(log: &[u8]) -> usize {
    let mut reader = Reader::open(log).unwrap();
    reader.next_frame().unwrap();
    let frame = reader.next_frame().unwrap().unwrap();
    let positions = frame.packets().find(|packet| packet.kind == Kind::Positions);
    positions.unwrap().offset as usize
}

#[test]
fn a_whole_log_is_told_with_its_length() {
    let (code, said) = Log::new("whole", &standing_car()).verified();
    assert_eq!(code, Some(0), "{said}");
    assert!(said.contains("3 frames, 0.100 s on Town01"), "{said}");
}

#[test]
fn a_count_that_is_flipped_is_named_with_its_place() {
    let mut log = standing_car();
    let at = second_positions(&log);
    // One actor becomes none, and its record a rest of the packet.
    log[at + 5] ^= 1;
    let (code, said) = Log::new("flipped", &log).verified();
    assert_eq!(code, Some(1), "{said}");
    assert!(said.contains("1 frames"), "{said}");
    let place = format!("at byte {at}: frame 2, Positions: ");
    assert!(said.contains(&place) && said.contains("found 28 bytes more"), "{said}");
}

#[test]
fn a_log_that_is_cut_is_named_with_its_last_frame() {
    let mut log = standing_car();
    log.truncate(second_positions(&log));
    let (code, said) = Log::new("cut", &log).verified();
    assert_eq!(code, Some(1), "{said}");
    assert!(said.contains("1 frames") && said.contains("the file ends within a frame"), "{said}");
}

#[test]
fn an_ego_that_is_in_no_frame_is_refused_and_no_file_is_left() {
    let log = Log::new("ego", &standing_car());
    for (word, ending) in [("export", "mcap"), ("page", "html")] {
        let to = log.0.with_extension(ending);
        let (code, said) = log.asked(&[word, "--ego", "25", "--to", to.to_str().unwrap()]);
        assert_eq!(code, Some(1), "{said}");
        assert!(said.contains("as --ego, found 25"), "{said}");
        assert!(!to.exists());
        let (code, said) = log.asked(&[word, "--ego", "24", "--to", to.to_str().unwrap()]);
        assert_eq!(code, Some(0), "{said}");
        std::fs::remove_file(to).unwrap();
    }
}

#[test]
fn times_and_distances_that_are_none_are_refused() {
    let log = Log::new("blocked", &standing_car());
    for flag in ["--time", "--distance"] {
        for wrong in ["nan", "-5"] {
            let (code, said) = log.asked(&["blocked", flag, wrong]);
            assert_eq!(code, Some(2), "{said}");
            assert!(said.contains("wanted a number from 0 on"), "{said}");
        }
    }
}

//! Whether a log says what its packets promise, to their last byte.

use std::io::{self, Read};

use crate::reader::{Frame, Reader};
use crate::record::FrameStart;

/// Times are sums of lengths that binary fractions do not have.
const EPSILON_SECS: f64 = 1e-6;

/// Decodes every packet of a log and gives its last whole frame. A packet that has less or more
/// than it promises, or a frame that does not follow the one before it, ends the log where it
/// lies ([`Reader::cut`]). What a damaged number means, nobody can tell.
///
/// # Errors
/// Those of the source.
pub fn check(reader: &mut Reader<impl Read>) -> io::Result<Option<FrameStart>> {
    let mut last = None;
    let mut damage = None;
    while let Some(frame) = reader.next_frame()? {
        damage = damage_of(last.as_ref(), &frame);
        if damage.is_some() {
            break;
        }
        last = Some(frame.start);
    }
    if let Some((offset, why)) = damage {
        reader.end_at(offset, &why);
    }
    Ok(last)
}

/// Where a frame is damaged, and how.
fn damage_of(before: Option<&FrameStart>, frame: &Frame<'_>) -> Option<(u64, String)> {
    let number = frame.start.number;
    if let Some(why) = out_of_turn(before, &frame.start) {
        return Some((frame.offset, why));
    }
    frame.packets().find_map(|packet| {
        let (kind, wrong) = (packet.kind, packet.check().err()?);
        Some((packet.offset, format!("frame {number}, {kind:?}: {wrong}")))
    })
}

/// Why a frame does not follow the one before it.
fn out_of_turn(before: Option<&FrameStart>, found: &FrameStart) -> Option<String> {
    let number = before.map_or(1, |before| before.number.saturating_add(1));
    if found.number != number {
        return Some(format!("wanted frame {number}, found frame {}", found.number));
    }
    let secs = before.map_or(0.0, |before| before.elapsed_secs + before.duration_secs);
    let is_in_turn = (found.elapsed_secs - secs).abs() < EPSILON_SECS;
    let elapsed_secs = found.elapsed_secs;
    (!is_in_turn)
        .then(|| format!("wanted frame {number} at {secs} s, found it at {elapsed_secs} s"))
}

//! The pieces of a journal's file.

use std::io::{self, ErrorKind, Read, Write};

use schemas::limits::MAP_BYTES_MAX;

/// "CWJL" and the version of the layout.
pub(super) const HEAD: [u8; 8] = *b"CWJL\x01\0\0\0";
/// Kind, length, digest.
pub(super) const CHUNK_HEAD_BYTES: u64 = 1 + 4 + 8;

/// What a chunk holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    /// Name of the map.
    MapName = 1,
    /// OpenDRIVE.
    MapText,
    /// The world when the journal began.
    Snapshot,
    /// Commands, as the request to run them.
    Commands,
    /// The wanted length of a tick in seconds, NaN for the world's own, and the frame after it.
    Tick,
    /// Nothing more was recorded: the journal was ended, or full.
    End,
}

impl Kind {
    fn of(byte: u8) -> Option<Self> {
        let all =
            [Self::MapName, Self::MapText, Self::Snapshot, Self::Commands, Self::Tick, Self::End];
        all.into_iter().find(|kind| *kind as u8 == byte)
    }
}

fn digest(content: &[&[u8]]) -> [u8; 8] {
    let mut hasher = blake3::Hasher::new();
    for part in content {
        hasher.update(part);
    }
    let mut short = [0; 8];
    short.copy_from_slice(&hasher.finalize().as_bytes()[..8]);
    short
}

/// Writes a chunk whose content comes in parts.
pub(super) fn write(out: &mut dyn Write, kind: Kind, content: &[&[u8]]) -> io::Result<()> {
    let bytes: usize = content.iter().map(|part| part.len()).sum();
    let length = u32::try_from(bytes).map_err(|_| io::Error::from(ErrorKind::FileTooLarge))?;
    out.write_all(&[kind as u8])?;
    out.write_all(&length.to_le_bytes())?;
    out.write_all(&digest(content))?;
    content.iter().try_for_each(|part| out.write_all(part))
}

/// The next chunk; `None` at the end of the file and for a chunk that is cut off.
///
/// # Errors
/// `InvalidData` for a damaged one.
pub(super) fn read(from: &mut dyn Read) -> io::Result<Option<(Kind, Vec<u8>)>> {
    let mut head = [0; CHUNK_HEAD_BYTES as usize];
    if !fill(from, &mut head)? {
        return Ok(None);
    }
    let damaged = |why: &str| io::Error::new(ErrorKind::InvalidData, why.to_owned());
    let [kind, l0, l1, l2, l3, wanted @ ..] = head;
    let kind = Kind::of(kind).ok_or_else(|| damaged("a chunk of an unknown kind"))?;
    let length = u32::from_le_bytes([l0, l1, l2, l3]);
    if length as usize > MAP_BYTES_MAX {
        return Err(damaged("a chunk is too long"));
    }
    let mut content = Vec::new();
    from.take(length.into()).read_to_end(&mut content)?;
    if content.len() < length as usize {
        return Ok(None);
    }
    if digest(&[&content]) != wanted {
        return Err(damaged("a chunk does not fit its digest"));
    }
    Ok(Some((kind, content)))
}

/// Whether there was enough.
pub(super) fn fill(from: &mut dyn Read, buffer: &mut [u8]) -> io::Result<bool> {
    match from.read_exact(buffer) {
        Ok(()) => Ok(true),
        Err(error) if error.kind() == ErrorKind::UnexpectedEof => Ok(false),
        Err(error) => Err(error),
    }
}

//! The pieces of a journal's file.

use std::io::{self, ErrorKind, Read, Write};

use schemas::limits::MAP_BYTES_MAX;

/// "CWJL" and the version of the layout.
pub(super) const HEAD: [u8; 8] = *b"CWJL\x02\0\0\0";
/// Kind, length, digest.
pub(super) const CHUNK_HEAD_BYTES: u64 = 1 + 4 + 8;
/// Most bytes of a chunk, also when it is unpacked.
const CHUNK_BYTES_MAX: usize = MAP_BYTES_MAX;

/// What a chunk holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    /// Name of the map.
    MapName = 1,
    /// OpenDRIVE, packed.
    MapText,
    /// The world when the journal began: its moment, and the snapshot, packed.
    Snapshot,
    /// Commands, as the request to run them.
    Commands,
    /// A tick: the wanted length in seconds, NaN for the world's own, its moment, and the frame
    /// after it, packed.
    Tick,
    /// Nothing more was recorded: the journal was ended, or full. Tells where the index is.
    End,
    /// The world in between, like a snapshot.
    Keyframe,
    /// Where keyframes and ticks are.
    Index,
}

impl Kind {
    fn of(byte: u8) -> Option<Self> {
        let all = [
            Self::MapName,
            Self::MapText,
            Self::Snapshot,
            Self::Commands,
            Self::Tick,
            Self::End,
            Self::Keyframe,
            Self::Index,
        ];
        all.into_iter().find(|kind| *kind as u8 == byte)
    }
}

/// The head of a chunk.
#[derive(Clone, Copy, Debug)]
pub(super) struct ChunkHead {
    pub(super) kind: Kind,
    pub(super) length: u32,
    digest: [u8; 8],
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

/// The head of the next chunk; `None` at the end of the file.
///
/// # Errors
/// `InvalidData` for a damaged one.
pub(super) fn read_head(from: &mut dyn Read) -> io::Result<Option<ChunkHead>> {
    let mut head = [0; CHUNK_HEAD_BYTES as usize];
    if !fill(from, &mut head)? {
        return Ok(None);
    }
    let [kind, l0, l1, l2, l3, digest @ ..] = head;
    let kind = Kind::of(kind).ok_or_else(|| damaged("a chunk of an unknown kind"))?;
    let length = u32::from_le_bytes([l0, l1, l2, l3]);
    if length as usize > CHUNK_BYTES_MAX {
        return Err(damaged("a chunk is too long"));
    }
    Ok(Some(ChunkHead { kind, length, digest }))
}

/// The next chunk; `None` at the end of the file and for a chunk that is cut off.
///
/// # Errors
/// `InvalidData` for a damaged one.
pub(super) fn read(from: &mut dyn Read) -> io::Result<Option<(Kind, Vec<u8>)>> {
    let Some(head) = read_head(from)? else { return Ok(None) };
    let mut content = Vec::new();
    from.take(head.length.into()).read_to_end(&mut content)?;
    if content.len() < head.length as usize {
        return Ok(None);
    }
    if digest(&[&content]) != head.digest {
        return Err(damaged("a chunk does not fit its digest"));
    }
    Ok(Some((head.kind, content)))
}

/// Packed bytes, with their length before them.
pub(super) fn pack(bytes: &[u8]) -> Vec<u8> {
    lz4_flex::compress_prepend_size(bytes)
}

/// The inverse of [`pack`].
///
/// # Errors
/// `InvalidData` for bytes that it cannot have made.
pub(super) fn unpack(packed: &[u8]) -> io::Result<Vec<u8>> {
    let length = packed.first_chunk::<4>().map_or(u32::MAX, |length| u32::from_le_bytes(*length));
    if length as usize > CHUNK_BYTES_MAX {
        return Err(damaged("what a chunk holds is too long"));
    }
    lz4_flex::decompress_size_prepended(packed)
        .map_err(|_| damaged("what a chunk holds cannot be unpacked"))
}

/// Whether there was enough.
pub(super) fn fill(from: &mut dyn Read, buffer: &mut [u8]) -> io::Result<bool> {
    match from.read_exact(buffer) {
        Ok(()) => Ok(true),
        Err(error) if error.kind() == ErrorKind::UnexpectedEof => Ok(false),
        Err(error) => Err(error),
    }
}

pub(super) fn damaged(why: &str) -> io::Error {
    io::Error::new(ErrorKind::InvalidData, why.to_owned())
}

/// Reads the magic of a file.
///
/// # Errors
/// `InvalidData` for a file that is no journal, or one of another version.
pub(super) fn read_magic(from: &mut dyn Read) -> io::Result<()> {
    let mut head = [0; HEAD.len()];
    let is_whole = fill(from, &mut head)?;
    if is_whole && head == HEAD {
        return Ok(());
    }
    if is_whole && head[..4] == HEAD[..4] {
        let found = u32::from_le_bytes([head[4], head[5], head[6], head[7]]);
        let why = format!("wanted a journal of version {}, found one of {found}", HEAD[4]);
        return Err(damaged(&why));
    }
    Err(damaged("it does not begin as a journal"))
}

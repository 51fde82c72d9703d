//! The head of a log.

use std::io::{self, Read};

use crate::bytes::Field;

/// What every log says of itself.
const MAGIC: &str = "CARLA_RECORDER";

/// The head of a log.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Header {
    /// 2 for CARLA 0.9.16, 1 before.
    pub version: u16,
    /// Seconds since 1970, UTC.
    pub date: i64,
    /// Short name of the map.
    pub map: String,
}

/// Why a file is no log.
#[derive(Debug, thiserror::Error)]
pub enum NotARecording {
    /// It begins otherwise, or ends within the head.
    #[error("wanted a recording of CARLA, which has {MAGIC} at its third byte")]
    Foreign,
    /// It cannot be read.
    #[error("the file cannot be read")]
    Io(#[from] io::Error),
}

impl Header {
    /// What CARLA 0.9.16 writes.
    pub const VERSION: u16 = 2;

    pub(crate) fn put(&self, out: &mut Vec<u8>) {
        self.version.put(out);
        MAGIC.to_owned().put(out);
        self.date.put(out);
        self.map.put(out);
    }

    /// The head and how many bytes it takes.
    pub(crate) fn read(source: &mut impl Read) -> Result<(Self, u64), NotARecording> {
        let mut bytes = 0;
        let version = u16::from_le_bytes(array(source, &mut bytes)?);
        if text(source, &mut bytes, MAGIC.len())? != MAGIC {
            return Err(NotARecording::Foreign);
        }
        let date = i64::from_le_bytes(array(source, &mut bytes)?);
        let map = text(source, &mut bytes, usize::from(u16::MAX))?;
        Ok((Self { version, date, map }, bytes))
    }
}

fn array<const N: usize>(
    source: &mut impl Read,
    bytes: &mut u64,
) -> Result<[u8; N], NotARecording> {
    let mut array = [0; N];
    fill(source, &mut array, bytes)?;
    Ok(array)
}

fn text(source: &mut impl Read, bytes: &mut u64, max: usize) -> Result<String, NotARecording> {
    let length = usize::from(u16::from_le_bytes(array(source, bytes)?));
    if length > max {
        return Err(NotARecording::Foreign);
    }
    let mut text = vec![0; length];
    fill(source, &mut text, bytes)?;
    Ok(String::from_utf8_lossy(&text).into_owned())
}

fn fill(source: &mut impl Read, buffer: &mut [u8], bytes: &mut u64) -> Result<(), NotARecording> {
    *bytes += buffer.len() as u64;
    source.read_exact(buffer).map_err(|error| match error.kind() {
        io::ErrorKind::UnexpectedEof => NotARecording::Foreign,
        _ => NotARecording::Io(error),
    })
}

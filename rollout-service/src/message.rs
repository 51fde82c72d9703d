//! What is said over the socket: JSON behind its length, and descriptors beside the first answer.

use std::io::{self, IoSlice, Read, Write};
use std::mem::MaybeUninit;
use std::os::fd::BorrowedFd;
use std::os::unix::net::UnixStream;

use rollouts::{Block, Column, Spec};
use rustix::net::{SendAncillaryBuffer, SendAncillaryMessage, SendFlags};
use schemas::{Error, ErrorCode};
use serde::{Deserialize, Serialize};

use crate::block::Layout;
use crate::limits::MESSAGE_BYTES_MAX;

/// What a client asks for.
#[derive(Debug, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub(crate) enum Request {
    /// The batch, once.
    Open {
        #[serde(default)]
        spec: Box<Spec>,
        /// Copies of all arrays.
        slots: usize,
        /// `None`: one for each 64 worlds, as far as there are cores.
        threads: Option<usize>,
    },
    /// Worlds begin anew: those of the mask, or all; with seeds or with their next episodes.
    Reset { seeds: Option<Vec<Option<u64>>>, mask: Option<Vec<bool>> },
    /// Keeps worlds as they are.
    Snapshot { worlds: Vec<usize> },
    /// Tells worlds as frames, for whoever has them drawn.
    Frames { worlds: Vec<usize> },
    /// Lets worlds go on from snapshots.
    Restore {
        snapshots: Vec<u64>,
        worlds: Vec<usize>,
        /// Whether their later episodes are their own.
        reseed: bool,
    },
    /// Lets worlds go on from another one.
    Fork { world: usize, into: Vec<usize>, reseed: bool },
    /// Gives snapshots up.
    Forget { snapshots: Vec<u64> },
}

/// What a client hears.
#[derive(Debug, Serialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum Reply {
    /// The block's layout and what is in it; the block and two events come with it.
    Opened(Box<Opened>),
    /// The slot that was written.
    Done { slot: usize },
    /// Names of the snapshots, in the order of the worlds.
    Snapshots { snapshots: Vec<u64> },
    /// Sizes of the frames, which follow one behind the other, and the actors that agents drive.
    Frames {
        bytes: Vec<usize>,
        cars: Vec<Vec<u32>>,
        #[serde(skip)]
        frames: Vec<Vec<u8>>,
    },
    /// Nothing has changed.
    Refused { message: String, wanted: String, found: String },
}

/// Reads a request.
///
/// # Errors
/// `InvalidMessage` with the setting that cannot be read.
pub(crate) fn read(text: &[u8]) -> Result<Request, Error> {
    let mut text = serde_json::Deserializer::from_slice(text);
    serde_path_to_error::deserialize(&mut text).map_err(|error| {
        Error::new(ErrorCode::InvalidMessage, format!("the request cannot be read: {error}"))
    })
}

/// All that a client needs to know of its batch.
#[derive(Debug, Serialize)]
pub(crate) struct Opened {
    pub layout: Layout,
    pub spec: Spec,
    pub columns: Vec<Column>,
    pub blocks: Vec<Block>,
    pub episode_columns: Vec<&'static str>,
    pub threads: usize,
    /// Seconds of a step.
    pub step_secs: f64,
    /// Length of the shortest way of each pair of a start and a goal, in metres.
    pub ways_m: Vec<f32>,
    /// Where status, length and text of a refused step, and the number of the last step lie.
    pub header: [usize; 4],
}

impl From<Error> for Reply {
    fn from(error: Error) -> Self {
        Self::Refused { message: error.message, wanted: error.wanted, found: error.found }
    }
}

/// The next request; `None` when the client has gone.
///
/// # Errors
/// When the socket fails, or a message is too long to be one.
pub(crate) fn receive(mut socket: &UnixStream) -> io::Result<Option<Vec<u8>>> {
    let mut length = [0; 4];
    match socket.read_exact(&mut length) {
        Ok(()) => {}
        Err(error) if is_gone(&error) => return Ok(None),
        Err(error) => return Err(error),
    }
    let length = u32::from_le_bytes(length) as usize;
    if length > MESSAGE_BYTES_MAX {
        let text = format!("wanted at most {MESSAGE_BYTES_MAX} bytes a message, found {length}");
        return Err(io::Error::new(io::ErrorKind::InvalidData, text));
    }
    let mut text = vec![0; length];
    match socket.read_exact(&mut text) {
        Ok(()) => Ok(Some(text)),
        Err(error) if is_gone(&error) => Ok(None),
        Err(error) => Err(error),
    }
}

fn is_gone(error: &io::Error) -> bool {
    matches!(error.kind(), io::ErrorKind::UnexpectedEof | io::ErrorKind::ConnectionReset)
}

/// # Errors
/// When the socket fails.
pub(crate) fn send(
    mut socket: &UnixStream,
    reply: &Reply,
    descriptors: &[BorrowedFd<'_>],
) -> io::Result<()> {
    let text = serde_json::to_vec(reply).map_err(io::Error::other)?;
    let length = u32::try_from(text.len()).map_err(io::Error::other)?.to_le_bytes();
    let mut space = [MaybeUninit::uninit(); rustix::cmsg_space!(ScmRights(3))];
    let mut beside = SendAncillaryBuffer::new(&mut space);
    if !descriptors.is_empty() && !beside.push(SendAncillaryMessage::ScmRights(descriptors)) {
        return Err(io::Error::other("too many descriptors for one message"));
    }
    // Descriptors go with the length; the text follows.
    let parts = [IoSlice::new(&length)];
    let sent = rustix::net::sendmsg(socket, &parts, &mut beside, SendFlags::NOSIGNAL)?;
    if sent < length.len() {
        socket.write_all(&length[sent..])?;
    }
    socket.write_all(&text)?;
    let frames = if let Reply::Frames { frames, .. } = reply { frames.as_slice() } else { &[] };
    frames.iter().try_for_each(|frame| socket.write_all(frame))
}

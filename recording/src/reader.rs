//! Reading a log frame by frame.

use std::fmt::Display;
use std::io::{self, Read, Seek, SeekFrom};

use crate::bytes::{Field, Layout, Malformed};
use crate::dialect::{self, Dialect};
use crate::header::{Header, NotARecording};
use crate::packet::{Kind, Packet};
use crate::record::FrameStart;

/// Largest frame that is read.
pub const FRAME_BYTES_MAX: usize = 64 * 1024 * 1024;
/// Bytes of the id and the size of a packet.
const HEAD_BYTES: u64 = 5;

/// Why a log ends before its file does.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the recording ends at byte {offset}: {why}")]
pub struct Cut {
    /// Where the last whole frame ends, or the packet lies that is damaged.
    pub offset: u64,
    /// What comes there.
    pub why: String,
}

/// The frames of a log, one after the other; those of a log that is cut or damaged, up to there.
///
/// **Cost:** memory of one frame.
pub struct Reader<R> {
    source: R,
    header: Header,
    dialect: Dialect,
    /// Where the next frame begins.
    offset: u64,
    bytes: Vec<u8>,
    packets: Vec<Place>,
    cut: Option<Cut>,
}

/// Where the body of a packet lies in the bytes of its frame.
struct Place {
    kind: Kind,
    begin: usize,
    end: usize,
}

/// One frame of a log.
pub struct Frame<'a> {
    /// Its number and times.
    pub start: FrameStart,
    /// Where it begins in the log.
    pub offset: u64,
    layout: Layout,
    bytes: &'a [u8],
    packets: &'a [Place],
}

/// A packet that is not decoded yet.
#[derive(Clone, Copy)]
pub struct RawPacket<'a> {
    /// What it is about.
    pub kind: Kind,
    /// Its bytes, without id and size.
    pub body: &'a [u8],
    /// Where it begins in the log.
    pub offset: u64,
    layout: Layout,
}

/// Why a packet is not what it promises.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub(crate) enum Damage {
    #[error(transparent)]
    Short(#[from] Malformed),
    #[error("wanted the packet to end with its last record, found {0} bytes more")]
    Long(usize),
}

impl<R: Read> Reader<R> {
    /// Reads the head of a log. `source` is read in small pieces: have it buffered.
    ///
    /// # Errors
    /// [`NotARecording`], also for a file that ends within the head.
    pub fn open(mut source: R) -> Result<Self, NotARecording> {
        let (header, offset) = Header::read(&mut source)?;
        let dialect = Dialect::of_version(header.version);
        let (bytes, packets) = (Vec::new(), Vec::new());
        Ok(Self { source, header, dialect, offset, bytes, packets, cut: None })
    }

    /// The head of the log.
    pub fn header(&self) -> &Header {
        &self.header
    }

    /// Set when the log ended within a frame.
    pub fn cut(&self) -> Option<&Cut> {
        self.cut.as_ref()
    }

    /// The frame that follows, `None` at the end.
    ///
    /// # Errors
    /// Those of the source.
    pub fn next_frame(&mut self) -> io::Result<Option<Frame<'_>>> {
        if self.cut.is_some() {
            return Ok(None);
        }
        self.bytes.clear();
        self.packets.clear();
        match self.fetch()? {
            Fetched::Frame(start) => {
                let offset = self.offset;
                self.offset += self.bytes.len() as u64 + HEAD_BYTES * self.packets.len() as u64;
                let layout = self.dialect.layout();
                let (bytes, packets) = (&self.bytes[..], &self.packets[..]);
                Ok(Some(Frame { start, offset, layout, bytes, packets }))
            }
            Fetched::End => Ok(None),
            Fetched::Cut(why) => {
                self.end_here(why);
                Ok(None)
            }
        }
    }

    /// Ends the log at the present place; for those who find a packet that says nothing sensible.
    pub(crate) fn end_at(&mut self, offset: u64, why: &impl Display) {
        self.offset = offset;
        self.end_here(why.to_string());
    }

    fn end_here(&mut self, why: String) {
        self.cut = Some(Cut { offset: self.offset, why });
    }

    /// Reads packets up to the end of a frame.
    fn fetch(&mut self) -> io::Result<Fetched> {
        let mut start = None;
        let mut is_before_positions = true;
        loop {
            let mut head = [0; HEAD_BYTES as usize];
            match read_up_to(&mut self.source, &mut head)? {
                0 if self.packets.is_empty() => return Ok(Fetched::End),
                HEAD => {}
                _ => return Ok(Fetched::cut("the file ends within a frame")),
            }
            let [id, size @ ..] = head;
            let size = u32::from_le_bytes(size) as usize;
            let begin = self.bytes.len();
            if size > FRAME_BYTES_MAX - begin {
                let why = format!("wanted frames of at most {FRAME_BYTES_MAX} bytes, found more");
                return Ok(Fetched::Cut(why));
            }
            // Grows as bytes come: a size that is not there takes no memory.
            (&mut self.source).take(size as u64).read_to_end(&mut self.bytes)?;
            let end = self.bytes.len();
            if end - begin < size {
                return Ok(Fetched::cut("the file ends within a packet"));
            }
            let kind = self.dialect.kind(id, is_before_positions);
            self.packets.push(Place { kind, begin, end });
            let body = &self.bytes[begin..end];
            self.dialect.note(kind, body);
            match (kind, &start) {
                (Kind::FrameStart, None) => match start_of(body) {
                    Ok(found) => start = Some(found),
                    Err(malformed) => return Ok(Fetched::Cut(malformed.to_string())),
                },
                (Kind::FrameStart, Some(_)) => {
                    return Ok(Fetched::cut("a frame begins within another"));
                }
                (Kind::FrameEnd, _) => {
                    let why = "a frame ends that did not begin";
                    return Ok(start.map_or_else(|| Fetched::cut(why), Fetched::Frame));
                }
                (Kind::Positions, _) => is_before_positions = false,
                _ => {}
            }
            if self.packets.len() > PACKETS_MAX {
                return Ok(Fetched::cut("a frame of too many packets"));
            }
        }
    }
}

impl<R: Read + Seek> Reader<R> {
    /// Goes on with the frame at this place of the log.
    ///
    /// # Errors
    /// Those of the source.
    pub fn go_to(&mut self, offset: u64) -> io::Result<()> {
        self.source.seek(SeekFrom::Start(offset))?;
        self.offset = offset;
        self.cut = None;
        Ok(())
    }
}

/// Bytes of a whole head.
const HEAD: usize = HEAD_BYTES as usize;
/// Packets of one frame at most; CARLA writes one of each kind.
const PACKETS_MAX: usize = 4_096;

enum Fetched {
    Frame(FrameStart),
    End,
    Cut(String),
}

impl Fetched {
    fn cut(why: &str) -> Self {
        Self::Cut(why.to_owned())
    }
}

fn start_of(body: &[u8]) -> Result<FrameStart, Malformed> {
    FrameStart::take(&mut crate::bytes::Cursor::new(body, Layout::default()))
}

/// Like `read_exact`, but tells how far it came.
fn read_up_to(source: &mut impl Read, buffer: &mut [u8]) -> io::Result<usize> {
    let mut filled = 0;
    while filled < buffer.len() {
        match source.read(&mut buffer[filled..]) {
            Ok(0) => break,
            Ok(count) => filled += count,
            Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
            Err(error) => return Err(error),
        }
    }
    Ok(filled)
}

impl<'a> Frame<'a> {
    /// Its packets, in the order of the log.
    pub fn packets(&self) -> impl Iterator<Item = RawPacket<'a>> + use<'a> {
        let (bytes, layout, first) = (self.bytes, self.layout, self.offset);
        (0..).zip(self.packets).map(move |(before, place)| RawPacket {
            kind: place.kind,
            body: &bytes[place.begin..place.end],
            offset: first + HEAD_BYTES * before + place.begin as u64,
            layout,
        })
    }
}

impl RawPacket<'_> {
    /// What it says.
    ///
    /// # Errors
    /// It is shorter than its records.
    pub fn decode(&self) -> Result<Packet, Malformed> {
        dialect::decode(self.kind, self.body, self.layout).map(|(packet, _)| packet)
    }

    /// Whether its records take all of it.
    pub(crate) fn check(&self) -> Result<(), Damage> {
        match dialect::decode(self.kind, self.body, self.layout)? {
            (_, 0) => Ok(()),
            (_, left) => Err(Damage::Long(left)),
        }
    }
}

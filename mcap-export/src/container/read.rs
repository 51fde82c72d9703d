//! Reading a file from its beginning, one record after the other.

use std::collections::BTreeMap;
use std::io::{self, Cursor, ErrorKind, Read};

use lz4_flex::frame::FrameDecoder;

use super::record::Opcode;
use super::{COMPRESSION, MAGIC};

/// Bytes of a record at most, also unpacked: far more than the largest map.
const RECORD_BYTES_MAX: u64 = 256 * 1024 * 1024;

/// Why a file is not read on.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ReadError {
    /// What the system says.
    #[error("it cannot be read: {0}")]
    Io(#[from] io::Error),
    /// Something that is not as the format has it, or damaged.
    #[error("it is damaged: {0}")]
    Damaged(&'static str),
    /// What other programs write, and this one does not read.
    #[error("wanted chunks without compression or with lz4, found {0:?}")]
    Compression(String),
}

/// What a file holds.
#[derive(Clone, Debug, PartialEq)]
pub enum Item {
    /// A file in the file.
    Attachment {
        /// What it is called.
        name: String,
        /// What it holds.
        data: Vec<u8>,
    },
    /// What is said of the whole.
    Metadata {
        /// What it is called.
        name: String,
        /// By name.
        told: BTreeMap<String, String>,
    },
    /// A message.
    Message {
        /// On which it was told.
        topic: String,
        /// As its topic encodes it.
        data: Vec<u8>,
    },
}

/// A file that is being read; memory is bounded by a chunk.
pub struct Reader<R> {
    source: R,
    /// Of channels, by their numbers.
    topics: BTreeMap<u16, String>,
    chunk: Cursor<Vec<u8>>,
}

impl<R: Read> Reader<R> {
    /// Of a file at its beginning.
    ///
    /// # Errors
    /// A file of another format.
    pub fn open(mut source: R) -> Result<Self, ReadError> {
        let mut magic = [0; MAGIC.len()];
        match source.read_exact(&mut magic) {
            Ok(()) if magic == MAGIC => {}
            Err(error) if error.kind() != ErrorKind::UnexpectedEof => return Err(error.into()),
            _ => return Err(ReadError::Damaged("it does not begin as an MCAP file")),
        }
        Ok(Self { source, topics: BTreeMap::new(), chunk: Cursor::default() })
    }

    /// Those that were told so far.
    pub fn topics(&self) -> impl Iterator<Item = &str> {
        self.topics.values().map(String::as_str)
    }

    /// The next of what it holds; `None` at the end of the data.
    ///
    /// # Errors
    /// [`ReadError`].
    pub fn next_item(&mut self) -> Result<Option<Item>, ReadError> {
        loop {
            let is_in_chunk = self.chunk.position() < self.chunk.get_ref().len() as u64;
            let (kind, body) =
                if is_in_chunk { record(&mut self.chunk)? } else { record(&mut self.source)? };
            let mut fields = Fields(&body);
            match kind {
                kind if kind == Opcode::DataEnd as u8 || kind == Opcode::Footer as u8 => {
                    return Ok(None);
                }
                kind if kind == Opcode::Channel as u8 => {
                    let id = fields.u16()?;
                    fields.u16()?;
                    self.topics.insert(id, fields.text()?);
                }
                kind if kind == Opcode::Chunk as u8 && !is_in_chunk => {
                    self.chunk = Cursor::new(unpacked(fields)?);
                }
                kind if kind == Opcode::Message as u8 => {
                    let topic = self.topics.get(&fields.u16()?);
                    let topic = topic.ok_or(ReadError::Damaged("a message of no channel"))?.clone();
                    fields.take(4 + 8 + 8)?;
                    return Ok(Some(Item::Message { topic, data: fields.0.to_vec() }));
                }
                kind if kind == Opcode::Attachment as u8 => return attachment(fields).map(Some),
                kind if kind == Opcode::Metadata as u8 => return metadata(fields).map(Some),
                _ => {}
            }
        }
    }
}

/// The next record: its kind and its content.
fn record(source: &mut impl Read) -> Result<(u8, Vec<u8>), ReadError> {
    const CUT: ReadError = ReadError::Damaged("it ends too early: it was not written to its end");
    let mut head = [0; 9];
    match source.read_exact(&mut head) {
        Ok(()) => {}
        Err(error) if error.kind() == ErrorKind::UnexpectedEof => return Err(CUT),
        Err(error) => return Err(error.into()),
    }
    let [kind, length @ ..] = head;
    let length = u64::from_le_bytes(length);
    if length > RECORD_BYTES_MAX {
        return Err(ReadError::Damaged("a record is too long"));
    }
    let mut body = Vec::new();
    source.take(length).read_to_end(&mut body)?;
    if (body.len() as u64) < length { Err(CUT) } else { Ok((kind, body)) }
}

fn unpacked(mut fields: Fields<'_>) -> Result<Vec<u8>, ReadError> {
    fields.take(8 + 8)?;
    let (size, sum) = (fields.u64()?, fields.u32()?);
    let compression = fields.text()?;
    let packed_bytes = fields.u64()?;
    let packed = fields.take(packed_bytes)?;
    if size > RECORD_BYTES_MAX {
        return Err(ReadError::Damaged("a chunk is too long"));
    }
    let mut records = Vec::new();
    match compression.as_str() {
        "" => records.extend_from_slice(packed),
        COMPRESSION => {
            // One byte more shows what is longer than it says.
            let read = FrameDecoder::new(packed).take(size + 1).read_to_end(&mut records);
            read.map_err(|_| ReadError::Damaged("a chunk cannot be unpacked"))?;
        }
        _ => return Err(ReadError::Compression(compression)),
    }
    let is_whole = records.len() as u64 == size && (sum == 0 || crc32fast::hash(&records) == sum);
    if is_whole { Ok(records) } else { Err(ReadError::Damaged("a chunk does not fit its sum")) }
}

fn attachment(mut fields: Fields<'_>) -> Result<Item, ReadError> {
    let all = fields.0;
    fields.take(8 + 8)?;
    let name = fields.text()?;
    fields.text()?;
    let bytes = fields.u64()?;
    let data = fields.take(bytes)?.to_vec();
    let sum = fields.u32()?;
    if sum != 0 && crc32fast::hash(&all[..all.len() - 4]) != sum {
        return Err(ReadError::Damaged("an attachment does not fit its sum"));
    }
    Ok(Item::Attachment { name, data })
}

fn metadata(mut fields: Fields<'_>) -> Result<Item, ReadError> {
    let name = fields.text()?;
    let bytes = fields.u32()?;
    let mut pairs = Fields(fields.take(bytes.into())?);
    let mut told = BTreeMap::new();
    while !pairs.0.is_empty() {
        let key = pairs.text()?;
        told.insert(key, pairs.text()?);
    }
    Ok(Item::Metadata { name, told })
}

/// What is left of the fields of a record.
struct Fields<'a>(&'a [u8]);

impl<'a> Fields<'a> {
    fn take(&mut self, bytes: u64) -> Result<&'a [u8], ReadError> {
        let split = usize::try_from(bytes).ok().and_then(|bytes| self.0.split_at_checked(bytes));
        let (taken, rest) = split.ok_or(ReadError::Damaged("a record is too short"))?;
        self.0 = rest;
        Ok(taken)
    }

    fn array<const N: usize>(&mut self) -> Result<[u8; N], ReadError> {
        let mut array = [0; N];
        array.copy_from_slice(self.take(N as u64)?);
        Ok(array)
    }

    fn u16(&mut self) -> Result<u16, ReadError> {
        self.array().map(u16::from_le_bytes)
    }

    fn u32(&mut self) -> Result<u32, ReadError> {
        self.array().map(u32::from_le_bytes)
    }

    fn u64(&mut self) -> Result<u64, ReadError> {
        self.array().map(u64::from_le_bytes)
    }

    fn text(&mut self) -> Result<String, ReadError> {
        let bytes = self.u32()?;
        let text = self.take(bytes.into())?.to_vec();
        String::from_utf8(text).map_err(|_| ReadError::Damaged("a text that is no UTF-8"))
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Schema, Writer};
    use super::*;

    const SCHEMA: Schema<'_> = Schema { name: "a.Kind", encoding: "jsonschema", data: b"{}" };

    fn file() -> Vec<u8> {
        let mut writer = Writer::begin(Vec::new(), "test").unwrap();
        let channel = writer.channel("/a", "json", &SCHEMA).unwrap();
        writer.attach("a.xodr", "application/xml", b"<map/>").unwrap();
        writer.metadata("about", &[("map", "Town01".to_owned())]).unwrap();
        for count in 0..50u8 {
            writer.message(channel, count.into(), &[count; 20]).unwrap();
        }
        writer.finish().unwrap()
    }

    fn items(file: &[u8]) -> Result<Vec<Item>, ReadError> {
        let mut reader = Reader::open(file)?;
        let mut items = Vec::new();
        while let Some(item) = reader.next_item()? {
            items.push(item);
        }
        assert_eq!(reader.topics().collect::<Vec<_>>(), ["/a"]);
        Ok(items)
    }

    #[test]
    fn what_was_written_is_read() {
        let items = items(&file()).unwrap();
        let (name, data) = ("a.xodr".to_owned(), b"<map/>".to_vec());
        assert_eq!(items[0], Item::Attachment { name, data });
        let told = BTreeMap::from([("map".to_owned(), "Town01".to_owned())]);
        assert_eq!(items[1], Item::Metadata { name: "about".to_owned(), told });
        assert_eq!(items.len(), 52);
        assert_eq!(items[51], Item::Message { topic: "/a".to_owned(), data: vec![49; 20] });
    }

    #[test]
    fn what_is_cut_foreign_or_damaged_is_an_error_and_never_a_panic() {
        let file = file();
        assert!(Reader::open(&b"CWJL\x02\0\0\0\0\0\0\0"[..]).is_err());
        let data_end = file.len() / 2;
        for length in 0..data_end {
            let cut = items(&file[..length]);
            assert!(cut.is_err(), "{length}");
        }
        for at in 8..file.len() {
            for bit in [0, 7] {
                let mut flipped = file.clone();
                flipped[at] ^= 1 << bit;
                let _ = Reader::open(&flipped[..])
                    .map(|mut reader| while let Ok(Some(_)) = reader.next_item() {});
            }
        }
    }
}

//! The MCAP container, version 0: chunks of messages, their indices and a summary.
//!
//! **Source:** the specification of the format, <https://mcap.dev/spec>.

mod read;
mod record;

use std::collections::BTreeMap;
use std::io::{self, Write};

use lz4_flex::frame::FrameEncoder;

pub use read::{Item, ReadError, Reader};
use record::{Body, Opcode, put};

const MAGIC: [u8; 8] = [0x89, b'M', b'C', b'A', b'P', 0x30, b'\r', b'\n'];
/// Bytes of a chunk before it is compressed.
const CHUNK_BYTES: usize = 4 * 1024 * 1024;
/// How chunks are compressed.
const COMPRESSION: &str = "lz4";

/// One kind of message.
#[derive(Clone, Debug)]
pub(crate) struct Schema<'a> {
    pub(crate) name: &'a str,
    /// `jsonschema` or `flatbuffer`.
    pub(crate) encoding: &'a str,
    pub(crate) data: &'a [u8],
}

/// A topic of one file.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct ChannelId(u16);

/// A file that is being written.
pub(crate) struct Writer<W> {
    sink: W,
    offset: u64,
    /// Schemas and channels, for the summary.
    described: Vec<(Opcode, Vec<u8>)>,
    channels: u16,
    schemas: u16,
    chunk: Chunk,
    chunk_indices: Vec<Vec<u8>>,
    attachment_indices: Vec<Vec<u8>>,
    metadata_indices: Vec<Vec<u8>>,
    message_counts: BTreeMap<ChannelId, u64>,
    times: Option<(u64, u64)>,
}

/// Messages that are not written yet.
#[derive(Default)]
struct Chunk {
    records: Vec<u8>,
    /// Times and offsets of the messages of each channel.
    messages: BTreeMap<ChannelId, Vec<(u64, u64)>>,
    times: Option<(u64, u64)>,
}

impl<W: Write> Writer<W> {
    pub(crate) fn begin(sink: W, library: &str) -> io::Result<Self> {
        let mut writer = Self {
            sink,
            offset: 0,
            described: Vec::new(),
            channels: 0,
            schemas: 0,
            chunk: Chunk::default(),
            chunk_indices: Vec::new(),
            attachment_indices: Vec::new(),
            metadata_indices: Vec::new(),
            message_counts: BTreeMap::new(),
            times: None,
        };
        writer.raw(&MAGIC)?;
        writer.record(Opcode::Header, &Body::default().text("").text(library).0)?;
        Ok(writer)
    }

    /// A topic with its own schema; its messages are encoded as `encoding` says.
    pub(crate) fn channel(
        &mut self,
        topic: &str,
        encoding: &str,
        schema: &Schema<'_>,
    ) -> io::Result<ChannelId> {
        self.schemas += 1;
        let body = Body::default().u16(self.schemas).text(schema.name).text(schema.encoding);
        self.describe(Opcode::Schema, body.bytes(schema.data).0)?;
        self.channels += 1;
        let id = ChannelId(self.channels);
        let body = Body::default().u16(id.0).u16(self.schemas).text(topic).text(encoding);
        self.describe(Opcode::Channel, body.u32(0).0)?;
        Ok(id)
    }

    /// Appends a message; `now` in nanoseconds.
    pub(crate) fn message(&mut self, channel: ChannelId, now: u64, data: &[u8]) -> io::Result<()> {
        let count = self.message_counts.entry(channel).or_default();
        let body = Body::default().u16(channel.0).u32(*count as u32).u64(now).u64(now);
        *count += 1;
        let chunk = &mut self.chunk;
        let offset = chunk.records.len() as u64;
        chunk.messages.entry(channel).or_default().push((now, offset));
        put(&mut chunk.records, Opcode::Message, &[&body.0, data]);
        for times in [&mut chunk.times, &mut self.times] {
            let (first, last) = times.unwrap_or((now, now));
            *times = Some((first.min(now), last.max(now)));
        }
        if chunk.records.len() >= CHUNK_BYTES { self.end_chunk() } else { Ok(()) }
    }

    pub(crate) fn attach(&mut self, name: &str, media: &str, data: &[u8]) -> io::Result<()> {
        self.end_chunk()?;
        let (offset, size) = (self.offset, data.len() as u64);
        let body = Body::default().u64(0).u64(0).text(name).text(media).u64(size);
        let mut body = body.0;
        body.extend_from_slice(data);
        let crc = crc32fast::hash(&body);
        body.extend_from_slice(&crc.to_le_bytes());
        self.record(Opcode::Attachment, &body)?;
        let index = Body::default().u64(offset).u64(self.offset - offset).u64(0).u64(0).u64(size);
        self.attachment_indices.push(index.text(name).text(media).0);
        Ok(())
    }

    pub(crate) fn metadata(&mut self, name: &str, told: &[(&str, String)]) -> io::Result<()> {
        self.end_chunk()?;
        let offset = self.offset;
        let pairs =
            told.iter().fold(Body::default(), |body, (key, value)| body.text(key).text(value));
        self.record(Opcode::Metadata, &Body::default().text(name).bytes(&pairs.0).0)?;
        let index = Body::default().u64(offset).u64(self.offset - offset).text(name);
        self.metadata_indices.push(index.0);
        Ok(())
    }

    /// Writes what is left, the summary and the end.
    pub(crate) fn finish(mut self) -> io::Result<W> {
        self.end_chunk()?;
        self.record(Opcode::DataEnd, &Body::default().u32(0).0)?;
        let summary_start = self.offset;
        let statistics = self.statistics();
        let described = std::mem::take(&mut self.described);
        let of = |wanted: u8| {
            let of_kind = described.iter().filter(move |(kind, _)| *kind as u8 == wanted);
            of_kind.map(|(_, body)| body.clone()).collect::<Vec<_>>()
        };
        let groups = [
            (Opcode::Schema, of(Opcode::Schema as u8)),
            (Opcode::Channel, of(Opcode::Channel as u8)),
            (Opcode::Statistics, vec![statistics]),
            (Opcode::ChunkIndex, std::mem::take(&mut self.chunk_indices)),
            (Opcode::AttachmentIndex, std::mem::take(&mut self.attachment_indices)),
            (Opcode::MetadataIndex, std::mem::take(&mut self.metadata_indices)),
        ];
        let mut offsets = Vec::new();
        for (kind, bodies) in groups.into_iter().filter(|(_, bodies)| !bodies.is_empty()) {
            let start = self.offset;
            bodies.iter().try_for_each(|body| self.record(kind, body))?;
            let group = Body::default().u8(kind as u8).u64(start).u64(self.offset - start);
            offsets.push(group.0);
        }
        let offsets_start = self.offset;
        offsets.iter().try_for_each(|body| self.record(Opcode::SummaryOffset, body))?;
        let footer = Body::default().u64(summary_start).u64(offsets_start).u32(0);
        self.record(Opcode::Footer, &footer.0)?;
        self.raw(&MAGIC)?;
        self.sink.flush()?;
        Ok(self.sink)
    }

    fn statistics(&self) -> Vec<u8> {
        let (first, last) = self.times.unwrap_or_default();
        let counts = self.message_counts.iter();
        let counts = counts.fold(Body::default(), |body, (id, count)| body.u16(id.0).u64(*count));
        Body::default()
            .u64(self.message_counts.values().sum())
            .u16(self.schemas)
            .u32(self.channels.into())
            .u32(self.attachment_indices.len() as u32)
            .u32(self.metadata_indices.len() as u32)
            .u32(self.chunk_indices.len() as u32)
            .u64(first)
            .u64(last)
            .bytes(&counts.0)
            .0
    }

    fn describe(&mut self, kind: Opcode, body: Vec<u8>) -> io::Result<()> {
        self.record(kind, &body)?;
        self.described.push((kind, body));
        Ok(())
    }

    fn end_chunk(&mut self) -> io::Result<()> {
        let Chunk { records, messages, times } = std::mem::take(&mut self.chunk);
        let Some((first, last)) = times else { return Ok(()) };
        let mut encoder = FrameEncoder::new(Vec::new());
        encoder.write_all(&records)?;
        let packed = encoder.finish().map_err(io::Error::other)?;
        let size = records.len() as u64;
        let head = Body::default().u64(first).u64(last).u64(size).u32(crc32fast::hash(&records));
        let mut body = head.text(COMPRESSION).u64(packed.len() as u64).0;
        body.extend_from_slice(&packed);
        let start = self.offset;
        self.record(Opcode::Chunk, &body)?;
        let chunk_bytes = self.offset - start;
        let index_start = self.offset;
        let mut indices = Body::default();
        for (channel, places) in messages {
            indices = indices.u16(channel.0).u64(self.offset);
            let places = places.iter();
            let places =
                places.fold(Body::default(), |body, (at, offset)| body.u64(*at).u64(*offset));
            let index = Body::default().u16(channel.0).bytes(&places.0);
            self.record(Opcode::MessageIndex, &index.0)?;
        }
        let index = Body::default().u64(first).u64(last).u64(start).u64(chunk_bytes);
        let index = index.bytes(&indices.0).u64(self.offset - index_start).text(COMPRESSION);
        self.chunk_indices.push(index.u64(packed.len() as u64).u64(size).0);
        Ok(())
    }

    fn record(&mut self, kind: Opcode, body: &[u8]) -> io::Result<()> {
        let mut record = Vec::with_capacity(body.len() + 9);
        put(&mut record, kind, &[body]);
        self.raw(&record)
    }

    fn raw(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.sink.write_all(bytes)?;
        self.offset += bytes.len() as u64;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use std::io::Read;

    use lz4_flex::frame::FrameDecoder;

    use super::*;

    const SCHEMA: Schema<'_> = Schema { name: "a.Kind", encoding: "jsonschema", data: b"{}" };

    /// Opcode, place and body of each record.
    fn records(file: &[u8]) -> Vec<(u8, usize, &[u8])> {
        let mut found = Vec::new();
        let mut at = 0;
        while at < file.len() {
            let length = u64::from_le_bytes(file[at + 1..at + 9].try_into().unwrap()) as usize;
            found.push((file[at], at, &file[at + 9..at + 9 + length]));
            at += 9 + length;
        }
        found
    }

    /// Without the magic at both ends, whose places are those of the file.
    fn inside(file: &[u8]) -> Vec<(u8, usize, &[u8])> {
        assert!(file.starts_with(&MAGIC) && file.ends_with(&MAGIC));
        let found = records(&file[8..file.len() - 8]);
        found.into_iter().map(|(kind, at, body)| (kind, at + 8, body)).collect()
    }

    fn number(body: &[u8], at: usize) -> u64 {
        u64::from_le_bytes(body[at..at + 8].try_into().unwrap())
    }

    fn written(messages: usize, bytes: usize) -> Vec<u8> {
        let mut writer = Writer::begin(Vec::new(), "test").unwrap();
        let channel = writer.channel("/a", "json", &SCHEMA).unwrap();
        for count in 0..messages {
            writer.message(channel, 100 + count as u64, &vec![b'x'; bytes]).unwrap();
        }
        writer.finish().unwrap()
    }

    #[test]
    fn records_come_in_the_order_of_the_format() {
        let file = written(2, 5);
        let kinds: Vec<u8> = inside(&file).iter().map(|(kind, ..)| *kind).collect();
        // Header, schema, channel, chunk, its index, end of the data; schema, channel, statistics
        // and chunk index again, four offsets to them, and the footer.
        assert_eq!(kinds, [1, 3, 4, 6, 7, 15, 3, 4, 11, 8, 14, 14, 14, 14, 2]);
    }

    #[test]
    fn a_chunk_unpacks_to_its_messages_and_its_index_leads_to_them() {
        let file = written(3, 5);
        let all = inside(&file);
        let (_, _, chunk) = all.iter().find(|(kind, ..)| *kind == Opcode::Chunk as u8).unwrap();
        assert_eq!((number(chunk, 0), number(chunk, 8)), (100, 102));
        // Two times, a size, a sum, the name of the compression and the packed size come before.
        let head = 8 + 8 + 8 + 4 + 4 + COMPRESSION.len() + 8;
        let mut unpacked = Vec::new();
        FrameDecoder::new(&chunk[head..]).read_to_end(&mut unpacked).unwrap();
        assert_eq!(unpacked.len() as u64, number(chunk, 16));
        assert_eq!(chunk[24..28], crc32fast::hash(&unpacked).to_le_bytes());
        let messages = records(&unpacked);
        assert!(messages.iter().all(|(kind, _, body)| *kind == 5 && body.ends_with(b"xxxxx")));
        let (_, _, index) = all.iter().find(|(kind, ..)| *kind == 7).unwrap();
        for (count, (_, at, _)) in messages.iter().enumerate() {
            let entry = 2 + 4 + 16 * count;
            let told = (number(index, entry), number(index, entry + 8));
            assert_eq!(told, (100 + count as u64, *at as u64));
        }
    }

    #[test]
    fn the_footer_leads_to_the_summary_and_that_to_every_chunk() {
        let file = written(5, 2 * 1024 * 1024);
        let all = inside(&file);
        let chunks: Vec<usize> =
            all.iter().filter(|(kind, ..)| *kind == 6).map(|(_, at, _)| *at).collect();
        assert!(chunks.len() > 1, "a chunk is full with some messages");
        let told: Vec<usize> = all
            .iter()
            .filter(|(kind, ..)| *kind == Opcode::ChunkIndex as u8)
            .map(|(_, _, body)| number(body, 16) as usize)
            .collect();
        assert_eq!(told, chunks);
        let (_, _, footer) = all.last().unwrap();
        let summary = number(footer, 0) as usize;
        let end = all.iter().find(|(kind, ..)| *kind == Opcode::DataEnd as u8).unwrap();
        assert_eq!(summary, end.1 + 9 + end.2.len());
        let (_, _, statistics) = all.iter().find(|(kind, ..)| *kind == 11).unwrap();
        assert_eq!(number(statistics, 0), 5);
    }

    #[test]
    fn attachments_and_metadata_are_found_through_the_summary() {
        let mut writer = Writer::begin(Vec::new(), "test").unwrap();
        writer.attach("a.xodr", "application/xml", b"<map/>").unwrap();
        writer.metadata("about", &[("map", "Town01".to_owned())]).unwrap();
        let file = writer.finish().unwrap();
        let all = inside(&file);
        for (index, what) in [(Opcode::AttachmentIndex, 9), (Opcode::MetadataIndex, 12)] {
            let (_, _, told) = all.iter().find(|(kind, ..)| *kind == index as u8).unwrap();
            let (_, at, body) = all.iter().find(|(kind, ..)| *kind == what).unwrap();
            assert_eq!(number(told, 0) as usize, *at);
            assert_eq!(number(told, 8) as usize, 9 + body.len());
        }
    }
}

//! Records: a kind, a length and fields, little-endian.

/// Kinds of records.
#[derive(Clone, Copy)]
pub(super) enum Opcode {
    Header = 1,
    Footer,
    Schema,
    Channel,
    Message,
    Chunk,
    MessageIndex,
    ChunkIndex,
    Attachment,
    AttachmentIndex,
    Statistics,
    Metadata,
    MetadataIndex,
    SummaryOffset,
    DataEnd,
}

/// Appends a record whose body comes in parts.
pub(super) fn put(out: &mut Vec<u8>, kind: Opcode, parts: &[&[u8]]) {
    let bytes: usize = parts.iter().map(|part| part.len()).sum();
    out.push(kind as u8);
    out.extend_from_slice(&(bytes as u64).to_le_bytes());
    parts.iter().for_each(|part| out.extend_from_slice(part));
}

/// The fields of a record, one after the other.
#[derive(Default)]
pub(super) struct Body(pub(super) Vec<u8>);

impl Body {
    fn append(mut self, bytes: &[u8]) -> Self {
        self.0.extend_from_slice(bytes);
        self
    }

    pub(super) fn u8(self, number: u8) -> Self {
        self.append(&[number])
    }

    pub(super) fn u16(self, number: u16) -> Self {
        self.append(&number.to_le_bytes())
    }

    pub(super) fn u32(self, number: u32) -> Self {
        self.append(&number.to_le_bytes())
    }

    pub(super) fn u64(self, number: u64) -> Self {
        self.append(&number.to_le_bytes())
    }

    pub(super) fn bytes(self, bytes: &[u8]) -> Self {
        self.u32(bytes.len() as u32).append(bytes)
    }

    pub(super) fn text(self, text: &str) -> Self {
        self.bytes(text.as_bytes())
    }
}

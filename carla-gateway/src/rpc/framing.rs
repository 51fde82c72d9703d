//! Cuts a byte stream into MessagePack objects. There is no length prefix, so the end of an object
//! shows only when all of its parts were seen.

use rmp::Marker;

/// Bytes of one request: the largest map that can be uploaded, and its envelope.
pub(crate) const REQUEST_BYTES_MAX: usize = 64 * 1024 * 1024;
/// Containers inside containers.
const DEPTH_MAX: usize = 32;

/// Why a byte stream is not what a CARLA client sends; the connection cannot go on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub(crate) enum Malformed {
    #[error("a byte that begins no MessagePack object")]
    Marker,
    #[error("containers nested deeper than {DEPTH_MAX}")]
    Depth,
    #[error("a request of more than {REQUEST_BYTES_MAX} bytes")]
    Size,
}

/// Collects bytes and gives whole objects.
#[derive(Debug, Default)]
pub(crate) struct Framer {
    buffer: Vec<u8>,
    /// Bytes of the first object that were looked at.
    scanned: usize,
    /// Parts that are missing of each container that is open.
    missing: Vec<u64>,
}

/// The first bytes of an object: how many, how many of payload follow, how many parts follow.
struct Head {
    bytes: usize,
    payload: usize,
    parts: u64,
}

impl Framer {
    /// Adds what was received.
    pub(crate) fn push(&mut self, bytes: &[u8]) {
        self.buffer.extend_from_slice(bytes);
    }

    /// Bytes of an object that is not whole yet.
    pub(crate) fn len(&self) -> usize {
        self.buffer.len()
    }

    /// The next whole object; `None` until more bytes come.
    ///
    /// # Errors
    /// [`Malformed`]; nothing after that can be understood.
    pub(crate) fn next(&mut self) -> Result<Option<Vec<u8>>, Malformed> {
        loop {
            let rest = self.buffer.get(self.scanned..).unwrap_or_default();
            let Some(head) = head(rest)? else { return self.wait() };
            let end = self.scanned.saturating_add(head.bytes).saturating_add(head.payload);
            if end > REQUEST_BYTES_MAX {
                return Err(Malformed::Size);
            }
            if end > self.buffer.len() {
                return Ok(None);
            }
            self.scanned = end;
            self.enter_or_leave(head.parts)?;
            if self.missing.is_empty() {
                let rest = self.buffer.split_off(self.scanned);
                self.scanned = 0;
                return Ok(Some(std::mem::replace(&mut self.buffer, rest)));
            }
        }
    }

    fn wait(&self) -> Result<Option<Vec<u8>>, Malformed> {
        if self.scanned >= REQUEST_BYTES_MAX { Err(Malformed::Size) } else { Ok(None) }
    }

    fn enter_or_leave(&mut self, parts: u64) -> Result<(), Malformed> {
        if parts > 0 {
            if self.missing.len() >= DEPTH_MAX {
                return Err(Malformed::Depth);
            }
            self.missing.push(parts);
            return Ok(());
        }
        while let Some(missing) = self.missing.last_mut() {
            *missing -= 1;
            if *missing > 0 {
                break;
            }
            self.missing.pop();
        }
        Ok(())
    }
}

/// What the first bytes say; `None` when there are too few of them.
fn head(bytes: &[u8]) -> Result<Option<Head>, Malformed> {
    let Some(first) = bytes.first() else { return Ok(None) };
    let plain = |payload: usize| Ok(Some(Head { bytes: 1, payload, parts: 0 }));
    let sized = |width: usize, extra: usize| {
        let head =
            |length: u64| Head { bytes: 1 + width, payload: length as usize + extra, parts: 0 };
        Ok(length(bytes, width).map(head))
    };
    let holding = |width: usize, factor: u64| {
        let head = |count: u64| Head { bytes: 1 + width, payload: 0, parts: count * factor };
        Ok(length(bytes, width).map(head))
    };
    let within = |count: u64| Ok(Some(Head { bytes: 1, payload: 0, parts: count }));
    match Marker::from_u8(*first) {
        Marker::FixPos(_) | Marker::FixNeg(_) | Marker::Null | Marker::True | Marker::False => {
            plain(0)
        }
        Marker::U8 | Marker::I8 => plain(1),
        Marker::U16 | Marker::I16 | Marker::FixExt1 => plain(2),
        Marker::FixExt2 => plain(3),
        Marker::U32 | Marker::I32 | Marker::F32 => plain(4),
        Marker::FixExt4 => plain(5),
        Marker::U64 | Marker::I64 | Marker::F64 => plain(8),
        Marker::FixExt8 => plain(9),
        Marker::FixExt16 => plain(17),
        Marker::FixStr(length) => plain(usize::from(length)),
        Marker::Str8 | Marker::Bin8 => sized(1, 0),
        Marker::Str16 | Marker::Bin16 => sized(2, 0),
        Marker::Str32 | Marker::Bin32 => sized(4, 0),
        Marker::Ext8 => sized(1, 1),
        Marker::Ext16 => sized(2, 1),
        Marker::Ext32 => sized(4, 1),
        Marker::FixArray(count) => within(u64::from(count)),
        Marker::FixMap(count) => within(u64::from(count) * 2),
        Marker::Array16 => holding(2, 1),
        Marker::Array32 => holding(4, 1),
        Marker::Map16 => holding(2, 2),
        Marker::Map32 => holding(4, 2),
        Marker::Reserved => Err(Malformed::Marker),
    }
}

/// The big-endian number of `width` bytes after the first byte.
fn length(bytes: &[u8], width: usize) -> Option<u64> {
    let digits = bytes.get(1..=width)?;
    Some(digits.iter().fold(0, |length, digit| length << 8 | u64::from(*digit)))
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// `[0, 1, "version", [[false]]]`, as every client begins.
    const VERSION: &[u8] =
        &[0x94, 0x00, 0x01, 0xa7, 0x76, 0x65, 0x72, 0x73, 0x69, 0x6f, 0x6e, 0x91, 0x91, 0xc2];

    #[test]
    fn requests_come_out_whole_however_they_were_cut() {
        let stream = VERSION.repeat(3);
        for size in 1..stream.len() {
            let mut framer = Framer::default();
            let mut found = Vec::new();
            for part in stream.chunks(size) {
                framer.push(part);
                while let Some(request) = framer.next().unwrap() {
                    found.push(request);
                }
            }
            assert_eq!(found, [VERSION, VERSION, VERSION], "in parts of {size}");
        }
    }

    #[test]
    fn deep_nesting_and_promised_size_are_refused_before_the_bytes_come() {
        let mut deep = Framer::default();
        deep.push(&[0x91; 64]);
        assert_eq!(deep.next(), Err(Malformed::Depth));
        let mut large = Framer::default();
        large.push(&[0xdb, 0xff, 0xff, 0xff, 0xff]);
        assert_eq!(large.next(), Err(Malformed::Size));
        let mut many = Framer::default();
        many.push(&[0xdd, 0xff, 0xff, 0xff, 0xff, 0xc0]);
        assert_eq!(many.next(), Ok(None));
        let mut reserved = Framer::default();
        reserved.push(&[0xc1]);
        assert_eq!(reserved.next(), Err(Malformed::Marker));
    }

    proptest! {
        #[test]
        fn no_bytes_break_the_framer(bytes in proptest::collection::vec(any::<u8>(), 0..512)) {
            let mut framer = Framer::default();
            framer.push(&bytes);
            let mut out = 0;
            while let Ok(Some(object)) = framer.next() {
                prop_assert!(!object.is_empty());
                out += object.len();
            }
            prop_assert!(out <= bytes.len());
        }
    }
}

//! The 24 bytes that name a stream.

use serde::Deserialize;

/// One stream in the life of an endpoint.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Deserialize)]
#[serde(transparent)]
pub(crate) struct StreamId(pub(crate) u32);

/// The stream of world snapshots; the same for the life of a server.
pub(crate) const WORLD_OBSERVER: StreamId = StreamId(1);

impl StreamId {
    /// The one that is opened after it.
    pub(crate) fn next(self) -> Self {
        Self(self.0.saturating_add(1))
    }
}

/// TCP.
const PROTOCOL_TCP: u8 = 1;

/// The token of a stream on a port of the host that the client already talks to.
pub(crate) fn token(stream: StreamId, port: u16) -> [u8; 24] {
    let mut token = [0; 24];
    token[..4].copy_from_slice(&stream.0.to_le_bytes());
    token[4..6].copy_from_slice(&port.to_le_bytes());
    token[6] = PROTOCOL_TCP;
    token
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_token_has_the_measured_layout() {
        let mut wanted = [0; 24];
        wanted[..7].copy_from_slice(&[7, 1, 0, 0, 0xd1, 0x07, 1]);
        assert_eq!(token(StreamId(263), 2001), wanted);
    }
}

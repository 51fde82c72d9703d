//! A frame as many hold it.

use std::borrow::Cow;
use std::fmt;
use std::ops::Deref;
use std::sync::Arc;

use crate::wire::{decode_frame, encode_frame};
use crate::{EncodedFrame, Error, Frame};

/// A frame with the bytes it came in. Copies are one more reference; nobody changes it, and whoever
/// passes it on sends the same bytes.
#[derive(Clone)]
pub struct SharedFrame(Arc<Parts>);

struct Parts {
    frame: Frame,
    encoded: EncodedFrame,
}

impl SharedFrame {
    /// The frame in these bytes.
    ///
    /// # Errors
    /// As for [`decode_frame`].
    pub fn decode(encoded: EncodedFrame) -> Result<Self, Error> {
        let frame = decode_frame(&encoded.0)?;
        Ok(Self(Arc::new(Parts { frame, encoded })))
    }

    /// As it came.
    pub fn encoded(&self) -> &EncodedFrame {
        &self.0.encoded
    }
}

impl From<Frame> for SharedFrame {
    fn from(frame: Frame) -> Self {
        let encoded = encode_frame(&frame);
        Self(Arc::new(Parts { frame, encoded }))
    }
}

impl Deref for SharedFrame {
    type Target = Frame;

    fn deref(&self) -> &Frame {
        &self.0.frame
    }
}

impl fmt::Debug for SharedFrame {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.frame.fmt(f)
    }
}

/// What has the bytes of a frame, or can make them.
pub trait FrameBytes {
    /// For [`decode_frame`].
    fn frame_bytes(&self) -> Cow<'_, [u8]>;
}

impl FrameBytes for SharedFrame {
    fn frame_bytes(&self) -> Cow<'_, [u8]> {
        Cow::Borrowed(&self.0.encoded.0)
    }
}

impl FrameBytes for Frame {
    fn frame_bytes(&self) -> Cow<'_, [u8]> {
        Cow::Owned(encode_frame(self).0)
    }
}

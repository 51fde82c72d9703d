//! What was done to a world, in a file that replays it bit for bit.
//!
//! A journal begins with the map's text and a snapshot, so that it can be replayed anywhere and
//! from any moment on. Then come commands, and for every tick its length and the frame that came of
//! it. [`verify`] does it all again and names the first tick, actor and field that differ.
//!
//! Layout: "CWJL", version; then chunks of kind, length, the first 8 bytes of the BLAKE3 digest,
//! and content. A file that ends within a chunk is what a killed process leaves: it counts up to
//! there.

mod chunk;
mod compare;
mod recorder;
mod replay;

pub use compare::Difference;
pub use recorder::Journal;
pub use replay::{JournalError, Replayed, verify};

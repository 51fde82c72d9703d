//! What was done to a world, in a file that replays it bit for bit.
//!
//! A journal begins with the map's text and a snapshot, so that it can be replayed anywhere and
//! from any moment on. Then come commands, and for every tick its length and the frame that came of
//! it; now and then there is a keyframe, a snapshot again, see [`Pace`]. [`Reader`] finds the frame
//! or the state of any tick; [`verify`] does it all again and names the first tick, actor and field
//! that differ.
//!
//! Layout: "CWJL", version; then chunks of kind, length, the first 8 bytes of the BLAKE3 digest,
//! and content. The last two tell where all others are. A file that ends within a chunk is what a
//! killed process leaves: it counts up to there. What is large is compressed (LZ4, a block each).

mod chunk;
mod compare;
mod cut;
mod entry;
mod index;
mod pace;
mod queue;
mod reader;
mod replay;
mod writer;

pub use compare::Difference;
pub use cut::cut;
pub use entry::{Entry, Head, Moment, Scribe, Step, TickEntry};
pub use index::Index;
pub use pace::Pace;
pub use queue::Queue;
pub use reader::{Reader, Way};
pub use replay::{JournalError, Replay, Replayed, verify};
pub use writer::Writer;

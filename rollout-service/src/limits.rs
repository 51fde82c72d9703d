//! Every bound of the service, in one place.

/// Bytes of one message on the socket: a reset of all worlds, each with a seed.
pub(crate) const MESSAGE_BYTES_MAX: usize = 1024 * 1024;
/// Bytes of one block.
pub(crate) const BLOCK_BYTES_MAX: usize = 4 * 1024 * 1024 * 1024;
/// Copies of all arrays in a block.
pub(crate) const SLOTS_MAX: usize = 4;
/// Threads of one batch.
pub(crate) const THREADS_MAX: usize = 256;
/// Worlds that one thread serves without others being woken, unless a client says how many threads.
pub(crate) const WORLDS_PER_THREAD: usize = 64;
/// Snapshots that a client keeps.
pub(crate) const SNAPSHOTS_MAX: usize = 4_096;
/// What they may take in all.
pub(crate) const SNAPSHOT_BYTES_MAX: usize = 1024 * 1024 * 1024;
/// Frames of one reply.
pub(crate) const FRAMES_MAX: usize = 1_024;
/// Clients at a time.
pub(crate) const SESSIONS_MAX: usize = 64;

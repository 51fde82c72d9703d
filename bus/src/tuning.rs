//! Settings of Zenoh's threads, which only the environment of a new process can carry.

/// Variable and value that spare every message one thread: connections that are opened or accepted
/// belong to the threads that read them, and not to others that would have to wake those.
///
/// Sending keeps a thread of its own: one that waits for room to send must not keep the very task
/// that makes room from running.
pub const RUNTIME: (&str, &str) = ("ZENOH_RUNTIME", "(app: (handover: rx), acc: (handover: rx))");

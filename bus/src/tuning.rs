//! Settings of Zenoh's threads, which only the environment of a new process can carry.

/// Variable and value that halve the round trip of a process that only asks: all of Zenoh's work on
/// two threads instead of six, so that fewer of them wake each other.
///
/// Only for processes that connect and never listen. Whoever passes traffic on would stall: a
/// thread that waits for room to send keeps the very task that makes room from running.
pub const CLIENT_RUNTIME: (&str, &str) = (
    "ZENOH_RUNTIME",
    "(tx: (handover: rx), app: (handover: rx), acc: (handover: rx), net: (handover: rx))",
);

//! The one error that crosses the bus.

use std::fmt;

/// What kind of refusal; programs branch on it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum ErrorCode {
    /// Our own fault.
    Internal,
    /// Bytes that are not the message they should be.
    InvalidMessage,
    /// A value outside its domain.
    InvalidArgument,
    /// No such world on this service.
    UnknownWorld,
    /// No such actor in the world.
    UnknownActor,
    /// No such blueprint.
    UnknownBlueprint,
    /// No such map.
    UnknownMap,
    /// No asset with this digest.
    UnknownAsset,
    /// Something stands where the actor should be.
    SpawnBlocked,
    /// The world is at another tick than the request expected.
    WrongTick,
    /// The world diverged or panicked and is kept aside.
    WorldQuarantined,
    /// A limit on how many is reached.
    Capacity,
    /// A message over its size limit.
    TooLarge,
    /// No renderer can draw.
    RendererUnavailable,
    /// Nobody answers on the key.
    Unreachable,
    /// No answer in time.
    TimedOut,
    /// Understood, but nothing here can do it.
    Unsupported,
}

/// Why a request was refused; the world is unchanged.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Error {
    /// What kind.
    pub code: ErrorCode,
    /// One sentence for people.
    pub message: String,
    /// What would have been accepted; empty if there is nothing to say.
    pub wanted: String,
    /// What was given; empty if there is nothing to say.
    pub found: String,
}

impl Error {
    /// An error with nothing to say about wanted and found.
    pub fn new(code: ErrorCode, message: impl Into<String>) -> Self {
        Self { code, message: message.into(), wanted: String::new(), found: String::new() }
    }

    /// Adds what would have been accepted.
    pub fn wanted(mut self, wanted: impl fmt::Display) -> Self {
        self.wanted = wanted.to_string();
        self
    }

    /// Adds what was given, cut to 256 characters.
    pub fn found(mut self, found: impl fmt::Display) -> Self {
        self.found = found.to_string().chars().take(256).collect();
        self
    }
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.message)?;
        if !self.wanted.is_empty() {
            write!(f, "; wanted {}", self.wanted)?;
        }
        if !self.found.is_empty() {
            write!(f, ", found {}", self.found)?;
        }
        Ok(())
    }
}

impl std::error::Error for Error {}

//! How a command ends when it does not end well: one line and an exit code.

use std::error::Error;
use std::process::ExitCode;

use crate::outlet::Outlet;

/// Why a command ended, for people, and which exit code says so to programs.
#[derive(Debug)]
pub(crate) struct Failure {
    text: String,
    code: u8,
}

/// It was asked for something possible and failed.
const FAILED: u8 = 1;
/// It cannot work as typed; starting it again changes nothing.
pub(crate) const USAGE: u8 = 2;

impl Failure {
    /// A failure with its chain of causes.
    pub(crate) fn of(error: &dyn Error) -> Self {
        Self { text: chain(error), code: FAILED }
    }

    /// A setting that cannot work.
    pub(crate) fn usage(error: &dyn Error) -> Self {
        Self { text: chain(error), code: USAGE }
    }

    /// Prints the line and gives the exit code.
    pub(crate) fn report(&self) -> ExitCode {
        Outlet::Error.tell(&format!("causeway: {}", self.text));
        ExitCode::from(self.code)
    }
}

/// The error and its causes on one line; a cause that the text above it tells already is left out.
fn chain(error: &dyn Error) -> String {
    let mut text = error.to_string();
    let mut source = error.source();
    while let Some(cause) = source {
        let cause_text = cause.to_string();
        if !text.contains(&cause_text) {
            text = format!("{text}: {cause_text}");
        }
        source = cause.source();
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Debug, thiserror::Error)]
    #[error("cannot start")]
    struct Outer(#[source] Inner);

    #[derive(Debug, thiserror::Error)]
    #[error("port 1 is taken")]
    struct Inner;

    #[derive(Debug, thiserror::Error)]
    #[error("cannot start: {0}")]
    struct Telling(#[source] Inner);

    #[test]
    fn causes_are_told_once() {
        assert_eq!(chain(&Outer(Inner)), "cannot start: port 1 is taken");
        assert_eq!(chain(&Telling(Inner)), "cannot start: port 1 is taken");
    }
}

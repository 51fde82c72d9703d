//! Numbers as they are typed.

use std::error::Error as _;
use std::io::{IsTerminal as _, stderr};
use std::num::ParseIntError;

/// What the standard library says of a whole number; all that can be typed are unsigned.
const NO_DIGIT: &str = "invalid digit found in string";

/// Ends the process as an error says, with what was wanted where it was a whole number.
pub(crate) fn refuse(wrong: &clap::Error) -> ! {
    let is_number =
        wrong.source().is_some_and(|cause| cause.downcast_ref::<ParseIntError>().is_some());
    if !is_number {
        wrong.exit();
    }
    let text = wrong.render();
    let text = if stderr().is_terminal() { text.ansi().to_string() } else { text.to_string() };
    eprint!("{}", in_words(&text));
    std::process::exit(wrong.exit_code());
}

fn in_words(text: &str) -> String {
    text.replace(NO_DIGIT, "wanted a whole number from 0 on")
}

/// Nothing, or more.
///
/// # Errors
/// What was wanted instead.
pub(crate) fn from_zero(text: &str) -> Result<f64, String> {
    let number = text.parse().ok().filter(|number: &f64| number.is_finite() && *number >= 0.0);
    number.ok_or_else(|| "wanted a number from 0 on".to_owned())
}

/// How long something is measured, in seconds.
///
/// # Errors
/// What was wanted instead.
pub(crate) fn seconds(text: &str) -> Result<f64, String> {
    let number = text.parse().ok().filter(|number: &f64| *number > 0.0 && *number <= 3_600.0);
    number.ok_or_else(|| "wanted seconds above 0 and at most 3600".to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_no_number_in_the_range_is_refused_by_what_was_wanted() {
        assert_eq!((from_zero("0"), seconds("0.5")), (Ok(0.0), Ok(0.5)));
        for wrong in ["nan", "inf", "-1", "far"] {
            assert!(from_zero(wrong).unwrap_err().contains("from 0 on"), "{wrong}");
            assert!(seconds(wrong).unwrap_err().contains("at most 3600"), "{wrong}");
        }
    }
}

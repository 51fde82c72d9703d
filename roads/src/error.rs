//! What is wrong with a map, said so that its author can find the place.

use std::fmt;

use crate::limits;

/// One fault of a map.
#[derive(Clone, Debug, PartialEq)]
pub struct Diagnostic {
    /// The road it lies on, if it lies on one.
    pub road: Option<u32>,
    /// Road coordinate of the place in metres, where the fault has one.
    pub s: Option<f64>,
    /// What the reader needed to find.
    pub wanted: String,
    /// What it found instead.
    pub found: String,
}

impl fmt::Display for Diagnostic {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(road) = self.road {
            write!(f, "road {road}")?;
            if let Some(s) = self.s {
                write!(f, " at s = {s} m")?;
            }
            write!(f, ": ")?;
        }
        write!(f, "wanted {}, found {}", self.wanted, self.found)
    }
}

/// Why a text was refused as a map. Nothing of it is kept.
#[derive(Debug, thiserror::Error)]
#[error("map {name:?} was refused: {}{}", first_of(.diagnostics), more(*.count))]
pub struct MapError {
    /// The name given to the map.
    pub name: String,
    /// The faults in the order they were met, at most [`limits::DIAGNOSTICS_MAX`].
    pub diagnostics: Vec<Diagnostic>,
    /// How many faults there are in all.
    pub count: usize,
}

fn first_of(diagnostics: &[Diagnostic]) -> String {
    diagnostics.first().map_or_else(String::new, ToString::to_string)
}

fn more(count: usize) -> String {
    if count > 1 { format!(" (and {} more)", count - 1) } else { String::new() }
}

/// Collects diagnostics up to the limit and goes on counting.
#[derive(Clone, Debug, Default)]
pub(crate) struct Report {
    pub(crate) diagnostics: Vec<Diagnostic>,
    pub(crate) count: usize,
}

impl Report {
    pub(crate) fn push(&mut self, diagnostic: Diagnostic) {
        self.count += 1;
        if self.diagnostics.len() < limits::DIAGNOSTICS_MAX {
            self.diagnostics.push(diagnostic);
        }
    }

    pub(crate) fn add(
        &mut self,
        road: Option<u32>,
        s: Option<f64>,
        wanted: impl Into<String>,
        found: impl Into<String>,
    ) {
        self.push(Diagnostic { road, s, wanted: wanted.into(), found: found.into() });
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.count == 0
    }
}

/// A user's text, in debug quotes and cut to a length.
pub(crate) fn shown(text: &str) -> String {
    let cut: String = text.chars().take(limits::SHOWN_CHARS_MAX).collect();
    if cut.len() < text.len() { format!("{cut:?}…") } else { format!("{cut:?}") }
}

//! What is wrong with a map, said so that its author can find the place.

use std::fmt;

use crate::limits;

/// What a fault does.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Severity {
    /// Nothing is wrong with the map; whoever drives on it may want to know.
    Note,
    /// The map works, but perhaps not as its author meant.
    Suspicious,
    /// We can use the map; CARLA's client library cannot: it ends, or answers nonsense.
    BreaksClient,
    /// The map cannot be used.
    Refused,
}

impl Severity {
    /// Whether CARLA's client does not survive it.
    #[must_use]
    pub fn breaks_client(self) -> bool {
        self >= Self::BreaksClient
    }
}

/// One fault of a map.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Diagnostic {
    /// What it does.
    pub severity: Severity,
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

/// Why no waypoints were generated.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error(
    "waypoints every {step_m} m along {metres} m of road: wanted a step above 0 m and at most {} \
     waypoints",
    limits::GENERATED_WAYPOINTS_MAX
)]
pub struct TooManyWaypoints {
    /// The step that was asked for, in metres.
    pub step_m: f64,
    /// Length of all roads of the map, in metres.
    pub metres: f64,
}

fn first_of(diagnostics: &[Diagnostic]) -> String {
    diagnostics.first().map_or_else(String::new, ToString::to_string)
}

fn more(count: usize) -> String {
    if count > 1 { format!(" (and {} more)", count - 1) } else { String::new() }
}

/// Diagnostics up to the limit, and how many there would be.
#[derive(Clone, Debug, Default)]
pub struct Report {
    /// In the order they were met, at most [`limits::DIAGNOSTICS_MAX`].
    pub diagnostics: Vec<Diagnostic>,
    /// How many there are in all.
    pub count: usize,
}

impl Report {
    pub(crate) fn push(&mut self, diagnostic: Diagnostic) {
        self.count += 1;
        if self.diagnostics.len() >= limits::DIAGNOSTICS_MAX {
            // A graver fault takes the place of a lesser one, so that the verdict stays right.
            let lesser = |known: &Diagnostic| known.severity < diagnostic.severity;
            let Some(index) = self.diagnostics.iter().rposition(lesser) else { return };
            self.diagnostics.remove(index);
        }
        self.diagnostics.push(diagnostic);
    }

    pub(crate) fn add(
        &mut self,
        road: Option<u32>,
        s: Option<f64>,
        wanted: impl Into<String>,
        found: impl Into<String>,
    ) {
        self.push(Diagnostic {
            severity: Severity::Refused,
            road,
            s,
            wanted: wanted.into(),
            found: found.into(),
        });
    }

    /// The gravest fault, of several the first.
    #[must_use]
    pub fn worst(&self) -> Option<&Diagnostic> {
        self.diagnostics.iter().rev().max_by_key(|fault| fault.severity)
    }

    /// Whether nothing was found.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.count == 0
    }
}

/// A user's text, in debug quotes and cut to a length.
pub(crate) fn shown(text: &str) -> String {
    let cut: String = text.chars().take(limits::SHOWN_CHARS_MAX).collect();
    if cut.len() < text.len() { format!("{cut:?}…") } else { format!("{cut:?}") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_grave_fault_is_kept_however_many_lesser_ones_there_are() {
        let mut report = Report::default();
        let fault = |severity| Diagnostic {
            severity,
            road: None,
            s: None,
            wanted: String::new(),
            found: String::new(),
        };
        for _ in 0..2 * limits::DIAGNOSTICS_MAX {
            report.push(fault(Severity::Suspicious));
        }
        report.push(fault(Severity::BreaksClient));
        report.push(fault(Severity::Suspicious));
        assert_eq!(report.worst().map(|one| one.severity), Some(Severity::BreaksClient));
        assert_eq!(report.diagnostics.len(), limits::DIAGNOSTICS_MAX);
        assert_eq!(report.count, 2 * limits::DIAGNOSTICS_MAX + 2);
    }
}

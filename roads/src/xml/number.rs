//! Attributes as checked numbers.

use super::tree::Node;
use crate::error::{Report, shown};
use crate::limits;

/// The attribute's text, empty when it is absent.
pub(super) fn text<'a>(node: Node<'a, '_>, name: &str) -> &'a str {
    node.attribute(name).unwrap_or("")
}

/// An id as the client library reads it: text that is no whole number is 0.
pub(super) fn id_or_zero(node: Node<'_, '_>, name: &str) -> u32 {
    leading_integer(text(node, name)).and_then(|id| u32::try_from(id).ok()).unwrap_or(0)
}

/// A lane id: absent is 0.
pub(super) fn lane_id(node: Node<'_, '_>, name: &str) -> i32 {
    leading_integer(text(node, name)).and_then(|id| i32::try_from(id).ok()).unwrap_or(0)
}

/// The whole number a text starts with.
pub(super) fn leading_integer(text: &str) -> Option<i64> {
    let text = text.trim_start();
    let digits_from = usize::from(text.starts_with(['-', '+']));
    let digits = text.get(digits_from..)?.bytes().take_while(u8::is_ascii_digit).count();
    text.get(..digits_from + digits)?.parse().ok()
}

/// Half of the numbers in CARLA's maps are this one, which is seen much quicker than read.
const ZERO: &str = "0.0000000000000000e+0";

/// A number, or the number a row of digits and signs starts with.
fn leading_number(text: &str) -> Option<f64> {
    if text == ZERO {
        return Some(0.0);
    }
    if let Ok(number) = text.parse() {
        return Some(number);
    }
    let text = text.trim();
    let is_part = |byte: u8| matches!(byte, b'0'..=b'9' | b'+' | b'-' | b'.' | b'e' | b'E');
    text.parse().ok().or_else(|| {
        let is_near = text.len() <= NUMBER_CHARS_MAX && text.bytes().all(is_part);
        let ends = (1..text.len()).rev().filter(|_| is_near);
        ends.filter_map(|end| text.get(..end)).find_map(|start| start.parse().ok())
    })
}

/// No number is written with more characters.
pub(super) const NUMBER_CHARS_MAX: usize = 64;

/// A number that may be anything: text that is no number is 0.
pub(super) fn number_or_zero(node: Node<'_, '_>, name: &str) -> f64 {
    leading_number(text(node, name)).filter(|number| number.is_finite()).unwrap_or(0.0)
}

/// Reads numbers of one road and reports what is no number within the limits.
pub(super) struct Numbers<'r> {
    pub(super) road: u32,
    pub(super) report: &'r mut Report,
}

impl Numbers<'_> {
    /// A number that must be there.
    pub(super) fn required(&mut self, node: Node<'_, '_>, name: &str) -> f64 {
        self.required_within(node, name, limits::NUMBER_ABS_MAX)
    }

    /// A coordinate of a reference line, which must be there.
    pub(super) fn place(&mut self, node: Node<'_, '_>, name: &str) -> f64 {
        self.required_within(node, name, limits::PLACE_ABS_MAX)
    }

    fn required_within(&mut self, node: Node<'_, '_>, name: &str, limit: f64) -> f64 {
        match node.attribute(name) {
            Some(value) => self.within(node, name, value, limit),
            None => {
                let wanted = format!("an attribute {name:?} of {}", node.name());
                self.report.add(Some(self.road), None, wanted, "none");
                0.0
            }
        }
    }

    /// A number that is 0 when absent.
    pub(super) fn optional(&mut self, node: Node<'_, '_>, name: &str) -> f64 {
        const LIMIT: f64 = limits::NUMBER_ABS_MAX;
        node.attribute(name).map_or(0.0, |value| self.within(node, name, value, LIMIT))
    }

    /// A factor of a polynomial, 0 when absent. Over a road of centimetres it may be very large.
    pub(super) fn coefficient(&mut self, node: Node<'_, '_>, name: &str) -> f64 {
        const LIMIT: f64 = limits::COEFFICIENT_ABS_MAX;
        node.attribute(name).map_or(0.0, |value| self.within(node, name, value, LIMIT))
    }

    fn within(&mut self, node: Node<'_, '_>, name: &str, value: &str, limit: f64) -> f64 {
        match leading_number(value) {
            Some(number) if number.abs() <= limit => number,
            _ => {
                let wanted = format!("{name:?} of {} to be a number within ±{limit}", node.name(),);
                self.report.add(Some(self.road), None, wanted, shown(value));
                0.0
            }
        }
    }
}

//! Attributes as checked numbers.

use roxmltree::Node;

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

/// Reads numbers of one road and reports what is no number within the limits.
pub(super) struct Numbers<'r> {
    pub(super) road: u32,
    pub(super) report: &'r mut Report,
}

impl Numbers<'_> {
    /// A number that must be there.
    pub(super) fn required(&mut self, node: Node<'_, '_>, name: &str) -> f64 {
        match node.attribute(name) {
            Some(value) => self.checked(node, name, value),
            None => {
                let wanted = format!("an attribute {name:?} of {}", node.tag_name().name());
                self.report.add(Some(self.road), None, wanted, "none");
                0.0
            }
        }
    }

    /// A number that is 0 when absent.
    pub(super) fn optional(&mut self, node: Node<'_, '_>, name: &str) -> f64 {
        node.attribute(name).map_or(0.0, |value| self.checked(node, name, value))
    }

    fn checked(&mut self, node: Node<'_, '_>, name: &str, value: &str) -> f64 {
        match value.trim().parse::<f64>() {
            Ok(number) if number.abs() <= limits::NUMBER_ABS_MAX => number,
            _ => {
                let wanted = format!(
                    "{name:?} of {} to be a number within ±{}",
                    node.tag_name().name(),
                    limits::NUMBER_ABS_MAX
                );
                self.report.add(Some(self.road), None, wanted, shown(value));
                0.0
            }
        }
    }
}

//! What a client reads and sets of a blueprint.

/// How the text of a value is read.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum AttributeKind {
    /// `true` or `false`.
    Bool,
    /// A whole number.
    Int,
    /// A decimal number.
    Float,
    /// Any text.
    String,
    /// `red,green,blue`, each from 0 to 255.
    Colour,
}

/// One attribute of a blueprint.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Attribute {
    /// CARLA's name of it.
    pub id: &'static str,
    /// How values are read.
    pub kind: AttributeKind,
    /// Unless a client sets another.
    pub value: String,
    /// Values that fit; the first is the default. Empty for those that cannot be set.
    pub recommended: Vec<String>,
    /// Whether a client may set it.
    pub is_modifiable: bool,
    /// Whether only recommended values may be set.
    pub is_restricted: bool,
}

impl AttributeKind {
    /// A client's text as this kind is written: `True` is `true`, `64.0` is the whole number `64`.
    /// Others stay as they are.
    pub fn written(self, text: &str) -> String {
        match self {
            Self::Bool => text.to_ascii_lowercase(),
            Self::Int if text.parse::<i32>().is_err() => match text.trim().parse::<f64>() {
                Ok(number) if number.abs() < f64::from(i32::MAX) => (number as i32).to_string(),
                _ => text.to_owned(),
            },
            _ => text.to_owned(),
        }
    }

    /// Whether a text is a value of this kind.
    pub fn accepts(self, text: &str) -> bool {
        match self {
            Self::Bool => matches!(text, "true" | "false"),
            Self::Int => text.parse::<i32>().is_ok(),
            Self::Float => text.parse::<f32>().is_ok_and(f32::is_finite),
            Self::String => true,
            Self::Colour => {
                let parts: Vec<&str> = text.split(',').collect();
                parts.len() == 3 && parts.iter().all(|part| part.trim().parse::<u8>().is_ok())
            }
        }
    }
}

impl Attribute {
    /// Whether a client may give this attribute this value.
    pub fn accepts(&self, text: &str) -> bool {
        let recommended = || self.recommended.iter().any(|value| value == text);
        self.kind.accepts(text)
            && (text == self.value || self.is_modifiable)
            && (!self.is_restricted || recommended())
    }

    /// One that clients may set to one of several values, the first by default, or to any other.
    pub(crate) fn open(id: &'static str, kind: AttributeKind, values: &[&str]) -> Self {
        let recommended: Vec<String> = values.iter().map(|&value| value.to_owned()).collect();
        let value = recommended.first().cloned().unwrap_or_default();
        Self { id, kind, value, recommended, is_modifiable: true, is_restricted: false }
    }

    /// One that clients may set to one of these values only.
    pub(crate) fn choice(id: &'static str, kind: AttributeKind, values: &[&str]) -> Self {
        Self { is_restricted: true, ..Self::open(id, kind, values) }
    }

    /// One that clients can only read.
    pub(crate) fn fixed(id: &'static str, kind: AttributeKind, value: impl ToString) -> Self {
        Self {
            id,
            kind,
            value: value.to_string(),
            recommended: Vec::new(),
            is_modifiable: false,
            is_restricted: false,
        }
    }
}

/// What every actor has.
pub(crate) fn common(id: &str, roles: &[&str]) -> Vec<Attribute> {
    vec![
        Attribute::open("role_name", AttributeKind::String, roles),
        Attribute::open("ros_name", AttributeKind::String, &[id]),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_text_is_accepted_when_it_parses_by_its_kind() {
        use AttributeKind::{Bool, Colour, Float, Int};
        for (kind, good, bad) in [
            (Bool, "true", "True"),
            (Int, "-3", "3.5"),
            (Float, "1e-3", "3.5f"),
            (Float, "2", "inf"),
            (Colour, "255,0,12", "256,0,0"),
            (Colour, "0,0,0", "0,0"),
        ] {
            assert!(kind.accepts(good) && !kind.accepts(bad), "{kind:?}: {good} {bad}");
        }
    }

    #[test]
    fn a_whole_number_may_be_written_with_a_point_and_a_truth_in_capitals() {
        use AttributeKind::{Bool, Int, String};
        for (kind, given, wanted) in [
            (Bool, "False", "false"),
            (Int, "64.0", "64"),
            (Int, "-3.9", "-3"),
            (Int, "1e30", "1e30"),
            (Int, "many", "many"),
            (String, "True", "True"),
        ] {
            assert_eq!(kind.written(given), wanted);
        }
    }

    #[test]
    fn a_fixed_attribute_keeps_its_value_and_a_choice_its_list() {
        let fixed = Attribute::fixed("generation", AttributeKind::Int, 2);
        assert!(fixed.accepts("2") && !fixed.accepts("1"));
        let choice = Attribute::choice("driver_id", AttributeKind::Int, &["0", "3"]);
        assert!(choice.accepts("3") && !choice.accepts("2"));
    }
}

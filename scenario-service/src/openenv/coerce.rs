//! JSON into typed values, as leniently as OpenEnv's own server, with the same error objects.

#![allow(
    clippy::result_large_err,
    reason = "an error of a field is made once per wrong message and moved once"
)]

use serde::Serialize;
use serde_json::{Map, Value, json};

use crate::action::{Action, ActionKind};
use crate::limits::{ECHO_CHARS_MAX, FIELD_ERRORS_MAX};

/// One thing that is wrong with a message, in the form that OpenEnv clients know.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(crate) struct FieldError {
    /// The machine-readable kind, e.g. `less_than_equal`.
    #[serde(rename = "type")]
    pub(crate) kind: &'static str,
    /// Where, from the outside in.
    pub(crate) loc: Vec<Value>,
    /// One sentence for people.
    pub(crate) msg: String,
    /// What was found there, cut to a length.
    pub(crate) input: Value,
    /// The bound or the list that was missed.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) ctx: Option<Value>,
}

impl FieldError {
    /// An error without context.
    pub(crate) fn new(kind: &'static str, at: &str, msg: &str, input: &Value) -> Self {
        Self { kind, loc: vec![at.into()], msg: msg.to_owned(), input: echo(input), ctx: None }
    }

    /// A required member that is not there.
    pub(crate) fn missing(at: &str, input: &Value) -> Self {
        Self::new("missing", at, "Field required", input)
    }

    /// A member that does not belong there.
    pub(crate) fn extra(at: &str, input: &Value) -> Self {
        let at: String = at.chars().take(ECHO_CHARS_MAX).collect();
        Self::new("extra_forbidden", &at, "Extra inputs are not permitted", input)
    }

    /// A number that must be above zero.
    pub(crate) fn not_above_zero(at: &str, input: &Value) -> Self {
        let error = Self::new("greater_than", at, "Input should be greater than 0", input);
        error.context(json!({ "gt": 0.0 }))
    }

    /// The same error seen from one level further out.
    #[must_use]
    pub(crate) fn below(mut self, outer: &str) -> Self {
        self.loc.insert(0, outer.into());
        self
    }

    fn context(mut self, ctx: Value) -> Self {
        self.ctx = Some(ctx);
        self
    }
}

/// A client's value as it is sent back: small ones whole, large ones as the start of their text.
fn echo(input: &Value) -> Value {
    let text = match input {
        Value::String(text) => text.clone(),
        Value::Array(_) | Value::Object(_) => input.to_string(),
        small => return small.clone(),
    };
    if text.chars().nth(ECHO_CHARS_MAX).is_none() {
        return input.clone();
    }
    Value::String(text.chars().take(ECHO_CHARS_MAX).collect())
}

/// The values a number may take.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Bounds {
    /// Smallest.
    pub(crate) min: f64,
    /// Largest.
    pub(crate) max: f64,
}

impl Bounds {
    /// 0 to 1.
    pub(crate) const UNIT: Self = Self { min: 0.0, max: 1.0 };
    /// -1 to 1.
    pub(crate) const SIGNED_UNIT: Self = Self { min: -1.0, max: 1.0 };
    /// Any finite number.
    pub(crate) const FINITE: Self = Self { min: f64::MIN, max: f64::MAX };
}

/// Reads the members of one object and collects what is wrong, in reading order.
pub(crate) struct Reader<'a> {
    object: &'a Map<String, Value>,
    known: Vec<&'static str>,
    errors: Vec<FieldError>,
}

impl<'a> Reader<'a> {
    /// A reader that has read nothing yet.
    pub(crate) fn new(object: &'a Map<String, Value>) -> Self {
        Self { object, known: Vec::with_capacity(16), errors: Vec::new() }
    }

    /// The value, or everything that was wrong; members never asked for are errors too.
    pub(crate) fn finish_closed<T>(mut self, value: T) -> Result<T, Vec<FieldError>> {
        for (key, input) in self.object {
            if self.errors.len() >= FIELD_ERRORS_MAX {
                break;
            }
            if !self.known.contains(&key.as_str()) {
                self.errors.push(FieldError::extra(key, input));
            }
        }
        self.finish_open(value)
    }

    /// The value, or everything that was wrong; members never asked for are ignored.
    pub(crate) fn finish_open<T>(self, value: T) -> Result<T, Vec<FieldError>> {
        if self.errors.is_empty() { Ok(value) } else { Err(self.errors) }
    }

    fn get(&mut self, key: &'static str) -> Option<&'a Value> {
        self.known.push(key);
        self.object.get(key)
    }

    fn check<T>(&mut self, result: Result<T, FieldError>) -> Option<T> {
        result.map_err(|error| self.errors.push(error)).ok()
    }

    /// A number that has a default and cannot be null.
    pub(crate) fn number(&mut self, key: &'static str, default: f64, bounds: Bounds) -> f64 {
        let Some(input) = self.get(key) else { return default };
        let result = number(key, input, bounds);
        self.check(result).unwrap_or(default)
    }

    /// A number that may be null or absent.
    pub(crate) fn optional_number(&mut self, key: &'static str, bounds: Bounds) -> Option<f64> {
        let input = self.get(key).filter(|input| !input.is_null())?;
        let result = number(key, input, bounds);
        self.check(result)
    }

    /// A whole number that may be null or absent.
    pub(crate) fn optional_integer(&mut self, key: &'static str, min: u64) -> Option<u64> {
        let input = self.get(key).filter(|input| !input.is_null())?;
        let result = integer(key, input, min);
        self.check(result)
    }

    /// A seed that may be null or absent: any whole number of 64 bits.
    pub(crate) fn optional_seed(&mut self, key: &'static str) -> Option<u64> {
        let input = self.get(key).filter(|input| !input.is_null())?;
        let result = seed(key, input);
        self.check(result)
    }

    /// A text that may be null or absent.
    pub(crate) fn optional_text(&mut self, key: &'static str) -> Option<String> {
        let input = self.get(key).filter(|input| !input.is_null())?;
        let result = text(key, input);
        self.check(result)
    }

    /// A text of limited length that may be null or absent.
    pub(crate) fn optional_short_text(
        &mut self,
        key: &'static str,
        chars_max: usize,
    ) -> Option<String> {
        let text = self.optional_text(key)?;
        if text.chars().nth(chars_max).is_none() {
            return Some(text);
        }
        let msg = format!("String should have at most {chars_max} characters");
        let error = FieldError::new("string_too_long", key, &msg, &Value::String(text));
        self.errors.push(error.context(json!({ "max_length": chars_max })));
        None
    }

    /// An object that may be absent.
    pub(crate) fn object(&mut self, key: &'static str) -> Option<&'a Map<String, Value>> {
        let input = self.get(key)?;
        if let Value::Object(object) = input {
            return Some(object);
        }
        let error = FieldError::new("dict_type", key, "Input should be a valid dictionary", input);
        self.errors.push(error);
        None
    }

    /// An object that may be null or absent.
    pub(crate) fn optional_object(&mut self, key: &'static str) -> Option<&'a Map<String, Value>> {
        if self.object.get(key).is_some_and(Value::is_null) {
            self.known.push(key);
            return None;
        }
        self.object(key)
    }

    fn action_kind(&mut self, key: &'static str) -> ActionKind {
        let Some(input) = self.get(key) else { return ActionKind::Observe };
        if let Some(kind) = input.as_str().and_then(ActionKind::parse) {
            return kind;
        }
        let expected = kinds_in_words();
        let error =
            FieldError::new("literal_error", key, &format!("Input should be {expected}"), input);
        self.errors.push(error.context(json!({ "expected": expected })));
        ActionKind::Observe
    }
}

fn kinds_in_words() -> String {
    let quoted: Vec<String> =
        ActionKind::ALL.iter().map(|kind| format!("'{}'", kind.as_str())).collect();
    match quoted.split_last() {
        Some((last, rest)) => format!("{} or {last}", rest.join(", ")),
        None => String::new(),
    }
}

/// A number from a number, a boolean or a numeric text.
pub(crate) fn number(at: &str, input: &Value, bounds: Bounds) -> Result<f64, FieldError> {
    let value = match input {
        Value::Number(number) => number.as_f64().unwrap_or(f64::NAN),
        Value::Bool(flag) => f64::from(u8::from(*flag)),
        Value::String(text) => number_in(text).ok_or_else(|| {
            let msg = "Input should be a valid number, unable to parse string as a number";
            FieldError::new("float_parsing", at, msg, input)
        })?,
        _ => {
            return Err(FieldError::new("float_type", at, "Input should be a valid number", input));
        }
    };
    if bounds.max == f64::MAX {
        if value.is_finite() {
            return Ok(value);
        }
        return Err(FieldError::new("finite_number", at, "Input should be a finite number", input));
    }
    // A NaN is neither below nor above; it is reported against the upper bound.
    if value > bounds.max || value.is_nan() {
        let msg = format!("Input should be less than or equal to {}", bounds.max);
        let error = FieldError::new("less_than_equal", at, &msg, input);
        return Err(error.context(json!({ "le": bounds.max })));
    }
    if value < bounds.min {
        let msg = format!("Input should be greater than or equal to {}", bounds.min);
        let error = FieldError::new("greater_than_equal", at, &msg, input);
        return Err(error.context(json!({ "ge": bounds.min })));
    }
    Ok(value)
}

/// A whole number from an integral number, a boolean or an integral text.
/// What is larger than 64 bits can hold becomes the largest that they can.
pub(crate) fn integer(at: &str, input: &Value, min: u64) -> Result<u64, FieldError> {
    let value = match input {
        Value::Number(number) => match number.as_u64() {
            Some(value) => return at_least(at, input, value, min),
            None => number.as_f64().unwrap_or(f64::NAN),
        },
        Value::Bool(flag) => f64::from(u8::from(*flag)),
        Value::String(text) => integer_in(text).ok_or_else(|| {
            let msg = "Input should be a valid integer, unable to parse string as an integer";
            FieldError::new("int_parsing", at, msg, input)
        })?,
        _ => return Err(FieldError::new("int_type", at, "Input should be a valid integer", input)),
    };
    if !value.is_finite() {
        return Err(FieldError::new("finite_number", at, "Input should be a finite number", input));
    }
    if value.fract() != 0.0 {
        let msg = "Input should be a valid integer, got a number with a fractional part";
        return Err(FieldError::new("int_from_float", at, msg, input));
    }
    if value < min as f64 {
        return Err(too_small(at, input, min));
    }
    // Saturates; what is larger has no other meaning to any user of this function.
    at_least(at, input, value as u64, min)
}

/// A seed from what [`integer`] takes. Larger ones are refused: many would be the same.
fn seed(at: &str, input: &Value) -> Result<u64, FieldError> {
    if let Value::String(text) = input
        && integer_in(text).is_some()
        && let Ok(exact) = text.trim().replace('_', "").parse()
    {
        return Ok(exact);
    }
    let value = integer(at, input, 0)?;
    if value < u64::MAX || input.as_u64().is_some() {
        return Ok(value);
    }
    let msg = format!("Input should be less than or equal to {}", u64::MAX);
    Err(FieldError::new("less_than_equal", at, &msg, input).context(json!({ "le": u64::MAX })))
}

/// The number in a text; single underscores group digits, as in Python.
fn number_in(text: &str) -> Option<f64> {
    let text = text.trim();
    let grouped = text.split('_').all(|group| !group.is_empty());
    if grouped { text.replace('_', "").parse().ok() } else { None }
}

/// The whole number in a text: digits, perhaps a sign before and zeros behind a point.
fn integer_in(text: &str) -> Option<f64> {
    let text = text.trim();
    let digits = text.strip_prefix(['+', '-']).unwrap_or(text);
    let (whole, zeros) = digits.split_once('.').unwrap_or((digits, "0"));
    let are_digits =
        |group: &str| !group.is_empty() && group.bytes().all(|byte| byte.is_ascii_digit());
    let is_integral = whole.split('_').all(are_digits)
        && !zeros.is_empty()
        && zeros.bytes().all(|byte| byte == b'0');
    if is_integral { number_in(text) } else { None }
}

fn at_least(at: &str, input: &Value, value: u64, min: u64) -> Result<u64, FieldError> {
    if value < min { Err(too_small(at, input, min)) } else { Ok(value) }
}

fn too_small(at: &str, input: &Value, min: u64) -> FieldError {
    let msg = format!("Input should be greater than or equal to {min}");
    FieldError::new("greater_than_equal", at, &msg, input).context(json!({ "ge": min }))
}

/// A text; nothing else becomes one.
pub(crate) fn text(at: &str, input: &Value) -> Result<String, FieldError> {
    match input {
        Value::String(text) => Ok(text.clone()),
        _ => Err(FieldError::new("string_type", at, "Input should be a valid string", input)),
    }
}

/// An action from the members a client sent; an empty object is an `observe`.
///
/// # Errors
/// Everything that is wrong, in the order of the fields, unknown members last.
pub(crate) fn action(object: &Map<String, Value>) -> Result<Action, Vec<FieldError>> {
    let mut read = Reader::new(object);
    let action = Action {
        metadata: read.object("metadata").cloned().unwrap_or_default(),
        kind: read.action_kind("action_type"),
        throttle: read.number("throttle", 0.0, Bounds::UNIT),
        steer: read.number("steer", 0.0, Bounds::SIGNED_UNIT),
        brake: read.number("brake", 0.0, Bounds::UNIT),
        lane_direction: read.optional_text("lane_direction"),
        target_speed_kmh: read.optional_number("target_speed_kmh", Bounds { min: 0.0, max: 200.0 }),
        brake_intensity: read.optional_number("brake_intensity", Bounds::UNIT),
        target_lane_id: read.optional_text("target_lane_id"),
        navigation_behavior: read.optional_text("navigation_behavior"),
        destination_x: read.optional_number("destination_x", Bounds::FINITE),
        destination_y: read.optional_number("destination_y", Bounds::FINITE),
        destination_z: read.optional_number("destination_z", Bounds::FINITE),
        route_steps: read.optional_integer("route_steps", 1),
    };
    read.finish_closed(action)
}

#[cfg(test)]
mod tests;

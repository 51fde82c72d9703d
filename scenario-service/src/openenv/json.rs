//! JSON text into values, with the literals that Python's encoder adds to the language.

use serde_json::Value;

/// Python writes non-finite floats as bare words, which are no JSON.
const WORDS: [&str; 3] = ["-Infinity", "Infinity", "NaN"];

/// A value; `NaN` and infinities become texts of the same letters, which no field of a message
/// accepts.
///
/// # Errors
/// The parser's text.
pub(super) fn parse(text: &str) -> Result<Value, String> {
    match serde_json::from_str(text) {
        Ok(value) => Ok(value),
        Err(error) => match quote_words(text) {
            Some(quoted) => serde_json::from_str(&quoted).map_err(|error| error.to_string()),
            None => Err(error.to_string()),
        },
    }
}

/// The text with the bare words in quotes; `None` if there are none.
fn quote_words(text: &str) -> Option<String> {
    let mut quoted = String::with_capacity(text.len() + 16);
    let mut rest = text;
    let mut found = false;
    while let Some(next) = rest.chars().next() {
        if next == '"' {
            let (string, after) = rest.split_at(string_bytes(rest));
            quoted.push_str(string);
            rest = after;
        } else if let Some(word) = WORDS.into_iter().find(|word| rest.starts_with(word)) {
            found = true;
            quoted.push('"');
            quoted.push_str(word);
            quoted.push('"');
            rest = rest.get(word.len()..)?;
        } else {
            quoted.push(next);
            rest = rest.get(next.len_utf8()..)?;
        }
    }
    found.then_some(quoted)
}

/// Length of the string literal that a text starts with, up to its end if it is not closed.
fn string_bytes(text: &str) -> usize {
    let mut escaped = false;
    for (at, byte) in text.bytes().enumerate().skip(1) {
        match byte {
            _ if escaped => escaped = false,
            b'\\' => escaped = true,
            b'"' => return at + 1,
            _ => {}
        }
    }
    text.len()
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;
    use serde_json::json;

    use super::*;

    #[test]
    fn python_words_become_texts_and_texts_stay_as_they_are() {
        let value = parse(r#"{"a": NaN, "b": [-Infinity, Infinity], "c": "NaN \" NaN"}"#).unwrap();
        assert_eq!(value, json!({ "a": "NaN", "b": ["-Infinity", "Infinity"], "c": "NaN \" NaN" }));
        assert!(parse("{NaNa}").is_err());
        assert!(parse("").is_err());
    }

    proptest! {
        #[test]
        fn no_text_panics(text in "[{}\\[\\]\",:a-zA-ZäN\\\\ 0-9-]{0,40}") {
            let _ = parse(&text);
        }

        #[test]
        fn what_json_accepts_is_untouched(value in "[ -~]{0,20}") {
            let text = json!([value]).to_string();
            prop_assert_eq!(parse(&text).unwrap(), json!([value]));
        }
    }
}

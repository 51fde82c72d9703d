//! One pass over the text of an XML document.
//!
//! Document type definitions are refused, and with them entities of one's own; nesting and numbers
//! of elements are limited.

use std::borrow::Cow;

use super::tree::{Attribute, Document, Element};
use crate::limits;

/// Most attributes of one element.
const ATTRIBUTES_MAX: usize = 256;
/// Characters of a map per attribute and per element, about: that much room is made at first.
const ATTRIBUTE_CHARS: usize = 16;
const ELEMENT_CHARS: usize = 64;

/// What was wanted and what was found instead.
#[derive(Debug, PartialEq, Eq)]
pub(super) struct Refusal {
    pub(super) wanted: String,
    pub(super) found: String,
}

/// Reads a document of at most [`limits::TEXT_BYTES_MAX`].
pub(super) fn parse(text: &str) -> Result<Document<'_>, Refusal> {
    let document = Document {
        text,
        elements: Vec::with_capacity(text.len() / ELEMENT_CHARS),
        attributes: Vec::with_capacity(text.len() / ATTRIBUTE_CHARS),
        ..Document::default()
    };
    let mut reader = Reader { text, at: 0, open: Vec::new(), document };
    match reader.read() {
        Ok(()) => Ok(reader.document),
        Err(Fault::Limit(wanted, found)) => Err(Refusal { wanted, found: found.to_owned() }),
        Err(Fault::Malformed(what)) => {
            let before = text.get(..reader.at).unwrap_or(text);
            let line = before.bytes().filter(|byte| *byte == b'\n').count() + 1;
            let wanted = "well-formed XML without DTD".to_owned();
            Err(Refusal { wanted, found: format!("{what} in line {line}") })
        }
    }
}

enum Fault {
    Malformed(&'static str),
    Limit(String, &'static str),
}

struct Reader<'i> {
    text: &'i str,
    at: usize,
    /// The elements around the present place: full name and position.
    open: Vec<(&'i str, u32)>,
    document: Document<'i>,
}

/// For every byte whether it may be part of a name.
const NAME_PARTS: [bool; 256] = {
    let mut parts = [false; 256];
    let mut byte = 0;
    while byte < 256 {
        let character = byte as u8;
        parts[byte] = character.is_ascii_alphanumeric()
            || matches!(character, b'_' | b'-' | b'.' | b':' | 128..);
        byte += 1;
    }
    parts
};

impl<'i> Reader<'i> {
    fn read(&mut self) -> Result<(), Fault> {
        loop {
            self.words()?;
            if self.peek().is_none() {
                break;
            }
            let rest = self.rest();
            match self.text.as_bytes().get(self.at + 1) {
                Some(b'!') if rest.starts_with("<!--") => {
                    self.at += 4;
                    self.until("-->", "a comment without end")?;
                }
                Some(b'!') if rest.starts_with("<![CDATA[") => {
                    self.at += 9;
                    let words = self.until("]]>", "a CDATA section without end")?;
                    self.keep(words.into())?;
                }
                Some(b'!') => return Err(Fault::Malformed("a declaration")),
                Some(b'?') => {
                    self.until("?>", "an instruction without end")?;
                }
                Some(b'/') => self.close()?,
                _ => self.open()?,
            }
        }
        match (self.open.last(), self.document.elements.is_empty()) {
            (Some(_), _) => Err(Fault::Malformed("an element without end")),
            (None, true) => Err(Fault::Malformed("no element")),
            (None, false) => Ok(()),
        }
    }

    fn rest(&self) -> &'i str {
        self.text.get(self.at..).unwrap_or("")
    }

    fn peek(&self) -> Option<u8> {
        self.text.as_bytes().get(self.at).copied()
    }

    /// Passes bytes as long as they are of a kind.
    fn pass(&mut self, is_of_kind: impl Fn(u8) -> bool) {
        let rest = self.text.as_bytes().get(self.at..).unwrap_or_default();
        let length = rest.iter().position(|byte| !is_of_kind(*byte));
        self.at += length.unwrap_or(rest.len());
    }

    fn skip_space(&mut self) {
        self.pass(|byte| byte.is_ascii_whitespace());
    }

    /// The text up to a mark, which is passed.
    fn until(&mut self, mark: &str, fault: &'static str) -> Result<&'i str, Fault> {
        let rest = self.rest();
        let length = rest.find(mark).ok_or(Fault::Malformed(fault))?;
        self.at += length + mark.len();
        Ok(rest.get(..length).unwrap_or(""))
    }

    /// Passes text up to the next tag, and keeps it unless it is space.
    fn words(&mut self) -> Result<(), Fault> {
        let start = self.at;
        self.skip_space();
        if matches!(self.peek(), None | Some(b'<')) {
            return Ok(());
        }
        let rest = self.text.get(start..).unwrap_or("");
        let words = rest.get(..rest.find('<').unwrap_or(rest.len())).unwrap_or("");
        self.at = start + words.len();
        self.keep(decoded(words)?)
    }

    fn keep(&mut self, words: Cow<'i, str>) -> Result<(), Fault> {
        let Some((_, element)) = self.open.last() else {
            return Err(Fault::Malformed("text outside of all elements"));
        };
        self.document.words.push((*element, words.into_owned()));
        Ok(())
    }

    fn name(&mut self) -> Result<&'i str, Fault> {
        let start = self.at;
        self.pass(|byte| NAME_PARTS[usize::from(byte)]);
        let name = self.text.get(start..self.at).unwrap_or("");
        if matches!(name.as_bytes().first(), None | Some(b'0'..=b'9' | b'-' | b'.')) {
            return Err(Fault::Malformed("no name where one belongs"));
        }
        Ok(name)
    }

    #[allow(clippy::cast_possible_truncation, reason = "elements and attributes are limited")]
    fn open(&mut self) -> Result<(), Fault> {
        self.at += 1;
        let name = self.name()?;
        let index = self.document.elements.len();
        if index > 0 && self.open.is_empty() {
            return Err(Fault::Malformed("a second root element"));
        }
        if index >= limits::XML_NODES_MAX as usize {
            let wanted = format!("at most {} elements", limits::XML_NODES_MAX);
            return Err(Fault::Limit(wanted, "more"));
        }
        if self.open.len() >= limits::XML_DEPTH_MAX as usize {
            let wanted = format!("at most {} nested elements", limits::XML_DEPTH_MAX);
            return Err(Fault::Limit(wanted, "deeper nesting"));
        }
        let first_attribute = self.document.attributes.len();
        let is_empty = self.attributes(first_attribute)?;
        let prefix = name.bytes().rposition(|byte| byte == b':').map_or(0, |colon| colon + 1);
        self.document.elements.push(Element {
            name: name.get(prefix..).unwrap_or(name),
            first_attribute: first_attribute as u32,
            attributes: (self.document.attributes.len() - first_attribute) as u32,
            end: index as u32 + 1,
        });
        if !is_empty {
            self.open.push((name, index as u32));
        }
        Ok(())
    }

    /// Reads attributes up to the end of the tag; whether it ends the element, too.
    fn attributes(&mut self, first: usize) -> Result<bool, Fault> {
        loop {
            let before = self.at;
            self.skip_space();
            match self.peek() {
                Some(b'>') => {
                    self.at += 1;
                    return Ok(false);
                }
                Some(b'/') if self.rest().starts_with("/>") => {
                    self.at += 2;
                    return Ok(true);
                }
                None => return Err(Fault::Malformed("a tag without end")),
                Some(_) if before == self.at => {
                    return Err(Fault::Malformed("no space before an attribute"));
                }
                Some(_) => {}
            }
            self.attribute(first)?;
        }
    }

    #[allow(clippy::cast_possible_truncation, reason = "the text is shorter than 2³² bytes")]
    fn attribute(&mut self, first: usize) -> Result<(), Fault> {
        let start = self.at;
        let name = self.name()?;
        let name_end = self.at;
        let [from, to] = self.value()?;
        let document = &self.document;
        let known = document.attributes.get(first..).unwrap_or_default();
        if known.len() >= ATTRIBUTES_MAX {
            let wanted = format!("at most {ATTRIBUTES_MAX} attributes of an element");
            return Err(Fault::Limit(wanted, "more"));
        }
        if known.iter().any(|known| document.is_named(known, name)) {
            return Err(Fault::Malformed("an attribute twice"));
        }
        let (name, value) = ([start as u32, name_end as u32], [from as u32, to as u32]);
        self.document.attributes.push(Attribute { name, value });
        Ok(())
    }

    /// Where the value after a name stands. One with entities is kept decoded.
    #[allow(clippy::cast_possible_truncation, reason = "the text is shorter than 2³² bytes")]
    fn value(&mut self) -> Result<[usize; 2], Fault> {
        self.skip_space();
        if self.peek() != Some(b'=') {
            return Err(Fault::Malformed("an attribute without value"));
        }
        self.at += 1;
        self.skip_space();
        let quote = match self.peek() {
            Some(quote @ (b'"' | b'\'')) => quote,
            _ => return Err(Fault::Malformed("a value without quotes")),
        };
        self.at += 1;
        let start = self.at;
        self.pass(|byte| byte != quote);
        if self.peek().is_none() {
            return Err(Fault::Malformed("a value without end"));
        }
        let end = self.at;
        self.at += 1;
        let value = self.text.get(start..end).unwrap_or("");
        // Nearly no value has one of these: looking at all of it is quicker than stopping early.
        let is_special = |byte: u8| byte == b'<' || byte == b'&';
        if value.bytes().fold(false, |found, byte| found | is_special(byte)) {
            if value.contains('<') {
                return Err(Fault::Malformed("a < within a value"));
            }
            let value = decoded(value)?.into_owned();
            self.document.decoded.push((self.document.attributes.len() as u32, value));
        }
        Ok([start, end])
    }

    #[allow(clippy::cast_possible_truncation, reason = "elements are limited")]
    fn close(&mut self) -> Result<(), Fault> {
        self.at += 2;
        let name = self.name()?;
        self.skip_space();
        if self.peek() != Some(b'>') {
            return Err(Fault::Malformed("an end tag without end"));
        }
        self.at += 1;
        match self.open.pop() {
            Some((opened, index)) if opened == name => {
                let end = self.document.elements.len() as u32;
                if let Some(element) = self.document.elements.get_mut(index as usize) {
                    element.end = end;
                }
                Ok(())
            }
            _ => Err(Fault::Malformed("an end tag of another element")),
        }
    }
}

/// Text with its entities replaced.
fn decoded(text: &str) -> Result<Cow<'_, str>, Fault> {
    let Some(first) = text.find('&') else { return Ok(Cow::Borrowed(text)) };
    let (plain, mut rest) = text.split_at(first);
    let mut decoded = plain.to_owned();
    while let Some(entity) = rest.strip_prefix('&') {
        let (name, after) = entity.split_once(';').ok_or(Fault::Malformed("a bare &"))?;
        decoded.push(character(name).ok_or(Fault::Malformed("an unknown entity"))?);
        let plain = after.find('&').unwrap_or(after.len());
        decoded.push_str(after.get(..plain).unwrap_or_default());
        rest = after.get(plain..).unwrap_or_default();
    }
    Ok(Cow::Owned(decoded))
}

fn character(entity: &str) -> Option<char> {
    match entity {
        "lt" => Some('<'),
        "gt" => Some('>'),
        "amp" => Some('&'),
        "quot" => Some('"'),
        "apos" => Some('\''),
        _ => {
            let number = entity.strip_prefix('#')?;
            let code = match number.strip_prefix('x') {
                Some(digits) => u32::from_str_radix(digits, 16).ok()?,
                None => number.parse().ok()?,
            };
            char::from_u32(code).filter(|character| *character != '\0')
        }
    }
}

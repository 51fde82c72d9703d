//! One pass over the text of an XML document, which tells it in parts: first the root element by
//! itself, then each element directly inside of it with all that it has inside. A part is small, so
//! it is asked while the processor still has it at hand; a megabyte of elements would not be.
//!
//! Document type definitions are refused, and with them entities of one's own; nesting and numbers
//! of elements are limited.

use std::borrow::Cow;

use super::tree::{Attribute, Element, Node, Part, key};
use crate::limits;

/// Most attributes of one element.
const ATTRIBUTES_MAX: usize = 256;
/// What was wanted and what was found instead.
#[derive(Debug, PartialEq, Eq)]
pub(super) struct Refusal {
    pub(super) wanted: String,
    pub(super) found: String,
}

/// Reads a document of at most [`limits::TEXT_BYTES_MAX`]. What is told: whether it is the root,
/// and the element.
pub(super) fn parse<'i>(
    text: &'i str,
    tell: impl FnMut(bool, Node<'_, 'i>),
) -> Result<(), Refusal> {
    let part = Part { text, ..Part::default() };
    let mut reader = Reader { text, at: 0, open: Vec::new(), elements: 0, part, tell };
    match reader.read() {
        Ok(()) => Ok(()),
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

struct Reader<'i, F> {
    text: &'i str,
    at: usize,
    /// The elements around the present place: full name and position in its part.
    open: Vec<(&'i str, u32)>,
    /// How many there were in all parts.
    elements: u32,
    part: Part<'i>,
    tell: F,
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

impl<'i, F: FnMut(bool, Node<'_, 'i>)> Reader<'i, F> {
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
        match (self.open.last(), self.elements) {
            (Some(_), _) => Err(Fault::Malformed("an element without end")),
            (None, 0) => Err(Fault::Malformed("no element")),
            (None, _) => Ok(()),
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
        match self.peek() {
            Some(byte) if byte.is_ascii_whitespace() => self.at += 1,
            _ => return,
        }
        // After the end of a line many spaces follow.
        let (chunks, _) = self.text.as_bytes().get(self.at..).unwrap_or_default().as_chunks();
        self.at += chunks.iter().take_while(|chunk| **chunk == [b' '; CHUNK]).count() * CHUNK;
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
        // What stands directly inside the root belongs to no part.
        if self.open.len() > 1 {
            self.part.words.push((*element, words.into_owned()));
        }
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
        let is_root = self.open.is_empty();
        if is_root && self.elements > 0 {
            return Err(Fault::Malformed("a second root element"));
        }
        if self.elements >= limits::XML_NODES_MAX {
            let wanted = format!("at most {} elements", limits::XML_NODES_MAX);
            return Err(Fault::Limit(wanted, "more"));
        }
        if self.open.len() >= limits::XML_DEPTH_MAX as usize {
            let wanted = format!("at most {} nested elements", limits::XML_DEPTH_MAX);
            return Err(Fault::Limit(wanted, "deeper nesting"));
        }
        self.elements += 1;
        let index = self.part.elements.len() as u32;
        let first_attribute = self.part.attributes.len();
        let is_empty = self.attributes(first_attribute)?;
        let prefix = name.bytes().rposition(|byte| byte == b':').map_or(0, |colon| colon + 1);
        let own_name = name.get(prefix..).unwrap_or(name);
        self.part.elements.push(Element {
            name: own_name,
            key: key(own_name),
            first_attribute: first_attribute as u32,
            attributes: (self.part.attributes.len() - first_attribute) as u32,
            end: index + 1,
        });
        if is_root || (is_empty && self.open.len() == 1) {
            self.end_part(is_root);
        }
        if !is_empty {
            self.open.push((name, index));
        }
        Ok(())
    }

    fn end_part(&mut self, is_root: bool) {
        (self.tell)(is_root, self.part.root());
        self.part.clear();
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
        let (part, key) = (&self.part, key(name));
        let known = part.attributes.get(first..).unwrap_or_default();
        if known.len() >= ATTRIBUTES_MAX {
            let wanted = format!("at most {ATTRIBUTES_MAX} attributes of an element");
            return Err(Fault::Limit(wanted, "more"));
        }
        if known.iter().any(|known| part.is_named(known, key, name)) {
            return Err(Fault::Malformed("an attribute twice"));
        }
        let (name, value) = ([start as u32, name_end as u32], [from as u32, to as u32]);
        self.part.attributes.push(Attribute { key, name, value });
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
        let rest = self.text.as_bytes().get(start..).unwrap_or_default();
        let mut end = start + first_of(rest, [quote, b'<', b'&']);
        let has_entities = self.text.as_bytes().get(end) == Some(&b'&');
        if has_entities {
            end = start + first_of(rest, [quote, b'<', b'<']);
        }
        self.at = end;
        match self.peek() {
            None => return Err(Fault::Malformed("a value without end")),
            Some(b'<') => return Err(Fault::Malformed("a < within a value")),
            Some(_) => self.at += 1,
        }
        if has_entities {
            let value = decoded(self.text.get(start..end).unwrap_or(""))?.into_owned();
            self.part.decoded.push((self.part.attributes.len() as u32, value));
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
                let end = self.part.elements.len() as u32;
                if let Some(element) = self.part.elements.get_mut(index as usize) {
                    element.end = end;
                }
                if self.open.len() == 1 {
                    self.end_part(false);
                }
                Ok(())
            }
            _ => Err(Fault::Malformed("an end tag of another element")),
        }
    }
}

/// Bytes that are looked at together.
const CHUNK: usize = size_of::<u64>();

/// How many bytes stand before the first of these; all of them where none stands.
fn first_of(bytes: &[u8], wanted: [u8; 3]) -> usize {
    const ONES: u64 = u64::from_le_bytes([1; CHUNK]);
    const HIGHS: u64 = u64::from_le_bytes([128; CHUNK]);
    let wanted_words = wanted.map(|byte| u64::from(byte) * ONES);
    let (chunks, rest) = bytes.as_chunks();
    for (index, chunk) in chunks.iter().enumerate() {
        let word = u64::from_le_bytes(*chunk);
        // The lowest bit that is set marks the first byte that became zero.
        let zeros = |word: u64| word.wrapping_sub(ONES) & !word & HIGHS;
        let [a, b, c] = wanted_words.map(|one| zeros(word ^ one));
        let found = a | b | c;
        if found != 0 {
            return index * CHUNK + found.trailing_zeros() as usize / 8;
        }
    }
    let end = rest.iter().position(|byte| wanted.contains(byte)).unwrap_or(rest.len());
    bytes.len() - rest.len() + end
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

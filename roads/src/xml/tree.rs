//! Elements, attributes and text of an XML document, and nothing else of it.
//!
//! One pass over the text, without copies but where entities stand: maps are megabytes long and
//! made of attributes. Document type definitions are refused, and with them entities of one's own;
//! nesting and numbers of elements are limited.

use std::borrow::Cow;

use crate::limits;

/// Most attributes of one element.
const ATTRIBUTES_MAX: usize = 256;

/// What was wanted and what was found instead.
#[derive(Debug, PartialEq, Eq)]
pub(super) struct Refusal {
    pub(super) wanted: String,
    pub(super) found: String,
}

#[derive(Debug)]
struct Element<'i> {
    /// Without the prefix of a namespace.
    name: &'i str,
    first_attribute: u32,
    attributes: u32,
    /// Position of the next element that is not inside of this one.
    end: u32,
}

/// A document, which borrows from its text.
#[derive(Debug, Default)]
pub(super) struct Document<'i> {
    /// In the order of the text: the root first.
    elements: Vec<Element<'i>>,
    attributes: Vec<(&'i str, Cow<'i, str>)>,
    /// Each with the position of the element it stands in.
    texts: Vec<(u32, Cow<'i, str>)>,
}

/// One element of a document.
#[derive(Clone, Copy, Debug)]
pub(super) struct Node<'a, 'i> {
    document: &'a Document<'i>,
    index: u32,
}

impl<'i> Document<'i> {
    pub(super) fn parse(text: &'i str) -> Result<Self, Refusal> {
        let mut reader = Reader { text, at: 0, open: Vec::new(), document: Self::default() };
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

    pub(super) fn root(&self) -> Node<'_, 'i> {
        Node { document: self, index: 0 }
    }
}

impl<'a, 'i> Node<'a, 'i> {
    fn element(self) -> Option<&'a Element<'i>> {
        self.document.elements.get(self.index as usize)
    }

    pub(super) fn name(self) -> &'a str {
        self.element().map_or("", |element| element.name)
    }

    pub(super) fn attribute(self, name: &str) -> Option<&'a str> {
        let element = self.element()?;
        let first = element.first_attribute as usize;
        let own = self.document.attributes.get(first..first + element.attributes as usize)?;
        own.iter().find(|(known, _)| *known == name).map(|(_, value)| value.as_ref())
    }

    /// The elements directly inside.
    pub(super) fn children(self) -> impl Iterator<Item = Self> {
        let document = self.document;
        let end = self.element().map_or(0, |element| element.end);
        let mut index = self.index + 1;
        std::iter::from_fn(move || {
            let child = Self { document, index };
            index = child.element().filter(|_| index < end)?.end;
            Some(child)
        })
    }

    /// All text inside, also that of inner elements.
    pub(super) fn text(self) -> String {
        let end = self.element().map_or(0, |element| element.end);
        let texts = self.document.texts.iter();
        let inside = texts.filter(|(element, _)| (self.index..end).contains(element));
        inside.map(|(_, text)| text.as_ref()).collect()
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

impl<'i> Reader<'i> {
    fn read(&mut self) -> Result<(), Fault> {
        while let Some(length) = self.rest().find('<') {
            let words = self.take(length);
            self.words(words, true)?;
            let rest = self.rest();
            if rest.starts_with("<!--") {
                self.at += 4;
                self.until("-->", "a comment without end")?;
            } else if rest.starts_with("<![CDATA[") {
                self.at += 9;
                let words = self.until("]]>", "a CDATA section without end")?;
                self.words(words, false)?;
            } else if rest.starts_with("<?") {
                self.until("?>", "an instruction without end")?;
            } else if rest.starts_with("<!") {
                return Err(Fault::Malformed("a declaration"));
            } else if rest.starts_with("</") {
                self.close()?;
            } else {
                self.open()?;
            }
        }
        self.words(self.rest(), true)?;
        match (self.open.last(), self.document.elements.is_empty()) {
            (Some(_), _) => Err(Fault::Malformed("an element without end")),
            (None, true) => Err(Fault::Malformed("no element")),
            (None, false) => Ok(()),
        }
    }

    fn rest(&self) -> &'i str {
        self.text.get(self.at..).unwrap_or("")
    }

    fn take(&mut self, length: usize) -> &'i str {
        let taken = self.rest().get(..length).unwrap_or("");
        self.at += taken.len();
        taken
    }

    /// The text up to a mark, which is passed.
    fn until(&mut self, mark: &str, fault: &'static str) -> Result<&'i str, Fault> {
        let length = self.rest().find(mark).ok_or(Fault::Malformed(fault))?;
        let taken = self.take(length);
        self.at += mark.len();
        Ok(taken)
    }

    fn words(&mut self, words: &'i str, is_encoded: bool) -> Result<(), Fault> {
        if words.bytes().all(|byte| byte.is_ascii_whitespace()) {
            return Ok(());
        }
        let Some((_, element)) = self.open.last() else {
            return Err(Fault::Malformed("text outside of all elements"));
        };
        let words = if is_encoded { decoded(words)? } else { Cow::Borrowed(words) };
        self.document.texts.push((*element, words));
        Ok(())
    }

    fn skip_space(&mut self) {
        let is_space = |byte: &u8| byte.is_ascii_whitespace();
        let rest = self.text.as_bytes().get(self.at..).unwrap_or_default();
        self.at += rest.iter().take_while(|byte| is_space(byte)).count();
    }

    fn peek(&self) -> Option<u8> {
        self.text.as_bytes().get(self.at).copied()
    }

    fn name(&mut self) -> Result<&'i str, Fault> {
        let is_part = |byte: &u8| {
            byte.is_ascii_alphanumeric() || matches!(byte, b'_' | b'-' | b'.' | b':' | 128..)
        };
        let rest = self.text.as_bytes().get(self.at..).unwrap_or_default();
        let length = rest.iter().take_while(|byte| is_part(byte)).count();
        let name = self.take(length);
        let starts_well = !name.starts_with(|c: char| c.is_ascii_digit() || c == '-' || c == '.');
        if name.is_empty() || !starts_well {
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
        self.document.elements.push(Element {
            name: name.rsplit(':').next().unwrap_or(name),
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
            let name = self.name()?;
            let value = self.value()?;
            let known = self.document.attributes.get(first..).unwrap_or_default();
            if known.len() >= ATTRIBUTES_MAX {
                let wanted = format!("at most {ATTRIBUTES_MAX} attributes of an element");
                return Err(Fault::Limit(wanted, "more"));
            }
            if known.iter().any(|(known, _)| *known == name) {
                return Err(Fault::Malformed("an attribute twice"));
            }
            self.document.attributes.push((name, value));
        }
    }

    fn value(&mut self) -> Result<Cow<'i, str>, Fault> {
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
        let rest = self.text.as_bytes().get(self.at..).unwrap_or_default();
        let length = rest.iter().position(|byte| *byte == quote);
        let length = length.ok_or(Fault::Malformed("a value without end"))?;
        let value = self.take(length);
        self.at += 1;
        if value.contains('<') {
            return Err(Fault::Malformed("a < within a value"));
        }
        decoded(value)
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

#[cfg(test)]
mod tests {
    use super::*;

    /// Names of elements, each with its attributes.
    type Seen = Vec<(String, Vec<(String, String)>)>;

    fn by_another(text: &str) -> Option<Seen> {
        let document = roxmltree::Document::parse(text).ok()?;
        let own = |node: roxmltree::Node<'_, '_>| {
            let pairs = node.attributes();
            pairs.map(|pair| (pair.name().to_owned(), pair.value().to_owned())).collect()
        };
        let elements = document.descendants().filter(roxmltree::Node::is_element);
        Some(elements.map(|node| (node.tag_name().name().to_owned(), own(node))).collect())
    }

    fn by_this(text: &str) -> Option<Seen> {
        let document = Document::parse(text).ok()?;
        let all = |element: &Element<'_>| {
            let first = element.first_attribute as usize;
            let own = document.attributes.get(first..first + element.attributes as usize).unwrap();
            let pairs = own.iter().map(|(name, value)| ((*name).to_owned(), value.to_string()));
            (element.name.to_owned(), pairs.collect())
        };
        Some(document.elements.iter().map(all).collect())
    }

    #[test]
    fn documents_read_as_another_reader_reads_them() {
        let town = crate::town::build("Town01").unwrap();
        for text in [
            "<a/>",
            "<?xml version=\"1.0\"?>\n<!-- <b> --><a x='1' y = \"&lt;&#65;&#x42;'\"><b/>t<c></c ></a>\n",
            "<a><![CDATA[<x>]]></a>",
            "<a é=\"ü\"/>",
            &town,
        ] {
            let wanted = by_another(text);
            assert!(wanted.is_some(), "{text}");
            assert_eq!(by_this(text), wanted, "{text}");
        }
    }

    #[test]
    fn what_another_reader_refuses_is_refused() {
        for text in [
            "",
            "a",
            "<a>",
            "</a>",
            "<a></b>",
            "<a/><b/>",
            "<a x=1/>",
            "<a x/>",
            "<a x=\"1/>",
            "<a x=\"1\"y=\"2\"/>",
            "<a x=\"1\" x=\"2\"/>",
            "<a x=\"<\"/>",
            "<a>&b;</a>",
            "<a",
            "< a/>",
            "<a>&</a>",
            "<!DOCTYPE a><a/>",
            "<a><!-- </a>",
            "<a><![CDATA[ </a>",
            "<1/>",
            "t<a/>",
            "<a/>t",
        ] {
            let options = roxmltree::ParsingOptions { allow_dtd: false, ..Default::default() };
            let other = roxmltree::Document::parse_with_options(text, options);
            assert!(other.is_err(), "{text}");
            assert!(Document::parse(text).is_err(), "{text}");
        }
    }

    #[test]
    fn children_text_and_attributes_are_found() {
        let text = "<r a='1'><x><y/>in <z>out</z></x><n:x p:b='2' b='3'/></r>";
        let document = Document::parse(text).unwrap();
        let root = document.root();
        assert_eq!((root.name(), root.attribute("a"), root.attribute("b")), ("r", Some("1"), None));
        let names: Vec<&str> = root.children().map(Node::name).collect();
        assert_eq!(names, ["x", "x"]);
        let [first, second] = [0, 1].map(|k| root.children().nth(k).unwrap());
        assert_eq!((first.text().as_str(), second.attribute("b")), ("in out", Some("3")));
        assert_eq!(first.children().map(Node::name).collect::<Vec<_>>(), ["y", "z"]);
    }

    #[test]
    fn faults_are_named_with_their_line() {
        let refusal = Document::parse("<a>\n<b></a>").unwrap_err();
        assert_eq!(refusal.found, "an end tag of another element in line 2");
        let deep = "<a>".repeat(65);
        assert!(Document::parse(&deep).unwrap_err().wanted.contains("64 nested"), "{deep}");
    }
}

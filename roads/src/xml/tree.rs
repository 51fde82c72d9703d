//! Elements, attributes and text of a part of an XML document, and nothing else of it.
//!
//! Positions in the text and no copies, but where entities stand: maps are megabytes long and made
//! of attributes. [`super::reader`] fills it.

use std::ops::Range;

#[derive(Debug)]
pub(super) struct Element<'i> {
    /// Without the prefix of a namespace.
    pub(super) name: &'i str,
    pub(super) key: u64,
    pub(super) first_attribute: u32,
    pub(super) attributes: u32,
    /// Position of the next element that is not inside of this one.
    pub(super) end: u32,
}

/// Where name and value of an attribute stand in the text.
#[derive(Clone, Copy, Debug)]
pub(super) struct Attribute {
    pub(super) key: u64,
    pub(super) name: [u32; 2],
    pub(super) value: [u32; 2],
}

/// The first eight bytes of a name, as a number. Names are compared all the time, and most are
/// told apart by it.
#[inline]
pub(super) fn key(name: &str) -> u64 {
    let bytes = name.bytes().take(size_of::<u64>()).enumerate();
    bytes.fold(0, |key, (index, byte)| key | u64::from(byte) << (8 * index))
}

/// Whether the key says all about a name: no name has a zero byte.
fn is_short(name: &str) -> bool {
    name.len() < 8
}

/// An element with all inside of it, which borrows from the text.
#[derive(Debug, Default)]
pub(super) struct Part<'i> {
    pub(super) text: &'i str,
    /// In the order of the text: the outermost first.
    pub(super) elements: Vec<Element<'i>>,
    pub(super) attributes: Vec<Attribute>,
    /// Values in which entities stood, each with the position of its attribute.
    pub(super) decoded: Vec<(u32, String)>,
    /// Each with the position of the element it stands in.
    pub(super) words: Vec<(u32, String)>,
}

/// One element of a part.
#[derive(Clone, Copy, Debug)]
pub(super) struct Node<'a, 'i> {
    part: &'a Part<'i>,
    index: u32,
}

impl<'i> Part<'i> {
    pub(super) fn root(&self) -> Node<'_, 'i> {
        Node { part: self, index: 0 }
    }

    /// Makes room for the next one.
    pub(super) fn clear(&mut self) {
        self.elements.clear();
        self.attributes.clear();
        self.decoded.clear();
        self.words.clear();
    }

    pub(super) fn slice(&self, [from, to]: [u32; 2]) -> &'i str {
        self.text.get(from as usize..to as usize).unwrap_or("")
    }

    /// `key` is that of the name.
    #[inline]
    pub(super) fn is_named(&self, attribute: &Attribute, key: u64, name: &str) -> bool {
        attribute.key == key && (is_short(name) || self.slice(attribute.name) == name)
    }

    fn own_attributes(&self, element: &Element<'_>) -> Range<usize> {
        let first = element.first_attribute as usize;
        first..first + element.attributes as usize
    }

    /// Value of the attribute at a position.
    fn value(&self, index: usize) -> Option<&str> {
        if !self.decoded.is_empty()
            && let Ok(known) = self.decoded.binary_search_by_key(&index, |(at, _)| *at as usize)
        {
            return self.decoded.get(known).map(|(_, value)| value.as_str());
        }
        self.attributes.get(index).map(|attribute| self.slice(attribute.value))
    }
}

impl<'a, 'i> Node<'a, 'i> {
    fn element(self) -> Option<&'a Element<'i>> {
        self.part.elements.get(self.index as usize)
    }

    pub(super) fn name(self) -> &'a str {
        self.element().map_or("", |element| element.name)
    }

    #[inline]
    pub(super) fn attribute(self, name: &str) -> Option<&'a str> {
        let own = self.part.own_attributes(self.element()?);
        let (first, key) = (own.start, key(name));
        let mut own = self.part.attributes.get(own)?.iter();
        let index = own.position(|known| self.part.is_named(known, key, name))?;
        self.part.value(first + index)
    }

    /// The elements directly inside.
    pub(super) fn children(self) -> impl Iterator<Item = Self> {
        self.elements().map(|(child, _)| child)
    }

    /// The elements directly inside that have this name.
    #[inline]
    pub(super) fn children_named(self, name: &'static str) -> impl Iterator<Item = Self> {
        let key = key(name);
        let is_it = move |element: &Element<'_>| {
            element.key == key && (is_short(name) || element.name == name)
        };
        self.elements().filter(move |(_, element)| is_it(element)).map(|(child, _)| child)
    }

    fn elements(self) -> impl Iterator<Item = (Self, &'a Element<'i>)> {
        let part = self.part;
        let end = self.element().map_or(0, |element| element.end);
        let mut index = self.index + 1;
        std::iter::from_fn(move || {
            let child = Self { part, index };
            let element = child.element().filter(|_| index < end)?;
            index = element.end;
            Some((child, element))
        })
    }

    /// All text inside, also that of inner elements.
    pub(super) fn text(self) -> String {
        let end = self.element().map_or(0, |element| element.end);
        let words = self.part.words.iter();
        let inside = words.filter(|(element, _)| (self.index..end).contains(element));
        inside.map(|(_, text)| text.as_str()).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::super::reader::parse;
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
        let mut seen = Seen::new();
        let all = |part: &Part<'_>, element: &Element<'_>| {
            let own = part.own_attributes(element);
            let pairs = own.map(|index| {
                let name = part.slice(part.attributes[index].name);
                (name.to_owned(), part.value(index).unwrap().to_owned())
            });
            (element.name.to_owned(), pairs.collect())
        };
        let tell = |_, node: Node<'_, '_>| {
            seen.extend(node.part.elements.iter().map(|element| all(node.part, element)));
        };
        parse(text, tell).ok()?;
        Some(seen)
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
            assert!(parse(text, |_, _| ()).is_err(), "{text}");
        }
    }

    #[test]
    fn children_text_and_attributes_are_found() {
        let text =
            "<all><r a='1' attribute='4'><x><y/>in <z>out</z></x><n:x p:b='2' b='3'/></r></all>";
        let mut parts = Vec::new();
        let tell = |is_root, root: Node<'_, '_>| {
            parts.push((is_root, root.name().to_owned()));
            if is_root {
                return;
            }
            let attributes = ["a", "b", "attribute", "attribut"].map(|name| root.attribute(name));
            assert_eq!(attributes, [Some("1"), None, Some("4"), None]);
            let names: Vec<&str> = root.children().map(Node::name).collect();
            assert_eq!(names, ["x", "x"]);
            let [first, second] = [0, 1].map(|k| root.children_named("x").nth(k).unwrap());
            assert_eq!((first.text().as_str(), second.attribute("b")), ("in out", Some("3")));
            assert_eq!(first.children().map(Node::name).collect::<Vec<_>>(), ["y", "z"]);
        };
        parse(text, tell).unwrap();
        assert_eq!(parts, [(true, "all".to_owned()), (false, "r".to_owned())]);
    }

    #[test]
    fn faults_are_named_with_their_line() {
        let refusal = parse("<a>\n<b></a>", |_, _| ()).unwrap_err();
        assert_eq!(refusal.found, "an end tag of another element in line 2");
        let deep = "<a>".repeat(65);
        assert!(parse(&deep, |_, _| ()).unwrap_err().wanted.contains("64 nested"), "{deep}");
    }
}

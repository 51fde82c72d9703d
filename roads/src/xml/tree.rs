//! Elements, attributes and text of an XML document, and nothing else of it.
//!
//! Positions in the text and no copies, but where entities stand: maps are megabytes long and made
//! of attributes. [`super::reader`] fills it.

use std::ops::Range;

#[derive(Debug)]
pub(super) struct Element<'i> {
    /// Without the prefix of a namespace.
    pub(super) name: &'i str,
    pub(super) first_attribute: u32,
    pub(super) attributes: u32,
    /// Position of the next element that is not inside of this one.
    pub(super) end: u32,
}

/// Where name and value of an attribute stand in the text.
#[derive(Clone, Copy, Debug)]
pub(super) struct Attribute {
    pub(super) name: [u32; 2],
    pub(super) value: [u32; 2],
}

/// A document, which borrows from its text.
#[derive(Debug, Default)]
pub(super) struct Document<'i> {
    pub(super) text: &'i str,
    /// In the order of the text: the root first.
    pub(super) elements: Vec<Element<'i>>,
    pub(super) attributes: Vec<Attribute>,
    /// Values in which entities stood, each with the position of its attribute.
    pub(super) decoded: Vec<(u32, String)>,
    /// Each with the position of the element it stands in.
    pub(super) words: Vec<(u32, String)>,
}

/// One element of a document.
#[derive(Clone, Copy, Debug)]
pub(super) struct Node<'a, 'i> {
    document: &'a Document<'i>,
    index: u32,
}

impl<'i> Document<'i> {
    pub(super) fn root(&self) -> Node<'_, 'i> {
        Node { document: self, index: 0 }
    }

    pub(super) fn slice(&self, [from, to]: [u32; 2]) -> &'i str {
        self.text.get(from as usize..to as usize).unwrap_or("")
    }

    pub(super) fn is_named(&self, attribute: &Attribute, name: &str) -> bool {
        let [from, to] = attribute.name;
        // Most names differ in length, which is quickly asked.
        (to - from) as usize == name.len() && self.slice(attribute.name) == name
    }

    fn own_attributes(&self, element: &Element<'_>) -> Range<u32> {
        element.first_attribute..element.first_attribute + element.attributes
    }

    /// Name and value of the attribute at a position.
    fn attribute(&self, index: u32) -> Option<(&'i str, &str)> {
        let attribute = self.attributes.get(index as usize)?;
        let value = match self.decoded.binary_search_by_key(&index, |(known, _)| *known) {
            Ok(known) => self.decoded.get(known).map_or("", |(_, value)| value),
            Err(_) => self.slice(attribute.value),
        };
        Some((self.slice(attribute.name), value))
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
        let own = self.document.own_attributes(self.element()?);
        let is_it = |index: &u32| {
            let known = self.document.attributes.get(*index as usize);
            known.is_some_and(|known| self.document.is_named(known, name))
        };
        let index = own.into_iter().find(is_it)?;
        self.document.attribute(index).map(|(_, value)| value)
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
        let words = self.document.words.iter();
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
        let document = parse(text).ok()?;
        let all = |element: &Element<'_>| {
            let own = document.own_attributes(element);
            let pairs = own.map(|index| document.attribute(index).unwrap());
            let pairs = pairs.map(|(name, value)| (name.to_owned(), value.to_owned()));
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
            assert!(parse(text).is_err(), "{text}");
        }
    }

    #[test]
    fn children_text_and_attributes_are_found() {
        let text = "<r a='1'><x><y/>in <z>out</z></x><n:x p:b='2' b='3'/></r>";
        let document = parse(text).unwrap();
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
        let refusal = parse("<a>\n<b></a>").unwrap_err();
        assert_eq!(refusal.found, "an end tag of another element in line 2");
        let deep = "<a>".repeat(65);
        assert!(parse(&deep).unwrap_err().wanted.contains("64 nested"), "{deep}");
    }
}

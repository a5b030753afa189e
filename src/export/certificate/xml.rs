//! Elements of a document and their writing.

use quick_xml::Writer;
use quick_xml::events::{BytesDecl, BytesEnd, BytesStart, BytesText, Event};

/// An element.
#[derive(Debug, Clone, PartialEq)]
pub struct Node {
    name: &'static str,
    attributes: Vec<(&'static str, String)>,
    content: Content,
}

#[derive(Debug, Clone, PartialEq)]
enum Content {
    Text(String),
    Nodes(Vec<Node>),
}

impl Node {
    /// An element with elements in it.
    pub fn with(name: &'static str, nodes: impl IntoIterator<Item = Self>) -> Self {
        Self {
            name,
            attributes: Vec::new(),
            content: Content::Nodes(nodes.into_iter().collect()),
        }
    }

    /// An element with text in it.
    pub fn text(name: &'static str, text: impl Into<String>) -> Self {
        Self {
            name,
            attributes: Vec::new(),
            content: Content::Text(text.into()),
        }
    }

    /// With an attribute.
    #[must_use]
    pub fn attribute(mut self, name: &'static str, value: impl Into<String>) -> Self {
        self.attributes.push((name, value.into()));
        self
    }

    /// The document that it is the root of.
    ///
    /// # Errors
    /// None in memory.
    pub fn document(&self) -> std::io::Result<String> {
        let mut writer = Writer::new_with_indent(Vec::new(), b' ', 2);
        writer.write_event(Event::Decl(BytesDecl::new("1.0", Some("UTF-8"), None)))?;
        self.write(&mut writer)?;
        let mut bytes = writer.into_inner();
        bytes.push(b'\n');
        String::from_utf8(bytes).map_err(std::io::Error::other)
    }

    fn write(&self, writer: &mut Writer<Vec<u8>>) -> std::io::Result<()> {
        let mut start = BytesStart::new(self.name);
        for (name, value) in &self.attributes {
            start.push_attribute((*name, allowed(value).as_str()));
        }
        writer.write_event(Event::Start(start))?;
        match &self.content {
            Content::Text(text) => {
                writer.write_event(Event::Text(BytesText::new(&allowed(text))))?;
            }
            Content::Nodes(nodes) => {
                for node in nodes {
                    node.write(writer)?;
                }
            }
        }
        writer.write_event(Event::End(BytesEnd::new(self.name)))
    }
}

/// Text with U+FFFD in place of characters that XML 1.0 (2.2) does not have.
fn allowed(text: &str) -> String {
    let known = |c: char| matches!(c, '\t' | '\n' | '\r' | '\u{20}'..='\u{FFFD}' | '\u{10000}'..);
    text.chars()
        .map(|c| if known(c) { c } else { '\u{FFFD}' })
        .collect()
}

//! Writing GraphML: the same draft gives the same bytes, one node or edge a line.

use super::{INTEGER_IDS, WEIGHT};
use crate::error::FormatError;
use crate::network::{NetworkDraft, NodeDraft, SegmentDraft};
use crate::networks::attributes::{
    AttributeKind, OF_NODES, OF_SEGMENTS, is_integer_text, node_members, position_names,
    segment_members, written_position,
};
use quick_xml::Writer;
use quick_xml::events::{BytesText, Event};
use serde_json::Value;
use std::borrow::Cow;
use std::io;

/// The replacement character: what is written for a character that XML has no place for.
const REPLACEMENT: &str = "\u{fffd}";

/// A network as GraphML.
#[derive(Clone, Debug)]
pub struct WrittenGraphml {
    /// The document.
    pub text: String,
    /// What the format has no place for, a line each.
    pub losses: Vec<String>,
}

/// Writes a network that `networkx.read_graphml` reads, with ids, positions and all that is known.
///
/// # Errors
/// An id with a character that XML has no place for, which would make it another id.
pub fn write_graphml(draft: &NetworkDraft) -> Result<WrittenGraphml, FormatError> {
    check_ids(draft)?;
    let mut writer = GraphmlWriter {
        xml: Writer::new(Vec::new()),
        losses: Vec::new(),
    };
    writer
        .document(draft)
        .expect("writing to memory does not fail");
    let body = String::from_utf8(writer.xml.into_inner()).expect("text is written");
    Ok(WrittenGraphml {
        text: format!("<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n{body}\n"),
        losses: writer.losses,
    })
}

fn check_ids(draft: &NetworkDraft) -> Result<(), FormatError> {
    let nodes = draft.nodes.iter().map(|node| ("node", &node.id));
    let segments = draft.segments.iter();
    let segments = segments.filter_map(|segment| Some(("segment", segment.id.as_ref()?)));
    match nodes
        .chain(segments)
        .find(|(_, id)| !id.chars().all(is_xml))
    {
        None => Ok(()),
        Some((kind, id)) => Err(FormatError::new(
            "",
            "has an id with a character that XML has no place for",
        )
        .of(format!("{kind} '{}'", id.escape_debug()))
        .hint("give it another id, or write another format")),
    }
}

/// The characters of XML 1.0, section 2.2.
fn is_xml(character: char) -> bool {
    matches!(character, '\t' | '\n' | '\r' | ' '..='\u{d7ff}' | '\u{e000}'..='\u{fffd}' | '\u{10000}'..)
}

struct GraphmlWriter {
    xml: Writer<Vec<u8>>,
    losses: Vec<String>,
}

impl GraphmlWriter {
    fn document(&mut self, draft: &NetworkDraft) -> io::Result<()> {
        self.open(
            "graphml",
            &[("xmlns", "http://graphml.graphdrawing.org/xmlns")],
        )?;
        self.keys(draft)?;
        self.open("graph", &[("edgedefault", "undirected")])?;
        self.data("graph", "name", &draft.name)?;
        self.data("graph", "attribution", &draft.attribution)?;
        let look_like_integers = draft.nodes.iter().all(|node| is_integer_text(&node.id));
        if look_like_integers && !draft.integer_ids {
            self.data("graph", INTEGER_IDS, "false")?;
        }
        self.line()?;
        for node in &draft.nodes {
            self.node(draft, node)?;
        }
        for segment in &draft.segments {
            self.edge(segment)?;
        }
        self.close("graph")?;
        self.close("graphml")
    }

    fn keys(&mut self, draft: &NetworkDraft) -> io::Result<()> {
        for name in ["name", "attribution"] {
            self.key("graph", name, "string")?;
        }
        self.key("graph", INTEGER_IDS, "boolean")?;
        for name in position_names(draft.coordinates) {
            self.key("node", name, "double")?;
        }
        for (name, kind) in OF_NODES {
            self.key("node", name, type_name(kind))?;
        }
        for (name, kind) in OF_SEGMENTS {
            self.key("edge", edge_name(name), type_name(kind))?;
        }
        Ok(())
    }

    fn key(&mut self, domain: &str, name: &str, kind: &str) -> io::Result<()> {
        let id = key_id(domain, name);
        let attributes = [
            ("id", id.as_str()),
            ("for", domain),
            ("attr.name", name),
            ("attr.type", kind),
        ];
        let key = self.xml.create_element("key");
        key.with_attributes(attributes).write_empty()?;
        self.line()
    }

    fn node(&mut self, draft: &NetworkDraft, node: &NodeDraft) -> io::Result<()> {
        self.begin("node", &[("id", &node.id)])?;
        let position = written_position(draft.coordinates, node.position);
        for (name, coordinate) in position_names(draft.coordinates).into_iter().zip(position) {
            self.data("node", name, &coordinate.to_string())?;
        }
        for (name, value) in &node_members(node) {
            self.member("node", name, value, &node.id)?;
        }
        self.close("node")
    }

    fn edge(&mut self, segment: &SegmentDraft) -> io::Result<()> {
        let ends = [
            ("source", segment.from.as_str()),
            ("target", segment.to.as_str()),
        ];
        let id = segment.id.iter().map(|id| ("id", id.as_str()));
        let attributes: Vec<(&str, &str)> = id.chain(ends).collect();
        self.begin("edge", &attributes)?;
        for (name, value) in &segment_members(segment) {
            self.member("edge", edge_name(name), value, "")?;
        }
        self.close("edge")
    }

    fn member(&mut self, domain: &str, name: &str, value: &Value, id: &str) -> io::Result<()> {
        let Value::String(words) = value else {
            return self.data(domain, name, &value.to_string());
        };
        if !words.chars().all(is_xml) {
            self.lose(&format!("the {name} of the {domain} '{id}'"));
        }
        self.data(domain, name, words)
    }

    fn data(&mut self, domain: &str, name: &str, text: &str) -> io::Result<()> {
        if domain == "graph" && !text.chars().all(is_xml) {
            self.lose(&format!("the {name} of the network"));
        }
        let text = match text.chars().all(is_xml) {
            true => Cow::Borrowed(text),
            false => Cow::Owned(text.replace(|character| !is_xml(character), REPLACEMENT)),
        };
        let id = key_id(domain, name);
        let data = self.xml.create_element("data");
        let data = data.with_attribute(("key", id.as_str()));
        data.write_text_content(BytesText::new(&text))?;
        Ok(())
    }

    fn lose(&mut self, place: &str) {
        self.losses.push(format!(
            "{place} has characters that XML has no place for; {REPLACEMENT} is written for them"
        ));
    }

    fn begin(&mut self, name: &str, attributes: &[(&str, &str)]) -> io::Result<()> {
        let start = quick_xml::events::BytesStart::new(name);
        let start = start.with_attributes(attributes.iter().copied());
        self.xml.write_event(Event::Start(start))
    }

    /// Begins an element whose content has lines of its own.
    fn open(&mut self, name: &str, attributes: &[(&str, &str)]) -> io::Result<()> {
        self.begin(name, attributes)?;
        self.line()
    }

    fn close(&mut self, name: &str) -> io::Result<()> {
        let end = quick_xml::events::BytesEnd::new(name);
        self.xml.write_event(Event::End(end))?;
        self.line()
    }

    fn line(&mut self) -> io::Result<()> {
        self.xml.write_event(Event::Text(BytesText::new("\n")))
    }
}

fn key_id(domain: &str, name: &str) -> String {
    format!("{domain}-{name}")
}

/// The length goes by the name under which NetworkX looks for it.
fn edge_name(name: &str) -> &str {
    match name {
        "length_m" => WEIGHT,
        other => other,
    }
}

fn type_name(kind: AttributeKind) -> &'static str {
    match kind {
        AttributeKind::Whole => "long",
        AttributeKind::Real => "double",
        AttributeKind::Text => "string",
    }
}

//! Reading GraphML: keys, and the data that nodes and edges have by them.

use super::{INTEGER_IDS, WEIGHT};
use crate::error::{FormatError, FormatErrors};
use crate::network::{NetworkDraft, SegmentDraft};
use crate::networks::attributes::{
    AttributeKind, OF_NODES, OF_SEGMENTS, ReadNetwork, Unread, add_node, is_integer_text,
    read_node, read_segment,
};
use crate::place::{Place, optional};
use roxmltree::{Document, Node, ParsingOptions};
use rustc_hash::{FxHashMap, FxHashSet};
use serde_json::{Map, Number, Value};

/// Nothing larger is read: the tree of a document takes several times its bytes.
pub const MAX_GRAPHML_BYTES: usize = 256 << 20;
/// Elements, texts and comments that are read.
const MAX_XML_NODES: u32 = 20_000_000;
/// A position as a text of two numbers, as layouts of NetworkX are often kept.
const POSITION: &str = "pos";
/// The coordinate reference system of `x` and `y`, as OSMnx states it.
const REFERENCE_SYSTEM: &str = "crs";
/// What is read of the graph as a whole.
const OF_GRAPH: [&str; 4] = ["name", "attribution", INTEGER_IDS, REFERENCE_SYSTEM];

type Members = Map<String, Value>;

/// Reads GraphML. Repairs are for the caller: see [`NetworkDraft::repair`].
///
/// # Errors
/// Each with its line and the node or edge it belongs to, up to a bound.
pub fn read_graphml(text: &str) -> Result<ReadNetwork, Vec<FormatError>> {
    let refused = |message: String| vec![FormatError::new("", message)];
    if text.len() > MAX_GRAPHML_BYTES {
        let limit = MAX_GRAPHML_BYTES >> 20;
        return Err(refused(format!(
            "is GraphML of more than {limit} MiB; write the network as node-link JSON or CSV"
        )));
    }
    let options = ParsingOptions {
        nodes_limit: MAX_XML_NODES,
        ..ParsingOptions::default()
    };
    let document = Document::parse_with_options(text, options)
        .map_err(|error| refused(format!("is not XML that can be read: {error}")))?;
    let root = document.root_element();
    let mut graphs = elements(root, "graph");
    let graph = match (graphs.next(), graphs.next()) {
        (Some(graph), None) => graph,
        (None, _) => return Err(refused("has no <graph> in its <graphml>".to_owned())),
        (Some(_), Some(_)) => {
            return Err(refused(
                "has several graphs; write the one that is the skyway by itself".to_owned(),
            ));
        }
    };
    Reader::new(root, graph).read()
}

/// The children of this name.
fn elements<'d>(
    parent: Node<'d, 'd>,
    name: &'static str,
) -> impl Iterator<Item = Node<'d, 'd>> + use<'d> {
    let children = parent.children().filter(Node::is_element);
    children.filter(move |child| child.tag_name().name() == name)
}

/// What a `<key>` declares.
struct Key<'d> {
    name: &'d str,
    /// `graph`, `node`, `edge` or `all`.
    domain: &'d str,
    default: Option<String>,
}

struct Reader<'d> {
    graph: Node<'d, 'd>,
    keys: FxHashMap<&'d str, Key<'d>>,
    is_geographic: bool,
    unread: Unread,
    errors: FormatErrors,
}

impl<'d> Reader<'d> {
    fn new(root: Node<'d, 'd>, graph: Node<'d, 'd>) -> Self {
        let key = |key: Node<'d, 'd>| {
            let id = key.attribute("id").unwrap_or_default();
            let declared = Key {
                name: key.attribute("attr.name").unwrap_or(id),
                domain: key.attribute("for").unwrap_or("all"),
                default: elements(key, "default").next().map(text_of),
            };
            (id, declared)
        };
        Self {
            graph,
            keys: elements(root, "key").map(key).collect(),
            is_geographic: false,
            unread: Unread::default(),
            errors: FormatErrors::default(),
        }
    }

    fn read(mut self) -> Result<ReadNetwork, Vec<FormatError>> {
        let facts = self.members(self.graph, "graph").unwrap_or_else(|error| {
            self.refuse(error, self.graph, "graph");
            Members::new()
        });
        let names = facts.keys().map(String::as_str);
        self.unread.of_graph(names, &OF_GRAPH);
        let words = |name: &str| facts.get(name).and_then(Value::as_str);
        self.is_geographic = words(REFERENCE_SYSTEM).is_some_and(is_degrees);
        let mut draft = NetworkDraft {
            name: words("name").unwrap_or("GraphML network").to_owned(),
            attribution: words("attribution").unwrap_or_default().to_owned(),
            ..NetworkDraft::default()
        };
        self.check_kind();
        self.read_nodes(&mut draft);
        self.read_edges(&mut draft);
        let are_text = words(INTEGER_IDS).is_some_and(|said| said.eq_ignore_ascii_case("false"));
        draft.integer_ids = !are_text && draft.nodes.iter().all(|node| is_integer_text(&node.id));
        let unread = self.unread;
        self.errors.or(ReadNetwork { draft, unread })
    }

    /// Refuses graphs of a kind that a skyway is not.
    fn check_kind(&mut self) {
        if self.graph.attribute("edgedefault") == Some("directed") {
            let error = FormatError::new("", "is a directed graph; a skyway is undirected");
            let error = error.hint("convert it with nx.Graph(graph) and write it again");
            self.refuse(error, self.graph, "graph");
        }
        if let Some(hyperedge) = elements(self.graph, "hyperedge").next() {
            let error = FormatError::new("", "joins any number of nodes; a segment joins two");
            self.refuse(error, hyperedge, "hyperedge");
        }
    }

    fn read_nodes(&mut self, draft: &mut NetworkDraft) {
        for node in elements(self.graph, "node") {
            if self.errors.is_full() {
                return;
            }
            if let Err(error) = self.read_node(node, draft) {
                let id = node.attribute("id").unwrap_or("?");
                self.refuse(error, node, &format!("node '{id}'"));
            }
        }
    }

    fn read_node(
        &mut self,
        node: Node<'d, 'd>,
        draft: &mut NetworkDraft,
    ) -> Result<(), FormatError> {
        let place = Place::ROOT;
        if elements(node, "graph").next().is_some() {
            return Err(place.error("has a graph inside; a rooftop is a single node"));
        }
        let mut members = self.members(node, "node")?;
        self.unread
            .of_node(members.keys().map(String::as_str), &[POSITION]);
        put_attribute(&mut members, node, "id");
        self.settle_position(&mut members)?;
        add_node(draft, read_node(&members, &place)?, &place)
    }

    /// Gives a node the two numbers by the names that say what they are.
    fn settle_position(&self, members: &mut Members) -> Result<(), FormatError> {
        let has = |members: &Members, name: &str| optional(members, name).is_some();
        let stated = ["x", "y", "lon", "lat"];
        if !stated.iter().any(|name| has(members, name))
            && let Some(Value::String(text)) = members.get(POSITION)
        {
            let [x, y] = two_numbers(text).ok_or_else(|| {
                let message = format!("is '{text}', not two numbers");
                Place::ROOT.member(POSITION).error(message)
            })?;
            members.insert("x".to_owned(), Value::Number(x));
            members.insert("y".to_owned(), Value::Number(y));
        }
        if self.is_geographic && !has(members, "lon") {
            for (planar, degrees) in [("x", "lon"), ("y", "lat")] {
                if let Some(coordinate) = members.remove(planar) {
                    members.insert(degrees.to_owned(), coordinate);
                }
            }
        }
        Ok(())
    }

    fn read_edges(&mut self, draft: &mut NetworkDraft) {
        let mut ids = elements(self.graph, "edge").filter_map(|edge| edge.attribute("id"));
        let mut seen = FxHashSet::default();
        // Of a multigraph NetworkX writes the keys of parallel edges here, the same for each pair of nodes.
        let has_ids = ids.all(|id| seen.insert(id));
        for (index, edge) in elements(self.graph, "edge").enumerate() {
            if self.errors.is_full() {
                return;
            }
            match self.read_edge(edge, has_ids) {
                Ok(segment) => draft.segments.push(segment),
                Err(error) => self.refuse(error, edge, &format!("edge {index}")),
            }
        }
    }

    fn read_edge(
        &mut self,
        edge: Node<'d, 'd>,
        has_ids: bool,
    ) -> Result<SegmentDraft, FormatError> {
        let place = Place::ROOT;
        if edge.attribute("directed") == Some("true") {
            let error = place.error("is directed; a segment is flown both ways");
            return Err(error.hint("convert the graph with nx.Graph(graph) and write it again"));
        }
        let mut members = self.members(edge, "edge")?;
        self.unread
            .of_segment(members.keys().map(String::as_str), &[]);
        put_attribute(&mut members, edge, "source");
        put_attribute(&mut members, edge, "target");
        if has_ids && optional(&members, "id").is_none() {
            put_attribute(&mut members, edge, "id");
        }
        read_segment(&members, &place)
    }

    /// What an element has by its `<data>`, and by the defaults of the keys.
    fn members(&self, element: Node<'d, 'd>, domain: &str) -> Result<Members, FormatError> {
        let mut members = Members::new();
        let is_for = |key: &Key<'_>| key.domain == domain || key.domain == "all";
        for key in self.keys.values().filter(|key| is_for(key)) {
            if let Some(default) = &key.default {
                members.insert(key.name.to_owned(), value(key.name, default)?);
            }
        }
        for data in elements(element, "data") {
            let id = data.attribute("key").unwrap_or_default();
            let key = self.keys.get(id).ok_or_else(|| {
                Place::ROOT.error(format!(
                    "has data of the key '{id}', which no <key> declares"
                ))
            })?;
            members.insert(key.name.to_owned(), value(key.name, &text_of(data))?);
        }
        Ok(members)
    }

    fn refuse(&mut self, mut error: FormatError, element: Node<'_, '_>, feature: &str) {
        let line = element.document().text_pos_at(element.range().start).row;
        error.pointer.insert_str(0, &format!("/line {line}"));
        self.errors.push(error.of(feature));
    }
}

/// Puts what an element states as an attribute of XML; without it the reader of members tells what is missing.
fn put_attribute(members: &mut Members, element: Node<'_, '_>, name: &str) {
    if let Some(stated) = element.attribute(name) {
        members.insert(name.to_owned(), Value::from(stated));
    }
}

/// All text in an element, around comments.
fn text_of(element: Node<'_, '_>) -> String {
    element
        .children()
        .filter_map(|child| child.text())
        .collect()
}

/// A value by the name of its key: numbers where numbers belong, else the text.
fn value(name: &str, text: &str) -> Result<Value, FormatError> {
    if !is_number(name) {
        return Ok(Value::from(text));
    }
    let text = text.trim();
    if text.is_empty() {
        return Ok(Value::Null);
    }
    let number = text.parse().ok().and_then(Number::from_f64);
    number.map(Value::Number).ok_or_else(|| {
        let message = format!("is '{text}', not a finite number");
        Place::ROOT.member(name).error(message)
    })
}

fn is_number(name: &str) -> bool {
    let named = OF_NODES.iter().chain(&OF_SEGMENTS);
    let mut numbers = named.filter(|(_, kind)| *kind != AttributeKind::Text);
    [WEIGHT, "x", "y", "lon", "lat"].contains(&name) || numbers.any(|(number, _)| *number == name)
}

/// Two finite numbers in a text, such as `(1.5, 2)`, `[1.5 2.0]` or `1.5,2`.
fn two_numbers(text: &str) -> Option<[Number; 2]> {
    let bare = text.trim().trim_matches(['(', ')', '[', ']']);
    let parts = bare.split([',', ' ']).filter(|part| !part.is_empty());
    let numbers = parts.map(|part| part.parse().ok().and_then(Number::from_f64));
    let numbers: Vec<Number> = numbers.collect::<Option<_>>()?;
    numbers.try_into().ok()
}

/// True for the names of WGS 84 in degrees.
fn is_degrees(reference_system: &str) -> bool {
    let name = reference_system.to_ascii_lowercase();
    ["epsg:4326", "ogc:crs84", "wgs84", "wgs 84"].contains(&name.as_str())
}

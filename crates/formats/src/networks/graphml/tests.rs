//! GraphML as NetworkX writes it, and what is wrong with what is no skyway. `round_trips` has what is written here.

use super::*;
use crate::network::{Coordinates, NetworkDraft, NodeDraft, SegmentDraft};

/// What `networkx.write_graphml` writes of a graph, with an attribute that no skyway has.
const OF_NETWORKX: &str = r#"<?xml version='1.0' encoding='utf-8'?>
<graphml xmlns="http://graphml.graphdrawing.org/xmlns" xmlns:xsi="http://www.w3.org/2001/XMLSchema-instance" xsi:schemaLocation="http://graphml.graphdrawing.org/xmlns http://graphml.graphdrawing.org/xmlns/1.0/graphml.xsd">
  <key id="d4" for="edge" attr.name="weight" attr.type="double" />
  <key id="d3" for="node" attr.name="colour" attr.type="string" />
  <key id="d2" for="node" attr.name="pads" attr.type="long"><default>1</default></key>
  <key id="d1" for="node" attr.name="y" attr.type="double" />
  <key id="d0" for="node" attr.name="x" attr.type="long" />
  <graph edgedefault="undirected">
    <node id="1"><data key="d0">0</data><data key="d1">0.5</data><data key="d2">3</data></node>
    <node id="2"><data key="d0">30</data><data key="d1">40.5</data><data key="d3">red</data></node>
    <edge source="1" target="2"><data key="d4">55.5</data></edge>
    <edge source="2" target="1"/>
  </graph>
</graphml>"#;

fn refused(original: &str, replacement: &str) -> String {
    assert!(OF_NETWORKX.contains(original), "{original}");
    let text = OF_NETWORKX.replace(original, replacement);
    let errors = read_graphml(&text).expect_err("at fault");
    errors[0].to_string()
}

/// The positions of the nodes, with what they are.
fn positions(text: &str) -> (Coordinates, Vec<[f64; 2]>) {
    let read = read_graphml(text).expect("a network").draft;
    let positions = read.nodes.iter().map(|node| node.position);
    (read.coordinates, positions.collect())
}

#[test]
fn what_networkx_writes_is_read() {
    let read = read_graphml(OF_NETWORKX).expect("a network");
    let network = read.draft;
    assert!(network.integer_ids);
    let nodes: Vec<_> = network
        .nodes
        .iter()
        .map(|node| (node.id.as_str(), node.position, node.pads))
        .collect();
    assert_eq!(nodes, [("1", [0.0, 0.5], 3), ("2", [30.0, 40.5], 1)]);
    let lengths: Vec<_> = network.segments.iter().map(|edge| edge.length_m).collect();
    assert_eq!(lengths, [Some(55.5), None]);
    assert_eq!(read.unread.lines(), ["attributes of nodes: colour"]);
}

#[test]
fn positions_go_by_their_names_or_by_the_reference_system() {
    let [x, y] = ["attr.name=\"x\"", "attr.name=\"y\""];
    let degrees = OF_NETWORKX
        .replace(x, "attr.name=\"lon\"")
        .replace(y, "attr.name=\"lat\"");
    let expected = vec![[0.0, 0.5], [30.0, 40.5]];
    assert_eq!(
        positions(OF_NETWORKX),
        (Coordinates::Planar, expected.clone())
    );
    assert_eq!(
        positions(&degrees),
        (Coordinates::Geographic, expected.clone())
    );
    // As OSMnx says it.
    let key = r#"<key id="g" for="graph" attr.name="crs" attr.type="string" /><graph edgedefault="undirected">"#;
    let stated = format!(r#"{key}<data key="g">epsg:4326</data>"#);
    let of_osmnx = OF_NETWORKX.replace(r#"<graph edgedefault="undirected">"#, &stated);
    assert_eq!(
        positions(&of_osmnx),
        (Coordinates::Geographic, expected.clone())
    );
    let projected = of_osmnx.replace("epsg:4326", "epsg:28356");
    assert_eq!(positions(&projected), (Coordinates::Planar, expected));
    for (first, second) in [("(1.5, -2)", "[3 4e2]"), ("1.5,-2", "3, 400.0")] {
        let laid_out = format!(
            r#"<graphml><key id="p" for="node" attr.name="pos" attr.type="string"/><graph>
            <node id="a"><data key="p">{first}</data></node><node id="b"><data key="p">{second}</data></node>
            <edge source="a" target="b"/></graph></graphml>"#
        );
        let expected = vec![[1.5, -2.0], [3.0, 400.0]];
        assert_eq!(positions(&laid_out), (Coordinates::Planar, expected));
    }
}

#[test]
fn ids_of_edges_are_theirs_where_they_are_unique() {
    let ids = |first: &str, second: &str| {
        let text = OF_NETWORKX
            .replace(
                "<edge source=\"1\"",
                &format!("<edge id=\"{first}\" source=\"1\""),
            )
            .replace(
                "<edge source=\"2\"",
                &format!("<edge id=\"{second}\" source=\"2\""),
            );
        let segments = read_graphml(&text).expect("a network").draft.segments;
        segments
            .into_iter()
            .map(|segment| segment.id)
            .collect::<Vec<_>>()
    };
    assert_eq!(
        ids("e1", "e2"),
        [Some("e1".to_owned()), Some("e2".to_owned())]
    );
    // The keys of a multigraph.
    assert_eq!(ids("0", "0"), [None, None]);
}

#[test]
fn every_fault_names_the_line_and_the_feature() {
    for (original, replacement, expected) in [
        (
            "40.5",
            "north",
            "line 10/y (node '2'): is 'north', not a finite number",
        ),
        (
            "40.5",
            "NaN",
            "line 10/y (node '2'): is 'NaN', not a finite number",
        ),
        (
            "<data key=\"d1\">40.5</data>",
            "",
            "line 10 (node '2'): has no member 'y'",
        ),
        (
            "<data key=\"d2\">3</data>",
            "<data key=\"d2\">2.5</data>",
            "line 9/pads (node '1'): is 2.5, not a whole number from 0 to 65535",
        ),
        (
            "<node id=\"2\">",
            "<node>",
            "line 10 (node '?'): has no member 'id'",
        ),
        (
            "key=\"d3\"",
            "key=\"d9\"",
            "line 10 (node '2'): has data of the key 'd9', which no <key> declares",
        ),
        (
            "source=\"2\" ",
            "",
            "line 12 (edge 1): has no member 'from'",
        ),
        (
            "edgedefault=\"undirected\"",
            "edgedefault=\"directed\"",
            "line 8 (graph): is a directed graph; a skyway is undirected; convert it with nx.Graph(graph) and write it again",
        ),
        (
            "<edge source=\"2\"",
            "<edge directed=\"true\" source=\"2\"",
            "line 12 (edge 1): is directed; a segment is flown both ways; convert the graph with nx.Graph(graph) and write it again",
        ),
        (
            "<node id=\"2\">",
            "<node id=\"2\"><graph/>",
            "line 10 (node '2'): has a graph inside; a rooftop is a single node",
        ),
        (
            "<edge source=\"1\"",
            "<hyperedge/><edge source=\"1\"",
            "line 11 (hyperedge): joins any number of nodes; a segment joins two",
        ),
        (
            "</graphml>",
            "<graph/></graphml>",
            "document: has several graphs; write the one that is the skyway by itself",
        ),
    ] {
        assert_eq!(refused(original, replacement), expected);
    }
}

#[test]
fn a_document_of_another_kind_is_refused_as_a_whole() {
    let message = |text: &str| read_graphml(text).expect_err("at fault")[0].to_string();
    assert_eq!(
        message("<graphml/>"),
        "document: has no <graph> in its <graphml>"
    );
    assert!(message("<graphml>").starts_with("document: is not XML that can be read: "));
    // Entities could make a small file a large one.
    let doctype = format!("<!DOCTYPE graphml [<!ENTITY a 'b'>]>{}", &OF_NETWORKX[39..]);
    assert!(message(&doctype).contains("DTD"), "{}", message(&doctype));
}

#[test]
fn what_xml_cannot_hold_is_told_or_refused() {
    let node = |id: &str, name: Option<&str>| NodeDraft {
        id: id.to_owned(),
        name: name.map(str::to_owned),
        ..NodeDraft::default()
    };
    let network = |id: &str, name: &str| NetworkDraft {
        name: name.to_owned(),
        nodes: vec![node(id, Some(name)), node("b", None)],
        segments: vec![SegmentDraft {
            from: id.to_owned(),
            to: "b".to_owned(),
            length_m: Some(1.0),
            ..SegmentDraft::default()
        }],
        ..NetworkDraft::default()
    };
    let written = write_graphml(&network("a", "bell\u{7}")).expect("written");
    assert_eq!(written.losses.len(), 2, "{:?}", written.losses);
    assert!(written.losses[0].starts_with("the name of the network has characters"));
    assert!(written.losses[1].starts_with("the name of the node 'a' has characters"));
    let read = read_graphml(&written.text).expect("well-formed").draft;
    assert_eq!(read.nodes[0].name.as_deref(), Some("bell\u{fffd}"));
    let error = write_graphml(&network("a\u{0}", "x")).expect_err("an id that would change");
    assert_eq!(
        error.to_string(),
        "document (node 'a\\0'): has an id with a character that XML has no place for; give it another id, or write another format"
    );
}

#[test]
fn a_large_file_is_refused_before_it_is_read() {
    let text = " ".repeat(MAX_GRAPHML_BYTES + 1);
    let error = read_graphml(&text).expect_err("too large")[0].to_string();
    assert!(
        error.starts_with("document: is GraphML of more than 256 MiB"),
        "{error}"
    );
}

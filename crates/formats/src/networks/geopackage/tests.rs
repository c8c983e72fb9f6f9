//! Rows out and in again, and geometries as other tools write them.

use super::geometry;
use super::read::read;
use super::*;
use crate::network::{Coordinates, NetworkDraft};
use crate::networks::round_trips::drawn;

/// A layer as a database would give it back: columns by its declaration, rows as they were put in.
fn layer(statements: &[GeopackageStatement], name: &str) -> GeopackageLayer {
    let find = |begins: String| {
        let found = statements
            .iter()
            .find(|statement| statement.sql.starts_with(&begins));
        found.expect("a statement")
    };
    let declared = &find(format!("CREATE TABLE {name} (")).sql;
    let (_, columns) = declared.split_once('(').expect("columns");
    let name_of = |column: &str| {
        let name = column.split_whitespace().next().expect("a name");
        name.trim_matches('"').to_owned()
    };
    GeopackageLayer {
        columns: columns.split(", ").map(name_of).collect(),
        geometry: 1,
        rows: find(format!("INSERT INTO {name} ")).rows.clone(),
    }
}

fn through_rows(draft: &NetworkDraft) -> GeopackageNetwork {
    let statements = write_geopackage(draft).statements;
    let facts = statements
        .iter()
        .find(|statement| statement.sql.starts_with("INSERT INTO network "));
    let words = |place: usize| match facts.map(|facts| &facts.rows[0][place]) {
        Some(Cell::Text(words)) => Some(words.clone()),
        _ => None,
    };
    GeopackageNetwork {
        name: words(1),
        attribution: words(2),
        coordinates: draft.coordinates,
        nodes: layer(&statements, NODES_LAYER),
        segments: layer(&statements, SEGMENTS_LAYER),
    }
}

#[test]
fn rows_keep_everything() {
    for seed in 0..300 {
        let network = drawn(seed);
        let again = read(&through_rows(&network));
        let again = again.unwrap_or_else(|errors| panic!("seed {seed}: {errors:?}"));
        assert_eq!(again.unread.lines(), Vec::<String>::new(), "seed {seed}");
        assert_eq!(again.draft, network, "seed {seed}");
    }
}

#[test]
fn every_statement_has_a_value_for_each_place() {
    for statement in write_geopackage(&drawn(1)).statements {
        let places = statement.sql.matches('?').count();
        assert!(
            statement.rows.iter().all(|row| row.len() == places),
            "{}",
            statement.sql
        );
    }
}

#[test]
fn blobs_are_those_of_the_standard() {
    let numbers = |numbers: &[f64]| -> Vec<u8> {
        numbers
            .iter()
            .flat_map(|number| number.to_le_bytes())
            .collect()
    };
    let point = [
        b"GP\x00\x01\xe6\x10\x00\x00".as_slice(),
        b"\x01\x01\x00\x00\x00",
        &numbers(&[151.2, -33.86]),
    ];
    assert_eq!(geometry::point([151.2, -33.86], 4326), point.concat());
    let line = [
        b"GP\x00\x03\xff\xff\xff\xff".as_slice(),
        &numbers(&[1.0, 5.0, 2.0, 3.0]),
        b"\x01\x02\x00\x00\x00\x02\x00\x00\x00",
        &numbers(&[5.0, 2.0, 1.0, 3.0]),
    ];
    assert_eq!(geometry::line([[5.0, 2.0], [1.0, 3.0]], -1), line.concat());
}

#[test]
fn geometries_of_other_tools_are_read() {
    let big: Vec<u8> = [2.0_f64, 3.0, 9.0]
        .iter()
        .flat_map(|number| number.to_be_bytes())
        .collect();
    let header = |flags: u8, envelope: usize| {
        [b"GP\x00", &[flags, 0, 0, 0, 0][..], &vec![0; envelope]].concat()
    };
    let read = |parts: &[&[u8]]| geometry::positions(&parts.concat());
    // Big-endian, with a height by either numbering, and each kind of envelope.
    let with_height = [&b"\x00\x00\x00\x03\xe9"[..], &big].concat();
    for (flags, envelope) in [(0, 0), (0b10, 32), (0b100, 48), (0b110, 48), (0b1000, 64)] {
        assert_eq!(
            read(&[&header(flags, envelope), &with_height]),
            Ok(vec![[2.0, 3.0]])
        );
    }
    let marked = [&b"\x00\xa0\x00\x00\x01\x00\x00\x10\xe6"[..], &big].concat();
    assert_eq!(read(&[&header(0, 0), &marked]), Ok(vec![[2.0, 3.0]]));
    // A line in a collection, as tools that promote geometries write it.
    let line = [
        b"\x00\x00\x00\x00\x02\x00\x00\x00\x01".as_slice(),
        &big[..16],
    ]
    .concat();
    let collection = [b"\x00\x00\x00\x00\x05\x00\x00\x00\x01".as_slice(), &line].concat();
    assert_eq!(read(&[&header(0, 0), &collection]), Ok(vec![[2.0, 3.0]]));
    let two = [
        b"\x00\x00\x00\x00\x05\x00\x00\x00\x02".as_slice(),
        &line,
        &line,
    ]
    .concat();
    assert_eq!(
        read(&[&header(0, 0), &two]),
        Err("has 2 parts, not one".to_owned())
    );
    let polygon = b"\x00\x00\x00\x00\x03\x00\x00\x00\x00";
    assert_eq!(
        read(&[&header(0, 0), polygon]),
        Err("is neither a point nor a line".to_owned())
    );
    let whole = [header(0b10, 32), with_height].concat();
    for length in 0..whole.len() {
        let cut = geometry::positions(&whole[..length]);
        assert_eq!(
            cut,
            Err("is no geometry of a GeoPackage".to_owned()),
            "{length}"
        );
    }
    let endless = b"\x00\x00\x00\x00\x02\xff\xff\xff\xff";
    assert!(read(&[&header(0, 0), endless]).is_err());
}

/// The first error of a network of two nodes with one cell replaced.
fn refused(layer: &str, column: &str, cell: Cell) -> String {
    let mut network = through_rows(&two_nodes());
    let layer = match layer {
        NODES_LAYER => &mut network.nodes,
        _ => &mut network.segments,
    };
    let place = layer.columns.iter().position(|name| name == column);
    layer.rows[0][place.expect("a column")] = cell;
    read(&network).expect_err("at fault")[0].to_string()
}

fn two_nodes() -> NetworkDraft {
    let text = r#"{"nodes": [{"id": 1, "x": 0, "y": 0}, {"id": 2, "x": 9, "y": 0}], "links": [{"source": 1, "target": 2}]}"#;
    crate::networks::node_link::read_node_link(text)
        .expect("a network")
        .draft
}

#[test]
fn faults_name_the_layer_and_the_row() {
    let text = |words: &str| Cell::Text(words.to_owned());
    let bend = geometry::line([[0.0, 0.0], [9.0, 0.0]], -1);
    for (layer, column, cell, expected) in [
        (NODES_LAYER, "id", Cell::Null, "nodes/0: has no member 'id'"),
        (NODES_LAYER, "geom", Cell::Null, "nodes/0: has no geometry"),
        (
            NODES_LAYER,
            "geom",
            Cell::Blob(bend),
            "nodes/0: is not a point",
        ),
        (
            NODES_LAYER,
            "geom",
            Cell::Blob(vec![1]),
            "nodes/0/geometry: is no geometry of a GeoPackage",
        ),
        (
            NODES_LAYER,
            "pads",
            Cell::Real(1.5),
            "nodes/0/pads: is 1.5, not a whole number from 0 to 65535",
        ),
        (
            SEGMENTS_LAYER,
            "to",
            Cell::Whole(7),
            "segments/0/properties/to: names the node '7', which the file does not have; add the node, or correct the id",
        ),
        (
            SEGMENTS_LAYER,
            "geom",
            Cell::Blob(geometry::point([0.0, 0.0], -1)),
            "segments/0/geometry: has 1 positions, not two; a segment is one straight line; put a node at every bend",
        ),
        (
            SEGMENTS_LAYER,
            "geom",
            Cell::Blob(geometry::line([[0.0, 0.0], [9.0, 2.0]], -1)),
            "segments/0/geometry/coordinates/1: is 2.0 m from the node '2'; a segment's line ends at its nodes",
        ),
        (
            SEGMENTS_LAYER,
            "lower_reference",
            text("agl"),
            "segments/0/lower_reference: has no 'lower_m' beside it",
        ),
    ] {
        assert_eq!(refused(layer, column, cell), expected);
    }
}

#[test]
fn rows_without_ids_go_by_their_numbers() {
    let mut network = through_rows(&two_nodes());
    network.nodes.columns[2] = "label".to_owned();
    let read = read(&network).expect("a network");
    let ids: Vec<&str> = read
        .draft
        .nodes
        .iter()
        .map(|node| node.id.as_str())
        .collect();
    assert_eq!(ids, ["1", "2"]);
    assert_eq!(read.draft.coordinates, Coordinates::Planar);
    assert_eq!(read.unread.lines(), ["attributes of nodes: label"]);
}

#[test]
fn ids_that_no_column_of_integers_holds_are_written_as_text_and_told() {
    let mut network = two_nodes();
    assert_eq!(write_geopackage(&network).losses, Vec::<String>::new());
    network.nodes[0].id = u64::MAX.to_string();
    network.segments[0].from = u64::MAX.to_string();
    assert_eq!(
        write_geopackage(&network).losses,
        ["an id is above 9223372036854775807; all ids are written as text"]
    );
    let read = read(&through_rows(&network)).expect("a network").draft;
    assert!(!read.integer_ids);
    assert_eq!(read.nodes[0].id, network.nodes[0].id);
}

//! Nodes are found by their ids as numbers and as text, and segments from either end.

use skyway::formats::{load_csv_network, node_id};
use skyway::network::{NetworkDraft, NodeDraft, SegmentDraft, Topology};
use skyway::wire::Id;

/// Nodes in a row, 10 m apart, each joined with the next.
fn row(ids: &[&str]) -> Topology {
    let places = ids.iter().zip(0..);
    let nodes: String = places
        .map(|(id, place)| format!("{id},{},0\n", 10 * place))
        .collect();
    let ends = ids.windows(2);
    let edges: String = ends
        .map(|ends| format!("{},{}\n", ends[0], ends[1]))
        .collect();
    let loaded = load_csv_network(
        &format!("id,x,y\n{nodes}"),
        &format!("source,target\n{edges}"),
    );
    loaded.expect("a row of nodes is a network").topology
}

#[test]
fn a_number_leads_to_the_node_of_its_digits() {
    for ids in [
        ["0", "1", "2", "3"],
        ["7", "3", "100000", "12"],
        ["-4", "9", "2", "9223372036854775807"],
    ] {
        let topology = row(&ids);
        assert!(topology.has_integer_ids());
        for id in ids {
            let number: i64 = id.parse().expect("an integer");
            let node = topology.node(id).expect("a node of the row");
            assert_eq!(topology.node(Id::from(number).text()), Some(node), "{id}");
            assert_eq!(node_id(&topology, node), Id::from(number), "{id}");
            assert_eq!(node_id(&topology, node), Id::new(id), "{id}");
        }
        for other in [-1, 5, 50, i64::MIN] {
            let found = topology.node(Id::from(other).text());
            assert_eq!(found, None, "{other} of {ids:?}");
        }
    }
}

#[test]
fn digits_that_no_number_is_written_with_stay_text() {
    let topology = row(&["007", "7", "8"]);
    for id in ["007", "7", "8"] {
        let node = topology.node(id).expect("a node of the row");
        let told = node_id(&topology, node);
        assert_eq!(topology.node(told.text()), Some(node), "{id}");
    }
    assert_ne!(topology.node("007"), topology.node(Id::from(7).text()));
}

#[test]
fn a_node_that_was_merged_away_is_still_found_by_its_number() {
    let nodes = "id,x,y\n1,0,0\n2,10,0\n3,10,0\n4,20,0\n";
    let edges = "source,target,length_m\n1,2,10\n2,3,0\n3,4,10\n";
    let loaded = load_csv_network(nodes, edges).expect("the import merges what coincides");
    let topology = loaded.topology;
    assert_eq!(topology.node_count(), 3);
    assert!(topology.node("3").is_some());
    for number in 1..=4 {
        let found = topology.node(Id::from(number).text());
        assert!(found.is_some(), "{number}");
    }
}

/// Nodes of these ids, and segments from one to another, the first of which has an id of its own.
fn joined(nodes: &[&str], segments: &[[&str; 2]], stated: Option<&str>) -> Topology {
    let node = |(place, id): (usize, &&str)| NodeDraft {
        id: (*id).to_owned(),
        position: [10.0 * place as f64, 0.0],
        ..NodeDraft::default()
    };
    let segment = |(place, [from, to]): (usize, &[&str; 2])| SegmentDraft {
        id: stated.filter(|_| place == 0).map(str::to_owned),
        from: (*from).to_owned(),
        to: (*to).to_owned(),
        ..SegmentDraft::default()
    };
    let draft = NetworkDraft {
        nodes: nodes.iter().enumerate().map(node).collect(),
        segments: segments.iter().enumerate().map(segment).collect(),
        ..NetworkDraft::default()
    };
    Topology::build(draft, [0; 32]).expect("a network")
}

#[test]
fn a_segment_has_one_id_and_is_found_from_either_end() {
    for stated in [None, Some("long")] {
        let topology = joined(&["10", "9", "2"], &[["2", "9"], ["10", "9"]], stated);
        let first = topology.find_segment("2-9").expect("a segment");
        assert_eq!(topology.segment_id(first), stated.unwrap_or("2-9"));
        assert_eq!(topology.find_segment("9-2"), Some(first));
        assert_eq!(
            stated.map(|id| topology.find_segment(id)),
            stated.map(|_| Some(first))
        );
        let second = topology.find_segment("10-9").expect("a segment");
        assert_eq!(topology.segment_id(second), "9-10", "{stated:?}");
        assert_eq!(topology.find_segment("9-10"), Some(second));
        assert_eq!(topology.find_segment("2-10"), None);
    }
}

#[test]
fn what_names_two_segments_names_none() {
    let topology = joined(
        &["x", "z-y", "z", "y-x"],
        &[["x", "z-y"], ["z", "y-x"]],
        None,
    );
    for id in ["x-z-y", "y-x-z"] {
        let found = topology.find_segment(id).expect("a segment");
        assert_eq!(topology.segment_id(found), id);
    }
    assert_eq!(topology.find_segment("z-y-x"), None);
}

//! Nodes whose ids are numbers are found by number as by text, however the numbers lie.

use skyway::formats::{load_csv_network, node_id};
use skyway::network::Topology;
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
            assert_eq!(topology.node_of_number(number), Some(node), "{id}");
            assert_eq!(topology.node_number(node), Some(number), "{id}");
            assert_eq!(node_id(&topology, node), Id::Integer(number), "{id}");
        }
        for other in [-1, 5, 50, i64::MIN] {
            assert_eq!(topology.node_of_number(other), None, "{other} of {ids:?}");
        }
    }
}

#[test]
fn digits_that_no_number_is_written_with_stay_text() {
    let topology = row(&["007", "7", "8"]);
    for id in ["007", "7", "8"] {
        let node = topology.node(id).expect("a node of the row");
        let told = node_id(&topology, node);
        assert_eq!(topology.node(&told.text()), Some(node), "{id}");
    }
    assert_eq!(topology.node_of_number(7), topology.node("7"));
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
        let by_text = topology.node(&number.to_string());
        assert_eq!(topology.node_of_number(number), by_text, "{number}");
    }
}

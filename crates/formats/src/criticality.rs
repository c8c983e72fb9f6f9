//! The cost of every failure on a network as GeoJSON, and the demand it is measured for from CSV.

use crate::geo::Point;
use crate::identifier::{node_id_json, segment_id_json};
use crate::network::Topology;
use crate::routing::{Cost, Criticality, Demand};
use csv::ReaderBuilder;
use serde::Deserialize;
use serde_json::{Map, Value, json};

/// Writes a feature for every segment and node, with what its failure costs; a node with pads also has the
/// cost of their loss, in members that begin with `pads_`.
///
/// Costs are sums over all deliveries: metres, minutes, deliveries.
pub fn write_criticality(topology: &Topology, criticality: &Criticality) -> String {
    let place = |point: Point| json!(topology.frame().from_plane(point));
    let segments = topology.segments().map(|segment| {
        let ends = topology.segment(segment);
        let (from, to) = topology.segment_ends(segment);
        let mut members = costs("", &criticality.segments[segment.at()]);
        members.insert("kind".to_owned(), json!("segment"));
        members.insert("from".to_owned(), node_id_json(topology, ends.from));
        members.insert("to".to_owned(), node_id_json(topology, ends.to));
        json!({
            "type": "Feature",
            "id": segment_id_json(topology, segment),
            "geometry": {"type": "LineString", "coordinates": [place(from), place(to)]},
            "properties": members,
        })
    });
    let nodes = topology.nodes().map(|node| {
        let mut members = costs("", &criticality.nodes[node.at()]);
        members.insert("kind".to_owned(), json!("node"));
        if topology.pads(node) > 0 {
            members.extend(costs("pads_", &criticality.pads[node.at()]));
        }
        json!({
            "type": "Feature",
            "id": node_id_json(topology, node),
            "geometry": {"type": "Point", "coordinates": place(topology.position(node))},
            "properties": members,
        })
    });
    let features: Vec<String> = nodes
        .chain(segments)
        .map(|feature| feature.to_string())
        .collect();
    let head = json!({
        "deliveries": criticality.deliveries,
        "without_route": criticality.without_route,
        "out_of_range": criticality.out_of_range,
        "total_m": criticality.total_m,
    });
    format!(
        "{{\"type\":\"FeatureCollection\",\"name\":{},\"attribution\":{},\"criticality\":{head},\"features\":[\n{}\n]}}\n",
        json!(topology.name()),
        json!(topology.attribution()),
        features.join(",\n")
    )
}

fn costs(prefix: &str, cost: &Cost) -> Map<String, Value> {
    let members = [
        ("rerouted", cost.rerouted),
        ("diverted", cost.diverted),
        ("grounded", cost.grounded),
        ("lost", cost.lost),
        ("extra_m", cost.extra_m),
        ("extra_minutes", cost.extra_minutes),
    ];
    let rounded = |value: f64| (value * 1e3).round() / 1e3;
    let members = members.map(|(name, value)| (format!("{prefix}{name}"), json!(rounded(value))));
    members.into_iter().collect()
}

#[derive(Debug, Deserialize)]
struct DemandRow {
    from: String,
    to: String,
    #[serde(default = "one")]
    deliveries: f64,
}

fn one() -> f64 {
    1.0
}

/// Reads demand from CSV with the columns `from`, `to` (ids of nodes) and, where it is not 1, `deliveries`.
///
/// # Errors
/// Every line that names no node of the network, or whose deliveries are not finite and above 0.
pub fn read_demand(topology: &Topology, text: &str) -> Result<Vec<Demand>, Vec<String>> {
    let mut reader = ReaderBuilder::new().from_reader(text.as_bytes());
    let (mut demand, mut problems) = (Vec::new(), Vec::new());
    for (line, row) in (2..).zip(reader.deserialize()) {
        let row: DemandRow = match row {
            Ok(row) => row,
            Err(error) => {
                problems.push(format!("line {line}: {error}"));
                continue;
            }
        };
        match (topology.node(&row.from), topology.node(&row.to)) {
            _ if !(row.deliveries.is_finite() && row.deliveries > 0.0) => problems.push(format!(
                "line {line}: deliveries is {}; give a finite number above 0",
                row.deliveries
            )),
            (Some(from), Some(to)) => demand.push(Demand {
                from,
                to,
                deliveries: row.deliveries,
            }),
            (None, _) => problems.push(format!("line {line}: there is no node {}", row.from)),
            (_, None) => problems.push(format!("line {line}: there is no node {}", row.to)),
        }
    }
    match problems.is_empty() {
        true => Ok(demand),
        false => Err(problems),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::load_network;
    use crate::network::bundled;
    use crate::routing::{Fleet, criticality};

    #[test]
    fn demand_is_read_and_its_slips_are_named() {
        let network = load_network(bundled::CORRIDOR).expect("the bundled network");
        let read = |text: &str| read_demand(&network.topology, text);
        let demand = read("from,to,deliveries\n1,2,3\n2,1,0.5\n").expect("demand");
        assert_eq!(demand.len(), 2);
        assert_eq!(demand[1].deliveries, 0.5);
        assert_eq!(read("from,to\n1,2\n").expect("demand")[0].deliveries, 1.0);
        let problems = read("from,to,deliveries\n1,nowhere,1\n1,2,-1\n").expect_err("slips");
        assert_eq!(
            problems,
            [
                "line 2: there is no node nowhere",
                "line 3: deliveries is -1; give a finite number above 0"
            ]
        );
    }

    #[test]
    fn every_segment_and_node_is_a_feature() {
        let topology = load_network(bundled::CORRIDOR).expect("bundled").topology;
        let demand = read_demand(&topology, "from,to\n1,2\n").expect("demand");
        let fleet = Fleet {
            range_m: 1e4,
            speed_mps: 16.0,
            stop_minutes: 20.0,
        };
        let text = write_criticality(&topology, &criticality(&topology, &demand, &fleet));
        let document: Value = serde_json::from_str(&text).expect("JSON");
        let features = document["features"].as_array().expect("features");
        assert_eq!(
            features.len(),
            topology.node_count() + topology.segment_count()
        );
    }
}

//! The cost of every failure on a network as GeoJSON, and the demand it is measured for from CSV.

use crate::geo::Point;
use crate::identifier::{node_id_json, segment_id_json};
use crate::network::Topology;
use crate::routing::{Cost, Criticality, Demand};
use csv::{ErrorKind, Position, ReaderBuilder, StringRecord};
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

/// The columns of a demand.
const COLUMNS: [&str; 3] = ["from", "to", "deliveries"];
/// A demand is no larger: beyond it whole numbers are not exact in sums, and far beyond it sums are infinite.
const MAX_DELIVERIES: f64 = 1e15;

/// Reads demand from CSV with the columns `from`, `to` (ids of nodes) and, where it is not 1, `deliveries`.
///
/// # Errors
/// A header with other columns, every line that names no node of the network or whose deliveries are not finite and
/// above 0, and more than 1e15 deliveries in all.
pub fn read_demand(topology: &Topology, text: &str) -> Result<Vec<Demand>, Vec<String>> {
    let mut reader = ReaderBuilder::new().from_reader(text.as_bytes());
    let header = reader.headers().map_err(|error| vec![error.to_string()])?;
    let places = columns(header).map_err(|problem| vec![problem])?;
    let (mut demand, mut problems) = (Vec::new(), Vec::new());
    for row in reader.records() {
        let (place, read) = match &row {
            Ok(row) => (row.position(), read_row(topology, &places, row)),
            Err(error) => (error.position(), Err(misshapen(error))),
        };
        match read {
            Ok(one) => demand.push(one),
            Err(problem) => problems.push(format!("line {}: {problem}", line_of(text, place))),
        }
    }
    let deliveries: f64 = demand.iter().map(|one| one.deliveries).sum();
    if deliveries > MAX_DELIVERIES {
        problems.push(format!(
            "there are {deliveries:e} deliveries; give {MAX_DELIVERIES:e} or fewer"
        ));
    }
    match problems.is_empty() {
        true => Ok(demand),
        false => Err(problems),
    }
}

/// Where each of [`COLUMNS`] is.
fn columns(header: &StringRecord) -> Result<[Option<usize>; 3], String> {
    if let Some(other) = header.iter().find(|name| !COLUMNS.contains(name)) {
        return Err(format!(
            "there is no use for the column {other}; give {}",
            COLUMNS.join(", ")
        ));
    }
    let places = COLUMNS.map(|name| header.iter().position(|found| found == name));
    match places {
        [Some(_), Some(_), _] => Ok(places),
        _ => Err("give the columns from and to".to_owned()),
    }
}

fn read_row(
    topology: &Topology,
    places: &[Option<usize>; 3],
    row: &StringRecord,
) -> Result<Demand, String> {
    let [from, to, deliveries] = places.map(|place| row.get(place?));
    let deliveries = deliveries.unwrap_or("1");
    let count = deliveries.parse::<f64>().ok();
    let count = count.filter(|count| count.is_finite() && *count > 0.0);
    let Some(count) = count else {
        return Err(format!(
            "deliveries is {deliveries}; give a finite number above 0"
        ));
    };
    let node = |id: Option<&str>| {
        let id = id.unwrap_or_default();
        let found = topology.node(id);
        found.ok_or_else(|| format!("there is no node {id}"))
    };
    Ok(Demand {
        from: node(from)?,
        to: node(to)?,
        deliveries: count,
    })
}

/// What is wrong with a row that has not the shape of the header.
fn misshapen(error: &csv::Error) -> String {
    match error.kind() {
        ErrorKind::UnequalLengths {
            expected_len, len, ..
        } => format!("has {len} of {expected_len} cells"),
        _ => error.to_string(),
    }
}

/// The line of a row, from 1. The reader tells where it began to look, which is before blank lines.
fn line_of(text: &str, place: Option<&Position>) -> u64 {
    let Some(place) = place else {
        return 1;
    };
    let rest = text.bytes().skip(place.byte() as usize);
    let blank = rest.take_while(|byte| matches!(byte, b'\r' | b'\n'));
    place.line() + blank.filter(|&byte| byte == b'\n').count() as u64
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
        let problems = |text: &str| read(text).expect_err("slips");
        let unknown = problems("from,to,Deliveries\n1,2,3\n");
        assert!(unknown[0].contains("column Deliveries"), "{unknown:?}");
        for ending in ["\n", "\r\n"] {
            let lines = ["from,to", "", "", "1,2", "", "1,nowhere", "1"];
            let placed = problems(&lines.join(ending));
            assert_eq!(
                placed,
                [
                    "line 6: there is no node nowhere",
                    "line 7: has 1 of 2 cells"
                ]
            );
        }
        let endless = problems("from,to,deliveries\n1,2,1e308\n2,1,1e308\n");
        assert!(endless[0].contains("or fewer"), "{endless:?}");
    }

    #[test]
    fn no_deliveries_are_not_below_zero() {
        let topology = load_network(bundled::CORRIDOR).expect("bundled").topology;
        let fleet = Fleet {
            range_m: 1e4,
            speed_mps: 16.0,
            stop_minutes: 20.0,
        };
        let text = write_criticality(&topology, &criticality(&topology, &[], &fleet));
        assert!(text.contains(r#""deliveries":0.0"#), "{text}");
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

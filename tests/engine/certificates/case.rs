//! A random request with its honest certificate, and what it takes to tamper with it.

use std::sync::Arc;

use jiff::{SignedDuration, Timestamp};
use serde_json::{Map, Value, json};
use skyway::airspace::{Airspace, Change, Closure};
use skyway::flight::{FailureReport, FailureType, Location};
use skyway::formats::write_certificate;
use skyway::geo::Point;
use skyway::network::{NetworkDraft, NodeDraft, NodeIx, SegmentDraft, SegmentIx, Topology};
use skyway::recompose::{Request, Scratch, World, certify};
use skyway::verify::{CertificateFault, NetworkFacts, Verdict, verify};

use crate::oracle::generate::{self, Closures, Draw};
use crate::oracle::{OracleNetwork, World as OracleWorld, shortest};

/// Forty of each kind of network; `SKYWAY_CASES` multiplies them.
fn seeds() -> std::ops::Range<u64> {
    let times = std::env::var("SKYWAY_CASES").ok();
    0..240 * times.and_then(|times| times.parse().ok()).unwrap_or(1)
}

/// The cases of all seeds, but those of a drone off its leg with nothing open near it: there is no way
/// into the network, so nothing is claimed and nothing can be proved.
pub(super) fn cases() -> impl Iterator<Item = Case> {
    seeds().map(Case::of).filter(|case| {
        let is_nowhere = entries(&case.document, "starts").is_empty();
        if is_nowhere {
            let fault = verify(&case.text, &case.facts);
            assert_eq!(fault, Err(CertificateFault::NoStart), "seed {}", case.seed);
        }
        !is_nowhere
    })
}

/// A random request with its honest certificate.
pub(super) struct Case {
    pub(super) seed: u64,
    pub(super) network: OracleNetwork,
    pub(super) facts: NetworkFacts,
    pub(super) airspace: Airspace,
    pub(super) request: Request,
    pub(super) closures: Closures,
    pub(super) text: String,
    pub(super) document: Value,
}

pub(super) fn topology_of(network: &OracleNetwork, fingerprint: [u8; 32]) -> Topology {
    let node = |index: usize| network.nodes[index].id.clone();
    let draft = NetworkDraft {
        name: "random".to_owned(),
        integer_ids: network
            .nodes
            .iter()
            .all(|node| node.id.parse::<i64>().is_ok()),
        nodes: (0..network.nodes.len())
            .map(|index| NodeDraft {
                id: node(index),
                position: [network.nodes[index].x, network.nodes[index].y],
                ..NodeDraft::default()
            })
            .collect(),
        segments: network
            .segments
            .iter()
            .map(|segment| SegmentDraft {
                from: node(segment.a),
                to: node(segment.b),
                length_m: Some(segment.length_m),
                ..SegmentDraft::default()
            })
            .collect(),
        ..NetworkDraft::default()
    };
    Topology::build(draft, fingerprint).expect("generated networks are valid")
}

pub(super) fn airspace_of(
    topology: Topology,
    nodes: Vec<NodeIx>,
    segments: Vec<SegmentIx>,
) -> Airspace {
    let now = Timestamp::UNIX_EPOCH;
    let open = Airspace::open(Arc::new(topology), 1, now, SignedDuration::from_hours(1));
    let closure = Closure::of_operator("test".to_owned(), "test".to_owned(), nodes, segments);
    open.apply(&[Change::Put(Arc::new(closure))], now)
}

pub(super) fn certificate(airspace: &Airspace, request: &Request) -> String {
    let world = World {
        airspace,
        trees: None,
    };
    let mut scratch = Scratch::new(airspace.topology());
    let certificate = certify(&world, request, &mut scratch);
    write_certificate(airspace.topology(), &certificate)
}

impl Case {
    fn of(seed: u64) -> Self {
        let (_, network) = generate::generate(seed);
        let mut fingerprint = [0xab; 32];
        fingerprint[..8].copy_from_slice(&seed.to_le_bytes());
        let topology = topology_of(&network, fingerprint);
        let mut draw = Draw::new(seed ^ 0xce27);
        let share = [0.0, 0.1, 0.3][draw.below(3)];
        let mut closures = generate::closures(&mut draw, &network, share, share);
        let leg = generate::failed_leg(&mut draw, &network);
        if draw.chance(0.25) {
            closures.nodes.extend([leg.0, leg.1]);
        }
        let destination = match draw.chance(0.1) {
            true => leg.0,
            false => draw.below(network.nodes.len()),
        };
        let node = |index: usize| topology.node(&network.nodes[index].id).expect("a node");
        let place = |index: usize| Point::new(network.nodes[index].x, network.nodes[index].y);
        let location = match draw.below(5) {
            0 => Location::LegStart,
            1 => Location::Unknown,
            2 | 3 => Location::At(place(leg.0).towards(place(leg.1), draw.unit())),
            _ => Location::At(Point::new(draw.unit() * 5000.0, draw.unit() * 4000.0)),
        };
        let report = FailureReport {
            failure: FailureType::ALL[draw.below(FailureType::ALL.len())],
            leg: (node(leg.0), node(leg.1)),
            location,
            cause_location: None,
            destination: node(destination),
            remaining_path: None,
        };
        let closed_nodes = closures.nodes.iter().map(|&index| node(index)).collect();
        let closed_segments = closures.segments.iter().map(|&index| {
            let segment = &network.segments[index];
            let found = topology.segment_between(node(segment.a), node(segment.b));
            found.expect("a segment")
        });
        let closed_segments = closed_segments.collect();
        let facts = NetworkFacts::of(&topology);
        let airspace = airspace_of(topology, closed_nodes, closed_segments);
        if report.failure.closes_leg() {
            closures
                .segments
                .extend(network.segments_between(leg.0, leg.1));
        }
        let request = Request::exact(report);
        let text = certificate(&airspace, &request);
        let document = serde_json::from_str(&text).expect("a certificate is JSON");
        Case {
            seed,
            network,
            facts,
            airspace,
            request,
            closures,
            text,
            document,
        }
    }

    pub(super) fn verdict(&self, document: &Value) -> Result<Verdict, CertificateFault> {
        verify(&document.to_string(), &self.facts)
    }

    #[track_caller]
    pub(super) fn refuses(&self, document: &Value, what: &str) -> CertificateFault {
        match self.verdict(document) {
            Err(fault) => fault,
            Ok(_) => panic!(
                "seed {}: proved in spite of {what}\n{}",
                self.seed, self.text
            ),
        }
    }

    /// What verifies is true, whatever was tampered with; true when it verifies.
    #[track_caller]
    pub(super) fn proves_only_truth(&self, document: &Value, what: &str) -> bool {
        let Ok(verdict) = self.verdict(document) else {
            return false;
        };
        let claimed_m = match verdict {
            Verdict::Proved { length_m, .. } => Some(length_m),
            Verdict::ProvedNoWay { .. } => None,
        };
        let true_m = self.truth(document);
        let agrees = match (claimed_m, true_m) {
            (Some(claimed_m), Some(true_m)) => (claimed_m - true_m).abs() <= 1e-7 * true_m.max(1.0),
            (None, None) => true,
            _ => false,
        };
        assert!(
            agrees,
            "seed {}: {what}: proved {claimed_m:?}, but the truth is {true_m:?}\n{document:#}",
            self.seed
        );
        true
    }

    pub(super) fn node(&self, id: &Value) -> usize {
        let id = id.as_str().map_or_else(|| id.to_string(), str::to_owned);
        let mut nodes = self.network.nodes.iter();
        nodes.position(|node| node.id == id).expect("a node")
    }

    pub(super) fn world(&self, document: &Value) -> OracleWorld<'_> {
        let closed_nodes = entries(document, "closed_nodes");
        let closed_segments = entries(document, "closed_segments").iter().map(|closed| {
            let ends = ["from", "to"].map(|end| self.node(&closed[end]));
            self.network.segments_between(ends[0], ends[1])[0]
        });
        OracleWorld {
            network: &self.network,
            closed_nodes: closed_nodes.iter().map(|id| self.node(id)).collect(),
            closed_segments: closed_segments.collect(),
        }
    }

    /// A node's id as certificates of this network write it.
    pub(super) fn written(&self, id: &str) -> Value {
        let number = id.parse::<i64>();
        match (self.document["destination"].is_number(), number) {
            (true, Ok(number)) => json!(number),
            _ => json!(id),
        }
    }

    /// The optimum from the starts and under the closures that a document names, by the oracle.
    pub(super) fn truth(&self, document: &Value) -> Option<f64> {
        let world = self.world(document);
        let destination = self.node(&document["destination"]);
        let ways = entries(document, "starts").iter().filter_map(|start| {
            let (way_m, _) = shortest(&world, self.node(&start["node"]), destination, None)?;
            Some(metres(&start["offset_m"]) + way_m)
        });
        ways.min_by(f64::total_cmp)
    }

    /// Ten times what the verifier allows for rounding.
    pub(super) fn step_m(&self) -> f64 {
        let numbers = entries(&self.document, "settled").iter();
        let numbers = numbers.map(|label| metres(&label["d_m"]));
        let bounds = members(&self.document, "h_m");
        let numbers = numbers.chain(bounds.values().filter_map(Value::as_f64));
        let largest_m = || numbers.fold(1.0, f64::max);
        let magnitude_m = self.document["length_m"].as_f64().unwrap_or_else(largest_m);
        1e-8 * magnitude_m.max(1.0)
    }

    pub(super) fn path_nodes(&self) -> &[Value] {
        entries(&self.document["path"], "nodes")
    }
}

pub(super) fn entries<'a>(document: &'a Value, member: &str) -> &'a [Value] {
    document[member].as_array().expect("an array")
}

pub(super) fn entries_mut<'a>(document: &'a mut Value, member: &str) -> &'a mut Vec<Value> {
    document[member].as_array_mut().expect("an array")
}

pub(super) fn members<'a>(document: &'a Value, member: &str) -> &'a Map<String, Value> {
    document[member].as_object().expect("an object")
}

pub(super) fn metres(value: &Value) -> f64 {
    value.as_f64().expect("a number")
}

/// The document with one value in place of another.
pub(super) fn with(document: &Value, pointer: &str, value: impl Into<Value>) -> Value {
    let mut changed = document.clone();
    *changed.pointer_mut(pointer).expect("a place") = value.into();
    changed
}

/// The document without one entry of an array.
pub(super) fn without(document: &Value, array: &str, entry: usize) -> Value {
    let mut changed = document.clone();
    let place = changed.pointer_mut(array).and_then(Value::as_array_mut);
    place.expect("an array").remove(entry);
    changed
}

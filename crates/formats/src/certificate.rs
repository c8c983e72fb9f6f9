//! Writing the certificate of an exact answer, for [`skyway_engine::verify`] and for verifiers written by others.

use crate::network::{NodeIx, SegmentIx, Topology};
use crate::recompose::Certificate;
use serde_json::{Value, json};

/// Writes a certificate as JSON: the same certificate gives the same bytes.
///
/// One entry a line; lists and `h_m` in node order, the path in its own. Ids are text. `length_m` is null when there is no way,
/// and so is `h_m` where there is none on the intact network. Numbers read back as the same doubles.
pub fn write_certificate(topology: &Topology, certificate: &Certificate) -> String {
    let writer = Writer { topology };
    let path = &certificate.path;
    let path_nodes = path.nodes.iter().map(|&node| writer.id(node));
    let path_segments = path.segments.iter();
    let path_segments = path_segments.map(|&segment| writer.segment_id(segment));
    let members = [
        ("network_sha256", writer.fingerprint(certificate)),
        ("starts", writer.labels(&certificate.starts, "offset_m")),
        ("destination", writer.id(certificate.destination)),
        ("closed_nodes", writer.nodes(&certificate.closed_nodes)),
        (
            "closed_segments",
            writer.closed_segments(&certificate.closed_segments),
        ),
        ("length_m", json!(certificate.length_m).to_string()),
        ("settled", writer.labels(&certificate.settled, "d_m")),
        ("h_m", writer.bounds(&certificate.h_m)),
        (
            "path",
            format!(
                "{{\"nodes\": {},\n\"segments\": {}}}",
                array(path_nodes),
                array(path_segments)
            ),
        ),
    ];
    let members = members.map(|(name, value)| format!("\"{name}\": {value}"));
    format!("{{\n{}\n}}\n", members.join(",\n"))
}

/// Each entry on a line of its own.
fn array(entries: impl Iterator<Item = String>) -> String {
    bracketed('[', entries, ']')
}

fn bracketed(open: char, entries: impl Iterator<Item = String>, close: char) -> String {
    let entries: Vec<String> = entries.collect();
    if entries.is_empty() {
        return format!("{open}{close}");
    }
    format!("{open}\n  {}\n{close}", entries.join(",\n  "))
}

struct Writer<'a> {
    topology: &'a Topology,
}

impl Writer<'_> {
    fn fingerprint(&self, certificate: &Certificate) -> String {
        json!(hex::encode(certificate.network_sha256)).to_string()
    }

    fn id(&self, node: NodeIx) -> String {
        json!(self.topology.node_id(node)).to_string()
    }

    fn segment_id(&self, segment: SegmentIx) -> String {
        Value::from(self.topology.segment_id(segment)).to_string()
    }

    fn nodes(&self, nodes: &[NodeIx]) -> String {
        let mut nodes = nodes.to_vec();
        nodes.sort_by_key(|&node| self.topology.rank(node));
        array(nodes.into_iter().map(|node| self.id(node)))
    }

    /// Nodes with a number of metres each.
    fn labels(&self, labels: &[(NodeIx, f64)], name: &str) -> String {
        let mut labels = labels.to_vec();
        labels.sort_by_key(|&(node, _)| self.topology.rank(node));
        array(labels.into_iter().map(|(node, metres)| {
            format!(
                r#"{{"node": {}, "{name}": {}}}"#,
                self.id(node),
                json!(metres)
            )
        }))
    }

    /// Closed segments with their nodes, the first in node order first, so that no reader need take an id apart.
    fn closed_segments(&self, segments: &[SegmentIx]) -> String {
        let rank = |node| self.topology.rank(node);
        let mut closed: Vec<(NodeIx, NodeIx, SegmentIx)> = segments
            .iter()
            .map(|&segment| {
                let ends = self.topology.segment(segment);
                match rank(ends.from) < rank(ends.to) {
                    true => (ends.from, ends.to, segment),
                    false => (ends.to, ends.from, segment),
                }
            })
            .collect();
        closed.sort_by_key(|&(from, to, _)| (rank(from), rank(to)));
        array(closed.into_iter().map(|(from, to, segment)| {
            format!(
                r#"{{"id": {}, "from": {}, "to": {}}}"#,
                self.segment_id(segment),
                self.id(from),
                self.id(to)
            )
        }))
    }

    /// An infinite bound is written as null.
    fn bounds(&self, bounds_m: &[f64]) -> String {
        let mut bounds: Vec<(NodeIx, f64)> = self
            .topology
            .nodes()
            .zip(bounds_m.iter().copied())
            .collect();
        bounds.sort_by_key(|&(node, _)| self.topology.rank(node));
        let entries = bounds
            .into_iter()
            .map(|(node, metres)| format!("{}: {}", self.id(node), json!(metres)));
        bracketed('{', entries, '}')
    }
}

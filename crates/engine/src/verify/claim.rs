//! A certificate in the terms of its network: every name found, nothing yet proved.

use super::document::{Document, Object, WrittenId, WrittenPath, WrittenSegment};
use super::facts::NetworkFacts;
use super::fault::{CertificateFault, Step};

/// What a certificate claims and offers as proof, by the indices of [`NetworkFacts`]; metres.
#[derive(Debug)]
pub(super) struct Claim {
    /// The starts with their first stretches.
    pub(super) starts: Vec<(usize, f64)>,
    pub(super) destination: usize,
    /// By node.
    pub(super) closes_node: Vec<bool>,
    /// By segment.
    pub(super) closes_segment: Vec<bool>,
    /// `None` claims that there is no way.
    pub(super) length_m: Option<f64>,
    /// By node; `None` is not settled.
    pub(super) label_m: Vec<Option<f64>>,
    /// By node; `None` is infinite.
    pub(super) bound_m: Vec<Option<f64>>,
    pub(super) path_nodes: Vec<usize>,
    pub(super) path_segments: Vec<usize>,
}

/// Finds everything that a certificate names.
pub(super) fn resolve(
    document: Document,
    network: &NetworkFacts,
) -> Result<Claim, CertificateFault> {
    if document.network_sha256 != network.sha256 {
        return Err(CertificateFault::OtherNetwork {
            stated: document.network_sha256,
            actual: network.sha256.clone(),
        });
    }
    let mut starts = Vec::with_capacity(document.starts.len());
    for Object(start) in &document.starts {
        starts.push((node(&start.node, "starts", network)?, start.offset_m));
    }
    let mut label_m = vec![None; network.node_ids.len()];
    for Object(label) in &document.settled {
        let place = node(&label.node, "settled", network)?;
        if label_m[place].replace(label.d_m).is_some() {
            return Err(repeated("settled", &label.node.0));
        }
    }
    let (path_nodes, path_segments) = path(&document.path.0, network)?;
    Ok(Claim {
        starts,
        destination: node(&document.destination, "destination", network)?,
        closes_node: closed_nodes(&document.closed_nodes, network)?,
        closes_segment: closed_segments(&document.closed_segments, network)?,
        length_m: document.length_m,
        label_m,
        bound_m: bounds(&document.h_m.0, network)?,
        path_nodes,
        path_segments,
    })
}

fn node(
    WrittenId(id): &WrittenId,
    place: &'static str,
    network: &NetworkFacts,
) -> Result<usize, CertificateFault> {
    node_of(id, place, network)
}

fn node_of(
    id: &str,
    place: &'static str,
    network: &NetworkFacts,
) -> Result<usize, CertificateFault> {
    network
        .node(id)
        .ok_or_else(|| CertificateFault::UnknownNode {
            place,
            node: id.to_owned(),
        })
}

fn segment(
    id: &str,
    place: &'static str,
    network: &NetworkFacts,
) -> Result<usize, CertificateFault> {
    network
        .segment(id)
        .ok_or_else(|| CertificateFault::UnknownSegment {
            place,
            segment: id.to_owned(),
        })
}

fn repeated(place: &'static str, id: &str) -> CertificateFault {
    let id = id.to_owned();
    CertificateFault::Repeated { place, id }
}

fn closed_nodes(
    written: &[WrittenId],
    network: &NetworkFacts,
) -> Result<Vec<bool>, CertificateFault> {
    const PLACE: &str = "closed_nodes";
    let mut closes = vec![false; network.node_ids.len()];
    for closed in written {
        let place = node(closed, PLACE, network)?;
        if std::mem::replace(&mut closes[place], true) {
            return Err(repeated(PLACE, &closed.0));
        }
    }
    Ok(closes)
}

/// The closed segments; the nodes that a certificate names beside each, in either order, must be its own.
fn closed_segments(
    written: &[Object<WrittenSegment>],
    network: &NetworkFacts,
) -> Result<Vec<bool>, CertificateFault> {
    const PLACE: &str = "closed_segments";
    let mut closes = vec![false; network.segments.len()];
    for Object(closed) in written {
        let place = segment(&closed.id, PLACE, network)?;
        let from = node(&closed.from, PLACE, network)?;
        let to = node(&closed.to, PLACE, network)?;
        let ends = network.segments[place].ends;
        if ends != [from, to] && ends != [to, from] {
            let step = Step {
                segment: closed.id.clone(),
                from: closed.from.0.clone(),
                to: closed.to.0.clone(),
            };
            return Err(CertificateFault::SegmentEnds { step });
        }
        if std::mem::replace(&mut closes[place], true) {
            return Err(repeated(PLACE, &closed.id));
        }
    }
    Ok(closes)
}

fn bounds(
    written: &[(String, Option<f64>)],
    network: &NetworkFacts,
) -> Result<Vec<Option<f64>>, CertificateFault> {
    const PLACE: &str = "h_m";
    let mut found: Vec<Option<Option<f64>>> = vec![None; network.node_ids.len()];
    for (id, bound_m) in written {
        let place = node_of(id, PLACE, network)?;
        if found[place].replace(*bound_m).is_some() {
            return Err(repeated(PLACE, id));
        }
    }
    let entries = found.into_iter().zip(&network.node_ids);
    entries
        .map(|(bound_m, id)| {
            bound_m.ok_or_else(|| CertificateFault::MissingBound { node: id.clone() })
        })
        .collect()
}

fn path(
    written: &WrittenPath,
    network: &NetworkFacts,
) -> Result<(Vec<usize>, Vec<usize>), CertificateFault> {
    let nodes = written.nodes.iter();
    let segments = written.segments.iter();
    Ok((
        nodes
            .map(|id| node(id, "path", network))
            .collect::<Result<_, _>>()?,
        segments
            .map(|id| segment(id, "path", network))
            .collect::<Result<_, _>>()?,
    ))
}

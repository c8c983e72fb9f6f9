//! The proof of an exact answer, for someone who does not trust the search.
//!
//! With `h` the distances to the destination on the intact network, `d` the labels of the settled nodes
//! and `D` the length found, `y(v) = min(d(v), D - h(v))` is a feasible dual of the shortest path problem:
//! nothing open is shorter than `D`. [`crate::verify`] checks it without any of this code.

use super::recomposition::{Scratch, World, close_for_request};
use super::request::Request;
use super::starts::{self, Leg};
use crate::airspace::Closed;
use crate::network::{NodeIx, SegmentIx};
use crate::routing::Path;

/// What proves that nothing open is shorter than the path, or that there is none.
#[derive(Clone, Debug, PartialEq)]
pub struct Certificate {
    /// SHA-256 of the text of the network.
    pub network_sha256: [u8; 32],
    /// The ways into the network, each with the metres flown before it.
    pub starts: Vec<(NodeIx, f64)>,
    /// Where the delivery goes.
    pub destination: NodeIx,
    /// Everything closed for the request.
    pub closed_nodes: Vec<NodeIx>,
    /// The segments closed themselves.
    pub closed_segments: Vec<SegmentIx>,
    /// Length of the path with its first stretch, in metres; `None` when there is no way.
    pub length_m: Option<f64>,
    /// The settled nodes with their distances from the starts, in metres.
    pub settled: Vec<(NodeIx, f64)>,
    /// Per node, metres to the destination on the intact network; infinite where there is no way.
    pub h_m: Vec<f64>,
    /// The path; empty when there is no way.
    pub path: Path,
}

/// Computes the certificate of the exact answer to a request. It is made when asked for, and costs a full search.
pub fn certify(world: &World<'_>, request: &Request, scratch: &mut Scratch) -> Certificate {
    let airspace = world.airspace;
    let topology = &**airspace.topology();
    scratch.fit(topology);
    let destination = request.report.destination;
    let Scratch {
        searcher,
        closures,
        starts,
        ..
    } = scratch;
    let tree = searcher.tree(topology, destination);
    closures.reset();
    close_for_request(request, airspace, closures);
    let closed = Closed::new(topology, airspace.closed(), closures);
    let leg = Leg::of(request, topology);
    starts::find(request, airspace, &closed, &leg, starts, &mut Vec::new());
    let arrival = searcher.exact(&closed, &starts.ways, &tree);
    let mut path = Path::default();
    match arrival {
        Some(arrival) => {
            searcher.append_way(arrival, Some(&tree), &mut path);
        }
        // That there is no way is proved by all that can be reached.
        None => {
            searcher.nearest(&closed, &starts.ways, |_| false);
        }
    }
    // The node at which the search stopped is the end of its proof, not part of it.
    let settled = searcher
        .settled_nodes(topology)
        .filter(|&(node, _)| arrival.is_none_or(|arrival| !arrival.stopped_at(node)));
    Certificate {
        network_sha256: *topology.fingerprint(),
        starts: starts
            .ways
            .iter()
            .map(|way| (way.node, way.stretch.length_m))
            .collect(),
        destination,
        closed_nodes: closed.closed_nodes().collect(),
        closed_segments: closed.closed_segments().collect(),
        length_m: arrival.map(|arrival| arrival.length_m),
        settled: settled.collect(),
        h_m: topology.nodes().map(|node| tree.distance_m(node)).collect(),
        path,
    }
}

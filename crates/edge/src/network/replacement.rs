//! A network about to take the place of the one in service, and what can be worked out of that beforehand.
//!
//! Working out what zones close on another network takes long; the writer must not. So it is done beside the
//! writer, on a snapshot, and the writer does again only what has changed since.

use super::documents::NetworkDocuments;
use crate::snapshot::Snapshot;
use bytes::Bytes;
use skyway_engine::airspace::{Closure, ZoneFault};
use skyway_engine::network::{Correspondence, Topology};
use skyway_service::refusal::{Code, Refusal};
use std::collections::BTreeMap;
use std::sync::{Arc, Weak};

/// A network that is to take the place of the one in service.
#[derive(Clone, Debug)]
pub struct NewNetwork {
    /// The network.
    pub topology: Arc<Topology>,
    /// The text it was read from, which clients get.
    pub geojson: Bytes,
    prepared: Option<Arc<Prepared>>,
}

/// A closure as it was, and as it is on the new network.
#[derive(Clone, Debug)]
pub(crate) struct Relaid {
    pub(crate) before: Arc<Closure>,
    pub(crate) after: Arc<Closure>,
    /// Whether it closes other things than it did, as far as those are there still.
    pub(crate) closes_other: bool,
}

/// What was worked out on a snapshot.
#[derive(Debug)]
struct Prepared {
    before: Arc<Topology>,
    correspondence: Arc<Correspondence>,
    documents: Arc<NetworkDocuments>,
    /// By id.
    closures: BTreeMap<String, Relaid>,
    /// By number.
    proposals: BTreeMap<u64, Relaid>,
}

/// All that the writer needs to put the new network into service.
#[derive(Debug)]
pub(crate) struct Relay {
    pub(crate) correspondence: Arc<Correspondence>,
    pub(crate) documents: Arc<NetworkDocuments>,
    pub(crate) closures: Vec<Relaid>,
    pub(crate) proposals: BTreeMap<u64, Relaid>,
    pub(crate) same_plane: bool,
}

impl NewNetwork {
    /// A network with the text it was read from.
    pub fn new(topology: Arc<Topology>, geojson: Bytes) -> Self {
        Self {
            topology,
            geojson,
            prepared: None,
        }
    }

    /// Works out beforehand what the writer would have to on a snapshot. This may take long; it is not the writer's to do.
    ///
    /// # Errors
    /// When the network cannot take the place of that of the snapshot.
    pub fn prepared_for(self, snapshot: &Snapshot) -> Result<Self, Refusal> {
        self.check(snapshot)?;
        let before = snapshot.topology().clone();
        let relay = self.relay(snapshot)?;
        let by_id = relay.closures.into_iter();
        let by_id = by_id.map(|relaid| (relaid.before.id.clone(), relaid));
        let prepared = Prepared {
            before,
            correspondence: relay.correspondence,
            documents: relay.documents,
            closures: by_id.collect(),
            proposals: relay.proposals,
        };
        Ok(Self {
            prepared: Some(Arc::new(prepared)),
            ..self
        })
    }

    /// Whether this network can take the place of that of a snapshot at all.
    pub(crate) fn check(&self, snapshot: &Snapshot) -> Result<(), Refusal> {
        let before = snapshot.topology();
        if self.topology.node_count() == 0 {
            let detail = "a network without nodes cannot take the place of another";
            return Err(Refusal::new(Code::NetworkInvalid, detail));
        }
        let is_geographic = |topology: &Topology| topology.frame().is_geographic();
        if before.node_count() > 0 && is_geographic(before) != is_geographic(&self.topology) {
            let detail = "the coordinates of one network are degrees and those of the other metres; \
                          start the edge anew for it";
            return Err(Refusal::new(Code::NetworkInvalid, detail));
        }
        Ok(())
    }

    /// What the writer needs: what was worked out beforehand where that still holds, the rest worked out now.
    ///
    /// # Errors
    /// When a zone cannot be laid on the new network.
    pub(crate) fn relay(&self, snapshot: &Snapshot) -> Result<Relay, Refusal> {
        let before = snapshot.topology();
        let usable = self.prepared.as_ref();
        let usable = usable.filter(|prepared| Arc::ptr_eq(&prepared.before, before));
        let correspondence = match usable {
            Some(prepared) => prepared.correspondence.clone(),
            None => Arc::new(Correspondence::between(before, &self.topology)),
        };
        let revision = snapshot.airspace.topology_revision() + 1;
        let documents = usable.map(|prepared| prepared.documents.clone());
        let documents = documents.filter(|documents| documents.topology_revision == revision);
        let same_plane = before.frame() == self.topology.frame();
        let relaid = |closure: &Arc<Closure>, known: Option<&Relaid>| match known {
            Some(known) if Arc::ptr_eq(&known.before, closure) => Ok(known.clone()),
            _ => relaid(closure, &self.topology, &correspondence, same_plane),
        };
        let closures = snapshot.airspace.closures().map(|(closure, _)| {
            let known = usable.and_then(|prepared| prepared.closures.get(&closure.id));
            relaid(closure, known)
        });
        let closures = closures.collect::<Result<Vec<Relaid>, Refusal>>()?;
        let proposals = snapshot.proposals.iter().filter_map(|(&number, proposal)| {
            let known = usable.and_then(|prepared| prepared.proposals.get(&number));
            // One that cannot be laid closes nothing yet: it goes, and the network does not wait for it.
            let relaid = relaid(&proposal.closure, known).ok()?;
            Some((number, relaid))
        });
        Ok(Relay {
            closures,
            proposals: proposals.collect(),
            documents: documents.unwrap_or_else(|| {
                let geojson = self.geojson.clone();
                Arc::new(NetworkDocuments::of(&self.topology, geojson, revision))
            }),
            correspondence,
            same_plane,
        })
    }
}

fn relaid(
    closure: &Arc<Closure>,
    topology: &Topology,
    correspondence: &Correspondence,
    same_plane: bool,
) -> Result<Relaid, Refusal> {
    let over = closure.over(topology, correspondence, same_plane);
    let after = over.map_err(|faults| not_laid(&closure.id, &faults))?;
    Ok(Relaid {
        closes_other: closes_other(closure, &after, correspondence),
        before: closure.clone(),
        after: Arc::new(after),
    })
}

/// Whether a zone closes anything on the new network that it did not close before.
fn closes_other(before: &Closure, after: &Closure, correspondence: &Correspondence) -> bool {
    if before.zone().is_none() {
        return false;
    }
    let segments = before.hits.segments.iter();
    let mut segments: Vec<_> = segments
        .filter_map(|&segment| correspondence.segment(segment))
        .collect();
    let nodes = before.hits.nodes.iter();
    let mut nodes: Vec<_> = nodes
        .filter_map(|&node| correspondence.node(node))
        .collect();
    segments.sort_unstable();
    nodes.sort_unstable();
    segments != after.hits.segments || nodes != after.hits.nodes
}

pub(crate) fn not_laid(id: &str, faults: &[ZoneFault]) -> Refusal {
    let why: Vec<String> = faults.iter().map(ToString::to_string).collect();
    let detail = format!(
        "the zone '{id}' cannot be laid on the new network: {}",
        why.join("; ")
    );
    Refusal::new(Code::NetworkInvalid, detail)
}

/// The network before the one in service, and what of it is there still.
#[derive(Debug)]
pub(crate) struct Succession {
    /// Weak, so that the old network goes with the last request on it.
    pub(crate) before: Weak<Topology>,
    pub(crate) correspondence: Arc<Correspondence>,
}

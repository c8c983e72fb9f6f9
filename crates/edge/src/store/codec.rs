//! How stored things are written: names instead of places in a network.
//!
//! Places in a network change with its next version; the ids of its nodes and segments do not.

use super::file::StoreFault;
use rustc_hash::FxHashMap;
use serde::Serialize;
use serde::de::DeserializeOwned;
use skyway_engine::network::{NodeIx, SegmentIx, Topology};

/// The JSON of something stored.
pub(super) fn write<T: Serialize>(stored: &T) -> String {
    // Maps with text keys and finite numbers always have a JSON form.
    serde_json::to_string(stored).unwrap_or_default()
}

/// What a row says.
pub(super) fn read<T: DeserializeOwned>(
    what: &str,
    key: &str,
    body: &str,
) -> Result<T, StoreFault> {
    serde_json::from_str(body)
        .map_err(|error| StoreFault::damaged(format!("{what} '{key}' cannot be read: {error}")))
}

/// A key that sorts as its number does.
pub(super) fn number_key(number: u64) -> String {
    format!("{number:020}")
}

/// The number of such a key.
pub(super) fn number_of(what: &str, key: &str) -> Result<u64, StoreFault> {
    key.parse()
        .map_err(|_| StoreFault::damaged(format!("{what} has the key '{key}'")))
}

/// Nodes and segments of a network by their ids.
#[derive(Clone, Copy, Debug)]
pub(super) struct Names<'a>(pub(super) &'a Topology);

impl Names<'_> {
    pub(super) fn nodes(self, nodes: &[NodeIx]) -> Vec<String> {
        let ids = nodes.iter().map(|&node| self.0.node_id(node).to_owned());
        ids.collect()
    }

    pub(super) fn segments(self, segments: &[SegmentIx]) -> Vec<String> {
        let ids = segments.iter().map(|&segment| self.0.segment_id(segment));
        ids.map(std::borrow::Cow::into_owned).collect()
    }

    pub(super) fn find_node(self, id: &str) -> Result<NodeIx, StoreFault> {
        self.0.node(id).ok_or_else(|| missing("node", id))
    }

    pub(super) fn find_nodes(self, ids: &[String]) -> Result<Vec<NodeIx>, StoreFault> {
        ids.iter().map(|id| self.find_node(id)).collect()
    }

    pub(super) fn find_segments(self, ids: &[String]) -> Result<Vec<SegmentIx>, StoreFault> {
        let segments = ids.iter().map(|id| {
            let segment = self.0.find_segment(id);
            segment.ok_or_else(|| missing("segment", id))
        });
        segments.collect()
    }
}

fn missing(what: &str, id: &str) -> StoreFault {
    StoreFault::damaged(format!(
        "it names the {what} '{id}', which its network does not have"
    ))
}

/// The nodes that a plan names, each written once: detours pass the same ones again and again.
#[derive(Debug, Default)]
pub(super) struct Dictionary {
    places: FxHashMap<NodeIx, u32>,
    nodes: Vec<NodeIx>,
}

impl Dictionary {
    pub(super) fn place(&mut self, node: NodeIx) -> u32 {
        let next = u32::try_from(self.nodes.len()).unwrap_or(u32::MAX);
        *self.places.entry(node).or_insert_with(|| {
            self.nodes.push(node);
            next
        })
    }

    pub(super) fn places(&mut self, nodes: &[NodeIx]) -> Vec<u32> {
        nodes.iter().map(|&node| self.place(node)).collect()
    }

    pub(super) fn nodes(&self) -> &[NodeIx] {
        &self.nodes
    }
}

/// The same, read back.
#[derive(Clone, Copy, Debug)]
pub(super) struct Places<'a>(pub(super) &'a [NodeIx]);

impl Places<'_> {
    pub(super) fn node(self, place: u32) -> Result<NodeIx, StoreFault> {
        let node = self.0.get(place as usize).copied();
        node.ok_or_else(|| StoreFault::damaged("a plan names a node that it does not list"))
    }

    pub(super) fn nodes(self, places: &[u32]) -> Result<Vec<NodeIx>, StoreFault> {
        places.iter().map(|&place| self.node(place)).collect()
    }
}

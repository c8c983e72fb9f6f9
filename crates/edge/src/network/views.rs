//! The network as clients see it.

use super::replacement::NewNetwork;
use crate::snapshot::Snapshot;
use crate::writer::commands::Command;
use crate::{Edge, words};
use bytes::Bytes;
use skyway_contract::{self as wire, Fault};
use skyway_engine::network::{NodeIx, Role};
use skyway_service::refusal::{Code, Refusal};
use std::borrow::Cow;
use std::sync::Arc;
use std::time::Duration;
use tokio_stream::StreamExt;

/// At most this many nodes near a place.
const NEAREST_MAX: u32 = 100;
/// How often a network is looked for that sends no news of it.
const READY_LOOKED_FOR: Duration = Duration::from_millis(100);
/// When a client may ask again while there is no network, in seconds.
const NOT_READY_RETRY_S: u32 = 1;

/// There is no network to answer on yet.
pub(crate) fn not_ready() -> Refusal {
    let detail = "the edge has no network to answer on yet";
    Refusal::new(Code::NotReady, detail).retry_after_s(NOT_READY_RETRY_S)
}

impl Edge {
    /// Puts another network in the place of the one in service.
    ///
    /// What it takes to work out what zones close on it is done before anything changes; requests under way keep the
    /// network that they began with. A network with the same text changes nothing.
    ///
    /// # Errors
    /// When it cannot take the place of the one in service, or the writer cannot take it.
    pub async fn replace_network(self: &Arc<Self>, network: NewNetwork) -> Result<(), Refusal> {
        let snapshot = self.snapshot();
        let network = self
            .aside(move || network.prepared_for(&snapshot))
            .await??;
        self.command(Command::ReplaceNetwork(Box::new(network)))
            .await
            .map(drop)
    }

    /// Whether the edge has a network to answer on.
    pub fn is_ready(&self) -> bool {
        self.world.load().has_network()
    }

    /// Checks that the edge has a network to answer on.
    ///
    /// # Errors
    /// While there is none.
    pub fn check_ready(&self) -> Result<(), Refusal> {
        self.on_network().map(drop)
    }

    /// Waits until the edge has a network to answer on.
    pub async fn ready(&self) {
        loop {
            // Listening begins before looking, so that nothing is missed in between.
            let events = self.events.listen(None);
            if self.is_ready() {
                return;
            }
            match events {
                Ok(mut events) => drop(events.next().await),
                Err(_) => tokio::time::sleep(READY_LOOKED_FOR).await,
            }
        }
    }

    /// The state as it is now, on a network.
    pub(crate) fn on_network(&self) -> Result<Arc<Snapshot>, Refusal> {
        let snapshot = self.world.load_full();
        match snapshot.has_network() {
            true => Ok(snapshot),
            false => Err(not_ready()),
        }
    }

    /// The network as GeoJSON, and its entity tag.
    ///
    /// # Errors
    /// While there is none.
    pub fn network_geojson(&self) -> Result<(Bytes, String), Refusal> {
        let documents = &self.on_network()?.network;
        Ok((
            documents.geojson.clone(),
            format!("\"{}-g\"", documents.etag),
        ))
    }

    /// The network in index form, and its entity tag.
    ///
    /// # Errors
    /// While there is none.
    pub fn network_compact(&self) -> Result<(Bytes, String), Refusal> {
        let documents = &self.on_network()?.network;
        // It names the topology revision, which may change back to a network that was there before.
        let tag = format!("\"{}-{}-c\"", documents.etag, documents.topology_revision);
        Ok((documents.compact.clone(), tag))
    }

    /// A node with its segments.
    ///
    /// # Errors
    /// When the network has none of this id.
    pub fn node(&self, id: &str) -> Result<wire::Node<'static>, Refusal> {
        let snapshot = self.on_network()?;
        let topology = snapshot.topology();
        let node = topology
            .node(id)
            .ok_or_else(|| Refusal::not_found("node", id))?;
        let closed = snapshot.airspace.closed();
        let segments = topology.arcs(node).iter().map(|arc| wire::NodeSegment {
            id: Cow::Owned(topology.segment_id(arc.segment).into_owned()),
            to: words::node_id(topology, arc.to),
            length_m: topology.segment(arc.segment).length_m,
            closed: closed.blocks(arc.segment),
        });
        Ok(wire::Node {
            id: words::node_id(topology, node),
            name: topology.node_name(node).map(words::text),
            location: topology.frame().from_plane(topology.position(node)),
            altitude_m: topology
                .node_altitude(node)
                .map(|altitude| altitude.value_m),
            pads: topology.pads(node),
            role: Cow::Borrowed(match topology.role(node) {
                Role::DeliveryTarget => "delivery_target",
                Role::RechargingStation => "recharging_station",
                Role::Both => "both",
            }),
            closed: closed.closes_node(node),
            pads_closed: snapshot.airspace.closes_pads(node),
            segments: segments.collect(),
            stamp: self.stamp_of(&snapshot),
        })
    }

    /// The `k` nodes nearest to a place, nearest first.
    ///
    /// # Errors
    /// When the place is none, or `k` is not between 1 and 100.
    pub fn nearest(&self, place: [f64; 2], k: u32) -> Result<wire::Nearest<'static>, Refusal> {
        if k == 0 || k > NEAREST_MAX {
            return Err(invalid(
                "?k",
                format!("{k} is not between 1 and {NEAREST_MAX}"),
                None,
            ));
        }
        let snapshot = self.on_network()?;
        let topology = snapshot.topology();
        let frame = topology.frame();
        let [first, second] = place;
        if frame.is_geographic() && (first.abs() > 180.0 || second.abs() > 90.0) {
            let hint = "longitude comes first: were they swapped?".to_owned();
            return Err(invalid(
                "?lat",
                format!("[{first}, {second}] is not on Earth"),
                Some(hint),
            ));
        }
        let point = frame.to_plane(place);
        if !point.is_finite() {
            return Err(invalid("?lon", "the place is not finite".to_owned(), None));
        }
        let boxes = topology
            .node_tree()
            .nearest_neighbor_iter(&[point.x as f32, point.y as f32]);
        // The tree's boxes are rounded outwards, so neighbours in a row may come swapped: look a little further.
        let mut near: Vec<(f64, NodeIx)> = boxes
            .take(k as usize + 8)
            .map(|boxed| (topology.position(boxed.node).distance_m(point), boxed.node))
            .collect();
        near.sort_by(|left, right| left.0.total_cmp(&right.0).then(left.1.cmp(&right.1)));
        near.truncate(k as usize);
        let nodes = near.into_iter().map(|(distance_m, node)| wire::NearNode {
            id: words::node_id(topology, node),
            location: frame.from_plane(topology.position(node)),
            distance_m,
            pads: topology.pads(node),
            closed: snapshot.airspace.closed().closes_node(node),
        });
        Ok(wire::Nearest {
            nodes: nodes.collect(),
            stamp: self.stamp_of(&snapshot),
        })
    }
}

fn invalid(pointer: &str, message: String, hint: Option<String>) -> Refusal {
    let fault = Fault {
        code: "out_of_range".to_owned(),
        pointer: pointer.to_owned(),
        message,
        hint,
    };
    Refusal::at(Code::ParameterInvalid, fault)
}

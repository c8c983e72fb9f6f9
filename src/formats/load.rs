//! A network file of any format that is read: found out by its content, repaired where it is foreign.

use super::csv_network::read_csv_network;
use super::error::FormatError;
use super::network_geojson::read_network;
use super::node_link::{is_node_link, read_node_link};
use crate::network::{NetworkDraft, NetworkError, Repair, Topology};
use serde_json::Value;
use sha2::{Digest, Sha256};
use thiserror::Error;

/// A network with what had to be repaired to load it.
#[derive(Debug)]
pub struct LoadedNetwork {
    /// The network.
    pub topology: Topology,
    /// Repairs to foreign data; the native format is never repaired.
    pub repairs: Vec<Repair>,
}

/// Why a network cannot be loaded.
#[derive(Debug, Error)]
pub enum LoadError {
    /// The text is not understood.
    #[error("{} errors in the text of the network", .0.len())]
    Format(Vec<FormatError>),
    /// The network that the text states is not one that can be flown.
    #[error("{} errors in the network", .0.len())]
    Network(Vec<NetworkError>),
}

impl LoadError {
    /// Every error as a line for people.
    pub fn lines(&self) -> Vec<String> {
        match self {
            Self::Format(errors) => errors.iter().map(ToString::to_string).collect(),
            Self::Network(errors) => errors.iter().map(ToString::to_string).collect(),
        }
    }
}

/// Loads a network from JSON: native GeoJSON or node-link.
///
/// # Errors
/// Everything that is wrong with it, up to a bound.
pub fn load_network(text: &str) -> Result<LoadedNetwork, LoadError> {
    match is_foreign(text) {
        true => {
            let draft = read_node_link(text).map_err(LoadError::Format)?;
            build_foreign(draft, fingerprint(&[text]))
        }
        false => {
            let draft = read_network(text).map_err(LoadError::Format)?;
            build(draft, fingerprint(&[text]), Vec::new())
        }
    }
}

/// Loads a network from two CSV tables.
///
/// # Errors
/// Everything that is wrong with it, up to a bound.
pub fn load_csv_network(nodes: &str, edges: &str) -> Result<LoadedNetwork, LoadError> {
    let draft = read_csv_network(nodes, edges).map_err(LoadError::Format)?;
    build_foreign(draft, fingerprint(&[nodes, edges]))
}

fn build_foreign(mut draft: NetworkDraft, sha256: [u8; 32]) -> Result<LoadedNetwork, LoadError> {
    let repairs = draft.repair();
    build(draft, sha256, repairs)
}

fn build(
    draft: NetworkDraft,
    sha256: [u8; 32],
    repairs: Vec<Repair>,
) -> Result<LoadedNetwork, LoadError> {
    let topology = Topology::build(draft, sha256).map_err(LoadError::Network)?;
    Ok(LoadedNetwork { topology, repairs })
}

/// SHA-256 of the texts, one after the other.
pub fn fingerprint(texts: &[&str]) -> [u8; 32] {
    let mut hasher = Sha256::new();
    for text in texts {
        hasher.update(text.as_bytes());
    }
    hasher.finalize().into()
}

/// True for node-link JSON; anything else, broken JSON included, is for the native reader to judge.
pub fn is_foreign(text: &str) -> bool {
    // GeoJSON says so at once; parsing a large file twice only to find that out would double the time to load it.
    let head = text
        .char_indices()
        .nth(512)
        .map_or(text, |(end, _)| &text[..end]);
    if head.contains("FeatureCollection") {
        return false;
    }
    let document = serde_json::from_str::<Value>(text);
    document.is_ok_and(|document| document.as_object().is_some_and(is_node_link))
}

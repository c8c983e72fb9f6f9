//! A network file of any format that is read: found out by its content, repaired where it is foreign.

use super::attributes::{ReadNetwork, Unread};
use super::csv::read_csv_network;
use super::foreign::ForeignFormat;
use super::geojson::read_network;
use super::graphml::read_graphml;
use super::node_link::read_node_link;
use crate::error::FormatError;
use crate::network::{NetworkDraft, NetworkError, Repair, Topology};
use serde::Deserializer as _;
use serde::de::{IgnoredAny, MapAccess, Visitor};
use serde_json::Value;
use sha2::{Digest, Sha256};
use std::fmt;
use thiserror::Error;

/// A network with what had to be repaired to load it.
#[derive(Debug)]
pub struct LoadedNetwork {
    /// The network.
    pub topology: Topology,
    /// Repairs to foreign data; the native format is never repaired.
    pub repairs: Vec<Repair>,
    /// What foreign data has and the network has no place for; the native format refuses what it does not know.
    pub unread: Unread,
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

/// Loads a network from JSON, native GeoJSON or node-link, or from GraphML.
///
/// # Errors
/// Everything that is wrong with it, up to a bound.
pub fn load_network(text: &str) -> Result<LoadedNetwork, LoadError> {
    let sha256 = fingerprint(&[text]);
    if is_graphml(text) {
        return build_foreign(read_graphml(text).map_err(LoadError::Format)?, sha256);
    }
    if is_node_link(text) {
        return build_foreign(read_node_link(text).map_err(LoadError::Format)?, sha256);
    }
    let draft = read_network(text).map_err(|errors| named(text, errors))?;
    build(draft, sha256, Vec::new(), Unread::default())
}

/// The errors of a text, or the one that names what it is: of another format every member is wrong.
fn named(text: &str, errors: Vec<FormatError>) -> LoadError {
    match ForeignFormat::of_text(text) {
        Some(foreign) => {
            let error = FormatError::new("", foreign.instead_of_network());
            LoadError::Format(vec![error])
        }
        None => LoadError::Format(errors),
    }
}

/// Loads a network from two CSV tables.
///
/// # Errors
/// Everything that is wrong with it, up to a bound.
pub fn load_csv_network(nodes: &str, edges: &str) -> Result<LoadedNetwork, LoadError> {
    let network = read_csv_network(nodes, edges).map_err(LoadError::Format)?;
    build_foreign(network, fingerprint(&[nodes, edges]))
}

/// Repairs a network of another tool and builds it.
pub(crate) fn build_foreign(
    network: ReadNetwork,
    sha256: [u8; 32],
) -> Result<LoadedNetwork, LoadError> {
    let ReadNetwork { mut draft, unread } = network;
    let repairs = draft.repair();
    build(draft, sha256, repairs, unread)
}

fn build(
    draft: NetworkDraft,
    sha256: [u8; 32],
    repairs: Vec<Repair>,
    unread: Unread,
) -> Result<LoadedNetwork, LoadError> {
    let topology = Topology::build(draft, sha256).map_err(LoadError::Network)?;
    Ok(LoadedNetwork {
        topology,
        repairs,
        unread,
    })
}

/// SHA-256 of the texts, one after the other.
pub fn fingerprint(texts: &[&str]) -> [u8; 32] {
    let mut hasher = Sha256::new();
    for text in texts {
        hasher.update(text.as_bytes());
    }
    hasher.finalize().into()
}

/// True for node-link JSON and for GraphML; anything else, JSON that breaks before it says what it is included, is for
/// the native reader to judge.
pub fn is_foreign(text: &str) -> bool {
    is_graphml(text) || is_node_link(text)
}

fn is_graphml(text: &str) -> bool {
    let is_xml = text.trim_start().starts_with('<');
    is_xml && ForeignFormat::of_text(text) == Some(ForeignFormat::Graphml)
}

fn is_node_link(text: &str) -> bool {
    let mut kind = Kind::default();
    // That reading stops early, or at a fault, says nothing: what was seen until then does.
    let _ = serde_json::Deserializer::from_str(text).deserialize_map(&mut kind);
    kind.is_node_link()
}

/// What the names of a document's members have told of it. GeoJSON says what it is at once, so that a large file is
/// not read twice only to find that out.
#[derive(Debug, Default)]
struct Kind {
    has_nodes: bool,
    has_links: bool,
}

impl Kind {
    fn is_node_link(&self) -> bool {
        self.has_nodes && self.has_links
    }
}

impl<'de> Visitor<'de> for &mut Kind {
    type Value = ();

    fn expecting(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str("an object")
    }

    fn visit_map<A: MapAccess<'de>>(self, mut members: A) -> Result<(), A::Error> {
        while let Some(name) = members.next_key::<String>()? {
            match name.as_str() {
                "features" => return Ok(()),
                "type" => {
                    if members.next_value::<Value>()? == "FeatureCollection" {
                        return Ok(());
                    }
                    continue;
                }
                "nodes" => self.has_nodes = true,
                "links" | "edges" => self.has_links = true,
                _ => {}
            }
            if self.is_node_link() {
                return Ok(());
            }
            members.next_value::<IgnoredAny>()?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_document_is_told_by_the_names_of_its_members_and_not_by_its_texts() {
        let named =
            r#"{"graph": {}, "nodes": [{"id": "FeatureCollection", "x": 0, "y": 0}], "links": []}"#;
        assert!(is_foreign(named));
        assert!(is_foreign(r#"{"links": [{"nodes": 1}], "nodes": []}"#));
        assert!(is_foreign(r#"{"type": "graph", "nodes": [], "edges": []}"#));
        assert!(is_foreign(
            "<?xml version='1.0'?>\n<graphml><graph/></graphml>"
        ));
        for native in [
            r#"{"type": "FeatureCollection", "features": [], "nodes": [], "links": []}"#,
            r#"{"name": "\"nodes\" \"links\"", "features": []}"#,
            r#"{"nodes": []}"#,
            r#"{"nodes": [}, "links": []}"#,
            r#"{"name": "<graphml>", "features": []}"#,
            "<kml/>",
            "[1]",
            "",
        ] {
            assert!(!is_foreign(native), "{native}");
        }
    }
}

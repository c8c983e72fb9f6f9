//! A network of a cell, loaded twice: by the engine, and by the oracle that checks it.

use super::design::Network;
use super::oracle::{Oracle, OracleError};
use crate::airspace::Airspace;
use crate::formats::{LoadError, load_network, write_network};
use crate::network::{Components, GenerateError, NetworkDraft, NodeIx, Topology};
use jiff::{SignedDuration, Timestamp};
use rustc_hash::FxHashSet;
use std::sync::Arc;
use thiserror::Error;

/// What a cell is computed on.
#[derive(Debug)]
pub struct Subject {
    /// The network with nothing closed.
    pub airspace: Airspace,
    /// The nodes of its largest component, by index.
    pub component: Vec<NodeIx>,
    /// What distances are checked against.
    pub oracle: Oracle,
}

/// Why a network cannot be evaluated.
#[derive(Debug, Error)]
pub enum SubjectError {
    /// Its variables are out of range.
    #[error("cell {cell}: {error}")]
    Generate {
        /// The cell.
        cell: String,
        /// What is out of range.
        error: GenerateError,
    },
    /// Its text is not a network.
    #[error("cell {cell}: {}", .error.lines().join("; "))]
    Load {
        /// The cell.
        cell: String,
        /// What is wrong.
        error: LoadError,
    },
    /// The oracle cannot read it.
    #[error("cell {cell}: {error}")]
    Oracle {
        /// The cell.
        cell: String,
        /// What is wrong.
        error: OracleError,
    },
    /// No two nodes are joined.
    #[error("cell {cell}: no segment joins two nodes of the network, so nothing can fail on it")]
    Empty {
        /// The cell.
        cell: String,
    },
}

/// The largest component of a generated network: places that no drone can fly to from there are no part of what a strategy
/// searches, and would make every share of the network smaller.
fn reachable(mut whole: NetworkDraft) -> Result<NetworkDraft, LoadError> {
    let topology = load_network(&write_network(&whole))?.topology;
    let components = Components::of(&topology);
    let component = components.largest();
    let kept: FxHashSet<&str> = component.map(|node| topology.node_id(node)).collect();
    whole.nodes.retain(|node| kept.contains(&*node.id));
    whole
        .segments
        .retain(|segment| kept.contains(&*segment.from));
    Ok(whole)
}

impl Subject {
    /// Makes or reads a network of a cell. Of a generated one the largest component is taken.
    ///
    /// # Errors
    /// [`SubjectError`] where that is not possible.
    pub fn load(cell: &str, network: &Network) -> Result<Self, SubjectError> {
        let cell = || cell.to_owned();
        let generated;
        let text = match network {
            Network::Text(text) => text,
            Network::Generated(network) => {
                let refused = |error| SubjectError::Generate {
                    cell: cell(),
                    error,
                };
                let whole = network.network().map_err(refused)?;
                let refused = |error| SubjectError::Load {
                    cell: cell(),
                    error,
                };
                generated = write_network(&reachable(whole).map_err(refused)?);
                &generated
            }
        };
        let refused = |error| SubjectError::Load {
            cell: cell(),
            error,
        };
        let topology = Arc::new(load_network(text).map_err(refused)?.topology);
        let refused = |error| SubjectError::Oracle {
            cell: cell(),
            error,
        };
        let oracle = Oracle::read(text).map_err(refused)?;
        let component: Vec<NodeIx> = Components::of(&topology).largest().collect();
        if component.len() < 2 {
            return Err(SubjectError::Empty { cell: cell() });
        }
        let horizon = SignedDuration::ZERO;
        Ok(Self {
            airspace: Airspace::open(topology, 1, Timestamp::UNIX_EPOCH, horizon),
            component,
            oracle,
        })
    }

    /// The network.
    pub fn topology(&self) -> &Topology {
        self.airspace.topology()
    }
}

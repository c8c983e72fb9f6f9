//! What a certificate proves, and from which premises.

use super::claim::Claim;
use super::facts::NetworkFacts;
use std::fmt;

/// What a certificate states of the world and cannot prove; to be compared with the report and the
/// closures that it was asked about.
#[derive(Clone, Debug, PartialEq)]
pub struct Premises {
    /// Ids of the nodes where the way may begin, each with the metres flown before it.
    pub starts: Vec<(String, f64)>,
    /// Id of the destination.
    pub destination: String,
    /// How many nodes are closed.
    pub closed_nodes: usize,
    /// How many segments are closed themselves.
    pub closed_segments: usize,
}

/// What a certificate proves.
#[derive(Clone, Debug, PartialEq)]
pub enum Verdict {
    /// The path is open and no open way is shorter.
    Proved {
        /// Length of the path with its first stretch, in metres.
        length_m: f64,
        /// What this rests on.
        premises: Premises,
    },
    /// No open way leads to the destination.
    ProvedNoWay {
        /// What this rests on.
        premises: Premises,
    },
}

impl Verdict {
    pub(super) fn of(claim: &Claim, network: &NetworkFacts) -> Self {
        let id = |node: usize| network.node_ids[node].clone();
        let count = |closes: &[bool]| closes.iter().filter(|&&closed| closed).count();
        let starts = claim.starts.iter();
        let premises = Premises {
            starts: starts
                .map(|&(node, offset_m)| (id(node), offset_m))
                .collect(),
            destination: id(claim.destination),
            closed_nodes: count(&claim.closes_node),
            closed_segments: count(&claim.closes_segment),
        };
        match claim.length_m {
            Some(length_m) => Self::Proved { length_m, premises },
            None => Self::ProvedNoWay { premises },
        }
    }

    /// What the proof rests on.
    pub fn premises(&self) -> &Premises {
        match self {
            Self::Proved { premises, .. } | Self::ProvedNoWay { premises } => premises,
        }
    }
}

impl fmt::Display for Verdict {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Proved { length_m, premises } => write!(
                formatter,
                "proved: the path is {length_m} m long and no open way is shorter, {premises}"
            ),
            Self::ProvedNoWay { premises } => {
                write!(formatter, "proved: there is no open way, {premises}")
            }
        }
    }
}

impl fmt::Display for Premises {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (place, (node, offset_m)) in self.starts.iter().enumerate() {
            let joint = if place == 0 { "from" } else { "or" };
            write!(formatter, "{joint} node '{node}' after {offset_m} m ")?;
        }
        write!(
            formatter,
            "to node '{}'; taken from the certificate, to be compared with the report: {}, {} closed",
            self.destination,
            counted(self.closed_nodes, "node"),
            counted(self.closed_segments, "segment"),
        )
    }
}

fn counted(count: usize, noun: &str) -> String {
    let plural = if count == 1 { "" } else { "s" };
    format!("{count} {noun}{plural}")
}

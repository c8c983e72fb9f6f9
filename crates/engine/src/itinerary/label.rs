//! Labels: what is known of a way to a node, and how a drone came there.

use super::charging_label::ChargingLabel;
use crate::network::NodeIx;

/// In place of a label.
pub(super) const NO_LABEL: u32 = u32::MAX;

/// How a label came about.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum How {
    /// It is a start of the request.
    Start(u8),
    /// By a leg that was entered in a period of the wind.
    Leg { leg: u32, period: u16 },
    /// By a stop; the arrival at the crossing altitude before it, in seconds.
    Stop { arrived_s: f64 },
}

/// A label: what a drone may have at a node by its charging function, and where it came from.
#[derive(Clone, Copy, Debug)]
pub(super) struct Label {
    pub(super) family: ChargingLabel,
    pub(super) node: NodeIx,
    pub(super) how: How,
    pub(super) parent: u32,
    /// Tells ways apart, whatever the stops on them.
    pub(super) way: u64,
    /// The next label at the node.
    pub(super) next: u32,
    /// Dominated by a later one.
    pub(super) is_dead: bool,
}

impl Label {
    pub(super) fn new(
        family: ChargingLabel,
        node: NodeIx,
        how: How,
        parent: u32,
        way: u64,
    ) -> Self {
        Self {
            family,
            node,
            how,
            parent,
            way,
            next: NO_LABEL,
            is_dead: false,
        }
    }
}

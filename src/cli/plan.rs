//! What the commands ask of plans: the one that a failure breaks, and room for the tables of destinations.

use crate::airspace::Airspace;
use crate::compose;
use crate::flight::FailureReport;
use crate::network::NodeIx;
use crate::recompose::World;
use crate::routing::{Searcher, TreeCache};

/// Bytes that the tables of destinations may take.
const TABLE_BYTES: usize = 256 << 20;

/// An empty cache of tables.
pub(super) fn tables() -> TreeCache {
    TreeCache::new(TABLE_BYTES)
}

/// The plan that a failure breaks: its leg, then the shortest way on over what was open before.
pub(super) fn planned_nodes(airspace: &Airspace, report: &FailureReport) -> Vec<NodeIx> {
    let world = World {
        airspace,
        trees: None,
    };
    let mut searcher = Searcher::new(airspace.topology());
    compose::planned_nodes(&world, report, &mut searcher)
}

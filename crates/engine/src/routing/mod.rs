//! Shortest ways through what is open: one search loop, and the bounds that make it fast.
//!
//! Nothing here logs, asks the time or allocates, but for the way itself, which goes into a buffer of
//! the caller. A [`Searcher`] is the memory of a search; one thread uses one at a time.

mod area;
mod baselines;
mod criticality;
mod exact;
mod frontier;
mod searcher;
mod tree;
mod tree_cache;
mod way;

pub use area::Area;
pub use baselines::Baseline;
pub use criticality::{Cost, Criticality, Demand, Fleet, criticality, uniform_demand};
pub use frontier::{Entrance, Start};
pub use searcher::{Arrival, Searcher};
pub use tree::DestinationTree;
pub use tree_cache::{CacheFigures, ClosureEpoch, TreeCache};
pub use way::Path;

/// A search begins from at most this many nodes.
pub const MAX_STARTS: usize = 16;

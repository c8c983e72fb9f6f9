//! Networks from buildings: rooftops are the nodes, and a segment joins two that see each other.

mod footprint;
mod rooftops;
mod skyline;

pub use footprint::{Building, Outline, OutlineFault, plane_of};
pub use skyline::{KeepOut, LineOfSight, LineOfSightError, PadRule, Skyline, SkylineReport};

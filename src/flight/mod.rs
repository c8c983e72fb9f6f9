//! What drones say: the failure report `<FT, DDS, LOC, TS>` (paper, Definition 3).

mod report;

pub use report::{FailureReport, FailureType, Location};

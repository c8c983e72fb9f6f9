//! The oracle: a second, naive reading of the published algorithms and their conventions.
//!
//! It shares no line and no type with the engine. It scans all nodes for every area, searches with
//! Bellman-Ford and runs every round that the conventions describe, so that an answer of the engine
//! can be compared with one that was reached in the plainest way. Nodes and segments are indices
//! into [`OracleNetwork`]; lengths and coordinates are metres in the plane.

mod cells;
pub(crate) mod generate;
mod local;
mod network;
mod radius;
mod recompose;
mod search;
mod tests;
mod two_phased;

pub(crate) use cells::{cell_density, cell_grid};
pub(crate) use local::{LocalAnswer, StageRecord, local_baseline};
pub(crate) use network::{OracleNetwork, OracleNode, OracleSegment, World};
pub(crate) use radius::radius;
pub(crate) use recompose::{
    Fallback, OracleAnswer, Repair, Report, Strategy, old_plan, recompose, recompose_plan,
};
pub(crate) use search::shortest;
pub(crate) use two_phased::two_phased;

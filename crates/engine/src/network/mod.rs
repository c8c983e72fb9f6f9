//! The skyway network: how it is stated, checked, indexed and made.
//!
//! A [`NetworkDraft`] is what a file or a generator says; [`Topology::build`] checks it and makes the
//! immutable [`Topology`] that everything above reads.

mod build;
pub mod bundled;
mod components;
mod correspondence;
mod corridor;
mod density;
mod draft;
mod error;
mod generate;
mod heap;
mod identity;
mod index;
mod neighbours;
mod order;
mod repair;
mod seeded;
mod sketch;
pub mod survey;
mod topology;

pub use components::Components;
pub use correspondence::Correspondence;
pub use corridor::{CORRIDOR_SEED, san_marcos_san_antonio};
pub use density::{CellPlace, CellSizeError, Density, DensityGrid, MAX_CELLS};
pub use draft::{Coordinates, NetworkDraft, NodeDraft, Role, SegmentDraft};
pub use error::{Feature, MAX_ERRORS, NetworkError, NetworkFault};
pub use generate::{
    GenerateError, Generated, Joining, MAX_GENERATED_NEIGHBOURS, MAX_GENERATED_NODES,
};
pub(crate) use heap::Heap;
pub use identity::{NodeIx, SegmentIx};
pub use index::{NodeBox, SegmentBox, outer_box};
pub use order::NodeOrder;
pub use repair::Repair;
pub use seeded::Seeded;
pub use sketch::{SKETCH_STEP_M, sketch};
pub use topology::{Arc, Segment, Topology};

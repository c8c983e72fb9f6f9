//! The network: as text and as clients see it, another one that takes its place, and tables of the destinations in use.

pub(crate) mod documents;
pub(crate) mod replacement;
pub(crate) mod tables;
mod views;

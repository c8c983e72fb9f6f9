//! What people read of a run: its plots, and one page that holds everything.
//!
//! Text in, text out. The page needs nothing from outside and no script; all words of a run are escaped by the
//! templates. Every number in it comes from the [`Run`](super::record::Run) it is made from.

mod claims;
mod figures;
mod html;
mod markdown;
mod method;
mod notes;
mod numbers;
mod opening;
mod plot;
mod provenance;

pub use html::html;
pub use markdown::markdown;
pub use plot::{PlotError, plot};

#[cfg(test)]
mod example;
#[cfg(test)]
mod tests;

//! Deliveries composed and answered in flight: outcomes, failure types, contingencies, each plan checked independently.

mod contingencies;
mod landings;
mod others;
mod outcomes;
mod stops;
mod strategies;
mod town;

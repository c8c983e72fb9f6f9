//! Composition: a plan from a source to a destination, each leg with what to do when it fails.
//!
//! [`compose`] makes the plan of a delivery, [`with_contingencies`] that of a way that exists already, a recomposed one
//! for instance. Which plans come too near to each other is told by [`conflicts`]. Times are nominal: at the airspeed, or a
//! segment's limit where that is slower, without wind, climb or stops. Energy is not checked.

mod composition;
mod conflict;
mod migrate;
mod open_way;

pub use composition::{
    Alternate, Composition, Contingency, Leg, compose, flight_time_s, with_contingencies,
};
pub use conflict::{Conflict, Direction, Occupation, conflicts};
pub use migrate::{Change, Migrated};
pub use open_way::{planned_nodes, prepare_table, shortest_way};

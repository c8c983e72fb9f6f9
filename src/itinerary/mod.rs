//! The search over position, time and battery: paths that this drone, with this battery and payload, in this
//! wind, can fly, recharging on free pads and never crossing anything that is closed when it gets there.
//!
//! [`find`] answers a request; its three steps and why a label may be dropped are in `docs/flight-search.md`.
//! [`Potentials`] are worked out once per destination, [`Obstacles`] and [`PadTimes`] once per state of the
//! world. Nothing here asks the time or the environment; memory is kept in an [`ItineraryScratch`].

mod family;
mod grouped;
mod memory;
mod obstacles;
mod openings;
mod pads;
mod potentials;
mod request;
mod run;
mod search;
mod terms;
mod trace;
mod walk;

pub use memory::ItineraryScratch;
pub use obstacles::Obstacles;
pub use pads::PadTimes;
pub use potentials::Potentials;
pub use request::{
    Effort, FlightAnswer, FlightRequest, FlightWorld, Limits, Objective, Step, Unproved, Value,
};
pub use search::{find, find_plainly};

/// A plan begins at one of at most this many starts; more are not looked at.
pub const MAX_STARTS: usize = 16;

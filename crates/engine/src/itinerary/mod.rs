//! The search over position, time and battery: paths that this drone, with this battery and payload, in this
//! wind, can fly, recharging on free pads and never crossing anything that is closed when it gets there.
//!
//! [`decide`] says what a drone is told: a plan, to wait, a safe node, or what cuts it off. Under it
//! [`find`] answers a request; its three steps and why a label may be dropped are in `docs/flight-search.md`.
//! [`Potentials`] are worked out once per destination, [`Obstacles`] and [`PadTimes`] once per state of the
//! world. Nothing here asks the time or the environment; memory is kept in an [`ItineraryScratch`].

mod decision;
mod family;
mod figures;
mod grouped;
mod in_the_way;
mod memory;
mod near;
mod obstacles;
mod openings;
mod pads;
mod potentials;
mod refuge;
mod request;
mod rim;
mod run;
mod search;
mod setting;
mod terms;
mod timed;
mod trace;
mod under_way;
mod walk;

pub use decision::{FlightDecision, FlightOpening, FlightOrder, FlightOutcome, decide};
pub use figures::{LegFigures, PlanFigures, StopFigures};
pub use memory::ItineraryScratch;
pub use near::{Nearby, find_near};
pub use obstacles::Obstacles;
pub use pads::PadTimes;
pub use potentials::Potentials;
pub use refuge::{Refuge, find_nearest, find_refuge};
pub use request::{
    Effort, FlightAnswer, FlightRequest, FlightWorld, Limits, Objective, Step, Unproved, Value,
};
pub use rim::FlightCause;
pub use search::{find, find_plainly};
pub use setting::FlightSetting;
pub use timed::timed_closures;

/// A plan begins at one of at most this many starts; more are not looked at.
pub const MAX_STARTS: usize = 16;

//! The search over position, time and battery: paths that this drone, with this battery and payload, in this
//! wind, can fly, recharging on free pads and never crossing anything that is closed when it gets there.
//!
//! [`decide`] says what a drone is told: a plan, to wait, an alternate, or what cuts it off. Under it
//! [`find`] answers a request; its three steps and why a label may be dropped are in `docs/flight-search.md`.
//! [`Potentials`] are worked out once per destination, [`Obstacles`] and [`PadTimes`] once per state of the
//! world. Nothing here asks the time or the environment; memory is kept in an [`ItineraryScratch`].

mod active_traffic;
mod alternate;
mod blocking_causes;
mod charging_label;
mod closed_windows;
mod decision;
mod dominance;
mod entry;
mod expander;
mod figures;
mod forbidden_times;
mod in_the_way;
mod joined;
mod label;
mod lower_bounds;
mod memory;
mod near;
mod near_traffic;
mod obstacles;
mod occupancy;
mod opening;
mod owner;
mod pad_stays;
mod pads;
mod potentials;
mod release_times;
mod request;
mod rounds;
mod run;
mod search;
mod separation;
mod setting;
mod stops;
mod timed;
mod trace;
mod under_way;
mod walk;
mod way_on;
mod yardstick;

pub use alternate::{Alternate, NoAlternate, find_alternate, find_nearest};
pub use blocking_causes::FlightCause;
pub use closed_windows::{ClosedWindows, ClosureKey};
pub use decision::{FlightDecision, FlightOpening, FlightOrder, FlightOutcome, decide};
pub use figures::{LegFigures, PlanFigures, StopFigures};
pub use memory::ItineraryScratch;
pub use near::{Nearby, find_near};
pub use obstacles::Obstacles;
pub use occupancy::{Occupancy, OccupiedLeg, OccupiedPad, OthersOccupancy};
pub use owner::Owner;
pub use pads::PadTimes;
pub use potentials::Potentials;
pub use request::{
    Effort, FlightAnswer, FlightRequest, FlightWorld, Limits, Objective, Step, Unproved, Value,
};
pub use search::{find, find_plainly};
pub use separation::Separation;
pub use setting::FlightSetting;
pub use timed::timed_closures;
pub use yardstick::Yardstick;

/// A plan begins at one of at most this many starts; more are not looked at.
pub const MAX_STARTS: usize = 16;

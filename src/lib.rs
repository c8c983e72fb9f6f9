//! Skyway: exact recomposition of drone delivery routes on a skyway network.
//!
//! Everything in this library is pure: values in, values out, no clock, no randomness that is not
//! seeded, no files, no environment. The one exception is the `cli` module, which exists only with
//! the feature of that name. `docs/ARCHITECTURE.md` has the map.
//!
//! Units are metres, seconds and degrees of longitude and latitude unless a name says otherwise;
//! positions are longitude first.

pub mod airspace;
#[cfg(feature = "cli")]
pub mod cli;
pub mod draw;
pub mod flight;
pub mod formats;
pub mod geo;
pub mod network;
pub mod recompose;
pub mod routing;
pub mod verify;

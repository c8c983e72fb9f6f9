//! Skyway: exact recomposition of drone delivery routes on a skyway network.
//!
//! What builds without features is pure: values in, values out, no clock, no randomness that is not
//! seeded, no files, no environment. Above it stand the service (feature `edge`) and the command line
//! (feature `cli`). `docs/ARCHITECTURE.md` has the map.
//!
//! Units are metres, seconds and degrees of longitude and latitude unless a name says otherwise;
//! positions are longitude first.

#[cfg(feature = "edge")]
pub mod access;
pub mod airspace;
#[cfg(feature = "edge")]
pub mod api;
pub mod checked;
pub mod checker;
#[cfg(feature = "cli")]
pub mod cli;
#[cfg(feature = "edge")]
pub mod clock;
pub mod compose;
#[cfg(feature = "edge")]
pub mod config;
pub mod delivery;
#[cfg(feature = "edge")]
pub mod demo;
pub mod draw;
#[cfg(feature = "edge")]
pub mod edge;
#[cfg(feature = "cli")]
pub mod evaluate;
pub mod flight;
pub mod formats;
pub mod geo;
#[cfg(feature = "edge")]
pub mod intake;
pub mod itinerary;
pub mod network;
pub mod planted;
#[cfg(feature = "edge")]
pub mod process;
pub mod recompose;
#[cfg(feature = "edge")]
pub mod refusal;
#[cfg(feature = "edge")]
pub mod registry;
pub mod routing;
pub mod verify;
pub mod wire;

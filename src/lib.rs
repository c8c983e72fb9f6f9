//! Skyway: exact recomposition of drone delivery routes on a skyway network.
//!
//! What builds without features is pure: values in, values out, no clock, no randomness that is not
//! seeded, no files, no environment. Above it stand the service (feature `edge`) and the command line
//! (feature `cli`). `docs/ARCHITECTURE.md` has the map.
//!
//! Units are metres, seconds and degrees of longitude and latitude unless a name says otherwise;
//! positions are longitude first.

#[cfg(feature = "edge")]
pub mod api;
#[cfg(feature = "cli")]
pub mod cli;
#[cfg(feature = "edge")]
pub mod demo;
#[cfg(feature = "edge")]
pub mod process;

pub use skyway_contract as wire;
#[cfg(feature = "edge")]
pub use skyway_dispatch as dispatch;
#[cfg(feature = "edge")]
pub use skyway_edge as edge;
pub use skyway_engine::{
    airspace, checked, checker, compose, delivery, flight, geo, itinerary, network, recompose,
    routing, verify,
};
pub use skyway_evaluation::evaluate;
pub use skyway_formats as formats;
pub use skyway_maps::{buildings, draw};
pub use skyway_market as market;
pub use skyway_pack as pack;
pub use skyway_planted as planted;
#[cfg(feature = "edge")]
pub use skyway_registry as registry;
#[cfg(feature = "edge")]
pub use skyway_service::{access, clock, config, intake, refusal};

//! What the edge and the registry are built on: who asks, what is refused, how a body is read, the clock and the settings.
//!
//! It knows neither of the two, nor HTTP or gRPC.

pub mod access;
pub mod clock;
pub mod config;
pub mod intake;
pub mod refusal;

use skyway_contract as wire;
use skyway_engine::{airspace, flight, geo, itinerary, network};
use skyway_formats as formats;
use skyway_pack as pack;

//! The paper's experiments on the engine: see [`evaluate`].

pub mod evaluate;

use skyway_engine::{airspace, compose, flight, network, recompose, routing};
use skyway_formats as formats;

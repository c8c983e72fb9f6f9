//! Maps of Skyway: networks from buildings and lines of sight, and pictures of networks and of what was flown on them.
//!
//! Values in, values and the text of an SVG out; no files, no clock.

pub mod buildings;
pub mod draw;

use skyway_engine::{airspace, flight, geo, network, recompose, routing};

//! The engine of Skyway: a network and its airspace, the flights on it, the searches for their routes, and the checks of
//! what the searches find.
//!
//! It is pure: values in, values out, no clock, no randomness that is not seeded, no files, no environment. Units are
//! metres, seconds and degrees of longitude and latitude unless a name says otherwise; positions are longitude first.

pub mod airspace;
pub mod checked;
pub mod checker;
pub mod compose;
pub mod delivery;
pub mod flight;
pub mod geo;
pub mod itinerary;
pub mod network;
pub mod recompose;
pub mod routing;
pub mod verify;

use skyway_planted as planted;

//! Deliveries as a market, pure: prices, offers, which drone for which order, and how a delivery stands.
//!
//! It is handed instants, lengths and documents, and hands back values: no clock, no store, no network of its own.

pub mod allocation;
pub mod area;
pub mod hours;
pub mod intervals;
pub mod matching;
pub mod money;
pub mod ranking;
pub mod status;
pub mod tariff;

#[cfg(test)]
mod seeded;

pub use intervals::{poisson_interval, wilson};

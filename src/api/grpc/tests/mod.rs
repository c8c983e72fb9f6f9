//! Tests of the dialect: its conversions, and its services over a small network.

mod conversions;
mod readiness;
mod services;
mod session;

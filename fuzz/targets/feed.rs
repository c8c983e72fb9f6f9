//! The fuzz target for feeds of zones: ED-269, ED-318, fences of QGroundControl, GeoJSON.

#![no_main]

#[path = "../bodies/feed.rs"]
mod body;
#[path = "../bodies/networks.rs"]
mod networks;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| body::run(bytes));

//! The fuzz target for zones as GeoJSON.

#![no_main]

#[path = "../bodies/zone.rs"]
mod body;
#[path = "../bodies/networks.rs"]
mod networks;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| body::run(bytes));

//! The fuzz target for failure reports as JSON.

#![no_main]

#[path = "../bodies/json_report.rs"]
mod body;
#[path = "../bodies/networks.rs"]
mod networks;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| body::run(bytes));

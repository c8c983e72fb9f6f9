//! The fuzz target for network files.

#![no_main]

#[path = "../bodies/network.rs"]
mod body;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| body::run(bytes));

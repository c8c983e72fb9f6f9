//! The fuzz target for requests as protobuf.

#![no_main]

#[path = "../bodies/protobuf.rs"]
mod body;
#[path = "../bodies/networks.rs"]
mod networks;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| body::run(bytes));

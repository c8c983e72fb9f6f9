//! Edges and a registry in one thread, on time that passes when nothing else can happen: what ships of both, over a
//! line and disks that are made up.
//!
//! A seed makes a run: who writes what and when, what the line loses, bends and delays, who crashes and what is
//! restored. The same seed makes the same run, event by event. Each run ends with a history that is checked, and each
//! planted bug has to be found by it.
//!
//! `SKYWAY_FAULT_ROUNDS` says how many seeds, `SKYWAY_FAULT_SEED` which one is the first. A failure prints its seed;
//! `SKYWAY_FAULT_SEED=7 SKYWAY_FAULT_ROUNDS=1 SKYWAY_FAULT_TRACE=1` tells all that happens under the seed 7.

#![expect(
    clippy::print_stdout,
    reason = "what runs came to is told, for the report of a long run"
)]

mod actors;
mod bend;
mod central;
mod disk;
mod drones;
#[expect(dead_code, reason = "no test waits for a machine here")]
#[path = "../faults/history/mod.rs"]
mod history;
mod judge;
mod kept;
mod line;
#[expect(dead_code, reason = "no disk hangs by itself here")]
#[path = "../edge/memory_disk.rs"]
mod memory_disk;
mod memory_store;
mod outpost;
mod places;
mod planted;
#[expect(dead_code, reason = "waits are drawn in milliseconds here")]
#[path = "../faults/rounds.rs"]
mod rounds;
mod run;
mod seeds;
mod trace;
mod world;

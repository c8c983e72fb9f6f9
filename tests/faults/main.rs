//! Faults, as they happen: the daemons as they ship, in child processes that are killed, stopped and cut off, over
//! disks that are full or fail, and files that are torn.
//!
//! Each story ends with a history that is checked (`history`). Built with the feature `planted`, each also runs with
//! a bug that it has to find. `SKYWAY_FAULT_ROUNDS` says how many rounds, `SKYWAY_FAULT_SEED` by which chance,
//! `SKYWAY_FAULT_BINARY` which program instead of the one that was built with it.

#![expect(
    clippy::print_stdout,
    reason = "what a story found is told, for the report of a long run"
)]

mod bad_edge_line;
mod bad_line;
mod checker;
#[path = "../registry/cluster.rs"]
mod cluster;
mod daemon;
mod edge;
mod edge_file;
mod failing_disk;
mod failing_edge_disk;
mod false_registry;
mod fleet;
mod herd;
mod history;
mod killed_edge;
mod killed_postgres;
mod killed_registry;
mod lies;
mod lives;
mod other_registry;
mod outage;
mod outcome;
mod party;
mod proxy;
mod registry_client;
mod restored_registry;
mod rounds;
mod square;
mod stage;
mod store_file;
mod tokens;
mod torn_edge;
mod torn_file;
mod tracing;
mod writers;

//! Faults, as they happen: the daemons as they ship, in child processes that are killed, stopped and cut off, over
//! disks that are full or fail, and files that are torn.
//!
//! Each story ends with a history that is checked (`history`). Built with the feature `planted`, each also runs with
//! a bug that it has to find. `SKYWAY_FAULT_ROUNDS` says how many rounds, `SKYWAY_FAULT_SEED` by which chance.

mod daemon;
mod history;
mod killed_registry;
mod registry_client;
mod rounds;
mod store_file;
mod writers;

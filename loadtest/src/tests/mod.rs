//! The open loop against servers of the tests' own, and scenarios as data.

mod open_loop;
mod scenarios;
mod workloads;

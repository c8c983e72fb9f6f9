//! The command line from outside: the real binary, its exit codes, what it writes and where.

mod answers;
mod binary;
#[cfg(all(unix, feature = "edge"))]
mod clock;
#[cfg(feature = "edge")]
mod config;
mod conversions;
#[cfg(all(target_os = "linux", feature = "edge"))]
mod daemons;
#[cfg(feature = "edge")]
mod demo;
mod evaluate;
mod flights;
mod foreign;
mod forged;
mod forged_plans;
mod help;
mod input;
#[cfg(feature = "edge")]
mod logs;
mod networks;
mod packs;
mod requests;
mod services;
#[cfg(feature = "edge")]
mod traces;
mod tracks;

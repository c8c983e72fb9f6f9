//! The registry: one suite over all of its stores, and stories over HTTP.

mod cluster;
mod compaction;
mod contract;
mod deliveries;
mod description;
mod documents;
mod drafts;
mod earlier_store;
mod harness;
mod keeping;
mod market;
mod memory;
#[expect(dead_code, reason = "simulations break it, and the suite does not")]
#[path = "../simulation/memory_store/mod.rs"]
mod memory_store;
mod messages;
mod pages;
mod positions;
mod postgres;
mod readiness;
mod restored;
mod sqlite;
mod stories;
mod stories_log;
mod tenancy;
mod told;

//! The registry: one suite over both of its stores, and stories over HTTP.

mod cluster;
mod compaction;
mod contract;
mod description;
mod drafts;
mod harness;
mod keeping;
mod pages;
mod postgres;
mod restored;
mod sqlite;
mod stories;
mod stories_log;

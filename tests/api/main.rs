//! The REST API of an edge over Sydney, asked over a real socket at a time that stands still.

mod bad_input;
mod description;
mod events;
mod harness;
mod idempotency;
mod stories;
mod versions;

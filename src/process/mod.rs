//! The processes that daemons are: what they serve and log, and the signals that end them.

pub mod listening;
mod live_keys;
mod live_tokens;
pub mod logs;
pub mod memory;
mod planted;
pub mod registry;
pub mod service;
pub mod signals;
mod store_lock;
mod store_thread;
pub mod supervisor;
pub mod traces;

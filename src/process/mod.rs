//! The process that an edge is: what it serves and logs, and the signals that end it.

pub mod logs;
pub mod service;
pub mod signals;

//! The server over real sockets: deadlines, limits, shedding, roles and the drain, with handlers of its own.

mod connections;
mod deadlines;
mod drain;
mod harness;
mod limits;
mod raw;
mod roles;
mod sharing;
mod shedding;
mod slowloris;
mod waiting;

//! The pages at `/`: what an edge does, and the shop window of a registry. Each needs nothing but its own daemon.
//!
//! The files are part of the program and are sent as they are written: no build step, no libraries, no
//! requests to anyone else. A page is a client of the REST interface like any other.

pub mod edge;
mod served;
pub mod shop;

#[cfg(test)]
mod tests;

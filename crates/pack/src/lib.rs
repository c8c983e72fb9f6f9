//! The pack: what a drone does when the line to its edge is gone, as bytes for a flight controller.
//!
//! [`Pack::read`] checks the signature and every byte before anything is told, so that nothing it tells can panic, whatever
//! the bytes are. It needs neither an allocator nor the standard library. `docs/pack.md` has the format with its offsets;
//! with the feature `write`, [`write::Draft`] makes packs.

#![no_std]
#![forbid(unsafe_code)]

#[cfg(feature = "write")]
extern crate alloc;

mod advice;
mod check;
mod fault;
mod key;
mod layout;
mod pack;
mod way;
#[cfg(feature = "write")]
pub mod write;

pub use advice::{Advice, Unknown};
pub use fault::Fault;
pub use key::KeyId;
pub use layout::{BYTES_OF_TEN_LEGS, BYTES_PER_FURTHER_LEG, State, bytes_max};
pub use pack::{Clock, HeightReference, Leg, Node, Pack};
pub use way::{Hop, Hops, Stop, Way};

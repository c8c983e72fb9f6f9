//! What operators send, read strictly: the one judge of zones, closures and weather, at the edge as at the registry.
//!
//! Everything wrong with a body is told at once, each fault with its place and a hint. Nothing here knows who
//! asks or where the result is kept.

mod closure;
mod fields;
mod network;
mod pages;
mod store_look;
mod version;
mod weather;
mod zone;

pub(crate) use closure::{ClosureIds, read_closure};
pub(crate) use fields::Faults;
pub(crate) use network::{network_refusal, network_rejected};
pub use pages::PageRequest;
pub(crate) use pages::{Page, filtered, read_token, slice, token};
pub(crate) use store_look::{EMPTY_STORE, FOREIGN_STORE, StoreLook, look_at_store};
pub(crate) use version::Expected;
pub(crate) use weather::read_weather;
pub(crate) use zone::read_zone;

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

pub use closure::{ClosureIds, read_closure};
pub use fields::Faults;
pub use network::{network_refusal, network_rejected};
pub use pages::PageRequest;
pub use pages::{Page, filtered, read_token, token};
pub use store_look::{EMPTY_STORE, FOREIGN_STORE, StoreLook, look_at_store};
pub use version::Expected;
pub use weather::read_weather;
pub use zone::read_zone;

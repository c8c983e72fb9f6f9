//! The configuration of a daemon: what it may say, who said what, and whether the daemon may start with it.
//!
//! `edge` and `registry` have one table each of all settings. A flag wins over the environment, that over the file, that over
//! the default; an unknown setting is refused, all of it at once, with the place where it was said.

mod airframes;
mod authorities;
mod edge;
mod fault;
mod new_token;
mod pack_keys;
pub mod registry;
mod resolve;
mod sample;
mod settings;
mod start;
mod tokens;
mod value;

#[cfg(test)]
mod tests;

pub use airframes::{AirframeError, read_airframe};
pub use authorities::{AuthoritiesError, read_authorities};
pub use edge::{
    Airspace, ClockConfig, Drain, Drones, EdgeConfig, Events, Flight, Freshness, Idempotency,
    Limits, Log, Plans, Records, RegistryLink, Reports, SETTINGS, Trees,
};
pub use fault::{ConfigFault, ConfigWarning, Origin};
pub use new_token::NewToken;
pub use pack_keys::{PackKey, PackKeys, PackKeysError};
pub use registry::RegistryConfig;
pub use resolve::{EffectiveConfig, Flag, Sources, resolve, resolve_leniently};
pub use sample::sample;
pub use settings::{Configuration, Exposure, Setting};
pub use start::Admission;
pub use tokens::{Tokens, TokensError, read_bearer};
pub use value::{ClockMover, HttpUrl, Kind, LogFilter, LogFormat, Names, Size};

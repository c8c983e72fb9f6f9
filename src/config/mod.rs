//! The configuration of an edge: what it may say, who said what, and whether an edge may start with it.
//!
//! [`SETTINGS`] is the one table of all settings. A flag wins over the environment, that over the file, that over
//! the default; what nobody knows is refused, all of it at once, with the place where it was said.

mod fault;
mod resolve;
mod sample;
mod settings;
mod start;
mod tokens;
mod value;

#[cfg(test)]
mod tests;

pub use fault::{ConfigFault, ConfigWarning, Origin};
pub use resolve::{EffectiveConfig, Flag, Sources, resolve};
pub use sample::sample;
pub use settings::{
    Airspace, ClockConfig, Drain, Drones, EdgeConfig, Events, Freshness, Idempotency, Limits, Log,
    Plans, Records, Reports, SETTINGS, Setting, Trees,
};
pub use start::Admission;
pub use tokens::{NewToken, Tokens, TokensError};
pub use value::{Kind, LogFilter, LogFormat, Size};

/// What the names of all variables begin with.
pub const ENVIRONMENT_PREFIX: &str = "SKYWAY_EDGE_";

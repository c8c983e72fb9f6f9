//! What every answer says of the world it was computed on.

use serde::{Deserialize, Serialize};
use std::borrow::Cow;

/// How current the edge's knowledge of the registry is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "edge", derive(utoipa::ToSchema))]
#[serde(rename_all = "snake_case")]
pub enum Freshness {
    /// As current as it should be; so is an edge that follows no registry.
    Fresh,
    /// The registry has been away for a while.
    Stale,
    /// The registry has been away for long, or the clock has stepped and nobody has confirmed it.
    Degraded,
}

/// What the edge's times are.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "edge", derive(utoipa::ToSchema))]
#[serde(rename_all = "snake_case")]
pub enum ClockKind {
    /// The machine's clock.
    Real,
    /// A clock of its own, for simulations.
    Simulated,
}

/// The clock after an operator has confirmed it: the answer to `POST /v1/clock:confirm`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "edge", derive(utoipa::ToSchema))]
pub struct ClockState<'a> {
    /// The time now, RFC 3339.
    pub now: Cow<'a, str>,
    /// How far the clock had stepped, in seconds; null where it had not, so that nothing was to be confirmed.
    pub confirmed_step_s: Option<f64>,
    /// The world it counts in.
    #[serde(flatten)]
    pub stamp: Stamp<'a>,
}

/// The world an answer was computed on.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "edge", derive(utoipa::ToSchema))]
pub struct Stamp<'a> {
    /// Epoch and sequence of the edge's state: a new epoch per start, one more with every change.
    pub revision: Cow<'a, str>,
    /// Changes with nodes and segments.
    pub topology_revision: u64,
    /// Revision of the registry that this state follows; null without a registry.
    pub registry_revision: Option<u64>,
    /// How long ago the registry was last heard, in seconds; null without a registry.
    pub registry_age_s: Option<f64>,
    /// How current that is.
    pub freshness: Freshness,
    /// What the edge's times are.
    pub clock: ClockKind,
}

//! What drones and operators report of a plan: versions taken over or declined, landings, cancellations, releases.

use super::id::Place;
use super::numbers::{some_share, some_whole_number, version_number};
use super::plan::EndedAs;
use serde::{Deserialize, Serialize};

/// A drone takes over a recomposed plan: the body of `POST /v1/plans/{id}/ack`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, utoipa::ToSchema)]
#[serde(deny_unknown_fields)]
pub struct Ack {
    /// The version taken over.
    #[serde(deserialize_with = "version_number")]
    #[schema(minimum = 1)]
    pub version: u32,
    /// Where the drone was then, as far as it tells.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub location: Option<Place>,
    /// The leg of that version that it was on, counted from 0.
    #[serde(
        default,
        deserialize_with = "some_whole_number",
        skip_serializing_if = "Option::is_none"
    )]
    pub leg: Option<u32>,
    /// How far on that leg it was, from 0 to 1.
    #[serde(
        default,
        deserialize_with = "some_share",
        skip_serializing_if = "Option::is_none"
    )]
    #[schema(minimum = 0, maximum = 1)]
    pub fraction: Option<f64>,
}

/// A drone cannot take a version over: the body of `POST /v1/plans/{id}/decline`. It flies on as it reported.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, utoipa::ToSchema)]
#[serde(deny_unknown_fields)]
pub struct Decline {
    /// The version declined.
    #[serde(deserialize_with = "version_number")]
    #[schema(minimum = 1)]
    pub version: u32,
    /// Why: `battery`, `payload`, `propulsion`, `obstacle`, `weather`, `passed` (the way begins behind the drone); any other
    /// text counts as a way that the drone cannot begin.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(max_length = 256)]
    pub reason: Option<String>,
    /// Where the drone was then, as far as it tells.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub location: Option<Place>,
    /// The leg of the reported version that it was on, counted from 0.
    #[serde(
        default,
        deserialize_with = "some_whole_number",
        skip_serializing_if = "Option::is_none"
    )]
    pub leg: Option<u32>,
    /// How far on that leg it was, from 0 to 1.
    #[serde(
        default,
        deserialize_with = "some_share",
        skip_serializing_if = "Option::is_none"
    )]
    #[schema(minimum = 0, maximum = 1)]
    pub fraction: Option<f64>,
}

/// A drone has landed at the end of its plan: the body of `POST /v1/plans/{id}/complete`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, utoipa::ToSchema)]
#[serde(deny_unknown_fields)]
pub struct Completion {
    /// Where it has landed; the end of the version that it reported where it does not tell.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub location: Option<Place>,
    /// The leg of the reported version that it was on, counted from 0.
    #[serde(
        default,
        deserialize_with = "some_whole_number",
        skip_serializing_if = "Option::is_none"
    )]
    pub leg: Option<u32>,
    /// How far on that leg it was, from 0 to 1.
    #[serde(
        default,
        deserialize_with = "some_share",
        skip_serializing_if = "Option::is_none"
    )]
    #[schema(minimum = 0, maximum = 1)]
    pub fraction: Option<f64>,
}

/// A plan is not to be flown any more: the query of `DELETE /v1/plans/{id}`.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Cancellation {
    /// Where its drone is, in flight: without a place what it takes stays taken.
    pub location: Option<Place>,
    /// The leg of the reported version that it is on, counted from 0.
    pub leg: Option<u32>,
    /// How far on that leg it is, from 0 to 1.
    pub fraction: Option<f64>,
    /// Only while its drone has not departed: else the plan goes on.
    pub before_departure: bool,
}

/// An operator says what became of a plan: the body of `POST /v1/plans/{id}/release`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, utoipa::ToSchema)]
#[serde(deny_unknown_fields)]
pub struct Release {
    /// What became of it.
    pub ended_as: EndedAs,
}

//! What the registry works out of all that it has been told.

use crate::failure::FailureType;
use crate::status::Stamp;
use serde::{Deserialize, Serialize};

/// A share with its 95 % interval (Wilson's score).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, utoipa::ToSchema)]
pub struct Share {
    /// How many.
    pub count: u64,
    /// Of how many.
    pub of: u64,
    /// The share, from 0 to 1; 0 where there are none.
    pub fraction: f64,
    /// The lower end of the interval.
    pub low_fraction: f64,
    /// Its upper end.
    pub high_fraction: f64,
}

/// How often something fails.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, utoipa::ToSchema)]
pub struct FailureRate {
    /// The segment; absent where the reports named none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub segment: Option<String>,
    /// The hour of the day, UTC, from 0 to 23.
    pub hour: u8,
    /// What failed.
    pub failure_type: FailureType,
    /// How many failures.
    pub failures: u64,
    /// Failures a day, over the days that are looked at.
    pub per_day: f64,
    /// The lower end of the 95 % interval of failures a day (exact, Garwood 1936).
    pub low_per_day: f64,
    /// Its upper end.
    pub high_per_day: f64,
}

/// How late the deliveries of a service are.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, utoipa::ToSchema)]
pub struct Lateness {
    /// The service.
    pub service_id: String,
    /// How many of its deliveries came in time.
    pub on_time: Share,
    /// The median of how late they are, in seconds; negative where they are early.
    pub median_s: f64,
    /// The 95th percentile.
    pub p95_s: f64,
}

/// Statistics of a network: the answer of `GET /v1/networks/{network}/statistics`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, utoipa::ToSchema)]
pub struct NetworkStatistics {
    /// The network.
    pub network: String,
    /// From when, RFC 3339.
    #[schema(format = DateTime)]
    pub from: String,
    /// Until when, RFC 3339.
    #[schema(format = DateTime)]
    pub until: String,
    /// Failures by segment, hour and type, the most frequent first; at most 10,000.
    pub failures: Vec<FailureRate>,
    /// Lateness by service; a provider sees its own.
    pub lateness: Vec<Lateness>,
}

/// How often what fails where, as an edge has it from its registry.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, utoipa::ToSchema)]
pub struct FailureRates<'a> {
    /// From when failures were counted, RFC 3339; absent while the registry has told nothing.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(format = DateTime)]
    pub from: Option<String>,
    /// Until when, RFC 3339: as old are the rates.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(format = DateTime)]
    pub until: Option<String>,
    /// Failures by segment, hour and type, the most frequent first; at most 10,000.
    pub failures: Vec<FailureRate>,
    /// The world of this answer.
    #[serde(flatten)]
    pub stamp: Stamp<'a>,
}

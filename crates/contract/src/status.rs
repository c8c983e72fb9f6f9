//! What every answer says of the world it was computed on.

use serde::{Deserialize, Deserializer, Serialize, Serializer};
use std::borrow::Cow;
use std::fmt;

/// How current the edge's knowledge of the registry is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, utoipa::ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum Freshness {
    /// As current as it should be; so is an edge that follows no registry.
    Fresh,
    /// The registry has been away for a while.
    Stale,
    /// The registry has been away for long, or the clock has stepped and no operator has confirmed it.
    Degraded,
}

/// What the edge's times are.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, utoipa::ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum ClockKind {
    /// The machine's clock.
    Real,
    /// A clock of its own, for simulations: it began at a time and passes at a rate of its own.
    Simulated,
    /// A clock that stands still until a client moves it.
    External,
}

/// The clock of an edge or a registry: the answer to `GET /v1/clock`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, utoipa::ToSchema)]
pub struct ClockReading<'a> {
    /// What moves it.
    pub kind: ClockKind,
    /// The time by which the daemon answers, RFC 3339.
    pub time: Cow<'a, str>,
    /// How many of its seconds pass in one of the machine's; 0 where it stands still until it is moved.
    pub rate: f64,
}

/// The clock after an operator has confirmed it: the answer to `POST /v1/clock:confirm`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, utoipa::ToSchema)]
pub struct ClockState<'a> {
    /// The time now, RFC 3339.
    pub now: Cow<'a, str>,
    /// How far the clock had stepped, in seconds; null where it had not, so that nothing was to be confirmed.
    pub confirmed_step_s: Option<f64>,
    /// The world it counts in.
    #[serde(flatten)]
    pub stamp: Stamp<'a>,
}

/// How far a client moves the clock: the body of `POST /v1/clock:advance`.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, utoipa::ToSchema)]
#[serde(deny_unknown_fields)]
pub struct ClockAdvance {
    /// The time that it is to show, RFC 3339: not before that which it shows, and at most 24 h after it.
    #[schema(format = DateTime)]
    pub to: String,
}

/// The clock after a client has moved it: the answer to `POST /v1/clock:advance`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, utoipa::ToSchema)]
pub struct ClockAdvanced<'a> {
    /// The time now, RFC 3339.
    pub time: Cow<'a, str>,
    /// How many timers came due on the way: ends and beginnings of windows, lives of closures, acknowledgements,
    /// departures, arrivals and the like.
    pub fired: u64,
    /// The world after all that they led to.
    #[serde(flatten)]
    pub stamp: Stamp<'a>,
}

/// How far a registry is followed: its epoch and revision, on the wire `epoch-revision`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RegistryRevision {
    /// Which life of the registry.
    pub epoch: u64,
    /// The last change in service.
    pub revision: u64,
}

impl fmt::Display for RegistryRevision {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{}-{}", self.epoch, self.revision)
    }
}

impl std::str::FromStr for RegistryRevision {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let parts = text.split_once('-');
        let read = parts.and_then(|(epoch, revision)| {
            Some(Self {
                epoch: epoch.parse().ok()?,
                revision: revision.parse().ok()?,
            })
        });
        read.ok_or_else(|| format!("'{text}' is not an epoch and a revision such as 1-7"))
    }
}

impl Serialize for RegistryRevision {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

impl<'de> Deserialize<'de> for RegistryRevision {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let text = Cow::<str>::deserialize(deserializer)?;
        text.parse().map_err(serde::de::Error::custom)
    }
}

/// The network an answer was computed on. Places and ids mean nothing on another one.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize, utoipa::ToSchema)]
pub struct NetworkName<'a> {
    /// Its name for people.
    pub name: Cow<'a, str>,
    /// SHA-256 of its file, in hexadecimal digits.
    pub sha256: Cow<'a, str>,
}

impl NetworkName<'_> {
    /// The same, borrowing nothing.
    pub fn into_owned(self) -> NetworkName<'static> {
        NetworkName {
            name: Cow::Owned(self.name.into_owned()),
            sha256: Cow::Owned(self.sha256.into_owned()),
        }
    }
}

/// The world an answer was computed on.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, utoipa::ToSchema)]
pub struct Stamp<'a> {
    /// Epoch and sequence of the edge's state: a new epoch per start, one more with every change.
    pub revision: Cow<'a, str>,
    /// Changes with nodes and segments.
    pub topology_revision: u64,
    /// Epoch and revision of the registry that this state follows; null without a registry.
    #[schema(value_type = Option<String>, example = "1-7")]
    pub registry_revision: Option<RegistryRevision>,
    /// How long ago this was all that the registry had, in seconds; null without a registry, and until it was
    /// first heard after a start.
    pub registry_age_s: Option<f64>,
    /// How current that is.
    pub freshness: Freshness,
    /// What the edge's times are.
    pub clock: ClockKind,
    /// The network; of an answer from before networks were named its texts are empty.
    #[serde(default)]
    pub network: NetworkName<'a>,
}

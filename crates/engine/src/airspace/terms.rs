//! What a zone means beside its shape and windows: its kind, its schedules, where it comes from.

use super::schedule::Recurrence;
use std::sync::Arc;

/// At most this many bytes in the record of a zone.
pub const MAX_RECORD_BYTES: usize = 65_536;

/// What a zone means for a drone: the types of ED-269 and ED-318.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum ZoneKind {
    /// Closed.
    #[default]
    Prohibited,
    /// Closed but for those who are authorised. Who is, is not said here, so that it closes for
    /// everyone.
    ReqAuthorization,
    /// Closed but under conditions. Who meets them is not said here, so that it closes for
    /// everyone.
    Conditional,
    /// U-space airspace; shown, closes nothing.
    Uspace,
    /// Information; shown, closes nothing.
    NoRestriction,
}

impl ZoneKind {
    /// All of them, the strictest first.
    pub const ALL: [Self; 5] = [
        Self::Prohibited,
        Self::ReqAuthorization,
        Self::Conditional,
        Self::Uspace,
        Self::NoRestriction,
    ];

    /// The name on the wire.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Prohibited => "prohibited",
            Self::ReqAuthorization => "req_authorization",
            Self::Conditional => "conditional",
            Self::Uspace => "uspace",
            Self::NoRestriction => "no_restriction",
        }
    }

    /// Whether drones are led around it.
    pub const fn closes(self) -> bool {
        matches!(
            self,
            Self::Prohibited | Self::ReqAuthorization | Self::Conditional
        )
    }
}

/// Where a zone was imported from.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ZoneSource {
    /// The name of the feed.
    pub feed: String,
    /// The identifier of the zone there, of which several zones here may be parts.
    pub id: String,
}

/// What a zone means beside its shape, its altitudes and its windows.
#[derive(Clone, Debug, PartialEq, Default)]
pub struct ZoneTerms {
    /// What it means for a drone.
    pub kind: ZoneKind,
    /// Its schedules: it counts when any of them does, beside its windows.
    pub schedules: Vec<Recurrence>,
    /// Where it was imported from.
    pub source: Option<ZoneSource>,
    /// What its feed says of it and nothing here acts on (country, authorities, conditions,
    /// exemptions, messages): a JSON object in the words of ED-318.
    pub record: Option<Arc<str>>,
}

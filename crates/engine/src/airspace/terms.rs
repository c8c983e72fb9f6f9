//! What a zone means beside its shape and windows: its kind, its schedules, where it comes from.

use super::schedule::Recurrence;
use std::sync::Arc;

/// At most this many bytes in the record of a zone.
pub const MAX_RECORD_BYTES: usize = 65_536;
/// At most this many objects and lists within one another in it: what is written around it has to be read again.
pub const MAX_RECORD_DEPTH: usize = 32;

/// What a zone means for a drone: the types of ED-269 and ED-318.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum ZoneKind {
    /// Closed.
    #[default]
    Prohibited,
    /// Closed, unless the drones of the network are authorized ([`ZoneTerms::is_authorized`]).
    ReqAuthorization,
    /// Closed, unless the drones of the network meet its conditions (likewise).
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

    /// Whether drones are led around it, unless they are authorized.
    pub const fn closes(self) -> bool {
        matches!(self, Self::Prohibited) || self.can_be_authorized()
    }

    /// Whether drones can be authorized for it.
    pub const fn can_be_authorized(self) -> bool {
        matches!(self, Self::ReqAuthorization | Self::Conditional)
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
    /// Whether the drones of the network are authorized for it, or meet its conditions: an operator's rule.
    pub is_authorized: bool,
    /// Its schedules: it counts when any of them does, beside its windows.
    pub schedules: Vec<Recurrence>,
    /// Where it was imported from.
    pub source: Option<ZoneSource>,
    /// What its feed says of it and nothing here acts on (country, authorities, conditions,
    /// exemptions, messages): a JSON object in the words of ED-318.
    pub record: Option<Arc<str>>,
}

impl ZoneTerms {
    /// Whether drones are led around the zone.
    pub const fn closes(&self) -> bool {
        self.kind.closes() && !self.is_authorized
    }

    /// How deep its record is nested, where that is too deep.
    pub(super) fn too_deep(&self) -> Option<usize> {
        let depth = record_depth(self.record.as_deref()?);
        (depth > MAX_RECORD_DEPTH).then_some(depth)
    }
}

/// How many objects and lists of a JSON text lie within one another.
pub fn record_depth(json: &str) -> usize {
    let (mut depth, mut deepest) = (0_usize, 0);
    let (mut is_text, mut is_escaped) = (false, false);
    for byte in json.bytes() {
        match byte {
            _ if is_escaped => is_escaped = false,
            b'\\' => is_escaped = is_text,
            b'"' => is_text = !is_text,
            b'{' | b'[' if !is_text => {
                depth += 1;
                deepest = deepest.max(depth);
            }
            b'}' | b']' if !is_text => depth = depth.saturating_sub(1),
            _ => {}
        }
    }
    deepest
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn brackets_in_texts_are_no_depth() {
        for (json, depth) in [
            ("{}", 1),
            (r#"{"a": [{}, [[]]], "b": {}}"#, 4),
            (r#"{"[{": "\\\"[[{", "a": "\\", "b": [1]}"#, 2),
        ] {
            assert_eq!(record_depth(json), depth, "{json}");
        }
    }
}

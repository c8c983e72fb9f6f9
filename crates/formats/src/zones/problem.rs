//! The table of codes for what can be wrong with a zone, and the problem that carries one.

use std::fmt;
use thiserror::Error;

/// At most this many problems are collected from one body or file.
pub const MAX_ZONE_PROBLEMS: usize = 20;

/// What is wrong with a zone, one code for each kind. Codes are stable: clients branch on them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ZoneCode {
    /// The text is not JSON.
    NotJson,
    /// The text is not XML that is read here.
    NotXml,
    /// A format of the field that is not read here.
    FormatForeign,
    /// A number in the text is beyond the range of a double; its place is a line and a column.
    NumberOutOfRange,
    /// A value is of another kind than it should be.
    WrongType,
    /// A field that nothing is known of.
    UnknownField,
    /// A field that has to be there.
    MissingField,
    /// A word that is not one of those allowed.
    UnknownValue,
    /// The id is empty.
    IdEmpty,
    /// The id cannot stand in an address.
    IdInvalid,
    /// The id is not the one the caller named.
    IdMismatch,
    /// Two zones of a file have the same id.
    IdDuplicate,
    /// A text is too long.
    TextTooLong,
    /// A geometry other than polygon, multipolygon and point with radius.
    GeometryUnsupported,
    /// A geometry with nothing in it.
    GeometryEmpty,
    /// A position that is not two numbers.
    PositionNotPair,
    /// A coordinate that is not finite.
    CoordinateNotFinite,
    /// A coordinate in metres that is too far away.
    CoordinateOutOfRange,
    /// A latitude beyond a pole.
    LatitudeOutOfRange,
    /// A longitude beyond half a turn.
    LongitudeOutOfRange,
    /// An edge or a circle runs across the antimeridian.
    CrossesAntimeridian,
    /// A circle reaches over a pole.
    CrossesPole,
    /// More vertices than allowed.
    TooManyVertices,
    /// A ring whose last position does not repeat its first.
    RingUnclosed,
    /// A ring of fewer than three distinct points.
    TooFewPoints,
    /// A ring on one straight line.
    ZeroArea,
    /// A ring that meets itself.
    SelfIntersection,
    /// A ring that folds back on itself.
    Spike,
    /// Two rings of a polygon that meet.
    RingsMeet,
    /// A hole outside its outer ring.
    HoleOutside,
    /// A hole inside another hole.
    HoleInHole,
    /// A radius that is not above 0, too large, or on something that is not a point.
    RadiusInvalid,
    /// A margin that is negative or too wide.
    MarginInvalid,
    /// An altitude that is not finite.
    AltitudeInvalid,
    /// A lower limit above the upper one.
    BandReversed,
    /// A time that is not an RFC 3339 instant.
    TimeInvalid,
    /// A window that does not end after it begins.
    WindowReversed,
    /// More windows than allowed.
    TooManyWindows,
    /// More daily periods than allowed.
    TooManyPeriods,
    /// A schedule that never counts, or one by the sun where there is none.
    ScheduleInvalid,
    /// An authorization for a zone whose kind has none.
    NotAuthorizable,
    /// A fence that keeps drones in, which a zone cannot.
    FenceKeepsIn,
    /// The id is that of something that does not come from this feed.
    IdTaken,
}

impl ZoneCode {
    /// All codes.
    pub const ALL: [Self; 43] = [
        Self::NotJson,
        Self::NotXml,
        Self::FormatForeign,
        Self::NumberOutOfRange,
        Self::WrongType,
        Self::UnknownField,
        Self::MissingField,
        Self::UnknownValue,
        Self::IdEmpty,
        Self::IdInvalid,
        Self::IdMismatch,
        Self::IdDuplicate,
        Self::TextTooLong,
        Self::GeometryUnsupported,
        Self::GeometryEmpty,
        Self::PositionNotPair,
        Self::CoordinateNotFinite,
        Self::CoordinateOutOfRange,
        Self::LatitudeOutOfRange,
        Self::LongitudeOutOfRange,
        Self::CrossesAntimeridian,
        Self::CrossesPole,
        Self::TooManyVertices,
        Self::RingUnclosed,
        Self::TooFewPoints,
        Self::ZeroArea,
        Self::SelfIntersection,
        Self::Spike,
        Self::RingsMeet,
        Self::HoleOutside,
        Self::HoleInHole,
        Self::RadiusInvalid,
        Self::MarginInvalid,
        Self::AltitudeInvalid,
        Self::BandReversed,
        Self::TimeInvalid,
        Self::WindowReversed,
        Self::TooManyWindows,
        Self::TooManyPeriods,
        Self::ScheduleInvalid,
        Self::NotAuthorizable,
        Self::FenceKeepsIn,
        Self::IdTaken,
    ];

    /// The code as clients see it.
    pub const fn code(self) -> &'static str {
        match self {
            Self::NotJson => "zone_not_json",
            Self::NotXml => "zone_not_xml",
            Self::FormatForeign => "zone_format_foreign",
            Self::NumberOutOfRange => "zone_number_out_of_range",
            Self::WrongType => "zone_wrong_type",
            Self::UnknownField => "zone_unknown_field",
            Self::MissingField => "zone_missing_field",
            Self::UnknownValue => "zone_unknown_value",
            Self::IdEmpty => "zone_id_empty",
            Self::IdInvalid => "zone_id_invalid",
            Self::IdMismatch => "zone_id_mismatch",
            Self::IdDuplicate => "zone_id_duplicate",
            Self::TextTooLong => "zone_text_too_long",
            Self::GeometryUnsupported => "zone_geometry_unsupported",
            Self::GeometryEmpty => "zone_geometry_empty",
            Self::PositionNotPair => "zone_position_not_pair",
            Self::CoordinateNotFinite => "zone_coordinate_not_finite",
            Self::CoordinateOutOfRange => "zone_coordinate_out_of_range",
            Self::LatitudeOutOfRange => "zone_latitude_out_of_range",
            Self::LongitudeOutOfRange => "zone_longitude_out_of_range",
            Self::CrossesAntimeridian => "zone_crosses_antimeridian",
            Self::CrossesPole => "zone_crosses_pole",
            Self::TooManyVertices => "zone_too_many_vertices",
            Self::RingUnclosed => "zone_ring_unclosed",
            Self::TooFewPoints => "zone_too_few_points",
            Self::ZeroArea => "zone_zero_area",
            Self::SelfIntersection => "zone_self_intersection",
            Self::Spike => "zone_spike",
            Self::RingsMeet => "zone_rings_meet",
            Self::HoleOutside => "zone_hole_outside",
            Self::HoleInHole => "zone_hole_in_hole",
            Self::RadiusInvalid => "zone_radius_invalid",
            Self::MarginInvalid => "zone_margin_invalid",
            Self::AltitudeInvalid => "zone_altitude_invalid",
            Self::BandReversed => "zone_band_reversed",
            Self::TimeInvalid => "zone_time_invalid",
            Self::WindowReversed => "zone_window_reversed",
            Self::TooManyWindows => "zone_too_many_windows",
            Self::TooManyPeriods => "zone_too_many_periods",
            Self::ScheduleInvalid => "zone_schedule_invalid",
            Self::NotAuthorizable => "zone_not_authorizable",
            Self::FenceKeepsIn => "zone_fence_keeps_in",
            Self::IdTaken => "zone_id_taken",
        }
    }
}

/// One thing wrong with a zone.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub struct ZoneProblem {
    /// Stable code, in snake case: one of [`ZoneCode`].
    pub code: &'static str,
    /// JSON Pointer (RFC 6901) of the exact place; empty for the document as a whole.
    pub pointer: String,
    /// What is wrong, in lower case and without a full stop.
    pub message: String,
    /// What would set it right, where that is known.
    pub hint: Option<String>,
}

impl ZoneProblem {
    pub(crate) fn new(code: ZoneCode, pointer: String, message: impl Into<String>) -> Self {
        Self {
            code: code.code(),
            pointer,
            message: message.into(),
            hint: None,
        }
    }

    #[must_use]
    pub(crate) fn hint(mut self, hint: impl Into<String>) -> Self {
        self.hint = Some(hint.into());
        self
    }
}

impl fmt::Display for ZoneProblem {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let place = self.pointer.strip_prefix('/').unwrap_or("document");
        write!(formatter, "{place}: {} ({})", self.message, self.code)?;
        match &self.hint {
            Some(hint) => write!(formatter, "; {hint}"),
            None => Ok(()),
        }
    }
}

/// Problems as they are found, no more than [`MAX_ZONE_PROBLEMS`].
#[derive(Debug, Default)]
pub(crate) struct Problems(Vec<ZoneProblem>);

impl Problems {
    pub(crate) fn push(&mut self, problem: ZoneProblem) {
        if !self.is_full() {
            self.0.push(problem);
        }
    }

    pub(crate) fn is_full(&self) -> bool {
        self.0.len() >= MAX_ZONE_PROBLEMS
    }

    pub(crate) fn count(&self) -> usize {
        self.0.len()
    }

    /// The value, unless there are problems.
    pub(crate) fn or<T>(self, value: Option<T>) -> Result<T, Vec<ZoneProblem>> {
        match value {
            Some(value) if self.0.is_empty() => Ok(value),
            _ => Err(self.0),
        }
    }
}

//! No-fly zones: a shape, a band of altitudes, windows in time, and who closed it why.
//!
//! A [`ZoneDraft`] is what a file or a caller says; [`Zone::new`] checks it. A zone is immutable: a
//! change makes a new one under the same id.

use super::schedule::{DailyPeriod, Days, MAX_PERIODS, Recurrence, merged};
use super::sun::Extent;
use super::terms::{MAX_RECORD_BYTES, MAX_RECORD_DEPTH, ZoneKind, ZoneTerms};
use super::zone_geometry::{GeometryError, ZoneGeometry};
use crate::geo::{Altitude, AltitudeBand, Frame, Point, PreparedShape};
use jiff::{SignedDuration, Timestamp};
use thiserror::Error;

/// By how much a zone is widened on all sides where it does not say, in metres.
pub const DEFAULT_MARGIN_M: f64 = 10.0;
/// The widest margin, in metres.
pub const MAX_MARGIN_M: f64 = 10_000.0;
/// At most this many windows in one zone.
pub const MAX_WINDOWS: usize = 1_000;
/// At most this many bytes in an id.
pub const MAX_ID_BYTES: usize = 200;
/// At most this many bytes in a name, a reason or an authority; ED-269 allows a condition as many letters.
pub const MAX_TEXT_BYTES: usize = 10_000;

/// A span of time, both ends included; a missing end is unlimited.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Window {
    from: Option<Timestamp>,
    until: Option<Timestamp>,
}

/// A window that ends before it begins, or as it begins.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
#[error("the window ends at {until}, not after it begins at {from}")]
pub struct WindowReversed {
    /// When it would begin.
    pub from: Timestamp,
    /// When it would end.
    pub until: Timestamp,
}

impl Window {
    /// A window without ends.
    pub const ALWAYS: Self = Self {
        from: None,
        until: None,
    };

    /// A window from when until when.
    ///
    /// # Errors
    /// When both ends are given and the first is not before the second.
    pub fn new(from: Option<Timestamp>, until: Option<Timestamp>) -> Result<Self, WindowReversed> {
        match (from, until) {
            (Some(from), Some(until)) if from >= until => Err(WindowReversed { from, until }),
            _ => Ok(Self { from, until }),
        }
    }

    /// When it begins; `None` when it always has been.
    pub fn from(&self) -> Option<Timestamp> {
        self.from
    }

    /// When it ends; `None` when it never will.
    pub fn until(&self) -> Option<Timestamp> {
        self.until
    }

    /// True when the window shares an instant with `now..=until`: touching counts.
    pub fn meets(&self, now: Timestamp, until: Timestamp) -> bool {
        self.from.is_none_or(|from| from <= until) && self.until.is_none_or(|end| end >= now)
    }

    /// True when it meets `now ..= now + horizon`.
    ///
    /// So long as no arrival times are computed, what it closes then counts as closed.
    pub fn counts(&self, now: Timestamp, horizon: SignedDuration) -> bool {
        let until = now.saturating_add(horizon).unwrap_or(Timestamp::MAX);
        self.meets(now, until)
    }

    /// The next instant after `now` at which [`Window::counts`] answers otherwise than just before.
    ///
    /// That is when it comes within the horizon, or the first nanosecond after it has ended, as its end
    /// belongs to it. `None` when nothing will change any more.
    pub fn next_change_after(&self, now: Timestamp, horizon: SignedDuration) -> Option<Timestamp> {
        let begins = self
            .from
            .map(|from| from.saturating_sub(horizon).unwrap_or(Timestamp::MIN));
        let just_after = SignedDuration::from_nanos(1);
        let has_ended = self
            .until
            .and_then(|until| until.checked_add(just_after).ok());
        let changes = [begins, has_ended].into_iter().flatten();
        changes.filter(|&instant| instant > now).min()
    }
}

/// A zone as stated, not yet checked.
#[derive(Clone, Debug, PartialEq)]
pub struct ZoneDraft {
    /// The zone's id, unique among zones.
    pub id: String,
    /// A name for people.
    pub name: Option<String>,
    /// Why it is closed.
    pub reason: Option<String>,
    /// Who closed it.
    pub authority: Option<String>,
    /// What it covers, in the coordinates of the network's file.
    pub geometry: ZoneGeometry,
    /// The altitudes it closes.
    pub band: AltitudeBand,
    /// When it counts; always, when there are none and no schedules.
    pub windows: Vec<Window>,
    /// By how much it is widened on all sides, in metres.
    pub margin_m: f64,
    /// What it means beside that, and when else it counts.
    pub terms: ZoneTerms,
}

/// A text of a zone.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ZoneText {
    /// The id.
    Id,
    /// The name for people.
    Name,
    /// Why it is closed.
    Reason,
    /// Who closed it.
    Authority,
    /// The name of the feed that it was imported from.
    Feed,
    /// Its identifier there.
    Identifier,
    /// What its feed says of it beside.
    Record,
}

impl ZoneText {
    /// The name of the field.
    pub const fn field(self) -> &'static str {
        match self {
            Self::Id => "id",
            Self::Name => "name",
            Self::Reason => "reason",
            Self::Authority => "authority",
            Self::Feed => "source/feed",
            Self::Identifier => "source/id",
            Self::Record => "record",
        }
    }
}

/// Why a zone is refused.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum ZoneFault {
    /// The id is empty.
    #[error("the id is empty")]
    EmptyId,
    /// A text is too long.
    #[error("{} has {bytes} bytes, more than the {limit} allowed", text.field())]
    TextTooLong {
        /// Which.
        text: ZoneText,
        /// How long it is.
        bytes: usize,
        /// How long it may be.
        limit: usize,
    },
    /// The record is nested deeper than [`MAX_RECORD_DEPTH`].
    #[error("record is nested {0} deep, more than the {limit} allowed", limit = MAX_RECORD_DEPTH)]
    RecordTooDeep(usize),
    /// The geometry is not valid.
    #[error(transparent)]
    Geometry(#[from] GeometryError),
    /// An altitude is not a finite number.
    #[error("an altitude is not a finite number")]
    AltitudeNotFinite,
    /// The lower limit is above the upper one.
    #[error("the lower limit {lower_m} m is above the upper limit {upper_m} m")]
    BandReversed {
        /// The lower limit, in metres above the reference of both.
        lower_m: f64,
        /// The upper limit, likewise.
        upper_m: f64,
    },
    /// More windows than [`MAX_WINDOWS`].
    #[error("{count} windows are more than the {limit} allowed")]
    TooManyWindows {
        /// How many there are.
        count: usize,
        /// How many are allowed.
        limit: usize,
    },
    /// More daily periods than [`MAX_PERIODS`].
    #[error("{count} daily periods are more than the {limit} allowed")]
    TooManyPeriods {
        /// How many there are.
        count: usize,
        /// How many are allowed.
        limit: usize,
    },
    /// A schedule without a daily period, or one of them without a day.
    #[error("a schedule has no day on which it counts")]
    ScheduleEmpty,
    /// A schedule by the sun on a planar network.
    #[error("a planar network has no sun: give the times by the clock")]
    NoSun,
    /// A margin that is negative, not a number, or above [`MAX_MARGIN_M`].
    #[error("the margin {margin_m} m is not between 0 and {limit_m} m")]
    Margin {
        /// The margin given, in metres.
        margin_m: f64,
        /// The widest allowed, in metres.
        limit_m: f64,
    },
    /// Drones are authorized for a zone of a kind that has no authorization.
    #[error("drones cannot be authorized for a zone of the kind '{}'", kind.name())]
    NotAuthorizable {
        /// The kind.
        kind: ZoneKind,
    },
}

/// A no-fly zone that has passed every check, ready to be asked what it closes.
#[derive(Clone, Debug, PartialEq)]
pub struct Zone {
    draft: ZoneDraft,
    shape: PreparedShape,
    /// Its windows, and those that its schedules lie in.
    windows: Vec<Window>,
}

impl Zone {
    /// Checks a draft; `frame` says what the coordinates of its geometry mean.
    ///
    /// Limits of different references are not compared with each other: nothing is known of the ground.
    ///
    /// # Errors
    /// Everything that is wrong with the draft, of its geometry as far as [`ZoneGeometry::to_shape`] tells.
    pub fn new(draft: ZoneDraft, frame: &Frame) -> Result<Self, Vec<ZoneFault>> {
        let mut faults = Vec::new();
        check_texts(&draft, &mut faults);
        let shape = match draft.geometry.to_shape(frame) {
            Ok(shape) => Some(shape),
            Err(errors) => {
                faults.extend(errors.into_iter().map(ZoneFault::from));
                None
            }
        };
        faults.extend(band_fault(&draft.band));
        let schedules = draft.terms.schedules.iter();
        let within = schedules.map(|schedule| schedule.within);
        let windows: Vec<Window> = draft.windows.iter().copied().chain(within).collect();
        let (count, limit) = (windows.len(), MAX_WINDOWS);
        if count > limit {
            faults.push(ZoneFault::TooManyWindows { count, limit });
        }
        check_schedules(&draft.terms, frame, &mut faults);
        let (margin_m, limit_m) = (draft.margin_m, MAX_MARGIN_M);
        if !(0.0..=limit_m).contains(&margin_m) {
            faults.push(ZoneFault::Margin { margin_m, limit_m });
        }
        let kind = draft.terms.kind;
        if draft.terms.is_authorized && !kind.can_be_authorized() {
            faults.push(ZoneFault::NotAuthorizable { kind });
        }
        match shape {
            Some(shape) if faults.is_empty() => Ok(Self {
                draft,
                shape: PreparedShape::new(shape),
                windows,
            }),
            _ => Err(faults),
        }
    }

    /// The same zone on the plane of another network.
    ///
    /// # Errors
    /// As [`Zone::new`]: a shape that only just held on one plane may not on another.
    pub fn on(&self, frame: &Frame) -> Result<Self, Vec<ZoneFault>> {
        Self::new(self.draft.clone(), frame)
    }

    /// Authorizes the drones of the network for it; false where its kind has no authorization.
    pub fn authorize(&mut self) -> bool {
        let terms = &mut self.draft.terms;
        terms.is_authorized |= terms.kind.can_be_authorized();
        terms.is_authorized
    }

    /// The zone's id.
    pub fn id(&self) -> &str {
        &self.draft.id
    }

    /// The name for people.
    pub fn name(&self) -> Option<&str> {
        self.draft.name.as_deref()
    }

    /// Why it is closed.
    pub fn reason(&self) -> Option<&str> {
        self.draft.reason.as_deref()
    }

    /// Who closed it.
    pub fn authority(&self) -> Option<&str> {
        self.draft.authority.as_deref()
    }

    /// The geometry as it was written.
    pub fn geometry(&self) -> &ZoneGeometry {
        &self.draft.geometry
    }

    /// The shape on the network's plane, not widened by the margin.
    pub fn shape(&self) -> &PreparedShape {
        &self.shape
    }

    /// The altitudes it closes.
    pub fn band(&self) -> &AltitudeBand {
        &self.draft.band
    }

    /// The windows outside of which it never counts; always, when there are none. Within those of
    /// its schedules it does not count all the time; see [`Zone::windows_around`].
    pub fn windows(&self) -> &[Window] {
        &self.windows
    }

    /// The windows as they were written, without its schedules.
    pub fn plain_windows(&self) -> &[Window] {
        &self.draft.windows
    }

    /// What it means beside its shape, its altitudes and its windows.
    pub fn terms(&self) -> &ZoneTerms {
        &self.draft.terms
    }

    /// Whether it has schedules.
    pub fn recurs(&self) -> bool {
        !self.draft.terms.schedules.is_empty()
    }

    /// The windows in which it counts, those of its schedules for the days around an instant: from
    /// two days before it until eight days after it. Beyond these, schedules count as closed
    /// throughout.
    pub fn windows_around(&self, instant: Timestamp) -> Vec<Window> {
        let mut windows = self.draft.windows.clone();
        let extent = self.extent();
        for schedule in &self.draft.terms.schedules {
            schedule.add_windows(instant, &extent, &mut windows);
        }
        match self.recurs() {
            true => merged(windows),
            false => windows,
        }
    }

    /// The box of longitudes and latitudes that it lies in.
    fn extent(&self) -> Extent {
        match &self.draft.geometry {
            ZoneGeometry::Circle { centre, radius_m } => Extent::about_circle(*centre, *radius_m),
            ZoneGeometry::Polygon(rings) => Extent::about(rings.iter().flatten().copied()),
            ZoneGeometry::MultiPolygon(polygons) => {
                Extent::about(polygons.iter().flatten().flatten().copied())
            }
        }
    }

    /// By how much it is widened on all sides, in metres.
    pub fn margin_m(&self) -> f64 {
        self.draft.margin_m
    }

    /// True when it closes a node at this place; a node of unknown altitude counts as within its band.
    pub fn closes_point(&self, position: Point, altitude: Option<Altitude>) -> bool {
        self.draft.terms.closes()
            && self.draft.band.may_meet(&AltitudeBand::at(altitude))
            && self.shape.covers_point(position, self.draft.margin_m)
    }

    /// True when it closes a segment between these places, flown in this band.
    pub fn closes_line(&self, from: Point, to: Point, band: &AltitudeBand) -> bool {
        self.draft.terms.closes()
            && self.draft.band.may_meet(band)
            && self.shape.meets_segment(from, to, self.draft.margin_m)
    }

    /// The parts of a line that it closes, whatever the altitude; see [`PreparedShape::coverage`].
    pub fn coverage(&self, from: Point, to: Point) -> Vec<(f64, f64)> {
        if !self.draft.terms.closes() {
            return Vec::new();
        }
        self.shape.coverage(from, to, self.draft.margin_m)
    }

    /// True when any of its windows counts (see [`Window::counts`]), or it has none.
    pub fn counts_at(&self, now: Timestamp, horizon: SignedDuration) -> bool {
        let windows = self.windows_around(now);
        windows.is_empty() || windows.iter().any(|window| window.counts(now, horizon))
    }

    /// The next instant after `now` at which [`Zone::counts_at`] may answer otherwise than just before;
    /// `None` when nothing will change any more.
    pub fn next_change_after(&self, now: Timestamp, horizon: SignedDuration) -> Option<Timestamp> {
        let windows = self.windows_around(now);
        windows
            .iter()
            .filter_map(|window| window.next_change_after(now, horizon))
            .min()
    }
}

fn check_texts(draft: &ZoneDraft, faults: &mut Vec<ZoneFault>) {
    if draft.id.is_empty() {
        faults.push(ZoneFault::EmptyId);
    }
    let source = draft.terms.source.as_ref();
    let texts = [
        (ZoneText::Id, Some(&draft.id), MAX_ID_BYTES),
        (ZoneText::Name, draft.name.as_ref(), MAX_TEXT_BYTES),
        (ZoneText::Reason, draft.reason.as_ref(), MAX_TEXT_BYTES),
        (
            ZoneText::Authority,
            draft.authority.as_ref(),
            MAX_TEXT_BYTES,
        ),
        (
            ZoneText::Feed,
            source.map(|source| &source.feed),
            MAX_ID_BYTES,
        ),
        (
            ZoneText::Identifier,
            source.map(|source| &source.id),
            MAX_ID_BYTES,
        ),
    ];
    let record_bytes = draft.terms.record.as_deref().map_or(0, str::len);
    let texts = texts
        .into_iter()
        .map(|(text, value, limit)| (text, value.map_or(0, String::len), limit))
        .chain([(ZoneText::Record, record_bytes, MAX_RECORD_BYTES)]);
    for (text, bytes, limit) in texts {
        if bytes > limit {
            faults.push(ZoneFault::TextTooLong { text, bytes, limit });
        }
    }
    faults.extend(draft.terms.too_deep().map(ZoneFault::RecordTooDeep));
}

fn check_schedules(terms: &ZoneTerms, frame: &Frame, faults: &mut Vec<ZoneFault>) {
    let periods = || {
        terms
            .schedules
            .iter()
            .flat_map(|schedule| &schedule.periods)
    };
    let (count, limit) = (periods().count(), MAX_PERIODS);
    if count > limit {
        faults.push(ZoneFault::TooManyPeriods { count, limit });
    }
    let is_without_days = |schedule: &Recurrence| {
        let mut periods = schedule.periods.iter();
        periods.all(|period| period.days == Days::NONE)
    };
    if terms.schedules.iter().any(is_without_days) {
        faults.push(ZoneFault::ScheduleEmpty);
    }
    if !frame.is_geographic() && periods().any(DailyPeriod::follows_sun) {
        faults.push(ZoneFault::NoSun);
    }
}

fn band_fault(band: &AltitudeBand) -> Option<ZoneFault> {
    let limits = [band.lower, band.upper];
    if limits
        .iter()
        .flatten()
        .any(|limit| !limit.value_m.is_finite())
    {
        return Some(ZoneFault::AltitudeNotFinite);
    }
    let (lower, upper) = (band.lower?, band.upper?);
    let reversed = lower.reference == upper.reference && lower.value_m > upper.value_m;
    reversed.then_some(ZoneFault::BandReversed {
        lower_m: lower.value_m,
        upper_m: upper.value_m,
    })
}

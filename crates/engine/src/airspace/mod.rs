//! What is closed, why, from when until when: zones, closures, and the immutable snapshots of them.

mod bits;
mod closed;
mod closure;
mod counts;
mod encloses;
mod held;
mod hits;
mod lists;
mod schedule;
mod snapshot;
mod sun;
mod terms;
mod zone;
mod zone_geometry;

pub use bits::Bits;
pub use closed::{Closed, ClosedSet, RequestClosures};
pub use closure::{Cause, Closure, counts_until};
pub use hits::Hits;
pub use lists::Lists;
pub use schedule::{DailyPeriod, DayTime, Days, MAX_PERIODS, Recurrence};
pub use snapshot::{Airspace, Change};
pub use sun::SunEvent;
pub use terms::{
    MAX_RECORD_BYTES, MAX_RECORD_DEPTH, ZoneKind, ZoneSource, ZoneTerms, record_depth,
};
pub use zone::{
    DEFAULT_MARGIN_M, MAX_ID_BYTES, MAX_MARGIN_M, MAX_TEXT_BYTES, MAX_WINDOWS, Window,
    WindowReversed, Zone, ZoneDraft, ZoneFault, ZoneText,
};
pub use zone_geometry::{GeometryError, GeometryFault, WrittenRing, ZoneGeometry};

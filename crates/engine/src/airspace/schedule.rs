//! Weekly schedules of zones, as feeds write them: days, and times by the clock or by the sun.
//!
//! A schedule is kept as written. Windows are made from it for the days around an instant; beyond
//! those days it counts as closed throughout, so that what looks far ahead errs on the safe side.

use super::sun::{Extent, SunEvent, sun_time};
use super::zone::Window;
use jiff::civil::{Date, Time, Weekday};
use jiff::tz::Offset;
use jiff::{SignedDuration, Timestamp, ToSpan};

/// At most this many daily periods in all schedules of one zone.
pub const MAX_PERIODS: usize = 100;
/// Windows are made from this long before an instant ...
const MADE_BEFORE: SignedDuration = SignedDuration::from_hours(2 * 24);
/// ... until this long after it.
const MADE_AHEAD: SignedDuration = SignedDuration::from_hours(8 * 24);

/// Days of the week.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Days(u8);

impl Days {
    /// Every day.
    pub const EVERY: Self = Self(0b111_1111);

    /// No day.
    pub const NONE: Self = Self(0);

    /// These days.
    pub fn of(days: impl IntoIterator<Item = Weekday>) -> Self {
        let bits = days.into_iter().map(Self::bit);
        Self(bits.fold(0, |all, bit| all | bit))
    }

    fn bit(day: Weekday) -> u8 {
        1 << day.to_monday_zero_offset()
    }

    /// These days and others.
    #[must_use]
    pub fn with(self, others: Self) -> Self {
        Self(self.0 | others.0)
    }

    /// Whether a day is one of them.
    pub fn contains(self, day: Weekday) -> bool {
        self.0 & Self::bit(day) != 0
    }
}

/// A time of a day.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DayTime {
    /// By the clock. The day of the week is that of this offset.
    Clock {
        /// The local time.
        time: Time,
        /// Local time less UTC.
        offset: Offset,
    },
    /// By the sun, at the place of the zone; the day is that of the mean local solar time.
    Sun(SunEvent),
}

/// From when until when on which days; both ends belong to it. What ends no later than it begins
/// ends on the day after, and belongs to the day that it begins on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct DailyPeriod {
    /// The days it begins on.
    pub days: Days,
    /// When it begins.
    pub from: DayTime,
    /// When it ends.
    pub until: DayTime,
}

/// Daily periods, as far as they lie within a window.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Recurrence {
    /// From the first until the last instant that may count.
    pub within: Window,
    /// The zone counts when any of them does.
    pub periods: Vec<DailyPeriod>,
}

impl DailyPeriod {
    /// Whether a time of it depends on the sun.
    pub fn follows_sun(&self) -> bool {
        [self.from, self.until]
            .iter()
            .any(|time| matches!(time, DayTime::Sun(_)))
    }

    /// When it counts if it begins on this day. Where the sun's events differ over the zone's
    /// extent the earliest begins it and the latest ends it.
    fn on(&self, day: Date, extent: &Extent) -> Option<(Timestamp, Timestamp)> {
        if !self.days.contains(day.weekday()) {
            return None;
        }
        let begins = instant(self.from, day, extent, Side::Begins)?;
        let ends = instant(self.until, day, extent, Side::Ends)?;
        if ends > begins {
            return Some((begins, ends));
        }
        let next = day.tomorrow().ok()?;
        Some((begins, instant(self.until, next, extent, Side::Ends)?))
    }
}

impl Recurrence {
    /// Adds the windows around an instant. Before and after the days looked at, the whole rest of
    /// `within` counts.
    pub(super) fn add_windows(&self, around: Timestamp, extent: &Extent, to: &mut Vec<Window>) {
        let first = around.saturating_sub(MADE_BEFORE).unwrap_or(Timestamp::MIN);
        let last = around.saturating_add(MADE_AHEAD).unwrap_or(Timestamp::MAX);
        let from = self.within.from().unwrap_or(Timestamp::MIN);
        let until = self.within.until().unwrap_or(Timestamp::MAX);
        let mut add = |begins: Timestamp, ends: Timestamp| {
            let (begins, ends) = (begins.max(from), ends.min(until));
            if begins <= ends {
                to.push(spanning(begins, ends));
            }
        };
        add(Timestamp::MIN, first);
        add(last, Timestamp::MAX);
        // A period that begins the day before may last into the first one, in any offset.
        let mut day = Offset::UTC.to_datetime(first).date();
        day = day.checked_sub(2.days()).unwrap_or(Date::MIN);
        let end = Offset::UTC.to_datetime(last).date();
        while day <= end {
            for period in &self.periods {
                if let Some((begins, ends)) = period.on(day, extent)
                    && ends >= first
                    && begins <= last
                {
                    add(begins, ends);
                }
            }
            let Ok(next) = day.tomorrow() else {
                return;
            };
            day = next;
        }
    }
}

/// Windows of something that recurs in their order, with those that share an instant made one.
///
/// There always is one: without any it would count at all times, so one that is long over stands for none.
pub(super) fn merged(mut windows: Vec<Window>) -> Vec<Window> {
    if windows.is_empty() {
        windows.push(spanning(Timestamp::MIN, Timestamp::UNIX_EPOCH));
    }
    windows.sort_unstable_by_key(|window| (window.from(), window.until().is_none()));
    let mut merged: Vec<Window> = Vec::with_capacity(windows.len());
    for window in windows {
        match merged.last_mut() {
            Some(last) if shares_instant(last, &window) => *last = union(last, &window),
            _ => merged.push(window),
        }
    }
    merged
}

/// Whether a window that begins no earlier shares an instant with another.
fn shares_instant(earlier: &Window, later: &Window) -> bool {
    match (earlier.until(), later.from()) {
        (Some(until), Some(from)) => from <= until,
        _ => true,
    }
}

fn union(earlier: &Window, later: &Window) -> Window {
    let until = match (earlier.until(), later.until()) {
        (Some(one), Some(other)) => Some(one.max(other)),
        _ => None,
    };
    // It begins as before, and ends no earlier.
    Window::new(earlier.from(), until).unwrap_or(*earlier)
}

/// A window of two instants; the ends of time are no ends.
fn spanning(begins: Timestamp, ends: Timestamp) -> Window {
    let from = (begins > Timestamp::MIN).then_some(begins);
    // A window is no single instant.
    let ends = match begins == ends {
        true => ends
            .saturating_add(SignedDuration::from_nanos(1))
            .unwrap_or(ends),
        false => ends,
    };
    let until = (ends < Timestamp::MAX).then_some(ends);
    Window::new(from, until).unwrap_or(Window::ALWAYS)
}

/// Which end of a period.
#[derive(Clone, Copy, PartialEq)]
enum Side {
    Begins,
    Ends,
}

fn instant(time: DayTime, day: Date, extent: &Extent, side: Side) -> Option<Timestamp> {
    match time {
        DayTime::Clock { time, offset } => offset.to_timestamp(day.to_datetime(time)).ok(),
        DayTime::Sun(event) => {
            let times = extent
                .corners()
                .map(|place| sun_time(event, day, place, side == Side::Begins));
            let times = times.into_iter().flatten();
            match side {
                Side::Begins => times.min(),
                Side::Ends => times.max(),
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(text: &str) -> Timestamp {
        text.parse().expect("an instant")
    }

    fn clock(hour: i8, minute: i8, offset_hours: i8) -> DayTime {
        DayTime::Clock {
            time: Time::constant(hour, minute, 0, 0),
            offset: Offset::constant(offset_hours),
        }
    }

    fn windows(period: DailyPeriod, around: &str, extent: &Extent) -> Vec<Window> {
        let recurrence = Recurrence {
            within: Window::ALWAYS,
            periods: vec![period],
        };
        let mut found = Vec::new();
        recurrence.add_windows(at(around), extent, &mut found);
        merged(found)
    }

    fn counts(windows: &[Window], instant: &str) -> bool {
        let instant = at(instant);
        windows.iter().any(|window| window.meets(instant, instant))
    }

    #[test]
    fn what_ends_before_it_begins_belongs_to_the_day_it_begins_on() {
        let period = DailyPeriod {
            days: Days::of([Weekday::Friday]),
            from: clock(22, 0, 2),
            until: clock(6, 0, 2),
        };
        // 2026-11-27 is a Friday; the offset is two hours east.
        let found = windows(period, "2026-11-25T00:00:00Z", &Extent::default());
        for (instant, is_closed) in [
            ("2026-11-27T19:59:59.999999999Z", false),
            ("2026-11-27T20:00:00Z", true),
            ("2026-11-28T04:00:00Z", true),
            ("2026-11-28T04:00:00.000000001Z", false),
            ("2026-11-28T20:30:00Z", false),
            ("2026-11-27T03:00:00Z", false),
        ] {
            assert_eq!(counts(&found, instant), is_closed, "{instant}");
        }
    }

    #[test]
    fn what_is_farther_away_than_the_days_looked_at_counts_as_closed() {
        let period = DailyPeriod {
            days: Days::of([Weekday::Monday]),
            from: clock(12, 0, 0),
            until: clock(13, 0, 0),
        };
        let found = windows(period, "2026-11-25T00:00:00Z", &Extent::default());
        assert!(!counts(&found, "2026-12-02T00:00:00Z"));
        assert!(counts(&found, "2026-12-30T00:00:00Z"));
        assert!(counts(&found, "2026-01-01T00:00:00Z"));
    }

    #[test]
    fn the_sun_of_sydney_and_of_a_polar_night() {
        let day = |from, until| DailyPeriod {
            days: Days::EVERY,
            from: DayTime::Sun(from),
            until: DayTime::Sun(until),
        };
        let sydney = Extent::about([[151.2, -33.87]]);
        // Geoscience Australia, 25 November 2026: the sun rises at 5:37 and sets at 19:45, at 11
        // hours east.
        let found = windows(
            day(SunEvent::Sunrise, SunEvent::Sunset),
            "2026-11-25T00:00:00Z",
            &sydney,
        );
        for (instant, is_closed) in [
            ("2026-11-24T18:34:00Z", false),
            ("2026-11-24T18:40:00Z", true),
            ("2026-11-25T08:42:00Z", true),
            ("2026-11-25T08:49:00Z", false),
        ] {
            assert_eq!(counts(&found, instant), is_closed, "{instant}");
        }
        // Where the sun never rises the period has no times: the whole day counts.
        let longyearbyen = Extent::about([[15.6, 78.2]]);
        let found = windows(
            day(SunEvent::Sunrise, SunEvent::Sunset),
            "2026-12-20T00:00:00Z",
            &longyearbyen,
        );
        assert!(counts(&found, "2026-12-20T00:30:00Z") && counts(&found, "2026-12-21T12:00:00Z"));
    }
}

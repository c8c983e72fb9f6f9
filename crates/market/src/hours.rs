//! When a service picks up: windows by the wall clock of its time zone.
//!
//! A window belongs to the day on which it begins, also where it goes on after midnight. Where clocks are put forward, a
//! wall-clock time that does not exist is the instant of the change; where they are put back, a window begins at the first
//! and ends at the second of the two instants that show its time.

use jiff::civil::{Date, DateTime, Time, Weekday};
use jiff::tz::{AmbiguousOffset, TimeZone};
use jiff::{SignedDuration, Span, Timestamp};
use skyway_contract::OpeningHours;
use thiserror::Error;

/// The most windows of a service.
pub const WINDOWS_MAX: usize = 28;
/// How far ahead an opening is looked for, in days: all windows come once a week.
const DAYS_AHEAD: i32 = 8;
const DAYS: [(&str, Weekday); 7] = [
    ("MON", Weekday::Monday),
    ("TUE", Weekday::Tuesday),
    ("WED", Weekday::Wednesday),
    ("THU", Weekday::Thursday),
    ("FRI", Weekday::Friday),
    ("SAT", Weekday::Saturday),
    ("SUN", Weekday::Sunday),
];

/// Why hours are none.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum HoursError {
    /// The time zone is not in the IANA database.
    #[error(
        "there is no time zone '{name}'; write a name of the IANA database, such as Australia/Sydney"
    )]
    TimeZone {
        /// What was written.
        name: String,
    },
    /// A day has no such name.
    #[error("window {window} names the day '{day}'; days are MON, TUE, WED, THU, FRI, SAT and SUN")]
    Day {
        /// Which window, counted from 0.
        window: usize,
        /// What was written.
        day: String,
    },
    /// A time is not one of the day.
    #[error(
        "window {window} names the time '{time}'; write HH:MM, from 00:00 to 23:59, or 24:00 as an end"
    )]
    Time {
        /// Which window, counted from 0.
        window: usize,
        /// What was written.
        time: String,
    },
    /// A window ends when it begins.
    #[error("window {window} ends when it begins; the whole day is from 00:00 until 24:00")]
    Empty {
        /// Which window, counted from 0.
        window: usize,
    },
    /// There are too many windows.
    #[error("there are {count} windows; at most {WINDOWS_MAX} are kept")]
    TooMany {
        /// How many.
        count: usize,
    },
}

/// When a service picks up.
#[derive(Clone, Debug, PartialEq)]
pub struct Hours {
    zone: TimeZone,
    /// None: always.
    windows: Vec<Window>,
}

#[derive(Clone, Debug, PartialEq, Eq)]
struct Window {
    /// None: every day.
    days: Vec<Weekday>,
    from: Time,
    until: Until,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Until {
    SameDay(Time),
    NextDay(Time),
}

impl Hours {
    /// Reads the hours of a service.
    ///
    /// # Errors
    /// When the time zone, a day or a time is none, or a window is empty.
    pub fn read(time_zone: &str, hours: &[OpeningHours]) -> Result<Self, HoursError> {
        let zone = TimeZone::get(time_zone).map_err(|_| HoursError::TimeZone {
            name: time_zone.to_owned(),
        })?;
        if hours.len() > WINDOWS_MAX {
            let count = hours.len();
            return Err(HoursError::TooMany { count });
        }
        let windows = hours.iter().enumerate();
        let windows: Result<Vec<Window>, HoursError> = windows
            .map(|(index, stated)| read_window(index, stated))
            .collect();
        Ok(Self {
            zone,
            windows: windows?,
        })
    }

    /// The first instant from `at` on at which the service picks up; `at` itself where it is open then, none at the end
    /// of the calendar.
    pub fn next_opening(&self, at: Timestamp) -> Option<Timestamp> {
        if self.windows.is_empty() {
            return Some(at);
        }
        let openings = self.windows_about(at).filter_map(|(opens, closes)| {
            let opening = opens.max(at);
            (closes > opening).then_some(opening)
        });
        openings.min()
    }

    /// When the service, open at an instant, closes; none where it does not in the week ahead.
    pub fn closing(&self, at: Timestamp) -> Option<Timestamp> {
        let mut windows: Vec<_> = self.windows_about(at).collect();
        windows.sort();
        let mut closing = at;
        // One window may begin before another has ended.
        for (opens, closes) in windows {
            if opens <= closing {
                closing = closing.max(closes);
            }
        }
        let week_ahead = at.saturating_add(SignedDuration::from_hours(24 * 7)).ok()?;
        (!self.windows.is_empty() && closing < week_ahead).then_some(closing)
    }

    /// The windows from the day before, as one of it may go on after midnight, until all have come once.
    fn windows_about(&self, at: Timestamp) -> impl Iterator<Item = (Timestamp, Timestamp)> {
        let today = at.to_zoned(self.zone.clone()).date();
        let days = (-1..=DAYS_AHEAD)
            .filter_map(move |days| today.checked_add(Span::new().days(days)).ok());
        days.flat_map(move |day| {
            let on_day = self.windows.iter().filter(move |window| window.is_on(day));
            on_day.filter_map(move |window| self.instants(window, day))
        })
    }

    fn instants(&self, window: &Window, day: Date) -> Option<(Timestamp, Timestamp)> {
        let opens = self.instant(day.to_datetime(window.from), Twice::First)?;
        let closing = match window.until {
            Until::SameDay(time) => day.to_datetime(time),
            Until::NextDay(time) => day.tomorrow().ok()?.to_datetime(time),
        };
        Some((opens, self.instant(closing, Twice::Second)?))
    }

    fn instant(&self, wall: DateTime, twice: Twice) -> Option<Timestamp> {
        let ambiguous = self.zone.to_ambiguous_timestamp(wall);
        match ambiguous.offset() {
            AmbiguousOffset::Unambiguous { .. } => ambiguous.unambiguous().ok(),
            AmbiguousOffset::Gap { .. } => {
                let before = ambiguous.earlier().ok()?;
                let change = self.zone.following(before).next()?;
                Some(change.timestamp())
            }
            AmbiguousOffset::Fold { .. } => match twice {
                Twice::First => ambiguous.earlier().ok(),
                Twice::Second => ambiguous.later().ok(),
            },
        }
    }
}

/// Which instant is meant where the wall clock shows a time twice.
#[derive(Clone, Copy)]
enum Twice {
    First,
    Second,
}

impl Window {
    fn is_on(&self, day: Date) -> bool {
        self.days.is_empty() || self.days.contains(&day.weekday())
    }
}

fn read_window(index: usize, stated: &OpeningHours) -> Result<Window, HoursError> {
    let days = stated.days.iter().map(|name| {
        let found = DAYS.iter().find(|(known, _)| known == name);
        found.map(|(_, day)| *day).ok_or_else(|| HoursError::Day {
            window: index,
            day: name.clone(),
        })
    });
    let days: Result<Vec<Weekday>, HoursError> = days.collect();
    let days = days?;
    let wrong = |time: &str| HoursError::Time {
        window: index,
        time: time.to_owned(),
    };
    let from = read_time(&stated.from).ok_or_else(|| wrong(&stated.from))?;
    let until = match stated.until.as_str() {
        "24:00" => Until::NextDay(Time::midnight()),
        text => {
            let time = read_time(text).ok_or_else(|| wrong(text))?;
            if time == from {
                return Err(HoursError::Empty { window: index });
            }
            if time > from {
                Until::SameDay(time)
            } else {
                Until::NextDay(time)
            }
        }
    };
    Ok(Window { days, from, until })
}

/// A time written `HH:MM`.
fn read_time(text: &str) -> Option<Time> {
    let (hour, minute) = text.split_once(':')?;
    let two_digits = |part: &str| {
        let is_plain = part.len() == 2 && part.bytes().all(|digit| digit.is_ascii_digit());
        is_plain.then(|| part.parse::<i8>().ok()).flatten()
    };
    Time::new(two_digits(hour)?, two_digits(minute)?, 0, 0).ok()
}

#[cfg(test)]
mod tests;

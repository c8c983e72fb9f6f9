//! When a zone of ED-269 or ED-318 applies.

use super::sheet::{Members, Sheet};
use crate::airspace::{DailyPeriod, DayTime, Days, Recurrence, SunEvent, Window};
use crate::place::Place;
use crate::zones::{DAYS, ZoneCode, clock_time};
use jiff::Timestamp;
use jiff::civil::Time;
use jiff::tz::Offset;
use serde_json::Value;

/// Schedules stand under one of these; the first is that of the standards.
const SCHEDULES: [&str; 2] = ["schedule", "dailyPeriod"];
const MIDNIGHT: DayTime = DayTime::Clock {
    time: Time::MIN,
    offset: Offset::UTC,
};

/// Windows and schedules, of which at least one has to count.
#[derive(Default)]
pub(super) struct Applicability {
    pub(super) windows: Vec<Window>,
    pub(super) schedules: Vec<Recurrence>,
}

impl Applicability {
    /// Reads one period of time: its ends, unless it is permanent, and its schedule.
    pub(super) fn read(&mut self, period: Members<'_>, is_permanent: bool, sheet: &mut Sheet) {
        let [from, until] = ["startDateTime", "endDateTime"].map(|name| {
            let place = period.place.member(name);
            match (period.get(name), is_permanent) {
                (None, _) => Some(None),
                (Some(_), true) => {
                    sheet.note(&place, "not used, as the zone is permanent");
                    Some(None)
                }
                (Some(value), false) => date_time(value, &place, sheet).map(Some),
            }
        });
        let (Some(from), Some(until)) = (from, until) else {
            return;
        };
        let place = period.place.member("endDateTime");
        let Some(within) = window(from, until, &place, sheet) else {
            return;
        };
        let found = period.first(&SCHEDULES);
        let periods = found.and_then(|(name, value)| {
            let place = period.place.member(name);
            if name != SCHEDULES[0] {
                sheet.note(&place, "was read as the schedule");
            }
            read_schedule(value, &place, sheet)
        });
        match periods {
            Some(periods) => self.schedules.push(Recurrence { within, periods }),
            None => self.windows.push(within),
        }
        let is_undated = within == Window::ALWAYS && found.is_none() && !is_permanent;
        if is_undated {
            sheet.note(period.place, "without dates and schedule it counts always");
        }
    }

    /// What counts always needs no windows.
    pub(super) fn simplified(mut self) -> Self {
        if self.windows.contains(&Window::ALWAYS) {
            self = Self::default();
        }
        self
    }
}

/// The daily periods; `None` where every entry is empty, as some feeds write for no schedule.
fn read_schedule(value: &Value, place: &Place<'_>, sheet: &mut Sheet) -> Option<Vec<DailyPeriod>> {
    let mut periods = Vec::new();
    let list = sheet.list(value, place);
    for (index, entry) in list.iter().enumerate() {
        let place = place.element(index);
        let Some(members) = sheet.object(entry, &place) else {
            continue;
        };
        let entry = Members {
            members,
            place: &place,
        };
        if is_empty(entry) {
            sheet.note(&place, "the empty entry of the schedule was left out");
            continue;
        }
        periods.extend(read_period(entry, sheet));
    }
    let is_without = periods.is_empty() && sheet.problems.count() == 0;
    (!is_without).then_some(periods)
}

fn is_empty(entry: Members<'_>) -> bool {
    entry.members.keys().all(|name| {
        let value = entry.get(name);
        value.is_none_or(|value| value.as_array().is_some_and(Vec::is_empty))
    })
}

fn read_period(entry: Members<'_>, sheet: &mut Sheet) -> Option<DailyPeriod> {
    let days = read_days(entry, sheet);
    let from = read_end(entry, ["startTime", "startEvent"], sheet);
    let until = read_end(entry, ["endTime", "endEvent"], sheet);
    match (from?, until?) {
        (None, None) => {
            sheet.note(entry.place, "without times it counts for whole days of UTC");
            Some(DailyPeriod {
                days: days?,
                from: MIDNIGHT,
                until: MIDNIGHT,
            })
        }
        (Some(from), Some(until)) => Some(DailyPeriod {
            days: days?,
            from,
            until,
        }),
        (None, Some(_)) => {
            sheet.missing(entry.place, "startTime");
            None
        }
        (Some(_), None) => {
            sheet.missing(entry.place, "endTime");
            None
        }
    }
}

fn read_days(entry: Members<'_>, sheet: &mut Sheet) -> Option<Days> {
    let place = entry.place.member("day");
    let Some(value) = entry.get("day") else {
        sheet.missing(entry.place, "day");
        return None;
    };
    let mut words: Vec<(String, Days)> = DAYS
        .iter()
        .map(|(name, day)| (name.to_ascii_uppercase(), Days::of([*day])))
        .collect();
    words.push(("ANY".to_owned(), Days::EVERY));
    let words: Vec<(&str, Days)> = words
        .iter()
        .map(|(word, days)| (word.as_str(), *days))
        .collect();
    let mut days = Days::NONE;
    for (index, day) in sheet.list(value, &place).iter().enumerate() {
        days = days.with(sheet.word(day, &place.element(index), &words)?);
    }
    if days == Days::NONE {
        let remedy = "name the days, or ANY";
        sheet.refuse(ZoneCode::ScheduleInvalid, &place, "names no day", remedy);
        return None;
    }
    Some(days)
}

/// The time or the event of the sun at one end; `Some(None)` where there is neither.
fn read_end(
    entry: Members<'_>,
    [time, event]: [&str; 2],
    sheet: &mut Sheet,
) -> Option<Option<DayTime>> {
    let events = SunEvent::ALL.map(|event| (event.code(), event));
    let (name, value) = match entry.first(&[time, event]) {
        None => return Some(None),
        Some(found) => found,
    };
    let place = entry.place.member(name);
    if name == event {
        return Some(Some(DayTime::Sun(sheet.word(value, &place, &events)?)));
    }
    if entry.get(event).is_some() {
        let remedy = "leave one of them";
        let message = format!("has both '{time}' and '{event}'");
        sheet.refuse(ZoneCode::ScheduleInvalid, &place, message, remedy);
        return None;
    }
    let written = sheet.text(value, &place)?;
    let as_told = written.trim();
    if time == "endTime" && as_told.starts_with("24:00") {
        sheet.note(&place, "24:00 was read as the end of the day");
        let midnight = as_told.replacen("24", "00", 1);
        return end_of_day(&midnight, &place, sheet);
    }
    end_of_day(as_told, &place, sheet)
}

fn end_of_day(written: &str, place: &Place<'_>, sheet: &mut Sheet) -> Option<Option<DayTime>> {
    let time = clock_time(written);
    if time.is_none() {
        let message = format!("'{written}' is no time of day with its offset");
        let remedy = "write it as in 06:30Z, or 06:30+02:00";
        sheet.refuse(ZoneCode::TimeInvalid, place, message, remedy);
    }
    time.map(Some)
}

fn date_time(value: &Value, place: &Place<'_>, sheet: &mut Sheet) -> Option<Timestamp> {
    let written = sheet.text(value, place)?;
    instant(&written, place, sheet)
}

/// An instant as it is written, with its offset.
pub(super) fn instant(written: &str, place: &Place<'_>, sheet: &mut Sheet) -> Option<Timestamp> {
    let instant = written.trim().parse::<Timestamp>().ok();
    if instant.is_none() {
        let message = format!("'{written}' is no instant");
        let remedy = "write date, time and offset, as in 2026-11-27T18:00:00Z";
        sheet.refuse(ZoneCode::TimeInvalid, place, message, remedy);
    }
    instant
}

/// The window between two instants; `place` is that of its end.
pub(super) fn window(
    from: Option<Timestamp>,
    until: Option<Timestamp>,
    place: &Place<'_>,
    sheet: &mut Sheet,
) -> Option<Window> {
    let window = Window::new(from, until);
    if let Err(reversed) = &window {
        let remedy = "let it end after it begins";
        let message = reversed.to_string();
        sheet.refuse(ZoneCode::WindowReversed, place, message, remedy);
    }
    window.ok()
}

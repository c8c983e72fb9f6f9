//! When a zone counts: windows, and windows with a schedule.
//!
//! ```json
//! [{"from": "2026-11-27T18:00:00Z", "until": "2026-11-27T23:00:00Z"},
//!  {"schedule": [{"days": ["mon", "tue"], "from": "sunset", "until": "06:00+01:00"}]}]
//! ```

use super::member::{Members, known_only, text, wrong_type};
use super::problem::{Problems, ZoneCode, ZoneProblem};
use crate::airspace::{DailyPeriod, DayTime, Days, Recurrence, SunEvent, Window, Zone};
use crate::place::Place;
use crate::suggestion::nearest;
use jiff::civil::{Time, Weekday};
use jiff::tz::Offset;
use serde_json::{Map, Value, json};

const WINDOW_MEMBERS: [&str; 3] = ["from", "until", "schedule"];
const PERIOD_MEMBERS: [&str; 3] = ["days", "from", "until"];
/// The days of the week, from Monday on.
pub(crate) const DAYS: [(&str, Weekday); 7] = [
    ("mon", Weekday::Monday),
    ("tue", Weekday::Tuesday),
    ("wed", Weekday::Wednesday),
    ("thu", Weekday::Thursday),
    ("fri", Weekday::Friday),
    ("sat", Weekday::Saturday),
    ("sun", Weekday::Sunday),
];
const SECONDS_PER_MINUTE: i32 = 60;

/// The windows of a zone, and its schedules.
#[derive(Default)]
pub(super) struct ReadWindows {
    pub(super) plain: Vec<Window>,
    pub(super) schedules: Vec<Recurrence>,
}

pub(super) fn read_windows(properties: &Members<'_>, problems: &mut Problems) -> ReadWindows {
    let place = properties.place.member("windows");
    let mut found = ReadWindows::default();
    let windows = match properties.optional("windows") {
        None => return found,
        Some(Value::Array(windows)) => windows,
        Some(other) => {
            problems.push(wrong_type(other, "an array", &place));
            return found;
        }
    };
    for (index, window) in windows.iter().enumerate() {
        read_window(window, &place.element(index), &mut found, problems);
        if problems.is_full() {
            break;
        }
    }
    found
}

fn read_window(value: &Value, place: &Place<'_>, found: &mut ReadWindows, problems: &mut Problems) {
    let Value::Object(members) = value else {
        problems.push(wrong_type(value, "an object", place));
        return;
    };
    known_only(members, &WINDOW_MEMBERS, place, problems);
    let members = Members { members, place };
    let from = members.instant("from", problems);
    let until = members.instant("until", problems);
    let (Some(from), Some(until)) = (from, until) else {
        return;
    };
    let within = match Window::new(from, until) {
        Ok(window) => window,
        Err(reversed) => {
            let pointer = place.member("until").pointer();
            let code = ZoneCode::WindowReversed;
            problems.push(ZoneProblem::new(code, pointer, reversed.to_string()));
            return;
        }
    };
    match members.optional("schedule") {
        None => found.plain.push(within),
        Some(schedule) => {
            let place = place.member("schedule");
            let periods = read_schedule(schedule, &place, problems);
            found.schedules.push(Recurrence { within, periods });
        }
    }
}

fn read_schedule(value: &Value, place: &Place<'_>, problems: &mut Problems) -> Vec<DailyPeriod> {
    let Value::Array(periods) = value else {
        problems.push(wrong_type(value, "an array", place));
        return Vec::new();
    };
    let mut found = Vec::with_capacity(periods.len());
    for (index, period) in periods.iter().enumerate() {
        found.extend(read_period(period, &place.element(index), problems));
        if problems.is_full() {
            break;
        }
    }
    found
}

fn read_period(value: &Value, place: &Place<'_>, problems: &mut Problems) -> Option<DailyPeriod> {
    let Value::Object(members) = value else {
        problems.push(wrong_type(value, "an object", place));
        return None;
    };
    known_only(members, &PERIOD_MEMBERS, place, problems);
    let members = Members { members, place };
    let days = read_days(&members, problems);
    let from = read_time(&members, "from", problems);
    let until = read_time(&members, "until", problems);
    Some(DailyPeriod {
        days: days?,
        from: from?,
        until: until?,
    })
}

/// Every day, where none is named.
fn read_days(members: &Members<'_>, problems: &mut Problems) -> Option<Days> {
    let place = members.place.member("days");
    let named = match members.optional("days") {
        None => return Some(Days::EVERY),
        Some(Value::Array(named)) => named,
        Some(other) => {
            problems.push(wrong_type(other, "an array", &place));
            return None;
        }
    };
    let mut days = Vec::with_capacity(named.len());
    for (index, day) in named.iter().enumerate() {
        let place = place.element(index);
        let name = text(day, &place, problems)?;
        let Some((_, day)) = DAYS.iter().find(|(known, _)| *known == name) else {
            let names = DAYS.map(|(name, _)| name);
            problems.push(unknown(name, "day", &names, &place));
            return None;
        };
        days.push(*day);
    }
    Some(Days::of(days))
}

fn read_time(members: &Members<'_>, name: &str, problems: &mut Problems) -> Option<DayTime> {
    let place = members.place.member(name);
    let written = text(members.required(name, problems)?, &place, problems)?;
    let mut events = SunEvent::ALL.into_iter();
    if let Some(event) = events.find(|event| event_name(*event) == written) {
        return Some(DayTime::Sun(event));
    }
    match clock_time(written) {
        Some(time) => Some(time),
        None => {
            let names = SunEvent::ALL.map(event_name).join(", ");
            let message = format!("'{written}' is no time of day");
            let problem = ZoneProblem::new(ZoneCode::TimeInvalid, place.pointer(), message);
            problems.push(problem.hint(format!(
                "write it with its offset, as in 06:30Z or 06:30+02:00, or as one of {names}"
            )));
            None
        }
    }
}

/// The problem for a word that is not one of those allowed.
pub(super) fn unknown(word: &str, what: &str, known: &[&str], place: &Place<'_>) -> ZoneProblem {
    let hint = match nearest(word, known.iter().copied(), 1).first() {
        Some(meant) => format!("did you mean '{meant}'?"),
        None => format!("use one of {}", known.join(", ")),
    };
    let message = format!("nothing is known of the {what} '{word}'");
    ZoneProblem::new(ZoneCode::UnknownValue, place.pointer(), message).hint(hint)
}

fn event_name(event: SunEvent) -> &'static str {
    match event {
        SunEvent::MorningTwilight => "morning_twilight",
        SunEvent::Sunrise => "sunrise",
        SunEvent::Sunset => "sunset",
        SunEvent::EveningTwilight => "evening_twilight",
    }
}

/// A time with its offset, such as 06:30Z, 06:30:15.5+02:00 or 06:30-0330.
pub(crate) fn clock_time(written: &str) -> Option<DayTime> {
    let (local, offset) = match written.strip_suffix(['Z', 'z']) {
        Some(local) => (local, Offset::UTC),
        None => {
            let sign_at = written.rfind(['+', '-'])?;
            let (local, offset) = written.split_at_checked(sign_at)?;
            (local, read_offset(offset)?)
        }
    };
    let is_clock = |byte: u8| byte.is_ascii_digit() || matches!(byte, b':' | b'.');
    if local.len() < 5 || !local.bytes().all(is_clock) {
        return None;
    }
    let time: Time = local.parse().ok()?;
    Some(DayTime::Clock { time, offset })
}

fn read_offset(written: &str) -> Option<Offset> {
    let (sign, digits) = match written.strip_prefix('-') {
        Some(digits) => (-1, digits),
        None => (1, written.strip_prefix('+')?),
    };
    let digits: String = digits.chars().filter(|&letter| letter != ':').collect();
    if !matches!(digits.len(), 2 | 4) || !digits.bytes().all(|byte| byte.is_ascii_digit()) {
        return None;
    }
    let hours: i32 = digits[..2].parse().ok()?;
    let minutes: i32 = digits.get(2..4).map_or(Ok(0), str::parse).ok()?;
    if hours > 23 || minutes > 59 {
        return None;
    }
    let seconds = sign * (hours * SECONDS_PER_MINUTE + minutes) * SECONDS_PER_MINUTE;
    Offset::from_seconds(seconds).ok()
}

/// A time of day as it is written in zones.
pub(crate) fn clock_text(time: Time, offset: Offset) -> String {
    if offset == Offset::UTC {
        return format!("{time}Z");
    }
    let minutes = offset.seconds() / SECONDS_PER_MINUTE;
    let sign = if minutes < 0 { '-' } else { '+' };
    let minutes = minutes.abs();
    let (hours, minutes) = (minutes / SECONDS_PER_MINUTE, minutes % SECONDS_PER_MINUTE);
    format!("{time}{sign}{hours:02}:{minutes:02}")
}

/// The windows and schedules of a zone, as they are read.
pub(super) fn windows_value(zone: &Zone) -> Option<Value> {
    let plain = zone.plain_windows().iter().map(window_members);
    let schedules = zone.terms().schedules.iter().map(|schedule| {
        let mut members = window_members(&schedule.within);
        let periods = schedule.periods.iter().map(period_value).collect();
        members.insert("schedule".to_owned(), Value::Array(periods));
        members
    });
    let windows: Vec<Value> = plain.chain(schedules).map(Value::Object).collect();
    (!windows.is_empty()).then_some(Value::Array(windows))
}

fn window_members(window: &Window) -> Map<String, Value> {
    let ends = [("from", window.from()), ("until", window.until())];
    let stated = ends
        .into_iter()
        .filter_map(|(name, instant)| Some((name.to_owned(), json!(instant?.to_string()))));
    stated.collect()
}

fn period_value(period: &DailyPeriod) -> Value {
    let days = DAYS
        .iter()
        .filter(|(_, day)| period.days.contains(*day))
        .map(|(name, _)| *name);
    let time = |time: DayTime| match time {
        DayTime::Clock { time, offset } => clock_text(time, offset),
        DayTime::Sun(event) => event_name(event).to_owned(),
    };
    json!({
        "days": days.collect::<Vec<&str>>(),
        "from": time(period.from),
        "until": time(period.until),
    })
}

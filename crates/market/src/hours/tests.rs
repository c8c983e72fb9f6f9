//! Windows through nights, weeks and changes of the clocks.

use super::{Hours, HoursError};
use jiff::Timestamp;
use skyway_contract::OpeningHours;

fn window(days: &[&str], from: &str, until: &str) -> OpeningHours {
    OpeningHours {
        days: days.iter().map(|&day| day.to_owned()).collect(),
        from: from.to_owned(),
        until: until.to_owned(),
    }
}

fn hours(time_zone: &str, windows: &[OpeningHours]) -> Hours {
    Hours::read(time_zone, windows).unwrap()
}

fn at(text: &str) -> Timestamp {
    text.parse().unwrap()
}

fn is_open(hours: &Hours, at: Timestamp) -> bool {
    hours.next_opening(at) == Some(at)
}

#[test]
fn without_windows_it_is_always_open() {
    let always = hours("UTC", &[]);
    let now = at("2026-11-25T03:00:00Z");
    assert_eq!(always.next_opening(now), Some(now));
    assert_eq!(always.closing(now), None);
}

#[test]
fn it_closes_where_no_window_follows() {
    let now = at("2026-11-25T10:00:00Z");
    let lunch = [
        window(&[], "08:00", "12:00"),
        window(&[], "12:00", "14:00"),
        window(&[], "15:00", "18:00"),
    ];
    let closing = hours("UTC", &lunch).closing(now);
    assert_eq!(closing, Some(at("2026-11-25T14:00:00Z")));
    let night = hours("UTC", &[window(&["TUE"], "22:00", "11:00")]);
    assert_eq!(night.closing(now), Some(at("2026-11-25T11:00:00Z")));
    let never = hours("UTC", &[window(&[], "00:00", "24:00")]);
    assert_eq!(never.closing(now), None);
}

#[test]
fn the_end_is_not_open_any_more() {
    let office = hours("Australia/Sydney", &[window(&[], "08:00", "18:00")]);
    // Sydney is 11 h ahead of UTC in November.
    assert!(!is_open(&office, at("2026-11-24T20:59:59Z")));
    assert!(is_open(&office, at("2026-11-24T21:00:00Z")));
    assert!(is_open(&office, at("2026-11-25T06:59:59Z")));
    assert!(!is_open(&office, at("2026-11-25T07:00:00Z")));
    let next = office.next_opening(at("2026-11-25T07:00:00Z"));
    assert_eq!(next, Some(at("2026-11-25T21:00:00Z")));
}

#[test]
fn a_night_belongs_to_the_day_on_which_it_begins() {
    // 2026-11-27 is a Friday.
    let nights = hours("UTC", &[window(&["FRI"], "22:00", "02:00")]);
    assert!(is_open(&nights, at("2026-11-27T23:00:00Z")));
    assert!(is_open(&nights, at("2026-11-28T01:59:59Z")));
    assert!(!is_open(&nights, at("2026-11-28T02:00:00Z")));
    assert!(!is_open(&nights, at("2026-11-27T01:00:00Z")));
    assert!(!is_open(&nights, at("2026-11-28T23:00:00Z")));
    let next = nights.next_opening(at("2026-11-28T02:00:00Z"));
    assert_eq!(next, Some(at("2026-12-04T22:00:00Z")));
}

#[test]
fn whole_days_follow_each_other_without_a_gap() {
    let weekend = hours("UTC", &[window(&["SAT", "SUN"], "00:00", "24:00")]);
    assert!(is_open(&weekend, at("2026-11-28T23:59:59.999Z")));
    assert!(is_open(&weekend, at("2026-11-29T00:00:00Z")));
    assert!(!is_open(&weekend, at("2026-11-30T00:00:00Z")));
}

#[test]
fn a_time_that_is_skipped_is_that_of_the_change() {
    // On 2026-03-29 clocks in Berlin go from 02:00 to 03:00, which is 01:00 UTC.
    let early = hours("Europe/Berlin", &[window(&[], "02:30", "04:00")]);
    let opening = early.next_opening(at("2026-03-29T00:30:00Z"));
    assert_eq!(opening, Some(at("2026-03-29T01:00:00Z")));
    assert!(!is_open(&early, at("2026-03-29T02:00:00Z")));
    let late = hours("Europe/Berlin", &[window(&[], "01:00", "02:30")]);
    assert!(is_open(&late, at("2026-03-29T00:59:59Z")));
    assert!(!is_open(&late, at("2026-03-29T01:00:00Z")));
}

#[test]
fn a_time_that_comes_twice_opens_at_the_first_and_closes_at_the_second() {
    // On 2026-10-25 clocks in Berlin go from 03:00 back to 02:00, which is 01:00 UTC.
    let night = hours("Europe/Berlin", &[window(&[], "02:30", "02:45")]);
    assert!(!is_open(&night, at("2026-10-25T00:29:59Z")));
    assert!(is_open(&night, at("2026-10-25T00:30:00Z")));
    assert!(is_open(&night, at("2026-10-25T01:44:59Z")));
    assert!(!is_open(&night, at("2026-10-25T01:45:00Z")));
}

#[test]
fn of_several_windows_the_first_counts() {
    let both = hours(
        "UTC",
        &[
            window(&["MON"], "09:00", "12:00"),
            window(&["MON"], "08:00", "10:00"),
        ],
    );
    // 2026-11-30 is a Monday.
    let next = both.next_opening(at("2026-11-28T00:00:00Z"));
    assert_eq!(next, Some(at("2026-11-30T08:00:00Z")));
    assert!(is_open(&both, at("2026-11-30T11:00:00Z")));
}

#[test]
fn what_is_no_hours_is_refused() {
    let refused = |zone: &str, stated: OpeningHours| Hours::read(zone, &[stated]).unwrap_err();
    let fine = window(&[], "08:00", "09:00");
    assert!(matches!(
        refused("Mars/Olympus", fine),
        HoursError::TimeZone { .. }
    ));
    let unknown_day = window(&["Monday"], "08:00", "09:00");
    assert!(matches!(
        refused("UTC", unknown_day),
        HoursError::Day { .. }
    ));
    for time in ["8:00", "24:00", "08:60", "08-00", "+8:00", "", "08:00:00"] {
        let wrong = window(&[], time, "09:00");
        assert!(
            matches!(refused("UTC", wrong), HoursError::Time { .. }),
            "{time}"
        );
    }
    let empty = window(&[], "08:00", "08:00");
    assert_eq!(refused("UTC", empty), HoursError::Empty { window: 0 });
}

#[test]
fn the_ends_of_the_calendar_break_nothing() {
    let office = hours("Pacific/Apia", &[window(&[], "22:00", "02:00")]);
    for end in [Timestamp::MIN, Timestamp::MAX] {
        let _ = office.next_opening(end);
    }
}

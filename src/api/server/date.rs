//! The `date` header of answers: the wall clock of the machine, also after it was set back.
//!
//! The server library writes one too, which is made anew only once the clock is past the last one: it stands still for as
//! long as the clock was set back. A header that is there already it leaves alone.

use http::HeaderValue;
use jiff::Timestamp;
use jiff::fmt::rfc2822::DateTimePrinter;
use std::cell::RefCell;

thread_local! {
    /// The second of the last header of this thread, and the header.
    static LAST: RefCell<(i64, HeaderValue)> =
        const { RefCell::new((i64::MIN, HeaderValue::from_static(""))) };
}

/// An instant as the header tells it; none before the year 0.
pub(super) fn date(now: Timestamp) -> Option<HeaderValue> {
    let second = now.as_second();
    LAST.with_borrow_mut(|last| {
        if last.0 != second {
            let text = DateTimePrinter::new().timestamp_to_rfc9110_string(&now);
            let header = HeaderValue::try_from(text.ok()?).ok()?;
            *last = (second, header);
        }
        Some(last.1.clone())
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_follows_a_clock_that_is_set_back() {
        for (now, told) in [
            ("2026-11-22T09:00:00.9Z", "Sun, 22 Nov 2026 09:00:00 GMT"),
            ("2026-11-22T09:00:01Z", "Sun, 22 Nov 2026 09:00:01 GMT"),
            ("2026-11-22T08:00:01Z", "Sun, 22 Nov 2026 08:00:01 GMT"),
            ("2026-11-22T08:00:01.5Z", "Sun, 22 Nov 2026 08:00:01 GMT"),
        ] {
            let now = now.parse().expect("an instant");
            assert_eq!(date(now).expect("a header"), told);
        }
    }
}

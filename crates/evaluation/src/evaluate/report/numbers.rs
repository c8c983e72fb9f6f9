//! Numbers as readers expect them: three digits, groups of thousands, signs of their units.

use crate::evaluate::record::Unit;
use crate::evaluate::text::number;

/// Between groups of digits, and between a number and its unit: narrow, and no line breaks there.
const NARROW_SPACE: char = '\u{202f}';
const MINUS: char = '\u{2212}';
/// No number of the paper is printed with more letters than this.
const MOST_PRINTED: usize = 6;

/// A value in the unit of its claim, such as `9.81 %` or `2.13×`.
pub(super) fn value(value: f64, unit: Unit) -> String {
    format!("{}{}", plain(value), sign_of(unit))
}

/// A number of the paper, with the digits it is printed with; a quotient of two such numbers has too many of its own.
pub(super) fn printed(value: f64, unit: Unit) -> String {
    let digits = value.to_string();
    let text = match digits.len() <= MOST_PRINTED {
        true => signed(&digits),
        false => plain(value),
    };
    format!("{text}{}", sign_of(unit))
}

/// An interval, in the unit of its value: `[9.1, 10.4]`.
pub(super) fn interval(low: f64, high: f64) -> String {
    format!("[{}, {}]", plain(low), plain(high))
}

/// A number with three significant digits, or as many as it has before the point.
pub(super) fn plain(value: f64) -> String {
    signed(&number(value))
}

/// A count, thousands apart.
pub(super) fn count(count: usize) -> String {
    signed(&count.to_string())
}

/// A number on an axis, without digits that say nothing.
pub(super) fn tick(value: f64) -> String {
    // Steps added up leave a rest behind the digits that were meant.
    let digits = format!("{value:.9}");
    signed(digits.trim_end_matches('0').trim_end_matches('.'))
}

fn sign_of(unit: Unit) -> String {
    match unit {
        Unit::Percent => format!("{NARROW_SPACE}%"),
        Unit::Times => "×".to_owned(),
        Unit::Count => String::new(),
    }
}

/// Digits with a true minus, and thousands apart from five digits on.
fn signed(digits: &str) -> String {
    let (minus, digits) = match digits.strip_prefix('-') {
        Some(rest) => (true, rest),
        None => (false, digits),
    };
    let whole = digits.find('.').unwrap_or(digits.len());
    let mut text = String::with_capacity(digits.len() + 4);
    if minus && digits.contains(|digit: char| ('1'..='9').contains(&digit)) {
        text.push(MINUS);
    }
    for (place, digit) in digits.chars().enumerate() {
        let is_border = place > 0 && place < whole && (whole - place).is_multiple_of(3);
        if whole >= 5 && is_border {
            text.push(NARROW_SPACE);
        }
        text.push(digit);
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_read_well() {
        assert_eq!(value(9.8123, Unit::Percent), "9.81\u{202f}%");
        assert_eq!(value(-0.5, Unit::Times), "\u{2212}0.500×");
        assert_eq!(value(-0.0, Unit::Percent), "0\u{202f}%");
        assert_eq!(printed(79.0, Unit::Percent), "79\u{202f}%");
        assert_eq!(printed(6.5, Unit::Percent), "6.5\u{202f}%");
        assert_eq!(printed(100.0 * 53.0 / 69.0, Unit::Percent), "76.8\u{202f}%");
        assert_eq!(interval(-1.0, 12.345), "[\u{2212}1.00, 12.3]");
        assert_eq!(
            [1_000, 12_345, 1_234_567].map(count),
            ["1000", "12\u{202f}345", "1\u{202f}234\u{202f}567"]
        );
        let ticks = [0.1 + 0.2, -2.5, 10_000.0, 0.0, -1e-12].map(tick);
        assert_eq!(ticks, ["0.3", "\u{2212}2.5", "10\u{202f}000", "0", "0"]);
    }
}

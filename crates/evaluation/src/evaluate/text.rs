//! Numbers in the sentences of a run.

/// A number with three significant digits, or as many as it has before the point.
pub(super) fn number(value: f64) -> String {
    let magnitude = value.abs();
    let decimals = match magnitude {
        _ if magnitude < 1e-9 => 0,
        _ if magnitude >= 100.0 => 0,
        _ if magnitude >= 10.0 => 1,
        _ if magnitude >= 1.0 => 2,
        _ if magnitude >= 0.1 => 3,
        _ => 4,
    };
    let text = format!("{value:.decimals$}");
    match text.trim_start_matches(['-', '0', '.']).is_empty() {
        true => "0".to_owned(),
        false => text,
    }
}

/// A time, from microseconds.
pub(super) fn time(microseconds: f64) -> String {
    match microseconds {
        ..1.0 => format!("{:.0} ns", microseconds * 1e3),
        ..1e3 => format!("{} µs", number(microseconds)),
        _ => format!("{} ms", number(microseconds / 1e3)),
    }
}

/// A count and the word for what is counted, with its plural.
pub(super) fn counted(count: usize, one: &str, many: &str) -> String {
    match count {
        1 => format!("1 {one}"),
        _ => format!("{count} {many}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_three_digits() {
        let texts = [0.0, 1e-12, -1e-12, 1.2345, -12.345, 123.4, 0.01234, 1e4].map(number);
        let expected = ["0", "0", "0", "1.23", "-12.3", "123", "0.0123", "10000"];
        assert_eq!(texts, expected);
        assert_eq!(time(0.25), "250 ns");
        assert_eq!(time(1234.0), "1.23 ms");
    }
}

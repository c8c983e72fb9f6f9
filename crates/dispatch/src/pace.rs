//! How long is waited between two questions about an order.

/// The first wait, in milliseconds; it doubles with each failure.
const FIRST_MS: i64 = 500;
/// The longest wait, in milliseconds.
const LONGEST_MS: i64 = 15_000;

/// The wait after a number of failures in a row, in milliseconds.
pub(super) fn pause_ms(failures: u32) -> i64 {
    let doublings = failures.saturating_sub(1).min(16);
    (FIRST_MS << doublings).min(LONGEST_MS)
}

#[cfg(test)]
mod tests {
    use super::pause_ms;

    #[test]
    fn waits_double_up_to_a_bound() {
        let waits: Vec<i64> = (0..8).map(pause_ms).collect();
        assert_eq!(
            waits,
            [500, 500, 1_000, 2_000, 4_000, 8_000, 15_000, 15_000]
        );
        assert_eq!(pause_ms(u32::MAX), 15_000);
    }
}

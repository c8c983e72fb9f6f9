//! What a median of few values says of the median that they are drawn from. The load test is compiled with this file, too.

/// The ranks, from 0, between which the median of what was drawn from lies in 95 of 100 cases, by the normal
/// approximation of the binomial distribution; the least and the greatest where there are too few.
pub(crate) fn of_median(count: usize) -> (usize, usize) {
    let half_width = 0.98 * (count as f64).sqrt();
    let middle = (count as f64 - 1.0) / 2.0;
    let low = (middle - half_width).floor().max(0.0) as usize;
    (low, count.saturating_sub(1 + low))
}

//! From values to places: the range of an axis and where its ticks stand.

use crate::evaluate::record::Scale;

/// What a range is widened by on either side, as a share of it.
const MARGIN: f64 = 0.04;
/// The digits at which ticks of a logarithmic axis may stand, from few to many.
const LOG_DIGITS: [&[f64]; 4] = [
    &[1.0],
    &[1.0, 3.0],
    &[1.0, 2.0, 5.0],
    &[1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 7.0],
];
/// A logarithmic axis with fewer ticks than this gets more digits.
const MIN_TICKS: usize = 4;

/// The values an axis reaches over.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Range {
    low: f64,
    high: f64,
    is_log: bool,
}

impl Range {
    /// The range of values that were measured, with a margin; a linear one of positive values that
    /// reaches far down begins at 0, as lengths are compared from there.
    pub(super) fn around(values: impl IntoIterator<Item = f64>, scale: &Scale) -> Self {
        let is_log = *scale == Scale::Log;
        let usable = |value: &f64| value.is_finite() && (!is_log || *value > 0.0);
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        for value in values.into_iter().filter(usable) {
            (low, high) = (low.min(value), high.max(value));
        }
        if low > high {
            (low, high) = (1.0, 1.0);
        }
        if is_log {
            let margin = (high / low).powf(MARGIN).max(1.05);
            return Self {
                low: low / margin,
                high: high * margin,
                is_log,
            };
        }
        let begins_at_0 = low >= 0.0 && low < high * 0.5;
        let width = match high > low {
            true => high - low,
            false => high.abs().max(1.0),
        };
        Self {
            // Marks at 0 itself keep off the border, as all others do.
            low: match begins_at_0 && low > 0.0 {
                true => 0.0,
                false => low - width * MARGIN,
            },
            high: high + width * MARGIN,
            is_log,
        }
    }

    /// How far along the axis a value is, in `0..=1`; what lies outside goes to the nearer end.
    pub(super) fn share(&self, value: f64) -> f64 {
        let share = match self.is_log {
            true if value <= 0.0 => 0.0,
            true => (value / self.low).ln() / (self.high / self.low).ln(),
            false => (value - self.low) / (self.high - self.low),
        };
        share.clamp(0.0, 1.0)
    }

    /// Round values within the range, by growing value, at most about `most` of them.
    pub(super) fn ticks(&self, most: usize) -> Vec<f64> {
        if !self.is_log {
            return self.linear_ticks(most);
        }
        let enough = MIN_TICKS.min(most)..=most;
        let mut sets = LOG_DIGITS.iter().map(|digits| self.log_ticks(digits));
        match sets.find(|ticks| enough.contains(&ticks.len())) {
            Some(ticks) => ticks,
            None if self.high / self.low < 20.0 => self.linear_ticks(most.min(6)),
            None => self.sparse_decades(most),
        }
    }

    fn linear_ticks(&self, most: usize) -> Vec<f64> {
        let step = round_step((self.high - self.low) / most.max(2) as f64);
        let (first, last) = ((self.low / step).ceil(), (self.high / step).floor());
        let count = (last - first) as usize + 1;
        (0..count)
            .map(|index| (first + index as f64) * step)
            .collect()
    }

    fn log_ticks(&self, digits: &[f64]) -> Vec<f64> {
        let (first, last) = (
            self.low.log10().floor() as i32,
            self.high.log10().ceil() as i32,
        );
        (first..=last)
            .flat_map(|decade| digits.iter().map(move |digit| digit * 10f64.powi(decade)))
            .filter(|tick| (self.low..=self.high).contains(tick))
            .collect()
    }

    /// Every second, third, ... power of ten, as many as there is room for.
    fn sparse_decades(&self, most: usize) -> Vec<f64> {
        let decades = self.log_ticks(&[1.0]);
        let every = decades.len().div_ceil(most.max(1)).max(1);
        decades.into_iter().step_by(every).collect()
    }
}

/// The next round number from a step on: 1, 2, 2.5, 5 or 10 times a power of ten.
fn round_step(step: f64) -> f64 {
    let decade = 10f64.powf(step.log10().floor());
    let digits = [1.0, 2.0, 2.5, 5.0];
    let reached = digits.into_iter().find(|digit| digit * decade >= step);
    reached.unwrap_or(10.0) * decade
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ticks(values: &[f64], scale: &Scale, most: usize) -> Vec<f64> {
        Range::around(values.iter().copied(), scale).ticks(most)
    }

    #[test]
    fn ticks_are_round() {
        assert_eq!(
            ticks(&[3.0, 97.0], &Scale::Linear, 6),
            [0.0, 20.0, 40.0, 60.0, 80.0, 100.0]
        );
        assert_eq!(
            ticks(&[0.5, 2000.0], &Scale::Log, 8),
            [1.0, 10.0, 100.0, 1000.0]
        );
        assert_eq!(
            ticks(&[0.9, 5.0], &Scale::Log, 8),
            [1.0, 1.5, 2.0, 3.0, 4.0, 5.0]
        );
        assert_eq!(
            ticks(&[-3.0, 11.0], &Scale::Linear, 8),
            [-2.0, 0.0, 2.0, 4.0, 6.0, 8.0, 10.0]
        );
    }

    #[test]
    fn every_range_has_ticks_and_room() {
        let ranges: [&[f64]; 6] = [
            &[],
            &[0.0],
            &[7.0],
            &[1e-9, 1e12],
            &[1.0, 1.0001],
            &[-5.0, -5.0],
        ];
        for values in ranges {
            for scale in [Scale::Linear, Scale::Log] {
                let range = Range::around(values.iter().copied(), &scale);
                for most in [2, 5, 9] {
                    let ticks = range.ticks(most);
                    assert!(
                        (1..=most + 1).contains(&ticks.len()),
                        "{values:?} {scale:?} {most}: {ticks:?}"
                    );
                }
                for &value in values {
                    assert!((0.0..=1.0).contains(&range.share(value)));
                }
            }
        }
    }
}

//! Averages with their bootstrap intervals.
//!
//! An interval is the percentile interval of the plain bootstrap (Efron 1979): cases are drawn again, with
//! replacement, as many as there are, and the average of each such sample is taken; 2.5 % of those averages lie below
//! the interval and 2.5 % above.

use super::random::Random;

/// What an interval leaves out on either side.
const TAIL: f64 = 0.025;
/// A sample of few cases is drawn again this often.
const MAX_RESAMPLES: usize = 1_000;
/// A sample of many cases at least this often.
const MIN_RESAMPLES: usize = 200;
/// Cases drawn in all for one interval, between those bounds.
const CASES_DRAWN: usize = 2_000_000;

/// An average with its 95 % interval.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimate {
    /// The average.
    pub value: f64,
    /// The lower end of its interval.
    pub low: f64,
    /// The upper end of its interval.
    pub high: f64,
    /// How many cases it is taken over.
    pub cases: usize,
}

impl Estimate {
    /// The estimate of a rising or falling function of this one.
    pub(super) fn map(self, change: impl Fn(f64) -> f64) -> Self {
        let (one, other) = (change(self.low), change(self.high));
        Self {
            value: change(self.value),
            low: one.min(other),
            high: one.max(other),
            cases: self.cases,
        }
    }
}

/// How the figures of many cases become one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Average {
    /// The mean of the one over the mean of the other: long cases weigh most.
    RatioOfMeans,
    /// The mean of the cases' ratios: every case weighs the same.
    MeanOfRatios,
    /// The median of the cases' ratios: outliers weigh nothing.
    MedianOfRatios,
}

impl Average {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::RatioOfMeans, Self::MeanOfRatios, Self::MedianOfRatios];

    /// The name for people.
    pub fn name(self) -> &'static str {
        match self {
            Self::RatioOfMeans => "ratio of means",
            Self::MeanOfRatios => "mean of ratios",
            Self::MedianOfRatios => "median of ratios",
        }
    }
}

/// Draws samples again for bootstrap intervals; the same seed and purpose give the same intervals.
pub struct Resampler(Random);

impl Resampler {
    /// The stream of a seed for what is to be estimated.
    pub fn new(seed: u64, purpose: &str) -> Self {
        Self(Random::new(seed, &format!("bootstrap of {purpose}")))
    }

    /// The average of paired figures, one over the other; `None` without cases or where it is not finite.
    pub fn of_pairs(&mut self, pairs: &[(f64, f64)], average: Average) -> Option<Estimate> {
        let statistic = |drawn: &mut [usize]| average_of_pairs(pairs, drawn, average);
        self.estimate(pairs.len(), statistic)
    }

    /// The median of single figures; `None` without cases.
    pub fn of_median(&mut self, figures: &[f64]) -> Option<Estimate> {
        self.estimate(figures.len(), |drawn| {
            let mut values: Vec<f64> = drawn.iter().map(|&case| figures[case]).collect();
            middle(&mut values)
        })
    }

    /// The mean of single figures; `None` without cases.
    pub fn of_mean(&mut self, figures: &[f64]) -> Option<Estimate> {
        self.estimate(figures.len(), |drawn| {
            drawn.iter().map(|&case| figures[case]).sum::<f64>() / drawn.len() as f64
        })
    }

    /// The mean of one group over the mean of another, whose cases are not paired.
    pub fn of_groups(&mut self, one: &[f64], other: &[f64]) -> Option<Estimate> {
        if one.is_empty() || other.is_empty() {
            return None;
        }
        // Both groups are drawn again on their own: the cases of the second follow those of the first.
        let mean = |figures: &[f64], drawn: &[usize]| {
            drawn.iter().map(|&case| figures[case]).sum::<f64>() / drawn.len() as f64
        };
        let everything = |figures: &[f64]| (0..figures.len()).collect::<Vec<usize>>();
        let value = mean(one, &everything(one)) / mean(other, &everything(other));
        let mut again: Vec<f64> = Vec::new();
        for _ in 0..resamples(one.len() + other.len()) {
            let [first, second] = [one, other].map(|figures| {
                let count = figures.len();
                (0..count).map(|_| self.0.below(count)).collect::<Vec<_>>()
            });
            again.push(mean(one, &first) / mean(other, &second));
        }
        interval(value, again, one.len() + other.len())
    }

    /// The interval of a statistic of the cases whose numbers it is handed; it may reorder them.
    pub fn estimate(
        &mut self,
        cases: usize,
        mut statistic: impl FnMut(&mut [usize]) -> f64,
    ) -> Option<Estimate> {
        if cases == 0 {
            return None;
        }
        let mut drawn: Vec<usize> = (0..cases).collect();
        let value = statistic(&mut drawn);
        let mut again = Vec::with_capacity(MAX_RESAMPLES);
        for _ in 0..resamples(cases) {
            for place in &mut drawn {
                *place = self.0.below(cases);
            }
            again.push(statistic(&mut drawn));
        }
        interval(value, again, cases)
    }
}

fn resamples(cases: usize) -> usize {
    (CASES_DRAWN / cases).clamp(MIN_RESAMPLES, MAX_RESAMPLES)
}

fn interval(value: f64, mut again: Vec<f64>, cases: usize) -> Option<Estimate> {
    again.retain(|value| value.is_finite());
    if !value.is_finite() || again.is_empty() {
        return None;
    }
    Some(Estimate {
        value,
        low: quantile(&mut again, TAIL),
        high: quantile(&mut again, 1.0 - TAIL),
        cases,
    })
}

fn average_of_pairs(pairs: &[(f64, f64)], drawn: &[usize], average: Average) -> f64 {
    let ratio = |&case: &usize| pairs[case].0 / pairs[case].1;
    match average {
        Average::RatioOfMeans => {
            let sums = drawn.iter().fold((0.0, 0.0), |(one, other), &case| {
                (one + pairs[case].0, other + pairs[case].1)
            });
            sums.0 / sums.1
        }
        Average::MeanOfRatios => drawn.iter().map(ratio).sum::<f64>() / drawn.len() as f64,
        Average::MedianOfRatios => middle(&mut drawn.iter().map(ratio).collect::<Vec<f64>>()),
    }
}

/// The median; the mean of the two in the middle where their number is even. Reorders the figures.
pub fn median(figures: &mut [f64]) -> f64 {
    quantile(figures, 0.5)
}

/// The quantile at a share, between neighbours by proportion (type 7 of Hyndman and Fan 1996). Reorders the
/// figures, of which there is at least one.
pub fn quantile(figures: &mut [f64], share: f64) -> f64 {
    figures.sort_unstable_by(f64::total_cmp);
    let place = share * (figures.len() - 1) as f64;
    let (below, above) = (place.floor() as usize, place.ceil() as usize);
    let (lower, upper) = (figures[below], figures[above]);
    match lower == upper {
        true => lower,
        false => lower + (upper - lower) * (place - place.floor()),
    }
}

/// The median without sorting everything: for intervals it is taken many times over. There is at least one
/// figure.
pub(super) fn middle(figures: &mut [f64]) -> f64 {
    let half = figures.len() / 2;
    let is_even = figures.len().is_multiple_of(2);
    let (below, &mut upper, _) = figures.select_nth_unstable_by(half, f64::total_cmp);
    match is_even {
        false => upper,
        true => {
            let lower = below.iter().copied().fold(f64::NEG_INFINITY, f64::max);
            f64::midpoint(lower, upper)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn medians_and_quantiles_of_few_figures_are_those_of_the_textbook() {
        assert_eq!(median(&mut [3.0]), 3.0);
        assert_eq!(median(&mut [4.0, 1.0]), 2.5);
        assert_eq!(median(&mut [9.0, 1.0, 5.0]), 5.0);
        assert_eq!(quantile(&mut [4.0, 1.0, 3.0, 2.0], 0.25), 1.75);
        assert_eq!(quantile(&mut [1.0, 2.0], 1.0), 2.0);
        for count in 1..40 {
            let mut random = Random::new(count, "figures");
            let mut figures: Vec<f64> = (0..count).map(|_| random.share()).collect();
            let fast = middle(&mut figures);
            assert!((fast - median(&mut figures)).abs() < 1e-15, "{count}");
        }
    }

    #[test]
    fn averages_of_pairs_weigh_cases_as_they_say() {
        let pairs = [(1.0, 2.0), (30.0, 10.0), (2.0, 2.0)];
        let drawn = [0, 1, 2];
        let of = |average| average_of_pairs(&pairs, &drawn, average);
        assert_eq!(of(Average::RatioOfMeans), 33.0 / 14.0);
        assert_eq!(of(Average::MeanOfRatios), 1.5);
        assert_eq!(of(Average::MedianOfRatios), 1.0);
    }

    #[test]
    fn an_interval_holds_the_truth_about_as_often_as_it_says() {
        let (mut held, samples) = (0, 300);
        for sample in 0..samples {
            let mut random = Random::new(sample, "sample");
            let figures: Vec<f64> = (0..60).map(|_| random.share()).collect();
            let estimate = Resampler::new(sample, "mean").of_mean(&figures);
            let estimate = estimate.expect("there are cases");
            assert!(estimate.low <= estimate.value && estimate.value <= estimate.high);
            held += usize::from((estimate.low..=estimate.high).contains(&0.5));
        }
        assert!((270..=298).contains(&held), "{held} of {samples}");
    }

    #[test]
    fn a_seed_gives_the_same_interval_and_another_purpose_another() {
        let figures: Vec<f64> = (0..50).map(f64::from).collect();
        let of = |purpose| Resampler::new(7, purpose).of_median(&figures);
        assert_eq!(of("a"), of("a"));
        assert_ne!(of("a"), of("b"));
        assert_eq!(Resampler::new(7, "a").of_median(&[]), None);
    }
}

//! Averages with their bootstrap intervals.
//!
//! An interval is the percentile interval of the cluster bootstrap: networks are drawn again with all their cases, with
//! replacement, as many as there are, and the average of each such sample is taken; 2.5 % of those averages lie below
//! the interval and 2.5 % above. Of one network the cases themselves are drawn again (Efron 1979).

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

    /// The average of some pairs, of which there is at least one.
    pub(super) fn of(self, pairs: &[(f64, f64)]) -> f64 {
        let ratios = || {
            pairs
                .iter()
                .map(|(one, other)| one / other)
                .collect::<Vec<f64>>()
        };
        match self {
            Self::RatioOfMeans => {
                let sums = pairs
                    .iter()
                    .fold((0.0, 0.0), |sums, pair| (sums.0 + pair.0, sums.1 + pair.1));
                sums.0 / sums.1
            }
            Self::MeanOfRatios => mean(&ratios()),
            Self::MedianOfRatios => middle(&mut ratios()),
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

    /// The average of paired figures by network, one over the other; `None` without cases or where it is not
    /// finite.
    pub fn of_pairs(&mut self, pairs: &[Vec<(f64, f64)>], average: Average) -> Option<Estimate> {
        self.estimate(pairs, |drawn| average.of(drawn))
    }

    /// The mean of single figures by network; `None` without cases.
    pub fn of_mean(&mut self, figures: &[Vec<f64>]) -> Option<Estimate> {
        self.estimate(figures, mean)
    }

    /// The median of single figures by network; `None` without cases.
    pub fn of_median(&mut self, figures: &[Vec<f64>]) -> Option<Estimate> {
        self.estimate(figures, |drawn| middle(&mut drawn.to_vec()))
    }

    /// The interval of a statistic of cases, which are handed in by network.
    pub fn estimate<T: Copy>(
        &mut self,
        networks: &[Vec<T>],
        statistic: impl Fn(&[T]) -> f64,
    ) -> Option<Estimate> {
        let networks: Vec<&[T]> = networks
            .iter()
            .map(Vec::as_slice)
            .filter(|cases| !cases.is_empty())
            .collect();
        let cases = networks.concat();
        if cases.is_empty() {
            return None;
        }
        let value = statistic(&cases);
        let mut drawn = Vec::with_capacity(2 * cases.len());
        let again = (0..resamples(cases.len())).map(|_| {
            drawn.clear();
            match networks[..] {
                [only] => drawn.extend(only.iter().map(|_| only[self.0.below(only.len())])),
                _ => {
                    for _ in &networks {
                        drawn.extend_from_slice(networks[self.0.below(networks.len())]);
                    }
                }
            }
            statistic(&drawn)
        });
        interval(value, again.collect(), cases.len())
    }
}

/// The mean of figures, of which there is at least one.
pub(super) fn mean(figures: &[f64]) -> f64 {
    figures.iter().sum::<f64>() / figures.len() as f64
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
        assert_eq!(Average::RatioOfMeans.of(&pairs), 33.0 / 14.0);
        assert_eq!(Average::MeanOfRatios.of(&pairs), 1.5);
        assert_eq!(Average::MedianOfRatios.of(&pairs), 1.0);
    }

    #[test]
    fn an_interval_holds_the_truth_about_as_often_as_it_says() {
        let samples = 300;
        // Of one network its cases vary; of many, whole networks, whose cases are alike.
        for (networks, cases) in [(1, 60), (60, 3)] {
            let mut held = 0;
            for sample in 0..samples {
                let mut random = Random::new(sample, "sample");
                let network = |random: &mut Random| match networks {
                    1 => (0..cases).map(|_| random.share()).collect(),
                    _ => vec![random.share(); cases],
                };
                let figures: Vec<Vec<f64>> = (0..networks).map(|_| network(&mut random)).collect();
                let estimate = Resampler::new(sample, "mean").of_mean(&figures);
                let estimate = estimate.expect("there are cases");
                assert!(estimate.low <= estimate.value && estimate.value <= estimate.high);
                held += usize::from((estimate.low..=estimate.high).contains(&0.5));
            }
            assert!(
                (270..=298).contains(&held),
                "{held} of {samples}, {networks} networks"
            );
        }
    }

    #[test]
    fn a_seed_gives_the_same_interval_and_another_purpose_another() {
        let figures = [(0..50).map(f64::from).collect::<Vec<f64>>()];
        let of = |purpose| Resampler::new(7, purpose).of_median(&figures);
        assert_eq!(of("a"), of("a"));
        assert_ne!(of("a"), of("b"));
        assert_eq!(Resampler::new(7, "a").of_median(&[]), None);
    }
}

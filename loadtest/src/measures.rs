//! What is counted of a stretch of load: how every request ended, and how long after the moment it was meant for.
//!
//! A request that was to be sent is in exactly one of the counts, also where it never left.

use hdrhistogram::Histogram;
use std::collections::BTreeMap;
use std::time::{Duration, Instant};

/// The longest time that is told apart, in microseconds; longer ones count as this.
const LONGEST_US: u64 = 120_000_000;
/// Significant digits of percentiles, and of those of an interval.
const DIGITS: u8 = 3;
const INTERVAL_DIGITS: u8 = 2;

/// How a request ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Ending {
    /// With what was asked for.
    Answered,
    /// Refused at once, as the server has too much to do.
    Shed,
    /// Refused for another reason.
    Refused,
    /// The connection could not be made, or broke.
    Broken,
    /// Without an answer in time. Its time is in the histograms as the time that was waited.
    TimedOut,
    /// Never sent: too many others were under way.
    Unsent,
}

/// What an answer says beside that it is one, as far as it was read.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Seen {
    /// Answers to failure reports.
    pub(crate) answers: u64,
    /// Those of them that lead on to the destination.
    pub(crate) rerouted: u64,
    /// Whether what was to be published was.
    pub(crate) published: Option<bool>,
    /// Whether the edge calls its own knowledge fresh.
    pub(crate) fresh: Option<bool>,
    /// How long ago that was all that the registry had.
    pub(crate) registry_age_s: Option<f64>,
}

/// Times in microseconds.
#[derive(Clone)]
pub(crate) struct Times(Histogram<u32>);

impl Default for Times {
    fn default() -> Self {
        Self::new(DIGITS)
    }
}

impl Times {
    pub(crate) fn new(digits: u8) -> Self {
        let histogram = Histogram::new_with_bounds(1, LONGEST_US, digits);
        Self(histogram.expect("bounds and digits that a histogram takes"))
    }

    pub(crate) fn add(&mut self, time: Duration) {
        let us = u64::try_from(time.as_nanos().div_ceil(1000)).unwrap_or(LONGEST_US);
        self.0.saturating_record(us.clamp(1, LONGEST_US));
    }

    pub(crate) fn merge(&mut self, other: &Self) {
        self.0.add(&other.0).expect("histograms of the same bounds");
    }

    /// The time that this part of all is within, in milliseconds; 0 where there is none.
    pub(crate) fn at_ms(&self, part: f64) -> f64 {
        match self.0.is_empty() {
            true => 0.0,
            false => self.0.value_at_quantile(part) as f64 / 1000.0,
        }
    }

    /// Ever nearer to the whole: parts, and the times that they are within in milliseconds.
    pub(crate) fn curve(&self) -> Vec<[f64; 2]> {
        let values = self.0.iter_quantiles(4);
        let point = |value: hdrhistogram::iterators::IterationValue<u32>| {
            [
                value.quantile_iterated_to(),
                value.value_iterated_to() as f64 / 1000.0,
            ]
        };
        values.map(point).collect()
    }
}

/// What is known of one kind of request.
#[derive(Clone, Default)]
pub(crate) struct Tally {
    /// Answers that came while it was measured, whenever they were asked for.
    pub(crate) came: u64,
    pub(crate) answered: u64,
    pub(crate) shed: u64,
    pub(crate) refused: u64,
    pub(crate) broken: u64,
    pub(crate) timed_out: u64,
    pub(crate) unsent: u64,
    /// From the intended send time to the answer.
    pub(crate) from_intended: Times,
    /// From when it had a connection, as a closed loop would tell: for comparison only.
    pub(crate) from_sent: Times,
    /// Until a request was shed.
    pub(crate) until_shed: Times,
    /// Statuses other than success.
    pub(crate) problems: BTreeMap<String, u64>,
    pub(crate) answers_read: u64,
    pub(crate) rerouted: u64,
    pub(crate) to_publish: u64,
    pub(crate) published: u64,
    pub(crate) freshness_read: u64,
    pub(crate) fresh: u64,
    pub(crate) registry_age_s: f64,
}

impl Tally {
    /// All that were to be sent.
    pub(crate) fn scheduled(&self) -> u64 {
        self.answered + self.shed + self.failed()
    }

    /// What is neither an answer nor shed.
    pub(crate) fn failed(&self) -> u64 {
        self.refused + self.broken + self.timed_out + self.unsent
    }

    pub(crate) fn see(&mut self, seen: Seen) {
        self.answers_read += seen.answers;
        self.rerouted += seen.rerouted;
        if let Some(published) = seen.published {
            self.to_publish += 1;
            self.published += u64::from(published);
        }
        if let Some(fresh) = seen.fresh {
            self.freshness_read += 1;
            self.fresh += u64::from(fresh);
        }
        if let Some(age_s) = seen.registry_age_s {
            self.registry_age_s = self.registry_age_s.max(age_s);
        }
    }

    pub(crate) fn merge(&mut self, other: &Self) {
        self.came += other.came;
        self.answered += other.answered;
        self.shed += other.shed;
        self.refused += other.refused;
        self.broken += other.broken;
        self.timed_out += other.timed_out;
        self.unsent += other.unsent;
        self.from_intended.merge(&other.from_intended);
        self.from_sent.merge(&other.from_sent);
        self.until_shed.merge(&other.until_shed);
        for (problem, count) in &other.problems {
            *self.problems.entry(problem.clone()).or_default() += count;
        }
        self.answers_read += other.answers_read;
        self.rerouted += other.rerouted;
        self.to_publish += other.to_publish;
        self.published += other.published;
        self.freshness_read += other.freshness_read;
        self.fresh += other.fresh;
        self.registry_age_s = self.registry_age_s.max(other.registry_age_s);
    }
}

/// A short part of the time, for plots.
#[derive(Clone)]
pub(crate) struct Interval {
    pub(crate) answered: u64,
    pub(crate) shed: u64,
    pub(crate) failed: u64,
    pub(crate) times: Times,
}

impl Default for Interval {
    fn default() -> Self {
        Self {
            answered: 0,
            shed: 0,
            failed: 0,
            times: Times::new(INTERVAL_DIGITS),
        }
    }
}

/// The moments of a request.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Moments {
    /// When it was due.
    pub(crate) intended: Instant,
    /// When the load came to it.
    pub(crate) begun: Instant,
    /// When it had a connection.
    pub(crate) sent: Instant,
    pub(crate) ended: Instant,
}

/// Takes down what happens from a moment on; what was meant for an earlier one warms up and is left out.
pub(crate) struct Recorder {
    pub(crate) measured_from: Instant,
    measured_until: Instant,
    pub(crate) interval: Duration,
    pub(crate) tallies: BTreeMap<&'static str, Tally>,
    pub(crate) intervals: Vec<Interval>,
    /// How much later than meant the load came to it.
    pub(crate) late: Times,
}

impl Recorder {
    pub(crate) fn new(measured_from: Instant, measured_until: Instant, interval: Duration) -> Self {
        Self {
            measured_from,
            measured_until,
            interval,
            tallies: BTreeMap::new(),
            intervals: Vec::new(),
            late: Times::default(),
        }
    }

    /// Takes down how a request ended; `problem` is its status where that is not success.
    pub(crate) fn record(
        &mut self,
        name: &'static str,
        moments: Moments,
        ending: Ending,
        problem: Option<String>,
    ) {
        let is_within = (self.measured_from..self.measured_until).contains(&moments.ended);
        if ending == Ending::Answered && is_within {
            self.tallies.entry(name).or_default().came += 1;
        }
        let Some(since) = moments.intended.checked_duration_since(self.measured_from) else {
            return;
        };
        let number = (since.as_secs_f64() / self.interval.as_secs_f64()) as usize;
        if self.intervals.len() <= number {
            self.intervals.resize_with(number + 1, Interval::default);
        }
        let interval = &mut self.intervals[number];
        let tally = self.tallies.entry(name).or_default();
        let took = moments.ended - moments.intended;
        match ending {
            Ending::Answered => {
                tally.answered += 1;
                interval.answered += 1;
            }
            Ending::Shed => {
                tally.shed += 1;
                interval.shed += 1;
                tally.until_shed.add(took);
            }
            Ending::Refused => tally.refused += 1,
            Ending::Broken => tally.broken += 1,
            Ending::TimedOut => tally.timed_out += 1,
            Ending::Unsent => tally.unsent += 1,
        }
        if !matches!(ending, Ending::Answered | Ending::Shed) {
            interval.failed += 1;
        }
        if matches!(ending, Ending::Answered | Ending::TimedOut) {
            tally.from_intended.add(took);
            tally.from_sent.add(moments.ended - moments.sent);
            interval.times.add(took);
        }
        if ending != Ending::Unsent {
            self.late.add(moments.begun - moments.intended);
        }
        if let Some(problem) = problem {
            *tally.problems.entry(problem).or_default() += 1;
        }
    }

    pub(crate) fn see(&mut self, name: &'static str, intended: Instant, seen: Seen) {
        if intended >= self.measured_from {
            self.tallies.entry(name).or_default().see(seen);
        }
    }

    /// Everything together.
    pub(crate) fn all(&self) -> Tally {
        let mut all = Tally::default();
        for tally in self.tallies.values() {
            all.merge(tally);
        }
        all
    }
}

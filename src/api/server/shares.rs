//! Which share of each class is shed, by how long requests wait for a worker.
//!
//! The controller is that of PIE (RFC 8033, 4.2), with a time in place of a queue's length: the part of all requests that is shed
//! grows with how far the wait is above its target and with how fast it grows, so that it settles where the wait stays at the
//! target. That part is taken from one class as far as it has requests, before the next is touched.

use crate::api::operations::Class;
use std::time::Duration;

/// The classes that are shed for waiting, the first one first. Writes of airspace, streams and probes are not among them: they are
/// few, and what they tell is needed most in an overload.
pub(super) const SHED_IN_ORDER: [Class; 3] = [Class::Read, Class::Other, Class::Failure];

/// The most that is shed of each: to refuse takes time too, and an edge that refuses every report is none.
const SHARES_MAX: [f64; SHED_IN_ORDER.len()] = [1.0, 1.0, 0.9];

/// How often the shares are worked out anew.
pub(super) const EVERY: Duration = Duration::from_millis(10);

/// How long a wait has to stand before anything is shed: a stall of the machine is shorter, and over before a refusal helps.
const PATIENCE: Duration = Duration::from_millis(150);

/// What a wait of e times the target adds to the part that is shed, in each step.
const OF_EXCESS: f64 = 0.03;

/// What growing e times as long adds to that part.
const OF_GROWTH: f64 = 0.15;

/// What is left of that part after a step without waiting.
const FADES_TO: f64 = 0.98;

/// Less than this is nothing.
const PART_MIN: f64 = 0.01;

/// What is left of the weight of earlier requests at each look: this many looks make up the mix of classes.
const REMEMBERED: f64 = 0.9;

/// The most steps that one look makes up for, and the most where requests waited: without a look,
/// no request was admitted meanwhile.
const STEPS_MAX: f64 = 100.0;
const WAITED_STEPS_MAX: f64 = 2.0;

/// The controller.
#[derive(Clone, Debug)]
pub(super) struct Shares {
    target: Duration,
    /// The part of all requests that is to be shed, from 0 to 1.
    part: f64,
    /// How many requests of each class have come lately; older ones count less.
    mix: [f64; SHED_IN_ORDER.len()],
    /// The last wait, by its excess over the target.
    excess: f64,
    /// How long the wait may still stand.
    patience: Duration,
}

impl Shares {
    /// With the wait to keep to, which is not zero.
    pub(super) fn new(target: Duration) -> Self {
        Self {
            target,
            part: 0.0,
            mix: [0.0; SHED_IN_ORDER.len()],
            excess: -1.0,
            patience: PATIENCE,
        }
    }

    /// Takes in how long requests wait now, a time after the last look, and how many of each class have come meanwhile.
    pub(super) fn look(
        &mut self,
        wait: Duration,
        since: Duration,
        came: [u64; SHED_IN_ORDER.len()],
    ) {
        for (known, came) in self.mix.iter_mut().zip(came) {
            *known = *known * REMEMBERED + came as f64;
        }
        let steps = (since.as_secs_f64() / EVERY.as_secs_f64()).min(STEPS_MAX);
        let of_target = wait.as_secs_f64() / self.target.as_secs_f64();
        // By its logarithm where it is too long, so that a long queue that becomes shorter is seen to.
        let excess = match of_target > 1.0 {
            true => of_target.ln(),
            false => of_target - 1.0,
        };
        let growth = excess - self.excess;
        let is_quiet = excess < -0.5 && self.excess < -0.5;
        self.excess = excess;
        let counted = match excess > 0.0 {
            true => steps.min(WAITED_STEPS_MAX),
            false => steps,
        };
        let change = OF_EXCESS * excess * counted + OF_GROWTH * growth;
        self.part = (self.part + change).clamp(0.0, 1.0);
        if is_quiet {
            self.part *= FADES_TO.powf(steps);
        }
        if self.part < PART_MIN && excess <= 0.0 {
            self.part = 0.0;
            self.patience = PATIENCE;
        } else if excess > 0.0 {
            // However long the looks were missing: that was one stall and no standing wait.
            let stood = EVERY.mul_f64(counted);
            self.patience = self.patience.saturating_sub(stood);
        }
        if !self.patience.is_zero() {
            self.part = 0.0;
        }
    }

    /// The share to shed of each class, from 0 to 1, in the order of `SHED_IN_ORDER`.
    pub(super) fn of_classes(&self) -> [f64; SHED_IN_ORDER.len()] {
        let all: f64 = self.mix.iter().sum();
        let mut left = self.part * all;
        std::array::from_fn(|place| {
            let (of_class, share_max) = (self.mix[place], SHARES_MAX[place]);
            let taken = left.min(of_class * share_max);
            left -= taken;
            if of_class > 0.0 {
                taken / of_class
            } else {
                0.0
            }
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TARGET_S: f64 = 0.005;

    /// What a worker does for a read, a report and a refusal, in seconds.
    const READ_S: f64 = 190e-6;
    const REPORT_S: f64 = 45e-6;
    const REFUSAL_S: f64 = 28e-6;

    /// What became of the requests of a phase.
    #[derive(Default)]
    struct Told {
        reads: usize,
        reads_shed: usize,
        reports: usize,
        reports_shed: usize,
        waits_s: Vec<f64>,
    }

    impl Told {
        fn p99_s(mut self) -> f64 {
            self.waits_s.sort_by(f64::total_cmp);
            self.waits_s[self.waits_s.len() * 99 / 100]
        }
    }

    /// One worker with a queue, half of whose requests are reads.
    struct Worker {
        shares: Shares,
        now_s: f64,
        free_s: f64,
        looked_s: f64,
        came: [u64; 3],
        sums: [f64; 3],
    }

    impl Worker {
        fn idle() -> Self {
            Self {
                shares: Shares::new(Duration::from_secs_f64(TARGET_S)),
                now_s: 0.0,
                free_s: 0.0,
                looked_s: 0.0,
                came: [0; 3],
                sums: [0.0; 3],
            }
        }

        fn is_shed(&mut self, class: Class) -> bool {
            let place = SHED_IN_ORDER.iter().position(|shed| *shed == class);
            let place = place.expect("a class that is shed");
            self.came[place] += 1;
            self.sums[place] += self.shares.of_classes()[place];
            let is_shed = self.sums[place] >= 1.0;
            self.sums[place] -= f64::from(u8::from(is_shed));
            is_shed
        }

        /// Requests at equal distances for a while.
        fn serve(&mut self, per_s: f64, for_s: f64) -> Told {
            let mut told = Told::default();
            for number in 0..(per_s * for_s) as usize {
                self.now_s += 1.0 / per_s;
                let start_s = self.free_s.max(self.now_s);
                let since_s = start_s - self.looked_s;
                if since_s >= EVERY.as_secs_f64() {
                    let wait = Duration::from_secs_f64(start_s - self.now_s);
                    let came = std::mem::take(&mut self.came);
                    self.shares
                        .look(wait, Duration::from_secs_f64(since_s), came);
                    self.looked_s = start_s;
                }
                let is_read = number % 2 == 0;
                let is_shed = self.is_shed(if is_read { Class::Read } else { Class::Failure });
                let (count, shed, cost_s) = match is_read {
                    true => (&mut told.reads, &mut told.reads_shed, READ_S),
                    false => (&mut told.reports, &mut told.reports_shed, REPORT_S),
                };
                *count += 1;
                *shed += usize::from(is_shed);
                self.free_s = start_s + if is_shed { REFUSAL_S } else { cost_s };
                if !is_shed {
                    told.waits_s.push(self.free_s - self.now_s);
                }
            }
            told
        }
    }

    #[test]
    fn at_three_times_the_capacity_reads_are_shed_and_what_is_admitted_waits_little() {
        let mut worker = Worker::idle();
        worker.serve(25_000.0, 1.0);
        let told = worker.serve(25_000.0, 3.0);
        assert!(told.reads_shed * 10 > told.reads * 9, "{}", told.reads_shed);
        assert_eq!(told.reports_shed, 0, "of {}", told.reports);
        let p99_s = told.p99_s();
        assert!(p99_s < 3.0 * TARGET_S, "{p99_s}");
    }

    #[test]
    fn where_reports_alone_are_too_many_they_are_shed_after_all_reads() {
        let mut worker = Worker::idle();
        worker.serve(31_000.0, 2.0);
        let told = worker.serve(31_000.0, 3.0);
        assert!(told.reports_shed > 0);
        assert_eq!(told.reads_shed, told.reads);
        let p99_s = told.p99_s();
        assert!(p99_s < 3.0 * TARGET_S, "{p99_s}");
    }

    #[test]
    fn where_even_refusals_are_too_many_a_tenth_of_the_reports_is_answered() {
        let mut worker = Worker::idle();
        worker.serve(45_000.0, 1.0);
        let told = worker.serve(45_000.0, 1.0);
        let answered = told.reports - told.reports_shed;
        assert_eq!(answered * 10 / told.reports, 1, "{answered} answered");
    }

    #[test]
    fn when_an_overload_begins_most_reports_are_answered_all_the_same() {
        let mut worker = Worker::idle();
        let told = worker.serve(25_000.0, 1.0);
        assert!(
            told.reports_shed * 10 < told.reports * 4,
            "{}",
            told.reports_shed
        );
        assert!(told.reads_shed > told.reports_shed * 2);
    }

    #[test]
    fn below_the_capacity_nothing_is_shed_and_soon_after_an_overload_either() {
        let mut worker = Worker::idle();
        let told = worker.serve(7_000.0, 2.0);
        assert_eq!((told.reads_shed, told.reports_shed), (0, 0));
        worker.serve(25_000.0, 2.0);
        worker.serve(4_000.0, 0.5);
        let told = worker.serve(4_000.0, 1.0);
        assert_eq!((told.reads_shed, told.reports_shed), (0, 0));
    }

    #[test]
    fn a_stall_of_the_machine_sheds_nothing() {
        let mut worker = Worker::idle();
        worker.serve(4_000.0, 0.5);
        // Once, and again when all is well again.
        worker.free_s += 0.06;
        worker.serve(4_000.0, 0.5);
        worker.free_s += 0.06;
        let told = worker.serve(4_000.0, 1.0);
        assert_eq!((told.reads_shed, told.reports_shed), (0, 0));
        assert!(told.p99_s() > TARGET_S, "the stall went unnoticed");
    }
}

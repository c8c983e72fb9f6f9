//! Percentiles over queries: each is timed by itself, in passes over all of them, so that no query finds
//! the caches warm from itself.

use std::hint::black_box;
use std::time::{Duration, Instant};

/// Passes over all queries; a query's time is its median over the passes.
const MAX_PASSES: usize = 25;
/// Passes stop when this much time has gone, once there are at least three.
const BUDGET: Duration = Duration::from_secs(6);

/// Times of many queries, in nanoseconds.
pub(crate) struct Percentiles {
    sorted_ns: Vec<f64>,
}

impl Percentiles {
    /// Times `query` for every index below `count`.
    pub(crate) fn of<T>(count: usize, mut query: impl FnMut(usize) -> T) -> Self {
        let begun = Instant::now();
        let mut times: Vec<Vec<f64>> = vec![Vec::with_capacity(MAX_PASSES); count];
        for pass in 0..MAX_PASSES {
            if pass >= 3 && begun.elapsed() > BUDGET {
                break;
            }
            for (index, times) in times.iter_mut().enumerate() {
                let start = Instant::now();
                black_box(query(black_box(index)));
                times.push(start.elapsed().as_nanos() as f64);
            }
        }
        Self::taken(times.into_iter().map(median).collect())
    }

    /// Of times that were taken elsewhere, in nanoseconds.
    pub(crate) fn taken(mut times_ns: Vec<f64>) -> Self {
        times_ns.sort_by(f64::total_cmp);
        Self {
            sorted_ns: times_ns,
        }
    }

    /// The time that a share of the queries stays within, in microseconds.
    pub(crate) fn at_us(&self, share: f64) -> f64 {
        let last = self.sorted_ns.len() - 1;
        self.sorted_ns[(share * last as f64).round() as usize] / 1e3
    }

    /// The mean, in microseconds.
    pub(crate) fn mean_us(&self) -> f64 {
        self.sorted_ns.iter().sum::<f64>() / self.sorted_ns.len() as f64 / 1e3
    }

    /// Prints a row of the table.
    pub(crate) fn print(&self, what: &str) {
        println!(
            "| {what} | {:.2} | {:.2} | {:.2} |",
            self.at_us(0.5),
            self.at_us(0.99),
            self.mean_us()
        );
    }
}

fn median(mut times: Vec<f64>) -> f64 {
    times.sort_by(f64::total_cmp);
    times[times.len() / 2]
}

/// Prints the head of a table.
pub(crate) fn print_head(title: &str) {
    println!("\n| {title} | p50 µs | p99 µs | mean µs |\n|---|---:|---:|---:|");
}

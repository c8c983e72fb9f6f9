//! How long each query takes: timed by itself, in passes over all of them, so that no query finds the caches warm
//! from itself; within a budget, which slow engines spend on fewer queries.

use std::hint::black_box;
use std::time::{Duration, Instant};

/// Queries asked however long they take.
const MIN_QUERIES: usize = 5;

/// How much is measured.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Effort {
    /// Passes over the queries; a query's time is its median over them.
    pub(crate) max_passes: usize,
    /// For one engine and kind of query: half of it bounds the first pass, all of it the passes.
    pub(crate) budget: Duration,
}

impl Effort {
    /// Times `query` for indices from 0 on; hands every answer to `check`, which is not timed.
    pub(crate) fn times_ns<T>(
        self,
        count: usize,
        mut query: impl FnMut(usize) -> T,
        mut check: impl FnMut(usize, T),
    ) -> Vec<u64> {
        let begun = Instant::now();
        let mut times_ns: Vec<Vec<u64>> = Vec::with_capacity(count);
        for pass in 0..self.max_passes {
            let asked = if pass == 0 { count } else { times_ns.len() };
            for index in 0..asked {
                let is_first = pass == 0;
                if is_first && index >= MIN_QUERIES && begun.elapsed() > self.budget / 2 {
                    break;
                }
                let start = Instant::now();
                let answer = black_box(query(black_box(index)));
                let took_ns = start.elapsed().as_nanos() as u64;
                check(index, answer);
                match is_first {
                    true => times_ns.push(vec![took_ns]),
                    false => times_ns[index].push(took_ns),
                }
            }
            if begun.elapsed() > self.budget {
                break;
            }
        }
        times_ns.into_iter().map(median).collect()
    }
}

fn median(mut times_ns: Vec<u64>) -> u64 {
    times_ns.sort_unstable();
    times_ns[times_ns.len() / 2]
}

/// The times of one engine on one kind of query, and how much longer its ways are than the shortest.
#[derive(Debug)]
pub(crate) struct Row {
    pub(crate) kind: &'static str,
    pub(crate) engine: &'static str,
    pub(crate) times_ns: Vec<u64>,
    /// Mean of `length / shortest - 1` over the queries asked; 0 for what is exact.
    pub(crate) mean_excess: f64,
}

/// What was measured on one network.
#[derive(Debug, Default)]
pub(crate) struct Times {
    pub(crate) rows: Vec<Row>,
    /// What an engine does once for a network or a destination: engine, what, seconds.
    pub(crate) preparations: Vec<(&'static str, &'static str, f64)>,
}

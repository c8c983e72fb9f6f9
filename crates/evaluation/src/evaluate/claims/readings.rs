//! What sentences about time, distance and search space can mean.

use super::super::cells::{Cell, FailureRow};
use super::super::method::{Approach, Inside, Method, Span};
use super::super::record::Reading;
use super::super::rows::Row;
use super::super::statistics::{Average, Estimate, Resampler};

/// How a ratio is told.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Shape {
    /// As it is.
    Times,
    /// In per cent.
    Percent,
    /// By how many per cent it is below 1.
    PercentBelow,
    /// By how many per cent it is above 1.
    PercentAbove,
}

/// Two figures of one failure, of which the ratio is taken; the second is what is compared with.
type Pair = fn(&Cell, Method, Method) -> Vec<(f64, f64)>;

/// One reading of a sentence.
pub(super) struct Candidate {
    name: String,
    method: Method,
    baseline: Method,
    average: Average,
    pair: Pair,
    /// What `exact` is called where it takes the method's place, and which figures are its.
    exact: (String, Pair),
}

impl Shape {
    fn of(self, ratio: f64) -> f64 {
        match self {
            Self::Times => ratio,
            Self::Percent => 1e2 * ratio,
            Self::PercentBelow => 1e2 * (1.0 - ratio),
            Self::PercentAbove => 1e2 * (ratio - 1.0),
        }
    }
}

impl Candidate {
    /// The reading's value on some cells, and that of `exact` in the method's place.
    pub(super) fn estimate(
        &self,
        claim: &str,
        shape: Shape,
        cells: &[&Cell],
        seed: u64,
    ) -> Option<(Reading, Option<Reading>)> {
        let mut resampler = Resampler::new(seed, &format!("{claim}: {}", self.name));
        let mut of = |name: &str, method: Method, pair: Pair| {
            let of_cell = |cell: &&Cell| pair(cell, method, self.baseline);
            let pairs: Vec<(f64, f64)> = cells.iter().flat_map(of_cell).collect();
            let ratio = resampler.of_pairs(&pairs, self.average)?;
            Some(reading(name, ratio.map(|ratio| shape.of(ratio))))
        };
        let own = of(&self.name, self.method, self.pair)?;
        let (exact_name, exact_pair) = &self.exact;
        let exact = of(exact_name, Method::exact(true), *exact_pair);
        Some((own, exact))
    }
}

/// An estimate under a name.
pub(super) fn reading(name: &str, estimate: Estimate) -> Reading {
    Reading {
        name: name.to_owned(),
        value: estimate.value,
        low: estimate.low,
        high: estimate.high,
        cases: estimate.cases,
    }
}

/// The methods that a sentence about an approach can mean.
fn methods(approach: Approach) -> Vec<Method> {
    let spans = [Span::Leg, Span::Route];
    let method = |span, inside| Method {
        approach,
        inside,
        span,
    };
    match approach.has_areas() {
        false => spans.map(|span| method(span, Inside::AStar)).to_vec(),
        true => spans
            .into_iter()
            .flat_map(|span| [Inside::AStar, Inside::Dijkstra].map(|inside| method(span, inside)))
            .collect(),
    }
}

fn ends(span: Span) -> &'static str {
    match span {
        Span::Leg => "A → B",
        Span::Route => "A → destination",
    }
}

fn describe(method: Method) -> String {
    let ends = ends(method.span);
    match (method.approach.has_areas(), method.inside) {
        (false, _) => ends.to_owned(),
        (true, Inside::AStar) => format!("areas for {ends}, A* inside"),
        (true, Inside::Dijkstra) => format!("areas for {ends}, Dijkstra inside"),
    }
}

/// What a sentence about time can mean: over which ends, which Dijkstra, and how cases are averaged.
pub(super) fn of_time(approach: Approach) -> Vec<Candidate> {
    let pair: Pair = |cell, method, baseline| cell.time_pairs(method, baseline);
    let mut candidates = Vec::new();
    for method in methods(approach) {
        // A local answer can be compared with a global one, which solves more than was asked; not the other way round.
        let baseline_spans: &[Span] = match (approach.has_areas(), method.span) {
            (true, Span::Leg) => &[Span::Leg, Span::Route],
            (false, Span::Leg) => &[Span::Leg],
            (_, Span::Route) => &[Span::Route],
        };
        for &span in baseline_spans {
            for full_tree in [false, true] {
                let baseline = Method::baseline(Approach::Dijkstra { full_tree }, span);
                let stop = if full_tree { "full tree" } else { "early exit" };
                let against = format!("Dijkstra {} with {stop}", ends(span));
                candidates.extend(Average::ALL.map(|average| Candidate {
                    name: format!("{}; {against}; {}", describe(method), average.name()),
                    method,
                    baseline,
                    average,
                    pair,
                    exact: (
                        format!(
                            "exact, warm, A → destination; {against}; {}",
                            average.name()
                        ),
                        pair,
                    ),
                }));
            }
        }
    }
    candidates
}

/// A figure of one failure under one method.
type Figure = fn(&FailureRow, &Row) -> f64;

fn pairs(cell: &Cell, method: Method, [length_m, best_m]: [Figure; 2]) -> Vec<(f64, f64)> {
    let lengths_m = cell.values(method, length_m).into_iter();
    lengths_m.zip(cell.values(method, best_m)).collect()
}

/// The new part, over the shortest way from A to B.
const NEW_PART: Pair = |cell, method, _| {
    let optimum_m: Figure = |failure, _| failure.local_optimum_m;
    pairs(cell, method, [|_, row| row.recomposed_m, optimum_m])
};

/// The rest of the route, over the shortest way from A to the destination.
const REST: Pair = |cell, method, _| {
    let optimum_m: Figure = |failure, _| failure.optimum_m;
    pairs(cell, method, [|_, row| row.remaining_m, optimum_m])
};

/// The whole route with what was flown before, over the shortest.
const WHOLE: Pair = |cell, method, _| {
    let length_m: Figure = |failure, row| failure.flown_m + row.remaining_m;
    let optimum_m: Figure = |failure, _| failure.flown_m + failure.optimum_m;
    pairs(cell, method, [length_m, optimum_m])
};

/// The rest of the route, over that of the baseline.
const REST_BESIDE_BASELINE: Pair = |cell, method, baseline| {
    let rests_m = |method| cell.values(method, |_, row| row.remaining_m).into_iter();
    rests_m(method).zip(rests_m(baseline)).collect()
};

/// What a sentence about distance can mean: of which part, over which optimum, and how cases are averaged.
pub(super) fn of_distance(approach: Approach) -> Vec<Candidate> {
    let local = Method::baseline(Approach::Dijkstra { full_tree: false }, Span::Leg);
    let whole_route: [(&str, Pair); 2] = [
        ("rest of the route over the shortest A → destination", REST),
        ("whole route, flown part included, over the shortest", WHOLE),
    ];
    let repaired: [(&str, Pair); 2] = [
        ("new part over the shortest A → B", NEW_PART),
        (
            "rest of the route over that of Dijkstra A → B",
            REST_BESIDE_BASELINE,
        ),
    ];
    let mut candidates = Vec::new();
    for span in [Span::Leg, Span::Route] {
        let method = Method {
            span,
            ..Method::of_paper(approach)
        };
        let figures = match span {
            Span::Leg => [repaired, whole_route].concat(),
            Span::Route => whole_route.to_vec(),
        };
        for (what, pair) in figures {
            candidates.extend(Average::ALL.map(|average| {
                let exact = "exact; rest of the route over the shortest A → destination";
                Candidate {
                    name: format!("areas for {}; {what}; {}", ends(span), average.name()),
                    method,
                    baseline: local,
                    average,
                    pair,
                    exact: (format!("{exact}; {}", average.name()), REST),
                }
            }));
        }
    }
    candidates
}

/// What a sentence about the share of the network can mean: of nodes or segments, and how cases are averaged.
pub(super) fn of_share(approach: Approach) -> Vec<Candidate> {
    let nodes: Pair = |cell, method, _| {
        let all = cell.figures.facts.nodes as f64;
        let areas = cell.values(method, |_, row| row.area_nodes as f64);
        areas.into_iter().map(|nodes| (nodes, all)).collect()
    };
    let segments: Pair = |cell, method, _| {
        let all = cell.figures.facts.segments as f64;
        let areas = cell.values(method, |_, row| row.area_segments as f64);
        areas.into_iter().map(|segments| (segments, all)).collect()
    };
    let settled: Pair = |cell, method, _| {
        let all = cell.figures.facts.nodes as f64;
        let counts = cell.values(method, |_, row| row.settled_nodes as f64);
        counts.into_iter().map(|nodes| (nodes, all)).collect()
    };
    let mut candidates = Vec::new();
    for span in [Span::Leg, Span::Route] {
        let method = Method {
            span,
            ..Method::of_paper(approach)
        };
        for (what, pair) in [("nodes", nodes), ("segments", segments)] {
            candidates.extend(Average::ALL.map(|average| Candidate {
                name: format!("{what}, areas for {}; {}", ends(span), average.name()),
                method,
                baseline: method,
                average,
                pair,
                exact: (
                    format!("exact, warm; nodes settled; {}", average.name()),
                    settled,
                ),
            }));
        }
    }
    candidates
}

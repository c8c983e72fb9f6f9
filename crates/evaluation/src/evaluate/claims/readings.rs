//! What a sentence means under a choice of conventions: which figures of which failures, and how they are averaged.

use super::super::cells::{Cell, Cells, FailureRow, by_network};
use super::super::failures::Placing;
use super::super::method::{Approach, Inside, Method, Span};
use super::super::record::Reading;
use super::super::rows::Row;
use super::super::skipped::{Case, Extent, cases};
use super::super::statistics::{Average, Estimate, Resampler, mean};
use super::Quantity;
use super::conventions::{Axis, Choice, POOLS};

/// The figures of a reading, by network.
pub(super) enum Sample {
    /// One over the other.
    Pairs(Vec<Vec<(f64, f64)>>, Average),
    /// The mean of the cases that are, over that of the others.
    Groups(Vec<Vec<(bool, f64)>>),
}

impl Sample {
    /// The ratio, without an interval.
    pub(super) fn ratio(&self) -> Option<f64> {
        let ratio = match self {
            Self::Pairs(pairs, average) => {
                let all = pairs.concat();
                (!all.is_empty()).then(|| average.of(&all))
            }
            Self::Groups(groups) => Some(of_groups(&groups.concat())),
        };
        ratio.filter(|ratio| ratio.is_finite())
    }

    /// The ratio with its interval.
    pub(super) fn estimate(&self, resampler: &mut Resampler) -> Option<Estimate> {
        match self {
            Self::Pairs(pairs, average) => resampler.of_pairs(pairs, *average),
            Self::Groups(groups) => resampler.estimate(groups, of_groups),
        }
    }
}

fn of_groups(cases: &[(bool, f64)]) -> f64 {
    let [one, other] = [true, false].map(|wanted| {
        let group = cases.iter().filter(|(is_in, _)| *is_in == wanted);
        mean(&group.map(|(_, figure)| *figure).collect::<Vec<f64>>())
    });
    one / other
}

impl Quantity {
    /// The axes that its sentence depends on.
    pub(super) fn axes(self, on_sydney: bool) -> Vec<Axis> {
        let of_approach: &[Axis] = match self.approach() {
            Some(Approach::CellDensity) => &[Axis::Areas, Axis::Cells],
            Some(Approach::TwoPhased | Approach::TwoPhasedPolygons) => &[Axis::Areas, Axis::Val],
            Some(Approach::Radius) => &[Axis::Areas],
            Some(_) => &[],
            None => &[Axis::Val],
        };
        let has_areas = self.approach().is_some_and(Approach::has_areas);
        let inside: &[Axis] = if has_areas { &[Axis::Inside] } else { &[] };
        let own = match self {
            Self::Faster(_) => [
                inside,
                &[Axis::Baseline, Axis::Average, Axis::Faster, Axis::Clock],
            ]
            .concat(),
            Self::TimesTheTime(Approach::BellmanFord) => {
                vec![Axis::Baseline, Axis::Average, Axis::Library]
            }
            Self::TimesTheTime(_) => {
                [inside, &[Axis::Baseline, Axis::Average, Axis::Clock]].concat()
            }
            Self::Longer(_) => vec![Axis::Average, Axis::Length],
            Self::Share(_) | Self::IneffectiveSpace => vec![Axis::Average, Axis::Extent],
            Self::EffectiveCases => Vec::new(),
            Self::EffectiveSpace => vec![Axis::Extent],
        };
        let networks: &[Axis] = if on_sydney { &[] } else { &[Axis::Networks] };
        [networks, &[Axis::Placing], of_approach, &own].concat()
    }

    /// The figures of a reading; `None` where a choice makes no sense. `exact` can stand in for the approach.
    pub(super) fn sample(
        self,
        cells: &Cells,
        on_sydney: bool,
        choice: Choice,
        is_exact: bool,
    ) -> Option<Sample> {
        let cells = match on_sydney {
            true => cells.of_sydney(),
            false => cells.of(POOLS[choice.of(Axis::Networks)]),
        };
        let placing = Placing::ALL[choice.of(Axis::Placing)];
        let average = Average::ALL[choice.of(Axis::Average)];
        let Some(approach) = self.approach() else {
            return self.of_skipping(&cells, placing, choice, average);
        };
        let method = match is_exact {
            true => Method::exact(true),
            false => method(approach, choice),
        };
        let pairs = match self {
            Self::Faster(_) | Self::TimesTheTime(_) => {
                let is_unfair = approach.has_areas()
                    && choice.of(Axis::Areas) == 1
                    && baseline(choice).span == Span::Leg;
                // A local answer can be compared with a global one, which solves more; not the other way round.
                if is_unfair {
                    return None;
                }
                let cost = |row: &Row| match choice.of(Axis::Clock) {
                    0 => row.time_us,
                    _ => row.settled_nodes as f64,
                };
                let pair = |_: &FailureRow, [own, other]: [&Row; 2]| (cost(own), cost(other));
                placed(&cells, placing, [method, baseline(choice)], pair)
            }
            Self::Longer(_) => {
                let usual = Approach::Dijkstra { full_tree: false };
                let methods = [method, Method::baseline(usual, method.span)];
                placed(&cells, placing, methods, |failure, [own, other]| {
                    lengths_m(failure, own, other, method.span, choice.of(Axis::Length))
                })
            }
            _ => searched(&cells, placing, method, choice),
        };
        Some(Sample::Pairs(pairs, average))
    }

    fn of_skipping(
        self,
        cells: &[&Cell],
        placing: Placing,
        choice: Choice,
        average: Average,
    ) -> Option<Sample> {
        let cases = cases(cells, placing, choice.of(Axis::Val));
        let space = |extent: &Extent| match choice.of(Axis::Extent) {
            0 => extent.nodes,
            1 => extent.segments,
            2 => extent.searched_nodes,
            _ => extent.searched_segments,
        };
        let each = |pair: &dyn Fn(&Case) -> Option<(f64, f64)>| {
            let networks = cases.iter();
            let pairs: Vec<Vec<(f64, f64)>> = networks
                .map(|cases| cases.iter().filter_map(pair).collect())
                .collect();
            pairs
        };
        Some(match self {
            Self::EffectiveCases => {
                let is_one = |case: &Case| Some((f64::from(u8::from(case.is_effective)), 1.0));
                Sample::Pairs(each(&is_one), Average::RatioOfMeans)
            }
            Self::IneffectiveSpace => {
                let pair = |case: &Case| {
                    let pair = (space(&case.with_skipping), space(&case.without));
                    (!case.is_effective && pair.1 > 0.0).then_some(pair)
                };
                Sample::Pairs(each(&pair), average)
            }
            _ => {
                let case = |case: &Case| (case.is_effective, space(&case.with_skipping));
                let networks = cases.iter();
                Sample::Groups(
                    networks
                        .map(|cases| cases.iter().map(case).collect())
                        .collect(),
                )
            }
        })
    }
}

fn placed<const METHODS: usize>(
    cells: &[&Cell],
    placing: Placing,
    methods: [Method; METHODS],
    pair: impl Fn(&FailureRow, [&Row; METHODS]) -> (f64, f64),
) -> Vec<Vec<(f64, f64)>> {
    by_network(cells, methods, |failure, rows| {
        (failure.placing == placing).then(|| pair(failure, rows))
    })
}

/// What is searched, and the whole network.
fn searched(
    cells: &[&Cell],
    placing: Placing,
    method: Method,
    choice: Choice,
) -> Vec<Vec<(f64, f64)>> {
    // What runs inside an area does not change it, and its stages are recorded for A*.
    let method = Method {
        inside: Inside::AStar,
        ..method
    };
    let (is_last, is_nodes) = match choice.of(Axis::Extent) {
        0 => (true, true),
        1 => (true, false),
        2 => (false, true),
        _ => (false, false),
    };
    let is_area = is_last && method.approach.has_areas();
    placed(cells, placing, [method], |failure, [row]| {
        let (last, all, whole) = match is_nodes {
            true => (row.area_nodes, row.searched_nodes, failure.nodes),
            false => (row.area_segments, row.searched_segments, failure.segments),
        };
        let found = if is_area { last } else { all.unwrap_or(last) };
        (found as f64, whole as f64)
    })
}

/// A length and what it is compared with, in metres.
fn lengths_m(
    failure: &FailureRow,
    own: &Row,
    baseline: &Row,
    span: Span,
    option: usize,
) -> (f64, f64) {
    match option {
        0 => (own.remaining_m, failure.optimum_m),
        1 => match span {
            Span::Leg => (own.recomposed_m, failure.local_optimum_m),
            Span::Route => (own.remaining_m, failure.optimum_m),
        },
        2 => (own.remaining_m, baseline.remaining_m),
        _ => (
            failure.flown_m + own.remaining_m,
            failure.flown_m + failure.optimum_m,
        ),
    }
}

fn baseline(choice: Choice) -> Method {
    let option = choice.of(Axis::Baseline);
    let span = if option < 2 { Span::Leg } else { Span::Route };
    let full_tree = option % 2 == 1;
    Method::baseline(Approach::Dijkstra { full_tree }, span)
}

/// The method that a sentence about an approach means.
fn method(approach: Approach, choice: Choice) -> Method {
    if !approach.has_areas() {
        let approach = match (approach, choice.of(Axis::Library)) {
            (Approach::BellmanFord, 1) => Approach::QueueBellmanFord,
            _ => approach,
        };
        return Method::baseline(approach, baseline(choice).span);
    }
    let spans = [Span::Leg, Span::Route];
    let insides = [Inside::Dijkstra, Inside::AStar];
    let variant = match approach {
        Approach::CellDensity => choice.of(Axis::Cells),
        Approach::Radius => 0,
        _ => choice.of(Axis::Val),
    };
    Method {
        approach,
        inside: insides[choice.of(Axis::Inside)],
        span: spans[choice.of(Axis::Areas)],
        variant,
    }
}

/// An estimate under a name.
pub(super) fn reading(name: String, estimate: Estimate) -> Reading {
    Reading {
        name,
        value: estimate.value,
        low: estimate.low,
        high: estimate.high,
        cases: estimate.cases,
    }
}

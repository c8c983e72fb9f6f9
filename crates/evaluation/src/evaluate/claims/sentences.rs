//! What the paper says without a number, put to the test network by network.

use super::super::cells::{Cell, Cells, FailureRow, by_network};
use super::super::design::{Sweep, name_of};
use super::super::method::{Approach, Inside, Method, Span};
use super::super::record::{Count, Sentence, Verdict};
use super::super::rows::Row;
use std::collections::BTreeMap;

/// On this share of the networks that tell a sentence holds, and on what is left of it it is contradicted.
const MOST: f64 = 0.75;

/// How a sentence is put to the test on the rows of some methods.
#[derive(Clone, Copy)]
enum Test {
    /// On each network the mean of the first figure is below that of the second.
    Below(Figures),
    /// The ratio of the two means is lower on the smallest network than on the largest of the same variables.
    Rises(Figures),
    /// It is higher there.
    Falls(Figures),
    /// The two figures are the same for every failure.
    Same(Figures),
}

/// Two figures of a failure; `None` where the sentence is not about it.
type Figures = fn(&FailureRow, [&Row; METHODS]) -> Option<[f64; 2]>;

const METHODS: usize = 12;

/// What the paper runs: A to B, with Dijkstra inside.
const fn of_paper(approach: Approach, variant: usize) -> Method {
    Method {
        approach,
        inside: Inside::Dijkstra,
        span: Span::Leg,
        variant,
    }
}

const DIJKSTRA: Approach = Approach::Dijkstra { full_tree: false };

/// The methods that sentences are about; figures name them by their places.
const OF: [Method; METHODS] = [
    of_paper(Approach::TwoPhased, 0),
    of_paper(Approach::CellDensity, 0),
    of_paper(Approach::Radius, 0),
    of_paper(Approach::TwoPhasedPolygons, 0),
    Method::of_paper(Approach::TwoPhasedAllStages),
    Method::baseline(DIJKSTRA, Span::Leg),
    Method::baseline(DIJKSTRA, Span::Route),
    Method::baseline(Approach::AStar, Span::Leg),
    Method::baseline(Approach::BellmanFord, Span::Leg),
    of_paper(Approach::CellDensity, 1),
    of_paper(Approach::CellDensity, 2),
    Method::of_paper(Approach::TwoPhased),
];

/// A name, what the paper says, how it is tested, and the test.
type Stated = (&'static str, &'static str, &'static str, Test);

const STATED: [Stated; 10] = [
    (
        "two-phased-is-fastest",
        "Two-phased needs the least time of the three strategies.",
        "its mean time is below the mean of the lower of the other two, taken failure by failure",
        Test::Below(|_, rows| Some([rows[0].time_us, rows[1].time_us.min(rows[2].time_us)])),
    ),
    (
        "radius-suffers-from-size",
        "Radius-based gets worse against the baseline as the network grows.",
        "its time over that of Dijkstra A → B is higher on the largest network than on the smallest",
        Test::Rises(|_, rows| Some([rows[2].time_us, rows[5].time_us])),
    ),
    (
        "density-suffers-from-cells",
        "Cell density pays for its cells: they have to be counted first.",
        "with cells of 1/8 of the map it takes less time than with cells of 1/32",
        Test::Below(|_, rows| Some([rows[9].time_us, rows[10].time_us])),
    ),
    (
        "two-phased-flies-longest",
        "The more an area is restricted the longer the path: two-phased flies the longest of the three (the paper's numbers say the shortest).",
        "the mean of the longer of the other two, taken failure by failure, is below its mean length",
        Test::Below(|_, rows| {
            let lengths_m = [0, 1, 2].map(|place: usize| rows[place].remaining_m);
            Some([lengths_m[1].max(lengths_m[2]), lengths_m[0]])
        }),
    ),
    (
        "local-loses-with-size",
        "Local search loses against global as the network grows.",
        "the time of Dijkstra A → B over that of Dijkstra A → destination is higher on the largest network than on the smallest",
        Test::Rises(|_, rows| Some([rows[5].time_us, rows[6].time_us])),
    ),
    (
        "skipping-pays",
        "Skipping stages pays.",
        "where a stage is skipped the mean time is below that of searching every stage",
        Test::Below(|_, rows| {
            let is_skipped = !rows[11].skipped.is_empty();
            is_skipped.then_some([rows[11].time_us, rows[4].time_us])
        }),
    ),
    (
        "textbook-order",
        "A* takes the least time, then Dijkstra, and Bellman-Ford the most.",
        "of A → B: the higher of A* over Dijkstra and Dijkstra over Bellman-Ford, taken failure by failure, has a mean below 1",
        Test::Below(|_, rows| {
            let [dijkstra, astar, bellman_ford] = [5, 7, 8].map(|place: usize| rows[place].time_us);
            Some([(astar / dijkstra).max(dijkstra / bellman_ford), 1.0])
        }),
    ),
    (
        "polygons-change-nothing",
        "Polygons cost time and change no path.",
        "with polygons and without every length is the same",
        Test::Same(|_, rows| Some([rows[0].remaining_m, rows[3].remaining_m])),
    ),
    (
        "density-searches-more",
        "Cell density searches more of the network than two-phased.",
        "two-phased's mean number of nodes is below that of cell density",
        Test::Below(|_, rows| Some([rows[0].area_nodes as f64, rows[1].area_nodes as f64])),
    ),
    (
        "compression-grows-with-size",
        "The time that restricting the search saves grows with the network.",
        "two-phased's time over that of Dijkstra A → B is lower on the largest network than on the smallest",
        Test::Falls(|_, rows| Some([rows[0].time_us, rows[5].time_us])),
    ),
];

/// The means of both figures on a network, and whether they are the same throughout.
#[derive(Clone, Copy)]
struct Means {
    one: f64,
    other: f64,
    is_same: bool,
}

/// Where a network stands: where it comes from, its variables but for the size, its number, its size.
type Place = (String, String, usize, usize);

/// All sentences, judged on the networks of a run.
pub(super) fn sentences(cells: &Cells) -> Vec<Sentence> {
    let one = |&(id, text, how, test): &Stated| {
        let counts = counts(cells, test);
        Sentence {
            id: id.to_owned(),
            text: text.to_owned(),
            test: how.to_owned(),
            holds: holds(&counts),
            counts,
        }
    };
    STATED.iter().map(one).collect()
}

fn holds(counts: &[Count]) -> Verdict {
    let holds: usize = counts.iter().map(|count| count.holds).sum();
    let fails: usize = counts.iter().map(|count| count.fails).sum();
    match holds as f64 / (holds + fails) as f64 {
        share if share.is_nan() => Verdict::NotMeasured,
        share if share >= MOST => Verdict::Reproduced,
        share if share <= 1.0 - MOST => Verdict::Contradicted,
        _ => Verdict::Depends,
    }
}

fn counts(cells: &Cells, test: Test) -> Vec<Count> {
    let (Test::Below(figures) | Test::Rises(figures) | Test::Falls(figures) | Test::Same(figures)) =
        test;
    let mut means: BTreeMap<Place, Means> = BTreeMap::new();
    for cell in &cells.0 {
        means.extend(of_networks(cell, figures));
    }
    let verdicts: Vec<(String, Option<bool>)> = match test {
        Test::Below(_) => {
            let told =
                |means: &Means| (means.one != means.other).then_some(means.one < means.other);
            means
                .iter()
                .map(|(place, means)| (place.0.clone(), told(means)))
                .collect()
        }
        Test::Same(_) => {
            let told = |means: &Means| Some(means.is_same);
            means
                .iter()
                .map(|(place, means)| (place.0.clone(), told(means)))
                .collect()
        }
        Test::Rises(_) => trends(&means, false),
        Test::Falls(_) => trends(&means, true),
    };
    let mut counts: Vec<Count> = Vec::new();
    for (networks, holds) in verdicts {
        let place = counts.iter().position(|count| count.networks == networks);
        let place = place.unwrap_or_else(|| {
            counts.push(Count {
                networks,
                holds: 0,
                fails: 0,
                of: 0,
            });
            counts.len() - 1
        });
        counts[place].holds += usize::from(holds == Some(true));
        counts[place].fails += usize::from(holds == Some(false));
        counts[place].of += 1;
    }
    counts
}

/// From the smallest to the largest network of the same variables and number.
fn trends(means: &BTreeMap<Place, Means>, falls: bool) -> Vec<(String, Option<bool>)> {
    let all: Vec<(&Place, &Means)> = means.iter().collect();
    let families = all
        .chunk_by(|(one, _), (other, _)| (&one.0, &one.1, one.2) == (&other.0, &other.1, other.2));
    families
        .filter(|family| family.len() > 1)
        .map(|family| {
            let ratio = |(_, means): &(&Place, &Means)| means.one / means.other;
            let (first, last) = (ratio(&family[0]), ratio(&family[family.len() - 1]));
            (family[0].0.0.clone(), Some((last > first) != falls))
        })
        .collect()
}

fn of_networks(cell: &Cell, figures: Figures) -> Vec<(Place, Means)> {
    let rows = by_network(&[cell], OF, |failure, rows| {
        Some((failure.network, figures(failure, rows)?))
    });
    let place = |number: usize| match cell.plan.variables() {
        None => (cell.plan.name.clone(), String::new(), 0, 0),
        Some(network) => {
            let variable = |sweep| cell.plan.variable(sweep).unwrap_or_default();
            let others = [Sweep::Neighbours, Sweep::Reach].map(variable);
            let others = format!("{others:?}");
            (
                name_of(network.joining).to_owned(),
                others,
                number,
                network.nodes,
            )
        }
    };
    rows.iter()
        .filter_map(|rows| {
            let mean =
                |at: usize| rows.iter().map(|(_, pair)| pair[at]).sum::<f64>() / rows.len() as f64;
            let means = Means {
                one: mean(0),
                other: mean(1),
                is_same: rows.iter().all(|(_, pair)| pair[0] == pair[1]),
            };
            Some((place(rows.first()?.0), means))
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sentence_is_contradicted_where_the_opposite_is_true_on_most_networks() {
        let of = |holds_on: usize, fails: usize| {
            holds(&[Count {
                networks: "random".to_owned(),
                holds: holds_on,
                fails,
                of: 100,
            }])
        };
        assert_eq!(of(0, 0), Verdict::NotMeasured);
        assert_eq!(of(75, 25), Verdict::Reproduced);
        assert_eq!(of(50, 50), Verdict::Depends);
        assert_eq!(of(3, 9), Verdict::Contradicted);
    }
}

//! Which method is faster than which, network by network.

use super::super::cells::{Cell, Cells, by_network, on_paths};
use super::super::design::name_of;
use super::super::method::{Approach, Inside, Method, Span};
use super::super::record::Note;
use super::super::statistics::{Resampler, mean, median};
use super::super::text::{number, time};
use super::table;

const STRATEGIES: [Approach; 3] = [Approach::TwoPhased, Approach::CellDensity, Approach::Radius];
const DIJKSTRA: Approach = Approach::Dijkstra { full_tree: false };
/// A*, Dijkstra, `exact` with its table and without, then every strategy with Dijkstra and with A* inside.
const METHODS: usize = 10;

fn methods() -> [Method; METHODS] {
    let inside = |approach, inside| Method {
        inside,
        ..Method::of_paper(approach)
    };
    let [two, cells, radius] = STRATEGIES;
    [
        Method::baseline(Approach::AStar, Span::Leg),
        Method::baseline(DIJKSTRA, Span::Leg),
        Method::exact(true),
        Method::exact(false),
        inside(two, Inside::Dijkstra),
        inside(two, Inside::AStar),
        inside(cells, Inside::Dijkstra),
        inside(cells, Inside::AStar),
        inside(radius, Inside::Dijkstra),
        inside(radius, Inside::AStar),
    ]
}

/// The median times of a network: A*, Dijkstra, `exact` warm and cold, and each strategy at its best.
struct Times {
    networks: String,
    textbook: [f64; 4],
    strategies: [f64; 3],
}

fn times(cells: &Cells) -> Vec<Times> {
    let mut all = Vec::new();
    for cell in &cells.0 {
        let networks = match cell.plan.variables() {
            Some(network) => name_of(network.joining).to_owned(),
            None => cell.plan.name.clone(),
        };
        for rows in by_network(&[cell], methods(), |_, rows| {
            Some(rows.map(|row| row.time_us))
        }) {
            if rows.is_empty() {
                continue;
            }
            let medians: [f64; METHODS] = std::array::from_fn(|method| {
                median(&mut rows.iter().map(|row| row[method]).collect::<Vec<f64>>())
            });
            all.push(Times {
                networks: networks.clone(),
                textbook: std::array::from_fn(|method| medians[method]),
                strategies: [4, 6, 8].map(|method| medians[method].min(medians[method + 1])),
            });
        }
    }
    all
}

/// By where networks come from: on how many each comparison is won.
fn wins<const COLUMNS: usize>(
    times: &[Times],
    won: impl Fn(&Times) -> [bool; COLUMNS],
) -> (Vec<Vec<String>>, [usize; COLUMNS]) {
    let mut totals = [0; COLUMNS];
    let mut rows = Vec::new();
    for group in times.chunk_by(|one, other| one.networks == other.networks) {
        let mut counts = [0; COLUMNS];
        for times in group {
            for (count, is_won) in counts.iter_mut().zip(won(times)) {
                *count += usize::from(is_won);
            }
        }
        let mut row = vec![group[0].networks.clone(), group.len().to_string()];
        row.extend(counts.map(|count| count.to_string()));
        rows.push(row);
        for (total, count) in totals.iter_mut().zip(counts) {
            *total += count;
        }
    }
    (rows, totals)
}

/// Plain A* against every strategy, and every strategy against Dijkstra.
pub(super) fn headline(cells: &Cells) -> Note {
    let times = times(cells);
    let (rows, [astar, two, density, radius]) = wins(&times, |times| {
        let [astar, dijkstra, ..] = times.textbook;
        let [two, density, radius] = times.strategies.map(|strategy_us| strategy_us < dijkstra);
        let is_first = times
            .strategies
            .iter()
            .all(|&strategy_us| astar < strategy_us);
        [is_first, two, density, radius]
    });
    let all = times.len();
    Note {
        title: "Plain A* beats the strategies".to_owned(),
        text: format!(
            "Plain A* from A to B over the whole network has a lower median time than every strategy of the paper, each with what suits it best inside, on {astar} of {all} networks. Restricting the area pays against Dijkstra alone, from A to B with early exit: for two-phased on {two} of {all}, for radius on {radius}, for cell density on {density}."
        ),
        table: table(
            &[
                "networks",
                "count",
                "A* beats every strategy",
                "two-phased beats Dijkstra",
                "cell density beats Dijkstra",
                "radius beats Dijkstra",
            ],
            rows,
        ),
    }
}

/// `exact` for the whole route against the strategies, which solve A to B, and what their routes cost.
pub(super) fn exact(cells: &Cells, seed: u64) -> Note {
    let times = times(cells);
    let (rows, [warm, cold]) = wins(&times, |times| {
        let [_, _, warm, cold] = times.textbook;
        [warm, cold].map(|exact_us| {
            times
                .strategies
                .iter()
                .all(|&strategy_us| exact_us < strategy_us)
        })
    });
    let everywhere: Vec<&Cell> = cells.0.iter().collect();
    let longer = STRATEGIES.map(|approach| {
        let method = [Method::of_paper(approach)];
        let values = on_paths(&everywhere, method, |failure, [row]| {
            1e2 * (row.remaining_m / failure.optimum_m - 1.0)
        });
        let purpose = format!("longer {}", approach.name());
        let estimate = Resampler::new(seed, &purpose).of_mean(&values);
        estimate.map_or_else(
            || "-".to_owned(),
            |percent| format!("{} ({} % longer)", approach.name(), number(percent.value)),
        )
    });
    let all = times.len();
    Note {
        title: "Exact for the whole route".to_owned(),
        text: format!(
            "With its table exact has a lower median time for the whole route than every strategy has for A to B on {warm} of {all} networks, without its table on {cold}. The strategies keep the rest of the plan: {}.",
            longer.join(", ")
        ),
        table: table(
            &[
                "networks",
                "count",
                "exact, warm, beats them",
                "exact, cold, beats them",
            ],
            rows,
        ),
    }
}

/// After how many queries to a destination the time to make its table has been saved.
pub(super) fn tables_that_pay(cells: &Cells) -> Note {
    let rivals = [
        Method::exact(false),
        Method::of_paper(STRATEGIES[0]),
        Method::of_paper(STRATEGIES[2]),
        Method::baseline(Approach::AStar, Span::Leg),
    ];
    let mut rows = Vec::new();
    let mut all_queries = Vec::new();
    for (name, group) in cells.by_size() {
        let of = |method| {
            on_paths(&group, [method], |failure, [row]| {
                (row.time_us, failure.table_us)
            })
            .concat()
        };
        let warm = of(Method::exact(true));
        if warm.is_empty() {
            continue;
        }
        let mean_of = |rows: &[(f64, f64)], figure: fn(&(f64, f64)) -> f64| {
            mean(&rows.iter().map(figure).collect::<Vec<f64>>())
        };
        let table_us = mean_of(&warm, |row| row.1);
        let mut row = vec![name, time(table_us)];
        for (number_of, rival) in rivals.into_iter().enumerate() {
            let saved_us = mean_of(&of(rival), |row| row.0) - mean_of(&warm, |row| row.0);
            row.push(match saved_us > 0.0 {
                true => number(table_us / saved_us),
                false => "never".to_owned(),
            });
            if number_of == 1 && saved_us > 0.0 {
                all_queries.push(table_us / saved_us);
            }
        }
        rows.push(row);
    }
    all_queries.sort_by(f64::total_cmp);
    let against = match (all_queries.first(), all_queries.last()) {
        (Some(&least), Some(&most)) => format!(
            "Against two-phased the table of exact pays after {} to {} queries to a destination, by generator and size.",
            number(least),
            number(most)
        ),
        _ if rows.is_empty() => "When a table of exact pays was not measured.".to_owned(),
        _ => "Against two-phased the table of exact never pays.".to_owned(),
    };
    Note {
        title: "When a table pays".to_owned(),
        text: format!(
            "{against} It is the mean time to make the table over the mean time that it saves on each query; A* solves A to B alone."
        ),
        table: table(
            &[
                "networks",
                "table made in",
                "exact, cold",
                "two-phased",
                "radius",
                "A*, A to B",
            ],
            rows,
        ),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_table_that_was_not_measured_is_not_said_never_to_pay() {
        let note = tables_that_pay(&Cells::default());
        assert!(note.text.contains("was not measured"), "{}", note.text);
    }
}

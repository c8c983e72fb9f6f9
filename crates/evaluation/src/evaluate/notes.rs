//! What is told beside plots and claims: where a heuristic wins, when a table pays, what was left out.

use super::cells::{Cell, Cells};
use super::figures::break_even;
use super::method::{Approach, Inside, Method, Span};
use super::record::{Claim, Note, Table, Verdict};
use super::skipped::cases;
use super::statistics::{Average, Resampler, median};
use super::text::{counted, number, time};

const STRATEGIES: [Approach; 4] = [
    Approach::TwoPhased,
    Approach::TwoPhasedPolygons,
    Approach::CellDensity,
    Approach::Radius,
];

/// All notes of a run. The seed is that of the intervals.
pub fn notes(cells: &Cells, claims: &[Claim], seed: u64) -> Vec<Note> {
    let mut notes = vec![
        optimality(cells),
        heuristics_that_win(cells, seed),
        whole_route_times(cells),
        tables_that_pay(cells, seed),
        without_detour(cells),
        skipping(cells),
        polygons(cells),
    ];
    if !claims.is_empty() {
        notes.insert(0, claims_that_fail(claims));
    }
    notes
}

fn table(header: &[&str], rows: Vec<Vec<String>>) -> Option<Table> {
    (!rows.is_empty()).then(|| Table {
        header: header.iter().map(|&title| title.to_owned()).collect(),
        rows,
    })
}

fn claims_that_fail(claims: &[Claim]) -> Note {
    let of = |verdict: Verdict| claims.iter().filter(move |claim| claim.holds == verdict);
    let failed = of(Verdict::DirectionOnly).chain(of(Verdict::NotReproduced));
    let rows: Vec<Vec<String>> = failed
        .map(|claim| {
            let closest = claim.closest.and_then(|place| claim.readings.get(place));
            vec![
                claim.id.clone(),
                claim.text.clone(),
                number(claim.paper),
                closest.map_or_else(|| "-".to_owned(), |reading| number(reading.value)),
                closest.map_or_else(|| "-".to_owned(), |reading| reading.name.clone()),
            ]
        })
        .collect();
    Note {
        title: "Claims that hold under no reading".to_owned(),
        text: format!(
            "Of {} numbers in the paper, {} are reproduced under some reading, {} in direction alone, {} not at all, and {} were not measured in this run.",
            claims.len(),
            of(Verdict::Reproduced).count(),
            of(Verdict::DirectionOnly).count(),
            of(Verdict::NotReproduced).count(),
            of(Verdict::NotMeasured).count(),
        ),
        table: table(
            &[
                "claim",
                "paper",
                "its value",
                "closest value",
                "closest reading",
            ],
            rows,
        ),
    }
}

fn optimality(cells: &Cells) -> Note {
    let mut failures = 0;
    let mut longer = 0;
    for cell in &cells.0 {
        for warm in [true, false] {
            let overheads = cell.values(Method::exact(warm), |failure, row| {
                row.remaining_m / failure.optimum_m - 1.0
            });
            failures += overheads.len();
            longer += overheads.iter().filter(|&&overhead| overhead > 0.0).count();
        }
    }
    let checked: usize = cells
        .0
        .iter()
        .map(|cell| cell.figures.facts.distances_checked)
        .sum();
    Note {
        title: "Exact is exact".to_owned(),
        text: format!(
            "Of {failures} answers of exact, with and without its table, {longer} are longer than the shortest route. {checked} distances of exact, Dijkstra, A* and Bellman-Ford were compared with those of petgraph's Dijkstra, on a graph read from the network's text independently of the engine, and all are equal; a run in which one is not stops with an error.",
        ),
        table: None,
    }
}

/// The methods that could be faster than `exact`, each at its best.
fn rivals() -> Vec<Method> {
    let mut rivals = Vec::new();
    for approach in STRATEGIES {
        rivals.extend([Inside::AStar, Inside::Dijkstra].map(|inside| Method {
            inside,
            ..Method::of_paper(approach)
        }));
    }
    for approach in [Approach::AStar, Approach::Dijkstra { full_tree: false }] {
        rivals.extend([Span::Leg, Span::Route].map(|span| Method::baseline(approach, span)));
    }
    rivals
}

fn heuristics_that_win(cells: &Cells, seed: u64) -> Note {
    let mut rows = Vec::new();
    let (mut compared, mut by_strategies) = (0, 0);
    // Without its table exact is A* on the whole route: between the two there is nothing to win.
    let is_itself = |method: Method, exact: Method| {
        exact == Method::exact(false) && method == Method::baseline(Approach::AStar, Span::Route)
    };
    for cell in &cells.0 {
        for method in rivals() {
            for exact in [Method::exact(true), Method::exact(false)] {
                if is_itself(method, exact) {
                    continue;
                }
                compared += 1;
                if let Some(row) = win(cell, method, exact, seed) {
                    by_strategies += usize::from(method.approach.has_areas());
                    rows.push(row);
                }
            }
        }
    }
    let by_textbook = rows.len() - by_strategies;
    Note {
        title: "Where a heuristic wins".to_owned(),
        text: format!(
            "Of {compared} comparisons of a median time with that of exact for the whole route, with its table (warm) or without (cold), the strategies of the paper win {by_strategies}, and Dijkstra and A* win {by_textbook}. Every one is listed. A method that solves A → B alone keeps the rest of the plan, and its route can be longer. The ratio is the median over failures of the time of exact over that of the method."
        ),
        table: table(
            &[
                "network",
                "method",
                "solves",
                "against",
                "its median",
                "median of exact",
                "exact / method",
                "its route is longer by",
            ],
            rows,
        ),
    }
}

/// A row where a method's median time is below that of `exact`.
fn win(cell: &Cell, method: Method, exact: Method, seed: u64) -> Option<Vec<String>> {
    let (mut own_us, mut exact_us) = (cell.times_us(method), cell.times_us(exact));
    if own_us.is_empty() || exact_us.is_empty() {
        return None;
    }
    let (own_us, exact_us) = (median(&mut own_us), median(&mut exact_us));
    if own_us >= exact_us {
        return None;
    }
    let name = &cell.plan.name;
    let purpose = format!("win {name} {} {}", method.id(), exact.id());
    let pairs = cell.time_pairs(exact, method);
    let ratio = Resampler::new(seed, &purpose).of_pairs(&pairs, Average::MedianOfRatios)?;
    let overheads = cell.values(method, |failure, row| {
        1e2 * (row.remaining_m / failure.optimum_m - 1.0)
    });
    let overhead = overheads.iter().sum::<f64>() / overheads.len() as f64;
    let inside = match (method.approach.has_areas(), method.inside) {
        (false, _) => "",
        (true, Inside::AStar) => ", A* inside",
        (true, Inside::Dijkstra) => ", Dijkstra inside",
    };
    let solves = match method.span {
        Span::Leg => "A → B",
        Span::Route => "A → destination",
    };
    Some(vec![
        name.clone(),
        format!("{}{inside}", method.approach.name()),
        solves.to_owned(),
        exact.approach.name().to_owned(),
        time(own_us),
        time(exact_us),
        format!(
            "{} ({} to {})",
            number(ratio.value),
            number(ratio.low),
            number(ratio.high)
        ),
        format!("{} %", number(overhead)),
    ])
}

fn whole_route_times(cells: &Cells) -> Note {
    let mut methods = vec![Method::exact(true), Method::exact(false)];
    methods.extend(STRATEGIES.map(Method::of_paper));
    methods.push(Method::baseline(Approach::AStar, Span::Route));
    methods.push(Method::baseline(
        Approach::Dijkstra { full_tree: false },
        Span::Route,
    ));
    let mut header = vec!["network"];
    header.extend(methods.iter().map(|method| method.approach.name()));
    let rows = cells.0.iter().map(|cell| {
        let medians = methods.iter().map(|&method| {
            let mut times_us = cell.times_us(method);
            match times_us.is_empty() {
                true => "-".to_owned(),
                false => time(median(&mut times_us)),
            }
        });
        std::iter::once(cell.plan.name.clone())
            .chain(medians)
            .collect()
    });
    Note {
        title: "Median time to a whole new route".to_owned(),
        text: "Every method ends with the whole route to the destination: exact, A* and Dijkstra search it, the strategies of the paper search from A to B with A* inside and keep the rest of the plan.".to_owned(),
        table: table(&header, rows.collect()),
    }
}

fn tables_that_pay(cells: &Cells, seed: u64) -> Note {
    let mut rivals = vec![Method::exact(false)];
    rivals.extend(STRATEGIES.map(Method::of_paper));
    rivals.push(Method::baseline(
        Approach::Dijkstra { full_tree: false },
        Span::Route,
    ));
    let mut header = vec!["network", "table made in"];
    header.extend(rivals.iter().map(|rival| rival.approach.name()));
    let mut rows = Vec::new();
    for cell in &cells.0 {
        let failures = cell.figures.failures.iter();
        let mut tables_us: Vec<f64> = failures.map(|failure| failure.table_us).collect();
        if tables_us.is_empty() {
            continue;
        }
        let mut row = vec![cell.plan.name.clone(), time(median(&mut tables_us))];
        for &rival in &rivals {
            let purpose = format!("break-even note {} {}", cell.plan.name, rival.id());
            let queries = break_even(cell, rival, &mut Resampler::new(seed, &purpose));
            row.push(queries.map_or_else(
                || "never".to_owned(),
                |queries| {
                    format!(
                        "{} ({} to {})",
                        number(queries.value),
                        number(queries.low),
                        number(queries.high)
                    )
                },
            ));
        }
        rows.push(row);
    }
    Note {
        title: "When a table pays".to_owned(),
        text: "After how many queries to a destination the time to make its table has been saved, beside exact without a table and beside each other method that needs none.".to_owned(),
        table: table(&header, rows),
    }
}

fn without_detour(cells: &Cells) -> Note {
    let facts = || cells.0.iter().map(|cell| &cell.figures.facts);
    let rows = facts()
        .filter(|facts| facts.without_detour > 0)
        .map(|facts| {
            vec![
                facts.name.clone(),
                facts.failures.to_string(),
                facts.without_detour.to_string(),
                format!(
                    "{} %",
                    number(1e2 * facts.without_detour as f64 / facts.failures as f64)
                ),
            ]
        });
    let drawn: usize = facts().map(|facts| facts.failures).sum();
    let lost: usize = facts().map(|facts| facts.without_detour).sum();
    Note {
        title: "Pairs without a detour".to_owned(),
        text: format!(
            "Of {} drawn, {lost} leave no way to the destination. They are counted here, take no part in any other figure, and no others are drawn in their place.",
            counted(drawn, "failure", "failures")
        ),
        table: table(
            &["network", "failures drawn", "without a detour", "share"],
            rows.collect(),
        ),
    }
}

fn skipping(cells: &Cells) -> Note {
    let mut rows = Vec::new();
    let (mut all, mut all_effective, mut saved) = (0, 0, 0.0);
    for cell in &cells.0 {
        let cases = cases(cell);
        if cases.is_empty() {
            continue;
        }
        let effective = cases.iter().filter(|case| case.is_effective).count();
        let mean = |figure: &dyn Fn(&super::skipped::Case) -> f64| {
            cases.iter().map(figure).sum::<f64>() / cases.len() as f64
        };
        all += cases.len();
        all_effective += effective;
        saved += cases
            .iter()
            .map(|case| case.without.searches - case.with_skipping.searches)
            .sum::<f64>();
        rows.push(vec![
            cell.plan.name.clone(),
            cases.len().to_string(),
            effective.to_string(),
            (cases.len() - effective).to_string(),
            number(mean(&|case| case.with_skipping.searches)),
            number(mean(&|case| case.without.searches)),
        ]);
    }
    Note {
        title: "Skipped stages".to_owned(),
        text: format!(
            "A stage was skipped in {}; in {all_effective} of them no skipped stage holds a path. Skipping saved {} searches in all.",
            counted(all, "failure", "failures"),
            number(saved)
        ),
        table: table(
            &[
                "network",
                "failures with a skipped stage",
                "effective",
                "ineffective",
                "searches with skipping",
                "searches without",
            ],
            rows,
        ),
    }
}

fn polygons(cells: &Cells) -> Note {
    let (mut compared, mut other_length, mut other_area) = (0, 0, 0);
    for cell in &cells.0 {
        let rows = |approach| cell.figures.rows.get(&Method::of_paper(approach));
        let (Some(frame), Some(polygons)) =
            (rows(Approach::TwoPhased), rows(Approach::TwoPhasedPolygons))
        else {
            continue;
        };
        for (one, other) in frame.iter().zip(polygons) {
            compared += 1;
            other_length += usize::from(one.recomposed_m != other.recomposed_m);
            let area = |row: &super::rows::Row| (row.stage.clone(), row.area_nodes, row.searches);
            other_area += usize::from(area(one) != area(other));
        }
    }
    Note {
        title: "With polygons and without".to_owned(),
        text: format!(
            "Of {} answered both ways, {other_area} differ in stage, searches or nodes of the area and {other_length} in length. Only nodes within a millionth of a metre of a boundary can be judged otherwise.",
            counted(compared, "failure", "failures")
        ),
        table: None,
    }
}

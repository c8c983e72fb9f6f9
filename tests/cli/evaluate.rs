//! `skyway evaluate`: what a run leaves, and that runs do not mix.

use crate::binary::{Run, Workspace, skyway};
use serde_json::Value;

/// The numbers in the text of the paper.
const CLAIMS: usize = 21;

fn evaluate(desk: &Workspace, more: &[&str]) -> Run {
    let out = desk.path("run");
    let arguments = ["evaluate", "--quick", "--failures", "8", "--out", &out];
    skyway(&[&arguments[..], more].concat())
}

fn rows(desk: &Workspace) -> Vec<(String, String)> {
    let names = desk.list("run/rows").into_iter();
    names
        .map(|name| {
            let text = desk.read(&format!("run/rows/{name}"));
            (name, text)
        })
        .collect()
}

fn list<'a>(value: &'a Value, name: &str) -> &'a Vec<Value> {
    value[name].as_array().expect("a list")
}

#[test]
fn a_run_leaves_rows_plots_and_a_report_and_is_not_computed_twice() {
    let desk = Workspace::new();
    let first = evaluate(&desk, &[]).exits(0);
    assert!(first.stdout.contains("radius-time"), "{}", first.stdout);
    let expected = [
        "figures",
        "report.html",
        "rows",
        "run.json",
        "settings.json",
        "summary.csv",
    ];
    assert_eq!(desk.list("run"), expected);

    let run: Value = serde_json::from_str(&desk.read("run/run.json")).expect("JSON");
    check_claims(&run);
    check_figures(&run, &desk);
    check_rows(&run, &desk);
    assert!(desk.read("run/report.html").contains("<html"));

    let before = rows(&desk);
    let second = evaluate(&desk, &[]).exits(0);
    assert!(
        second
            .stderr
            .contains("6 of 6 networks had been measured before"),
        "{second:?}"
    );
    assert!(rows(&desk) == before, "rows were computed twice");
    assert_eq!(second.stdout, first.stdout);

    let other = evaluate(&desk, &["--seed", "2"]).exits(1);
    assert!(other.stderr.contains("its seed is 1, not 2"), "{other:?}");
    assert!(other.stderr.contains("--fresh"), "{other:?}");
    assert!(rows(&desk) == before, "rows of another run were touched");
}

fn check_claims(run: &Value) {
    let claims = list(run, "claims");
    assert_eq!(claims.len(), CLAIMS);
    for claim in claims {
        let readings = list(claim, "readings");
        // So few failures need not have one in which a skipped stage holds a path.
        if readings.is_empty() {
            assert_eq!(claim["section"], "Stage skipping", "{claim}");
            assert_eq!(claim["holds"], "not_measured", "{claim}");
            continue;
        }
        let closest = claim["closest"].as_u64().expect("a place") as usize;
        let paper = claim["paper"].as_f64().expect("a number");
        let distance =
            |reading: &Value| (reading["value"].as_f64().expect("a number") - paper).abs();
        let best = readings.iter().map(distance).fold(f64::INFINITY, f64::min);
        assert_eq!(distance(&readings[closest]), best, "{claim}");
        for reading in readings {
            let [low, value, high] =
                ["low", "value", "high"].map(|name| reading[name].as_f64().expect("a number"));
            assert!(low <= high && value.is_finite(), "{reading}");
        }
        assert_ne!(claim["holds"], "not_measured", "{claim}");
    }
}

fn check_figures(run: &Value, desk: &Workspace) {
    let figures = list(run, "figures");
    let files = desk.list("run/figures");
    assert_eq!(files.len(), 2 * figures.len(), "{files:?}");
    for figure in figures {
        let slug = figure["slug"].as_str().expect("a name");
        assert!(files.contains(&format!("{slug}.csv")), "{slug}");
        assert!(files.contains(&format!("{slug}.svg")), "{slug}");
        let series = list(figure, "series");
        let shows_exact = series.iter().any(|series| {
            let name = series["name"].as_str().expect("a name");
            name.contains("exact")
        });
        assert!(shows_exact, "{slug}");
    }
}

/// On every failure of every network, exact is as long as the shortest route.
fn check_rows(run: &Value, desk: &Workspace) {
    let networks = list(&run["provenance"], "networks");
    assert_eq!(networks.len(), 6);
    for network in networks {
        let name = network["name"].as_str().expect("a name");
        let count = |field: &str| network[field].as_u64().expect("a count") as usize;
        let measured = count("failures") - count("without_detour");
        assert_eq!(count("failures"), 8);
        assert_eq!(count("distances_checked"), 10 * measured, "{name}");
        let failures = table(&desk.read(&format!("run/rows/{name}.failures.csv")));
        assert_eq!(failures.len(), measured, "{name}");
        let rows = table(&desk.read(&format!("run/rows/{name}.csv")));
        let exact: Vec<&Vec<(String, String)>> = rows
            .iter()
            .filter(|row| field(row, "method").starts_with("exact"))
            .collect();
        assert_eq!(exact.len(), 2 * measured, "{name}");
        for row in exact {
            let of_row = |failure: &&Vec<(String, String)>| {
                field(failure, "failure") == field(row, "failure")
            };
            let failure = failures.iter().find(of_row).expect("its failure");
            assert_eq!(
                field(row, "remaining_m"),
                field(failure, "optimum_m"),
                "{name}"
            );
        }
    }
}

fn field<'a>(row: &'a [(String, String)], name: &str) -> &'a str {
    let found = row.iter().find(|(title, _)| title == name);
    &found.expect("a column").1
}

fn table(text: &str) -> Vec<Vec<(String, String)>> {
    let mut lines = text.lines();
    let titles: Vec<&str> = lines.next().expect("a header").split(',').collect();
    let row = |line: &str| {
        let cells = titles.iter().zip(line.split(','));
        cells
            .map(|(title, cell)| ((*title).to_owned(), cell.to_owned()))
            .collect()
    };
    lines.map(row).collect()
}

#[test]
fn one_plot_computes_its_own_networks_alone() {
    let desk = Workspace::new();
    let run = evaluate(&desk, &["--figure", "17"]).exits(0);
    assert_eq!(run.stdout, "");
    assert_eq!(
        desk.list("run/figures"),
        ["sydney-time.csv", "sydney-time.svg"]
    );
    assert_eq!(desk.list("run/rows").len(), 3);
    let refused = evaluate(&desk, &["--figure", "fig-17"]).exits(2);
    assert!(refused.stderr.contains("time-by-size"), "{refused:?}");
}

#[test]
fn a_network_of_ones_own_is_evaluated_alone() {
    let desk = Workspace::new();
    let town = desk.path("town.geojson");
    skyway(&[
        "network", "generate", "--nodes", "60", "--reach", "0.4", "-o", &town,
    ])
    .exits(0);
    evaluate(&desk, &["--network", &town]).exits(0);
    let expected = [
        "network-town.csv",
        "network-town.failures.csv",
        "network-town.json",
    ];
    assert_eq!(desk.list("run/rows"), expected);
    let run: Value = serde_json::from_str(&desk.read("run/run.json")).expect("JSON");
    let of_sydney = list(&run, "claims")
        .iter()
        .filter(|claim| claim["section"] == "Sydney CBD");
    assert!(of_sydney.clone().count() > 0);
    for claim in of_sydney {
        assert_eq!(claim["holds"], "not_measured", "{claim}");
    }
    evaluate(&desk, &[]).exits(1);
    evaluate(&desk, &["--fresh"]).exits(0);
    assert!(!desk.list("run/rows").contains(&expected[0].to_owned()));
}

//! `skyway evaluate`: what a run leaves, and that runs do not mix.

use crate::binary::{Run, Workspace, skyway};
use serde_json::Value;

/// The numbers in the text of the paper.
const CLAIMS: usize = 21;
/// Its sentences without a number.
const SENTENCES: usize = 10;
/// Two sizes, two numbers of neighbours and three generators, and Sydney CBD.
const CELLS: usize = 13;

fn evaluate(desk: &Workspace, more: &[&str]) -> Run {
    let out = desk.path("run");
    let arguments = ["evaluate", "--quick", "--failures", "1", "--out", &out];
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
        "findings.md",
        "report.html",
        "rows",
        "run.json",
        "settings.json",
        "summary.csv",
    ];
    assert_eq!(desk.list("run"), expected);

    let run: Value = serde_json::from_str(&desk.read("run/run.json")).expect("JSON");
    check_claims(&run);
    insta::assert_snapshot!("quick", without_times(&desk.read("run/summary.csv")));
    check_figures(&run, &desk);
    check_rows(&run, &desk);
    assert!(desk.read("run/report.html").contains("<html"));

    let before = rows(&desk);
    let second = evaluate(&desk, &[]).exits(0);
    assert!(
        second
            .stderr
            .contains("13 of 13 cells had been measured before"),
        "{second:?}"
    );
    assert!(rows(&desk) == before, "rows were computed twice");
    assert_eq!(second.stdout, first.stdout);

    let other = evaluate(&desk, &["--seed", "2"]).exits(1);
    assert!(other.stderr.contains("its seed is 1, not 2"), "{other:?}");
    assert!(other.stderr.contains("--fresh"), "{other:?}");
    assert!(rows(&desk) == before, "rows of another run were touched");
}

/// The summary without its columns of times, which differ from run to run.
fn without_times(summary: &str) -> String {
    let titles: Vec<&str> = summary
        .lines()
        .next()
        .expect("a header")
        .split(',')
        .collect();
    let kept = |line: &str| {
        let cells = titles.iter().zip(line.split(','));
        let cells = cells.filter(|(title, _)| !title.ends_with("_us"));
        cells.map(|(_, cell)| cell).collect::<Vec<&str>>().join(",")
    };
    summary
        .lines()
        .map(kept)
        .collect::<Vec<String>>()
        .join("\n")
}

fn check_claims(run: &Value) {
    let claims = list(run, "claims");
    assert_eq!(claims.len(), CLAIMS);
    let mut met = 0;
    for claim in claims {
        let count = |name: &str| claim[name].as_u64().expect("a count");
        // So few failures need not have one in which a skipped stage holds a path.
        if count("readings") == 0 {
            assert_eq!(claim["section"], "Stage skipping", "{claim}");
            assert_eq!(claim["holds"], "not_measured", "{claim}");
            continue;
        }
        let value = |reading: &Value| reading["value"].as_f64().expect("a number");
        let paper = claim["paper"].as_f64().expect("a number");
        let is_met = |reading: &Value| (value(reading) - paper).abs() <= 0.1 * paper;
        let [least, most] = [0, 1].map(|end| claim["range"][end].as_f64().expect("a number"));
        for reading in [&claim["joint"], &claim["closest"], &claim["exact"]] {
            if let Some(value) = reading["value"].as_f64() {
                let [low, high] = ["low", "high"].map(|name| reading[name].as_f64());
                assert!(low <= high && value.is_finite(), "{reading}");
            }
        }
        assert!(
            (least..=most).contains(&value(&claim["closest"])),
            "{claim}"
        );
        assert_eq!(count("met") > 0, is_met(&claim["closest"]), "{claim}");
        let is_joint = !claim["joint"].is_null() && is_met(&claim["joint"]);
        met += u64::from(is_joint);
        let is_reproduced = claim["holds"] == "reproduced";
        assert_eq!(is_reproduced, is_joint && count("met") > 1, "{claim}");
    }
    assert_eq!(run["conventions"]["met"], met);
    let sentences = list(run, "sentences");
    assert_eq!(sentences.len(), SENTENCES);
    let of = |id: &str| sentences.iter().find(|sentence| sentence["id"] == id);
    let polygons = of("polygons-change-nothing").expect("a sentence");
    assert_eq!(polygons["holds"], "reproduced", "{polygons}");
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
        assert!(shows_exact || slug == "overview", "{slug}");
    }
}

/// On every failure of every network, exact is as long as the shortest route.
fn check_rows(run: &Value, desk: &Workspace) {
    let networks = list(&run["provenance"], "networks");
    assert_eq!(networks.len(), CELLS);
    for network in networks {
        let name = network["name"].as_str().expect("a name");
        let count = |field: &str| network[field].as_u64().expect("a count") as usize;
        let measured = count("failures") - count("without_detour");
        assert!(count("failures") >= 6, "{name}");
        assert_eq!(count("distances_checked"), 12 * measured, "{name}");
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
        [
            "sydney-time-same.csv",
            "sydney-time-same.svg",
            "sydney-time.csv",
            "sydney-time.svg"
        ]
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
    let generated = ["--network", &town, "--figure", "time-by-size"];
    let refused = evaluate(&desk, &generated).exits(2);
    assert!(refused.stderr.contains("sydney-time"), "{refused:?}");
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
    let mut settings: Value = serde_json::from_str(&desk.read("run/settings.json")).expect("JSON");
    settings["machine"] = Value::from("an abacus");
    desk.write("run/settings.json", settings.to_string());
    let elsewhere = evaluate(&desk, &["--network", &town]).exits(1);
    let told = "its machine is an abacus, not ";
    assert!(elsewhere.stderr.contains(told), "{elsewhere:?}");
    evaluate(&desk, &["--fresh"]).exits(0);
    assert!(!desk.list("run/rows").contains(&expected[0].to_owned()));
}

/// Others have folders of these names, too.
#[test]
fn what_no_run_left_is_not_removed() {
    let desk = Workspace::new();
    desk.write("report.html", "ours");
    let begin_anew = || {
        let folder = desk.path("");
        skyway(&["evaluate", "--quick", "--fresh", "--out", &folder]).exits(1)
    };
    let refused = begin_anew();
    assert!(refused.stderr.contains("beside report.html"), "{refused:?}");
    desk.write("settings.json", r#"{"colour": "blue", "seed": "1"}"#);
    begin_anew();
    assert_eq!(desk.read("report.html"), "ours");
}

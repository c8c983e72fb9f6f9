//! A report as tables in Markdown.

use crate::report::{PhaseReport, Report, RunReport, ScenarioReport, Summary};
use std::fmt::Write;

/// The objectives of all scenarios, and whether they are met.
pub(crate) fn objectives(report: &Report) -> String {
    let mut text = String::new();
    if report.quick {
        text.push_str("A quick run: its times say nothing.\n\n");
    }
    text.push_str("| scenario | | objective | measured | |\n|---|---|---|---:|---|\n");
    for scenario in &report.scenarios {
        for judgement in &scenario.judgements {
            let met = if judgement.met { "met" } else { "**missed**" };
            // Writing to text does not fail.
            let _ = writeln!(
                text,
                "| {} | {} | {} | {} | {met} |",
                scenario.name,
                scenario.dialect,
                judgement.objective,
                judgement.measured()
            );
        }
    }
    text
}

/// What was measured in every phase: medians over the repetitions.
pub(crate) fn figures(report: &Report) -> String {
    let mut text = String::new();
    for scenario in &report.scenarios {
        let repetitions = scenario.runs.iter().filter(|run| run.server == "edge");
        // Writing to text does not fail.
        let _ = writeln!(
            text,
            "\n#### {}: {}, {} ({} arrivals, seed {}, repetitions: {})\n",
            scenario.name,
            scenario.title,
            scenario.dialect,
            scenario.arrivals,
            scenario.seed,
            repetitions.count()
        );
        text.push_str("| server, phase | offered/s | answered/s | p50 ms | p99 ms | p99.9 ms | max ms | shed | errors | rerouted | server busy | load busy | others busy | sent late, p99 ms |\n");
        text.push_str("|---|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|\n");
        for (server, phase) in lines(scenario) {
            text.push_str(&line(scenario, &server, &phase));
        }
    }
    text
}

/// Every server and phase, in the order in which they come.
fn lines(scenario: &ScenarioReport) -> Vec<(String, String)> {
    let mut lines: Vec<(String, String)> = Vec::new();
    for server in ["edge", "echo"] {
        for run in scenario.runs.iter().filter(|run| run.server == server) {
            for phase in &run.phases {
                let line = (server.to_owned(), phase.name.clone());
                if !lines.contains(&line) {
                    lines.push(line);
                }
            }
        }
    }
    lines
}

fn line(scenario: &ScenarioReport, server: &str, name: &str) -> String {
    let is_server = |run: &&RunReport| run.server == server;
    let runs = scenario.runs.iter().filter(is_server);
    let phases: Vec<&PhaseReport> = runs.filter_map(|run| run.phase(name)).collect();
    let median = |figure: &dyn Fn(&PhaseReport) -> Option<f64>| -> Option<f64> {
        let values = phases.iter().filter_map(|phase| figure(phase));
        Summary::of(values).map(|summary| summary.median)
    };
    let number = |digits: usize, figure: &dyn Fn(&PhaseReport) -> f64| {
        median(&|phase| Some(figure(phase)))
            .map_or_else(String::new, |value| format!("{value:.digits$}"))
    };
    let share = |figure: &dyn Fn(&PhaseReport) -> Option<f64>| {
        median(figure).map_or_else(String::new, |value| format!("{:.2} %", value * 100.0))
    };
    format!(
        "| {server}, {name} | {} | {} | {} | {} | {} | {} | {} | {} | {} | {} | {} | {} | {} |\n",
        number(0, &|phase| phase.offered_per_s),
        number(0, &|phase| phase.all.goodput_per_s),
        number(2, &|phase| phase.all.p50_ms),
        number(2, &|phase| phase.all.p99_ms),
        number(2, &|phase| phase.all.p999_ms),
        number(2, &|phase| phase.all.max_ms),
        share(&|phase| Some(phase.all.shed_share)),
        share(&|phase| Some(phase.all.error_share)),
        share(&|phase| phase.all.rerouted_share),
        share(&|phase| phase.server_share),
        share(&|phase| phase.load_share),
        share(&|phase| phase.elsewhere_share),
        number(2, &|phase| phase.late_p99_ms),
    )
}

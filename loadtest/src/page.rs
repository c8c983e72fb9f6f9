//! A report as one page of HTML that needs nothing beside it.

use crate::plot::{Band, Line, Plot, Scale};
use crate::report::{PhaseReport, Report, RunReport, ScenarioReport};
use maud::{DOCTYPE, Markup, PreEscaped, html};

const STYLE: &str = include_str!("page.css");
/// A part of the curve beyond this has too few requests to say anything.
const PART_MOST: f64 = 0.999_999;

/// The whole page.
pub(crate) fn page(report: &Report) -> String {
    let missed = report.missed().len();
    let page = html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width, initial-scale=1";
                title { "Skyway under load" }
                style { (PreEscaped(STYLE)) }
            }
            body {
                header {
                    h1 { "Skyway under load" }
                    p class="facts" {
                        (report.begun_at) " · commit " code { (report.commit) } " · " (report.machine) " · " code { (report.server) }
                    }
                    @if report.quick {
                        p class="warning" { "A quick run: whether everything works. Its times say nothing." }
                    }
                    @if !report.pinned {
                        p class="warning" { "Servers and load shared all cores: each takes time from the other." }
                    }
                    p {
                        "Open loop: requests are sent when they are due, and times count from then. "
                        @if missed == 0 { "Every objective is met." } @else { strong { (missed) @if missed == 1 { " objective is missed." } @else { " objectives are missed." } } }
                    }
                    (contents(report))
                }
                main {
                    @for (number, scenario) in report.scenarios.iter().enumerate() {
                        (section(number, scenario))
                    }
                }
            }
        }
    };
    page.into_string()
}

fn contents(report: &Report) -> Markup {
    html! {
        nav {
            @for (number, scenario) in report.scenarios.iter().enumerate() {
                @let is_met = scenario.judgements.iter().all(|judgement| judgement.met);
                a href={ "#s" (number) } class=(if is_met { "met" } else { "missed" }) {
                    (scenario.name) " " small { (scenario.dialect) }
                }
            }
        }
    }
}

fn section(number: usize, scenario: &ScenarioReport) -> Markup {
    let shown = shown_repetition(scenario);
    let of = |server: &str| {
        let mut runs = scenario.runs.iter();
        runs.find(|run| run.server == server && run.repetition == shown)
    };
    html! {
        section id={ "s" (number) } {
            h2 { (scenario.name) " " small { (scenario.dialect) } }
            p { (scenario.title) ". Arrivals: " (scenario.arrivals) ", seed " (scenario.seed) "." }
            (judgements(scenario))
            @if let Some(edge) = of("edge") {
                p class="facts" { "Pictures: repetition " (shown + 1) ", the one in the middle by p99." }
                (latency(edge))
                (throughput(edge))
                (percentiles(edge, of("echo")))
            }
            // What was shed is told at once.
            @let has_shed = scenario.runs.iter().flat_map(|run| &run.phases).any(|phase| phase.all.shed > 0);
            details open[has_shed] {
                summary { "every phase of every repetition" }
                (runs(scenario))
            }
        }
    }
}

/// The repetition of the edge whose last phase has its p99 in the middle.
fn shown_repetition(scenario: &ScenarioReport) -> usize {
    let edges = scenario.runs.iter().filter(|run| run.server == "edge");
    let p99_ms = |run: &RunReport| run.phases.last().map_or(0.0, |phase| phase.all.p99_ms);
    let mut sorted: Vec<&RunReport> = edges.collect();
    sorted.sort_by(|one, other| p99_ms(one).total_cmp(&p99_ms(other)));
    sorted.get(sorted.len() / 2).map_or(0, |run| run.repetition)
}

fn judgements(scenario: &ScenarioReport) -> Markup {
    html! {
        table {
            thead { tr { th { "objective" } th { "measured" } th {} } }
            tbody {
                @for judgement in &scenario.judgements {
                    tr {
                        td { (judgement.objective) }
                        td class="number" { (judgement.measured()) }
                        td { @if judgement.met { b class="met" { "met" } } @else { b class="missed" { "missed" } } }
                    }
                }
            }
        }
    }
}

/// The phases of a run one after the other.
fn bands(run: &RunReport) -> Vec<Band> {
    let mut from = 0.0;
    let band = |phase: &PhaseReport| {
        let begin = from;
        from += phase.measured_s;
        Band {
            name: phase.name.clone(),
            from: begin,
            until: from,
        }
    };
    run.phases.iter().map(band).collect()
}

/// A figure of every interval over the time; what is not positive is left out where the axis is logarithmic.
fn over_time(
    run: &RunReport,
    name: &str,
    colour: usize,
    figure: impl Fn(&PhaseReport, usize) -> f64,
) -> Line {
    let mut points = Vec::new();
    for (phase, band) in run.phases.iter().zip(bands(run)) {
        for number in 0..phase.intervals.len() {
            let at = band.from + (number as f64 + 0.5) * phase.interval_s;
            let value = figure(phase, number);
            if at <= band.until && value.is_finite() {
                points.push([at, value]);
            }
        }
    }
    Line {
        name: name.to_owned(),
        colour,
        is_dashed: false,
        points,
    }
}

fn latency(run: &RunReport) -> Markup {
    let known = |value: f64| if value > 0.0 { value } else { f64::NAN };
    let lines = vec![
        over_time(run, "largest", 5, |phase, at| {
            known(phase.intervals[at].max_ms)
        }),
        over_time(run, "p99", 1, |phase, at| known(phase.intervals[at].p99_ms)),
        over_time(run, "p50", 0, |phase, at| known(phase.intervals[at].p50_ms)),
    ];
    let plot = Plot {
        title: "Latency from the intended send time, ms".to_owned(),
        across: "seconds measured".to_owned(),
        x: Scale::Linear,
        y: Scale::Logarithmic,
        bands: bands(run),
        lines,
    };
    plot.draw()
}

fn throughput(run: &RunReport) -> Markup {
    let mut offered = over_time(run, "offered", 4, |phase, _| phase.offered_per_s);
    offered.is_dashed = true;
    let lines = vec![
        offered,
        over_time(run, "answered", 2, |phase, at| {
            phase.intervals[at].answered_per_s
        }),
        over_time(run, "shed", 3, |phase, at| phase.intervals[at].shed_per_s),
        over_time(run, "failed or unsent", 1, |phase, at| {
            phase.intervals[at].failed_per_s
        }),
    ];
    let plot = Plot {
        title: "Requests per second, and what was shed".to_owned(),
        across: "seconds measured".to_owned(),
        x: Scale::Linear,
        y: Scale::Linear,
        bands: bands(run),
        lines,
    };
    plot.draw()
}

fn percentiles(edge: &RunReport, echo: Option<&RunReport>) -> Markup {
    let curve = |run: &RunReport, colour: usize, phase: &PhaseReport| {
        let points = phase.all.curve.iter().copied();
        let points = points.filter(|point| point[0] < PART_MOST && point[1] > 0.0);
        Line {
            name: format!("{}, {}", run.server, phase.name),
            colour: colour % 8,
            is_dashed: run.server == "echo",
            points: points.collect(),
        }
    };
    let mut lines = Vec::new();
    for run in std::iter::once(edge).chain(echo) {
        let phases = run.phases.iter().enumerate();
        lines.extend(phases.map(|(colour, phase)| curve(run, colour, phase)));
    }
    let plot = Plot {
        title: "Latency that a part of the requests is within, ms".to_owned(),
        across: "part of the requests".to_owned(),
        x: Scale::Nines,
        y: Scale::Logarithmic,
        bands: Vec::new(),
        lines,
    };
    plot.draw()
}

fn runs(scenario: &ScenarioReport) -> Markup {
    let percent = |share: f64| format!("{:.2} %", share * 100.0);
    html! {
        table class="wide" {
            thead {
                tr {
                    @for name in [
                        "run", "phase", "request", "offered/s", "answered/s", "p50 ms", "p99 ms", "p99.9 ms", "max ms",
                        "p99 ms from sending", "shed", "errors", "unsent", "server busy", "load busy", "others busy", "sent late, p99 ms",
                    ] { th { (name) } }
                }
            }
            tbody {
                @for run in &scenario.runs {
                    @for phase in &run.phases {
                        @for (name, figures) in std::iter::once(("all", &phase.all)).chain(phase.operations.iter().map(|(name, figures)| (name.as_str(), figures))) {
                            tr {
                                td { (run.server) " " (run.repetition + 1) }
                                td { (phase.name) }
                                td { (name) }
                                td class="number" { (format!("{:.0}", figures.scheduled as f64 / phase.measured_s.max(1e-9))) }
                                td class="number" { (format!("{:.0}", figures.goodput_per_s)) }
                                @for value in [figures.p50_ms, figures.p99_ms, figures.p999_ms, figures.max_ms, figures.p99_from_sent_ms] {
                                    td class="number" { (format!("{value:.2}")) }
                                }
                                td class="number" { (percent(figures.shed_share)) }
                                td class="number" { (percent(figures.error_share)) }
                                td class="number" { (figures.unsent) }
                                td class="number" { (phase.server_share.map_or_else(String::new, percent)) }
                                td class="number" { (phase.load_share.map_or_else(String::new, percent)) }
                                td class="number" { (phase.elsewhere_share.map_or_else(String::new, percent)) }
                                td class="number" { (format!("{:.2}", phase.late_p99_ms)) }
                            }
                        }
                    }
                }
            }
        }
    }
}

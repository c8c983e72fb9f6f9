//! The top of the page: title, warnings, abstract and the findings in short.

use super::notes;
use super::numbers::count;
use crate::evaluate::record::{Claim, Run, Verdict};
use crate::evaluate::text::counted;
use maud::{Markup, html};

pub(super) const TITLE: &str =
    "Recomposition of drone deliveries: the paper’s evaluation, repeated";

/// Every verdict with its class, its word and its sign.
pub(super) const VERDICTS: [(Verdict, &str, &str); 7] = [
    (Verdict::Reproduced, "reproduced", "✓ reproduced"),
    (
        Verdict::InIsolation,
        "direction",
        "◌ reproduced in isolation",
    ),
    (Verdict::DirectionOnly, "direction", "≈ direction only"),
    (Verdict::Depends, "direction", "± depends on the network"),
    (Verdict::Contradicted, "refuted", "✗ contradicted"),
    (Verdict::NotReproduced, "refuted", "✗ not reproduced"),
    (Verdict::NotMeasured, "unmeasured", "– not measured"),
];

/// Title and byline.
pub(super) fn header(run: &Run) -> Markup {
    let provenance = &run.provenance;
    html! {
        header {
            h1 { (TITLE) }
            p class="byline" {
                "Skyway " (provenance.version) " · commit " code { (provenance.commit) } " · "
                time datetime=(provenance.started) { (provenance.started) }
                " · seed " (provenance.seed)
            }
            @if provenance.checks_assertions {
                p class="warning" {
                    strong { "Times are no result. " }
                    "This build checks its assertions (profile " code { (provenance.profile) }
                    "), which costs time. Lengths, counts and searched areas are not touched by that."
                }
            }
            @if provenance.quick {
                p class="warning" {
                    strong { "A short run. " }
                    "Few failures on few networks: it shows that everything works, and its intervals are wide."
                }
            }
        }
    }
}

/// The abstract, and one line per note.
pub(super) fn summary(run: &Run) -> Markup {
    let networks = &run.provenance.networks;
    let of_cells = networks.iter().map(|network| network.networks);
    let of_cells: usize = of_cells.sum();
    let drawn: usize = networks.iter().map(|network| network.failures).sum();
    let without_detour: usize = networks.iter().map(|network| network.without_detour).sum();
    let checked: usize = networks
        .iter()
        .map(|network| network.distances_checked)
        .sum();
    html! {
        section id="abstract" {
            h2 { "Abstract" }
            @if let Some(first) = run.notes.first() { p { strong { (first.text) } } }
            p {
                "When a segment of a delivery’s route fails, a new way has to be found from where the drone is. The paper’s "
                "strategies look for it in small areas about the failed segment: in circles (radius), in grid cells (cell "
                "density) and in shapes that grow in stages (two-phased). This run repeats the paper’s evaluation of them and "
                "puts " em { "exact" } " beside everything, which finds the shortest way for the whole rest of the route."
            }
            p {
                "It drew " (count(drawn)) " failures on " (counted(of_cells, "network", "networks"))
                (sizes(run)) "; " (after_failure(without_detour)) " "
                (count(checked)) " distances of exact and of the baselines were compared with those of petgraph’s Dijkstra "
                "on a graph that it loaded itself, and all are equal; a run in which one is not ends with an error."
            }
            @if !run.claims.is_empty() { (tally(&run.claims)) }
            (notes::findings(&run.notes))
        }
    }
}

/// From the smallest network to the largest, in nodes.
fn sizes(run: &Run) -> String {
    let nodes = || run.provenance.networks.iter().map(|network| network.nodes);
    match (nodes().min(), nodes().max()) {
        (Some(least), Some(most)) if least < most => {
            format!(" of {} to {} nodes", count(least), count(most))
        }
        (Some(least), _) => format!(" of {} nodes", count(least)),
        (None, _) => String::new(),
    }
}

fn after_failure(without_detour: usize) -> String {
    match without_detour {
        0 => "each of them leaves a way to the destination.".to_owned(),
        1 => "1 of them leaves no way to the destination and is kept apart.".to_owned(),
        many => format!(
            "{} of them leave no way to the destination and are kept apart.",
            count(many)
        ),
    }
}

/// How many numbers of the paper got which verdict.
fn tally(claims: &[Claim]) -> Markup {
    html! {
        p { "Of " (counted(claims.len(), "number", "numbers")) " in the text of the paper:" }
        ul class="tally" {
            @for (verdict, class, words) in VERDICTS {
                @let found = claims.iter().filter(|claim| claim.holds == verdict).count();
                @if found > 0 {
                    li class=(class) { b { (count(found)) } " " (words) }
                }
            }
        }
    }
}

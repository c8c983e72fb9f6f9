//! How the figures came about: what is drawn, what is compared, what is timed, how intervals are made.

use super::numbers::count;
use crate::evaluate::record::Run;
use maud::{Markup, html};

/// The parts of the method, each a word and its explanation.
const PARTS: [(&str, &str); 7] = [
    (
        "Networks",
        "Generated after the paper’s Table 1: from one middle network each variable (nodes, neighbours, reach of a \
         segment, size of the map) is changed on its own. Sydney CBD, or a network that was handed in, is a cell of its own.",
    ),
    (
        "Failures",
        "Source and destination are uniform in the largest component of the network, and the failed segment is uniform on \
         the shortest path between them. Every draw counts: a failure after which no way leads to the destination is \
         reported as such, and no other is drawn in its place.",
    ),
    (
        "Methods",
        "The strategies of the paper are given their best: the same search kernel and the same spatial index as exact, \
         with A* and with Dijkstra inside. Exact is shown twice: warm, with the table of the destination in memory, and \
         cold, without any.",
    ),
    (
        "Times",
        "What is timed is one call, from the failure report to the finished answer, search areas included. Everything timed \
         runs on one thread, and the methods take turns on each failure. A failure’s time is the median of its \
         repetitions. The compiler cannot remove or share the calls.",
    ),
    (
        "Lengths",
        "Overheads are taken over the shortest way after the failure. Every distance of exact and of the baselines is \
         compared with petgraph’s Dijkstra on a graph that it loaded itself; a difference ends the run with an error.",
    ),
    (
        "Intervals",
        "95\u{202f}% percentile intervals of the bootstrap, failures drawn again with replacement; their random numbers \
         come from the seed too.",
    ),
    (
        "Verdicts",
        "A number is reproduced when, under some reading, our value is within a tenth of the paper’s or our interval covers \
         it; in direction only, when no reading comes so near but some point the same way; not reproduced, when none does.",
    ),
];

pub(super) fn section(run: &Run) -> Markup {
    html! {
        section id="method" {
            h2 { "Method" }
            dl {
                @for (word, explanation) in PARTS {
                    dt { (word) }
                    dd { (explanation) }
                }
            }
            h3 { "Networks and failures" }
            div class="scroll" {
                table class="values" {
                    thead {
                        tr {
                            th scope="col" { "Network" }
                            @for title in [
                                "Nodes",
                                "Segments",
                                "Largest component",
                                "Failures drawn",
                                "Without detour",
                                "Distances checked",
                                "Median failed segment",
                            ] { th scope="col" class="number" { (title) } }
                        }
                    }
                    tbody { @for network in &run.provenance.networks {
                        tr {
                            th scope="row" { (network.name) }
                            @for figure in [
                                network.nodes,
                                network.segments,
                                network.component_nodes,
                                network.failures,
                                network.without_detour,
                                network.distances_checked,
                            ] { td class="number" { (count(figure)) } }
                            td class="number" {
                                (count(network.median_failed_segment_m.round() as usize)) "\u{202f}m"
                            }
                        }
                    } }
                }
            }
        }
    }
}

//! How the figures came about: what is drawn, what is compared, what is timed, how intervals are made.

use super::numbers::count;
use crate::evaluate::record::Run;
use maud::{Markup, html};

/// The parts of the method, each a word and its explanation.
const PARTS: [(&str, &str); 8] = [
    (
        "Networks",
        "All cells of the paper’s Table 1 (nodes, neighbours, reach of a segment) under three generators: nearest neighbours \
         joined, neighbours within reach drawn at random, and a Delaunay triangulation thinned to the number of neighbours; \
         several networks to a cell. Of what is generated the largest component is the network: places that cannot be flown \
         to are never searched, and are no part of what is compared with. The size of the map changes no figure, as every \
         length scales with it. Sydney CBD, or a network that was handed in, is a cell of its own.",
    ),
    (
        "Failures",
        "Source and destination are uniform in the network, in its largest component where it comes from a file. The failed segment is drawn in three \
         ways: uniform on the shortest path between them, by length on it, and uniform in the network. Every draw counts: a \
         failure after which no way leads to the destination is reported as such, and no other is drawn in its place.",
    ),
    (
        "Methods",
        "The strategies of the paper are given their best: the same search kernel as exact, with A* and with Dijkstra inside, \
         and cells with lists of their nodes. Cells of another size than 1/16 of the map are counted for each failure, as the \
         paper’s algorithm does. Exact is shown twice: warm, with the table of the destination in memory, and cold, without any.",
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
        "95\u{202f}% percentile intervals of the bootstrap: networks are drawn again with all their failures, with \
         replacement; of a single network the failures are. Their random numbers come from the seed too.",
    ),
    (
        "Joint conventions",
        "Every combination of what the paper leaves open is tried, and the one that comes within a tenth of most of its numbers \
         is taken for all of them; of several, the one that is nearest to all.",
    ),
    (
        "Verdicts",
        "A number is reproduced when it is met under the joint conventions and not under one reading alone; reproduced in \
         isolation, when only readings of its own meet it; contradicted, when under the joint conventions its whole interval \
         lies on the other side; in direction only, when no reading meets it and ours lies on the paper’s side.",
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
            details {
                summary { "All " (run.provenance.networks.len()) " cells" }
                table class="values" {
                    thead {
                        tr {
                            th scope="col" { "Cell" }
                            @for title in [
                                "Networks",
                                "Nodes generated",
                                "Segments",
                                "In largest components",
                                "Failures drawn",
                                "Without detour",
                                "Distances checked",
                            ] { th scope="col" class="number" { (title) } }
                        }
                    }
                    tbody { @for network in &run.provenance.networks {
                        tr {
                            th scope="row" { (network.name) }
                            @for figure in [
                                network.networks,
                                network.nodes,
                                network.segments,
                                network.component_nodes,
                                network.failures,
                                network.without_detour,
                                network.distances_checked,
                            ] { td class="number" { (count(figure)) } }
                        }
                    } }
                }
            }
        }
    }
}

//! Plots with their captions and the values behind them, by topic.

use super::numbers::{count, interval, plain, tick};
use crate::evaluate::record::{Figure, Scale};
use maud::{Markup, PreEscaped, html};

/// The topics of the paper and the last of its figures that belongs to each.
const TOPICS: [(u32, &str); 5] = [
    (8, "Radius-based"),
    (12, "Cell density-based and two-phased"),
    (14, "Two-phased beside textbook searches"),
    (16, "Stage skipping"),
    (u32::MAX, "Sydney CBD"),
];

/// The figures of a run, apart.
pub(super) struct Groups<'a> {
    /// Those with a counterpart in the paper, by topic.
    pub(super) of_paper: Vec<(&'static str, Vec<&'a Figure>)>,
    /// The others.
    pub(super) own: Vec<&'a Figure>,
}

pub(super) fn groups(figures: &[Figure]) -> Groups<'_> {
    let (of_paper, own): (Vec<&Figure>, Vec<&Figure>) =
        figures.iter().partition(|figure| figure.paper.is_some());
    let with_topic = TOPICS.iter().map(|&(_, topic)| {
        let on_topic = |figure: &&Figure| self::topic(figure) == topic;
        (topic, of_paper.iter().copied().filter(on_topic).collect())
    });
    Groups {
        of_paper: with_topic
            .filter(|(_, figures): &(_, Vec<&Figure>)| !figures.is_empty())
            .collect(),
        own,
    }
}

/// The topic of a figure's counterpart, which is named by its number.
fn topic(figure: &Figure) -> &'static str {
    let name = figure.paper.as_deref().unwrap_or_default();
    let digits: String = name.chars().filter(char::is_ascii_digit).collect();
    let number = digits.parse().unwrap_or(u32::MAX);
    let found = TOPICS.iter().find(|(last, _)| number <= *last);
    found.map_or("", |(_, topic)| topic)
}

pub(super) fn sections(figures: &[Figure], plots: &[(String, String)]) -> Markup {
    let groups = groups(figures);
    html! {
        @if !groups.of_paper.is_empty() {
            section id="figures" class="wide" {
                h2 { "The paper’s figures" }
                @for (topic, figures) in &groups.of_paper {
                    h3 { (topic) }
                    (grid(figures, plots))
                }
            }
        }
        @if !groups.own.is_empty() {
            section id="more-figures" class="wide" {
                h2 { "Beyond the paper" }
                (grid(&groups.own, plots))
            }
        }
    }
}

fn grid(figures: &[&Figure], plots: &[(String, String)]) -> Markup {
    html! {
        div class="grid" {
            @for figure in figures { (with_plot(figure, plots)) }
        }
    }
}

fn with_plot(figure: &Figure, plots: &[(String, String)]) -> Markup {
    let plot = plots.iter().find(|(slug, _)| *slug == figure.slug);
    html! {
        figure id={ "figure-" (figure.slug) } {
            @match plot {
                Some((_, svg)) => div class="card" { (PreEscaped(svg)) },
                None => p class="warning" { (figure.title) ": no picture, as there is nothing to draw." },
            }
            figcaption {
                @if let Some(paper) = &figure.paper { b { "Counterpart of " (paper) "." } " " }
                (figure.caption)
                (values(figure))
            }
        }
    }
}

/// What is plotted, as a table.
fn values(figure: &Figure) -> Markup {
    let place = |x: f64| match &figure.x.scale {
        Scale::Categories(names) => names.get(x as usize).cloned().unwrap_or_default(),
        Scale::Linear | Scale::Log => tick(x),
    };
    html! {
        details {
            summary { "Values" }
            p class="small" {
                (figure.x.label) " / " (figure.y.label) "; also in " code { "figures/" (figure.slug) ".csv" }
            }
            div class="scroll" {
                table class="values" {
                    thead {
                        tr {
                            th scope="col" { "Series" }
                            th scope="col" { (figure.x.label) }
                            th scope="col" class="number" { "Value" }
                            th scope="col" class="number" { "95\u{202f}% interval" }
                            th scope="col" class="number" { "Quartiles" }
                            th scope="col" class="number" { "Cases" }
                        }
                    }
                    tbody {
                        @for series in &figure.series {
                            @for point in &series.points {
                                tr {
                                    th scope="row" { (series.name) }
                                    td { (place(point.x)) }
                                    td class="number" { (plain(point.y)) }
                                    td class="number" { (interval(point.low, point.high)) }
                                    td class="number" { (interval(point.spread[0], point.spread[1])) }
                                    td class="number" { (count(point.cases)) }
                                }
                            }
                        }
                    }
                }
            }
        }
    }
}

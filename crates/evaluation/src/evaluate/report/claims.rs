//! The table "paper | ours | reading": every number in the text of the paper, and what came of it.

use super::numbers::{count, interval, printed, value};
use super::opening::VERDICTS;
use crate::evaluate::record::{Better, Claim, Reading};
use maud::{Markup, html};

pub(super) fn section(claims: &[Claim]) -> Markup {
    html! {
        @if !claims.is_empty() {
            section id="claims" {
                h2 { "The paper’s numbers" }
                p {
                    "The paper leaves open whether its baseline stops at the goal, which problem it solves, over which distance "
                    "an overhead is taken and how cases are averaged. Each number is therefore measured under every sensible "
                    "reading of its sentence. The table shows the reading that comes closest to the paper; the others unfold below "
                    "it. Brackets hold 95\u{202f}% intervals."
                }
                table class="claims" {
                    thead {
                        tr {
                            th scope="col" { "What the paper says" }
                            th scope="col" class="number" { "Paper" }
                            th scope="col" class="number" { "Ours" }
                            th scope="col" { "Reading" }
                            th scope="col" class="number" { "Exact" }
                        }
                    }
                    @for (place, claim) in claims.iter().enumerate() {
                        @if place == 0 || claims[place - 1].section != claim.section {
                            tbody { tr class="topic" { th scope="rowgroup" colspan="5" { (claim.section) } } }
                        }
                        (row(claim))
                    }
                }
            }
        }
    }
}

fn row(claim: &Claim) -> Markup {
    let closest = claim.closest.and_then(|place| claim.readings.get(place));
    let verdict = VERDICTS
        .iter()
        .find(|(verdict, ..)| *verdict == claim.holds);
    html! {
        tbody class="claim" id={ "claim-" (claim.id) } {
            tr {
                th scope="row" { (claim.text) }
                td class="number" data-label="Paper" { (printed(claim.paper, claim.unit)) }
                td class="number" data-label="Ours" { (measured(claim, closest)) }
                td class="reading" data-label="Reading" {
                    @match closest { Some(reading) => (reading.name), None => "–" }
                }
                td class="number" data-label="Exact" { (measured(claim, claim.exact.as_ref())) }
            }
            tr {
                td class="verdict" colspan="5" {
                    @if let Some((_, class, words)) = verdict { span class={ "chip " (class) } { (words) } " " }
                    (claim.verdict)
                    @if !claim.readings.is_empty() { (readings(claim)) }
                }
            }
        }
    }
}

/// A value and its interval.
fn measured(claim: &Claim, reading: Option<&Reading>) -> Markup {
    html! {
        @match reading {
            Some(reading) => {
                (value(reading.value, claim.unit)) " "
                span class="interval" { (interval(reading.low, reading.high)) }
            }
            None => "–",
        }
    }
}

fn readings(claim: &Claim) -> Markup {
    let exact = claim.exact.iter().map(|exact| (None, exact));
    let readings = claim.readings.iter().enumerate();
    let all = readings
        .map(|(place, reading)| (Some(place), reading))
        .chain(exact);
    html! {
        details {
            summary { "All " (count(claim.readings.len())) " readings" }
            p class="small" {
                code { (claim.id) }
                @match claim.better {
                    Better::Lower => " · less is better",
                    Better::Higher => " · more is better",
                    Better::Neither => " · neither side is better",
                }
            }
            table class="values" {
                thead {
                    tr {
                        th scope="col" { "Reading" }
                        th scope="col" class="number" { "Value" }
                        th scope="col" class="number" { "95\u{202f}% interval" }
                        th scope="col" class="number" { "Cases" }
                    }
                }
                tbody {
                    @for (place, reading) in all {
                        tr class=[(place.is_some() && place == claim.closest).then_some("closest")] {
                            th scope="row" {
                                @if place.is_none() { em { "exact" } ": " }
                                (reading.name)
                                @if place.is_some() && place == claim.closest { " " b { "(closest)" } }
                            }
                            td class="number" { (value(reading.value, claim.unit)) }
                            td class="number" { (interval(reading.low, reading.high)) }
                            td class="number" { (count(reading.cases)) }
                        }
                    }
                }
            }
        }
    }
}

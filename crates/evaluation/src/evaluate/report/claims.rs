//! The tables of what the paper says, with numbers and without, and what came of it.

use super::numbers::{count, interval, plain, printed, value};
use super::opening::VERDICTS;
use crate::evaluate::record::{Better, Claim, Reading, Sentence, Verdict};
use maud::{Markup, html};

pub(super) fn section(claims: &[Claim]) -> Markup {
    html! {
        @if !claims.is_empty() {
            section id="claims" {
                h2 { "The paper’s numbers" }
                p {
                    "The paper leaves open how its networks are made, whether its baseline stops at the goal, which problem it "
                    "solves, over which distance an overhead is taken and how cases are averaged. All its numbers are judged "
                    "under one set of conventions, the one that meets most of them. Beside it stands under how many readings of "
                    "its own sentence a number is met. Brackets hold 95\u{202f}% intervals."
                }
                table class="claims" {
                    thead {
                        tr {
                            th scope="col" { "What the paper says" }
                            th scope="col" class="number" { "Paper" }
                            th scope="col" class="number" { "Ours, jointly" }
                            th scope="col" class="number" { "Closest alone" }
                            th scope="col" class="number" { "Met under" }
                            th scope="col" class="number" { "Exact" }
                        }
                    }
                    @for (place, claim) in claims.iter().enumerate() {
                        @if place == 0 || claims[place - 1].section != claim.section {
                            tbody { tr class="topic" { th scope="rowgroup" colspan="6" { (claim.section) } } }
                        }
                        (row(claim))
                    }
                }
            }
        }
    }
}

fn chip(holds: Verdict) -> Markup {
    let verdict = VERDICTS.iter().find(|(verdict, ..)| *verdict == holds);
    html! {
        @if let Some((_, class, words)) = verdict { span class={ "chip " (class) } { (words) } }
    }
}

fn row(claim: &Claim) -> Markup {
    html! {
        tbody class="claim" id={ "claim-" (claim.id) } {
            tr {
                th scope="row" { (claim.text) }
                td class="number" data-label="Paper" { (printed(claim.paper, claim.unit)) }
                td class="number" data-label="Jointly" { (measured(claim, claim.joint.as_ref())) }
                td class="number" data-label="Closest" { (measured(claim, claim.closest.as_ref())) }
                td class="number" data-label="Met under" {
                    (count(claim.met)) " of " (count(claim.readings))
                }
                td class="number" data-label="Exact" { (measured(claim, claim.exact.as_ref())) }
            }
            tr {
                td class="verdict" colspan="6" {
                    (chip(claim.holds)) " " (claim.verdict)
                    p class="small" {
                        code { (claim.id) }
                        @match claim.better {
                            Better::Lower => " · less is better",
                            Better::Higher => " · more is better",
                            Better::Neither => " · neither side is better",
                        }
                        @if let Some([least, most]) = claim.range {
                            " · all readings " (interval(least, most))
                        }
                    }
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
                span class="interval" title=(reading.name) { (interval(reading.low, reading.high)) }
            }
            None => "–",
        }
    }
}

pub(super) fn sentences(sentences: &[Sentence]) -> Markup {
    let told = |sentence: &Sentence| {
        let counts = sentence.counts.iter();
        let counts = counts.map(|found| {
            let equal = found.of - found.holds - found.fails;
            let equal = if equal > 0 {
                format!(", no difference on {}", count(equal))
            } else {
                String::new()
            };
            format!(
                "{}: {} of {}{equal}",
                found.networks,
                count(found.holds),
                count(found.of)
            )
        });
        counts.collect::<Vec<String>>().join("; ")
    };
    let share = |sentence: &Sentence| {
        let sum = |figure: fn(&crate::evaluate::record::Count) -> usize| {
            sentence.counts.iter().map(figure).sum::<usize>()
        };
        let (holds, told) = (
            sum(|found| found.holds),
            sum(|found| found.holds + found.fails),
        );
        match told {
            0 => "–".to_owned(),
            told => format!("{}\u{202f}%", plain(1e2 * holds as f64 / told as f64)),
        }
    };
    html! {
        @if !sentences.is_empty() {
            section id="sentences" {
                h2 { "The paper’s sentences" }
                p {
                    "Each is put to the test network by network. It is reproduced where it holds on three quarters of the "
                    "networks that show a difference, and contradicted where it holds on a quarter at most."
                }
                table class="claims" {
                    thead {
                        tr {
                            th scope="col" { "What the paper says" }
                            th scope="col" class="number" { "Holds on" }
                        }
                    }
                    @for sentence in sentences {
                        tbody class="claim" id={ "sentence-" (sentence.id) } {
                            tr {
                                th scope="row" { (sentence.text) }
                                td class="number" data-label="Holds on" { (share(sentence)) }
                            }
                            tr {
                                td class="verdict" colspan="2" {
                                    (chip(sentence.holds)) " " (told(sentence)) ". Test: " (sentence.test) "."
                                }
                            }
                        }
                    }
                }
            }
        }
    }
}

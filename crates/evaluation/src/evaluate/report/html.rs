//! The page: what stands on it, in which order.

use super::{claims, figures, method, notes, opening, provenance};
use crate::evaluate::record::Run;
use maud::{DOCTYPE, PreEscaped, html};

const STYLE: &str = include_str!("style.css");

/// Writes the report of a run as one HTML page; `plots` are the pictures of its figures, by their slugs.
///
/// A figure without a picture keeps its caption and its values.
pub fn html(run: &Run, plots: &[(String, String)]) -> String {
    let page = html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width, initial-scale=1";
                meta name="color-scheme" content="light dark";
                title { (opening::TITLE) }
                style { (PreEscaped(STYLE)) }
            }
            body {
                (opening::header(run))
                nav aria-label="Contents" {
                    ol {
                        @for (anchor, title) in contents(run) {
                            li { a href={ "#" (anchor) } { (title) } }
                        }
                    }
                }
                main {
                    (opening::summary(run))
                    (claims::section(&run.claims))
                    (claims::sentences(&run.sentences))
                    (figures::sections(&run.figures, plots))
                    (notes::section(&run.notes))
                    (method::section(run))
                    (provenance::section(&run.provenance))
                }
            }
        }
    };
    page.into_string() + "\n"
}

/// The sections that the page has, with their anchors.
fn contents(run: &Run) -> Vec<(&'static str, &'static str)> {
    let has_figures = figures::groups(&run.figures);
    let parts = [
        (true, ("abstract", "Abstract")),
        (!run.claims.is_empty(), ("claims", "The paper's numbers")),
        (
            !run.sentences.is_empty(),
            ("sentences", "The paper's sentences"),
        ),
        (
            !has_figures.of_paper.is_empty(),
            ("figures", "The paper's figures"),
        ),
        (
            !has_figures.own.is_empty(),
            ("more-figures", "Beyond the paper"),
        ),
        (!run.notes.is_empty(), ("notes", "Notes")),
        (true, ("method", "Method")),
        (true, ("provenance", "Provenance")),
    ];
    let present = parts.into_iter().filter(|(is_present, _)| *is_present);
    present.map(|(_, part)| part).collect()
}

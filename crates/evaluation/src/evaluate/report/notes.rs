//! What is told beside plots and claims.

use crate::evaluate::record::{Note, Table};
use maud::{Markup, html};

/// Tables longer than this are folded.
const MOST_OPEN_ROWS: usize = 12;

/// One line per note: its heading and its first sentence.
pub(super) fn findings(notes: &[Note]) -> Markup {
    html! {
        @if !notes.is_empty() {
            ul class="findings" {
                @for (place, note) in notes.iter().enumerate() {
                    li {
                        a href={ "#note-" (place + 1) } { (note.title) } ": " (first_sentence(&note.text))
                    }
                }
            }
        }
    }
}

pub(super) fn section(notes: &[Note]) -> Markup {
    html! {
        @if !notes.is_empty() {
            section id="notes" {
                h2 { "Notes" }
                @for (place, note) in notes.iter().enumerate() {
                    h3 id={ "note-" (place + 1) } { (note.title) }
                    p { (note.text) }
                    @if let Some(rows) = &note.table { (folded(rows)) }
                }
            }
        }
    }
}

fn folded(rows: &Table) -> Markup {
    let long = rows.rows.len() > MOST_OPEN_ROWS;
    html! {
        @if long {
            details {
                summary { "All " (rows.rows.len()) " rows" }
                (table(rows))
            }
        } @else {
            (table(rows))
        }
    }
}

/// A table of text; columns of numbers are set to the right.
fn table(rows: &Table) -> Markup {
    let class = |column: usize| {
        let cells = || rows.rows.iter().filter_map(|row| row.get(column));
        let begins_with_number = |cell: &String| {
            cell.starts_with(|first: char| {
                first.is_ascii_digit() || "-\u{2212}–[<>".contains(first)
            })
        };
        (column > 0 && cells().all(begins_with_number)).then_some("number")
    };
    html! {
        div class="scroll" {
            table class="values" {
                thead {
                    tr {
                        @for (column, title) in rows.header.iter().enumerate() {
                            th scope="col" class=[class(column)] { (title) }
                        }
                    }
                }
                tbody {
                    @for row in &rows.rows {
                        tr {
                            @for (column, cell) in row.iter().enumerate() {
                                td class=[class(column)] { (cell) }
                            }
                        }
                    }
                }
            }
        }
    }
}

/// Up to the first full stop that ends a sentence, which is one before a space.
fn first_sentence(text: &str) -> &str {
    let end = text.find(". ").map_or(text.len(), |stop| stop + 1);
    &text[..end]
}

//! What a command says: data on standard output, talk on standard error.
//!
//! Colours are left out where the stream is no terminal, where `NO_COLOR` is set, or where `--color`
//! says so.

use super::stop::Stop;
use anstream::{AutoStream, ColorChoice};
use clap::ValueEnum;
use clap::builder::styling::{AnsiColor, Style};
use comfy_table::{Attribute, Cell, CellAlignment, LineStyle, Table, TableStyle};
use serde_json::Value;
use std::io::{self, Write};

const ERROR: Style = AnsiColor::Red.on_default().bold();
const WARNING: Style = AnsiColor::Yellow.on_default().bold();

/// When to use colours.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default, ValueEnum)]
pub(super) enum Color {
    #[default]
    Auto,
    Always,
    Never,
}

/// The streams of a command.
#[derive(Clone, Copy, Debug)]
pub(super) struct Output {
    quiet: bool,
}

impl Output {
    /// Settles on colours for the whole process; `quiet` leaves the notes out.
    pub(super) fn new(color: Color, quiet: bool) -> Self {
        let choice = match color {
            Color::Auto => ColorChoice::Auto,
            Color::Always => ColorChoice::Always,
            Color::Never => ColorChoice::Never,
        };
        choice.write_global();
        Self { quiet }
    }

    /// Writes a line of data.
    pub(super) fn line(&self, text: &str) -> Result<(), Stop> {
        let mut stream = standard_output();
        writeln!(stream, "{text}")
            .and_then(|()| stream.flush())
            .map_err(|error| Stop::of_output(&error))
    }

    /// Writes data as it is.
    pub(super) fn raw(&self, bytes: &[u8]) -> Result<(), Stop> {
        let mut stream = standard_output().into_inner().lock();
        stream
            .write_all(bytes)
            .and_then(|()| stream.flush())
            .map_err(|error| Stop::of_output(&error))
    }

    /// Writes a JSON value: for people to read on a terminal, else on one line.
    pub(super) fn json(&self, value: &Value) -> Result<(), Stop> {
        let text = match standard_output().is_terminal() {
            true => format!("{value:#}"),
            false => value.to_string(),
        };
        self.raw(text.as_bytes()).and_then(|()| self.raw(b"\n"))
    }

    /// Writes a table.
    pub(super) fn table(&self, table: &Table) -> Result<(), Stop> {
        self.line(&table.trim_fmt())
    }

    /// Tells people something, unless they asked for quiet.
    pub(super) fn note(&self, text: &str) {
        if !self.quiet {
            self.talk(text);
        }
    }

    /// Tells people something they should not miss.
    pub(super) fn warn(&self, text: &str) {
        self.talk(&format!("{WARNING}warning:{WARNING:#} {text}"));
    }

    /// Tells people what went wrong.
    pub(super) fn error(&self, text: &str) {
        self.talk(&format!("{ERROR}error:{ERROR:#} {text}"));
    }

    /// True when notes are left out.
    pub(super) fn is_quiet(&self) -> bool {
        self.quiet
    }

    fn talk(&self, text: &str) {
        // Without a reader there is no one to tell.
        let _ = writeln!(standard_error(), "{text}");
    }
}

#[expect(clippy::disallowed_methods, reason = "the door to standard output")]
fn standard_output() -> AutoStream<io::Stdout> {
    AutoStream::auto(io::stdout())
}

#[expect(clippy::disallowed_methods, reason = "the door to standard error")]
fn standard_error() -> AutoStream<io::Stderr> {
    AutoStream::auto(io::stderr())
}

/// How the cells of a column are set.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Align {
    /// Words.
    Left,
    /// Numbers.
    Right,
}

/// A table with a bold header over a line, and nothing else that has to be looked at.
pub(super) fn titled_table(columns: &[(&str, Align)]) -> Table {
    let mut table = Table::new();
    let rule = LineStyle::none().fill('─').junction('─');
    table.load_style(TableStyle::new().header_separator(rule));
    table.enforce_styling();
    table.style_text_only();
    let header = columns.iter().map(|&(title, align)| {
        let cell = Cell::new(title).add_attribute(Attribute::Bold);
        cell.set_alignment(alignment(align))
    });
    table.set_header(header.collect::<Vec<Cell>>());
    for (place, &(_, align)) in columns.iter().enumerate() {
        if let Some(column) = table.column_mut(place) {
            column.set_cell_alignment(alignment(align));
        }
    }
    table
}

/// A table of names and their values.
pub(super) fn facts_table<'a>(facts: impl IntoIterator<Item = (&'a str, String)>) -> Table {
    let mut table = Table::new();
    table.load_style(TableStyle::new());
    table.enforce_styling();
    table.style_text_only();
    for (name, value) in facts {
        let name = Cell::new(name).add_attribute(Attribute::Bold);
        table.add_row(vec![name, Cell::new(value)]);
    }
    table
}

fn alignment(align: Align) -> CellAlignment {
    match align {
        Align::Left => CellAlignment::Left,
        Align::Right => CellAlignment::Right,
    }
}

/// A length as people read it.
pub(super) fn metres(length_m: f64) -> String {
    format!("{length_m:.1} m")
}

/// A length that there may not be.
pub(super) fn metres_or_dash(length_m: Option<f64>) -> String {
    length_m.map_or_else(|| "-".to_owned(), metres)
}

/// By how much a length is above the best one, in per cent.
pub(super) fn overhead(length_m: Option<f64>, best_m: Option<f64>) -> Option<f64> {
    let (length_m, best_m) = (length_m?, best_m?);
    let percent = (length_m / best_m - 1.0) * 100.0;
    // The same way added up in another order differs in its last digits: that is no overhead.
    (best_m > 0.0).then_some(if percent.abs() < 1e-9 { 0.0 } else { percent })
}

/// An overhead as people read it.
pub(super) fn percent_or_dash(percent: Option<f64>) -> String {
    percent.map_or_else(|| "-".to_owned(), |percent| format!("{percent:+.2} %"))
}

/// A time as people read it, from microseconds.
pub(super) fn time(microseconds: f64) -> String {
    match microseconds {
        ..1.0 => format!("{:.0} ns", microseconds * 1e3),
        ..100.0 => format!("{microseconds:.1} µs"),
        ..1e3 => format!("{microseconds:.0} µs"),
        ..1e5 => format!("{:.2} ms", microseconds / 1e3),
        ..1e6 => format!("{:.0} ms", microseconds / 1e3),
        _ => format!("{:.2} s", microseconds / 1e6),
    }
}

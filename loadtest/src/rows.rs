//! A table of figures, each beside the goal that it is held to.

use crate::run::eprintln_line;
use crate::{MISSED, Result, machine};
use std::io::Write;
use std::process::ExitCode;

/// A figure, and what it is held to.
pub(crate) struct Row {
    pub(crate) what: String,
    pub(crate) found: String,
    pub(crate) goal: String,
    pub(crate) is_met: bool,
}

impl Row {
    /// A figure that may be at most so large.
    pub(crate) fn at_most(what: impl Into<String>, (found, most): (f64, f64), unit: &str) -> Self {
        Self {
            what: what.into(),
            found: format!("{found:.1} {unit}"),
            goal: format!("at most {most} {unit}"),
            is_met: found <= most,
        }
    }

    pub(crate) fn at_least(
        what: impl Into<String>,
        (found, least): (f64, f64),
        unit: &str,
    ) -> Self {
        Self {
            what: what.into(),
            found: format!("{found:.1} {unit}"),
            goal: format!("at least {least} {unit}"),
            is_met: found >= least,
        }
    }

    /// How many of something there are, of which there is to be none.
    pub(crate) fn none(what: impl Into<String>, found: usize) -> Self {
        Self {
            what: what.into(),
            found: found.to_string(),
            goal: "0".to_owned(),
            is_met: found == 0,
        }
    }
}

/// What a table says of the run that it is of.
pub(crate) struct Header<'a> {
    pub(crate) commit: &'a str,
    /// The servers, beside the load.
    pub(crate) servers: &'a str,
    /// Whether these and the load have a core each.
    pub(crate) is_pinned: bool,
    /// A quick run holds nothing to its goals.
    pub(crate) is_quick: bool,
}

/// Writes the table; the code tells whether a goal is missed.
pub(crate) fn write_rows(header: &Header<'_>, rows: &[Row]) -> Result<ExitCode> {
    let apart = match header.is_pinned {
        true => "cores of their own",
        false => "all cores",
    };
    let quick = match header.is_quick {
        true => ". A quick run: its figures say nothing",
        false => "",
    };
    let mut stdout = std::io::stdout().lock();
    writeln!(
        stdout,
        "Commit `{}`, {}, {} and load on {apart}{quick}.\n\n| | found | goal | |\n|---|---:|---:|---|",
        header.commit,
        machine(),
        header.servers
    )?;
    for row in rows {
        let verdict = if row.is_met { "met" } else { "missed" };
        let Row {
            what, found, goal, ..
        } = row;
        writeln!(stdout, "| {what} | {found} | {goal} | {verdict} |")?;
    }
    let missed = rows.iter().filter(|row| !row.is_met).count();
    let is_held = !header.is_quick && missed > 0;
    if is_held {
        eprintln_line(&format!("{missed} goals are missed"));
    }
    Ok(ExitCode::from(if is_held { MISSED } else { 0 }))
}

/// The time that this part of all is within.
pub(crate) fn at(sorted_ms: &[f64], part: f64) -> f64 {
    let rank = (part * sorted_ms.len() as f64).ceil() as usize;
    sorted_ms
        .get(rank.saturating_sub(1))
        .copied()
        .unwrap_or_default()
}

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
    /// Whether it is a count that no load excuses, so that a quick run is held to it as well.
    pub(crate) is_always_held: bool,
}

impl Row {
    /// A figure that may be at most so large.
    pub(crate) fn at_most(what: impl Into<String>, (found, most): (f64, f64), unit: &str) -> Self {
        Self {
            what: what.into(),
            found: format!("{found:.1} {unit}"),
            goal: format!("at most {most} {unit}"),
            is_met: found <= most,
            is_always_held: false,
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
            is_always_held: false,
        }
    }

    /// How many of something there are, of which there is to be none under any load.
    pub(crate) fn none(what: impl Into<String>, found: usize) -> Self {
        Self {
            what: what.into(),
            found: found.to_string(),
            goal: "0".to_owned(),
            is_met: found == 0,
            is_always_held: true,
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
    /// A quick run is held to its counts alone.
    pub(crate) is_quick: bool,
}

/// Writes the table; the code tells whether a goal is missed.
pub(crate) fn write_rows(header: &Header<'_>, rows: &[Row]) -> Result<ExitCode> {
    let apart = match header.is_pinned {
        true => "cores of their own",
        false => "all cores",
    };
    let quick = match header.is_quick {
        true => ". A quick run: its times say nothing",
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
    let held = rows
        .iter()
        .filter(|row| !header.is_quick || row.is_always_held);
    let missed = held.filter(|row| !row.is_met).count();
    if missed > 0 {
        eprintln_line(&format!("{missed} goals are missed"));
    }
    Ok(ExitCode::from(if missed > 0 { MISSED } else { 0 }))
}

/// The time that this part of all is within; without end where there are none, which meets no goal.
pub(crate) fn at(sorted_ms: &[f64], part: f64) -> f64 {
    let rank = (part * sorted_ms.len() as f64).ceil() as usize;
    let within = sorted_ms.get(rank.saturating_sub(1));
    within.copied().unwrap_or(f64::INFINITY)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_goal_is_not_met_by_what_was_not_measured() {
        assert!(!Row::at_most("times", (at(&[], 0.99), 1_000.0), "ms").is_met);
        assert_eq!(at(&[1.0, 2.0, 3.0, 4.0], 0.5), 2.0);
        assert_eq!(at(&[1.0, 2.0, f64::INFINITY], 0.99), f64::INFINITY);
    }

    #[test]
    fn a_quick_run_is_held_to_its_counts() {
        let ends = |row: Row, is_quick| {
            let header = Header {
                commit: "",
                servers: "none",
                is_pinned: false,
                is_quick,
            };
            write_rows(&header, &[row]).expect("written")
        };
        let slow = || Row::at_most("slow", (2.0, 1.0), "ms");
        let missed = ExitCode::from(MISSED);
        assert_eq!(ends(slow(), true), ExitCode::SUCCESS);
        assert_eq!(ends(slow(), false), missed);
        assert_eq!(ends(Row::none("lost", 1), true), missed);
    }
}

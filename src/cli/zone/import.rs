//! `skyway zone import`: a feed of zones into an edge, or looked at.

use super::check::check;
use super::edge_arguments::EdgeArguments;
use crate::cli::edge::runtime;
use crate::cli::files;
use crate::cli::network_source::NetworkArguments;
use crate::cli::output::Output;
use crate::cli::remote::{JSON, Remote, START_OR_NAME};
use crate::cli::stop::{Stop, Verdict};
use crate::formats::{ForeignFormat, KML_MEDIA_TYPE};
use crate::wire::{Fault, ImportAction, ZoneImport};
use clap::Args;
use jiff::Timestamp;
use std::path::PathBuf;

const EXAMPLES: &str = "\
Examples:
  skyway zone import national.json --check --at 2026-11-27T18:00:00Z --json
  skyway zone import national.json --feed national --dry-run
  skyway zone import national.json --feed national --authorized conditional,LPR12
  skyway zone import mission.plan --feed mission --prefix mission-

Importing a feed again lifts the zones that it has no more; many at once wait for an operator. \
A zone that is refused keeps its last version in force.

Exit codes: 0 when every zone is imported, 1 when some are refused or the feed cannot be read, \
2 for arguments that make no sense, 4 when the edge cannot be reached.";

/// Arguments of `skyway zone import`.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(in crate::cli) struct Import {
    /// The feed, or - for standard input
    #[arg(value_name = "FILE")]
    pub(super) file: PathBuf,
    /// Its name, by which it is known when it comes again [default: the name of the file]
    #[arg(long, value_name = "NAME")]
    feed: Option<String>,
    /// What is put before each identifier to make the id of a zone
    #[arg(long, value_name = "TEXT", default_value = "")]
    pub(super) prefix: String,
    /// Zones that the drones of the network are authorized for, or meet the conditions of, so that they close nothing:
    /// req_authorization or conditional for all of the kind, or an identifier
    #[arg(long, value_name = "KIND|IDENTIFIER", value_delimiter = ',')]
    pub(super) authorized: Vec<String>,
    #[command(flatten)]
    edge: EdgeArguments,
    /// Ask the edge what the import would do; nothing changes
    #[arg(long, conflicts_with = "check")]
    dry_run: bool,
    /// Look at the feed over --network, without an edge
    #[arg(long)]
    check: bool,
    #[command(flatten)]
    pub(super) network: NetworkArguments,
    /// With --check: the time for which it is told what is in force, in RFC 3339 [default: now]
    #[arg(help_heading = "Check", long, value_name = "TIME", requires = "check")]
    pub(super) at: Option<Timestamp>,
    /// Write JSON
    #[arg(long)]
    pub(super) json: bool,
}

impl Import {
    pub(super) fn run(&self, output: &Output) -> Result<Verdict, Stop> {
        // Under a name that they share, two feeds would lift each other's zones.
        if !self.check && self.feed.is_none() && files::is_standard_stream(&self.file) {
            let problem = "standard input has no name; name the feed with --feed";
            return Err(Stop::Usage(problem.to_owned()));
        }
        let text = files::read_text(&self.file)?;
        if self.check {
            return check(self, &text, output);
        }
        let remote = Remote::of(
            &self.edge.edge,
            self.edge.token_file.as_deref(),
            START_OR_NAME.to_owned(),
        )?;
        let media_type = match ForeignFormat::of_markup(&text) {
            Some(_) => KML_MEDIA_TYPE,
            None => JSON,
        };
        let feed = self.feed();
        let query = [
            ("feed", feed.as_str()),
            ("prefix", self.prefix.as_str()),
            ("authorized", &self.authorized.join(",")),
            ("validate_only", if self.dry_run { "true" } else { "false" }),
        ];
        let answer =
            runtime()?.block_on(remote.post("/v1/zones:import", &query, (media_type, text)))?;
        let told: ZoneImport<'_> = serde_json::from_slice(&answer)
            .map_err(|error| Stop::failed(format!("the edge's answer cannot be read: {error}")))?;
        match self.json {
            true => output.json(&serde_json::to_value(&told).map_err(Stop::failed)?)?,
            false => tell(&told, output)?,
        }
        Ok(verdict(told.counts.refused))
    }

    /// The name of the feed.
    pub(super) fn feed(&self) -> String {
        let of_file = || {
            self.file
                .file_stem()
                .map(|name| name.to_string_lossy().into_owned())
        };
        self.feed.clone().or_else(of_file).unwrap_or_default()
    }
}

pub(super) fn verdict(refused: usize) -> Verdict {
    match refused {
        0 => Verdict::Done,
        _ => Verdict::Negative,
    }
}

fn tell(told: &ZoneImport<'_>, output: &Output) -> Result<(), Stop> {
    for note in &told.notes {
        output.note(&note_text(
            note.identifier.as_deref(),
            &note.pointer,
            &note.message,
        ));
    }
    for zone in &told.refused {
        for fault in &zone.faults {
            output.warn(&refusal_text(zone.identifier.as_deref(), fault));
        }
        if zone.is_proposed {
            let zone = zone.identifier.as_deref().unwrap_or_default();
            output.note(&format!(
                "{zone}: its shape waits as a proposal, closed at all heights and always"
            ));
        }
    }
    for zone in &told.zones {
        let action = match zone.action {
            ImportAction::Created => "created",
            ImportAction::Changed => "changed",
            ImportAction::Unchanged => "unchanged",
            ImportAction::Removed => "removed",
            ImportAction::Held => "removal waits",
            ImportAction::Kept => "kept as it was",
        };
        let force = match (zone.in_force, zone.authorized) {
            (true, _) => ", in force",
            (false, true) => ", authorized",
            (false, false) => "",
        };
        output.line(&format!("{}: {action}, {}{force}", zone.id, zone.kind))?;
    }
    let counts = told.counts;
    let proposed = match counts.proposed {
        0 => String::new(),
        count => format!(" ({count} of them proposed)"),
    };
    output.line(&format!(
        "{} from {}: created {}, changed {}, unchanged {}, removed {}, waiting {}, kept {}, refused: {}{proposed}; {} plans met",
        told.format,
        told.feed,
        counts.created,
        counts.changed,
        counts.unchanged,
        counts.removed,
        counts.held,
        counts.kept,
        counts.refused,
        told.plan_count,
    ))
}

/// One repair, or what is not acted on.
pub(super) fn note_text(identifier: Option<&str>, pointer: &str, message: &str) -> String {
    let zone = identifier.map_or_else(String::new, |identifier| format!("{identifier} "));
    format!("{zone}{pointer}: {message}")
}

/// Why a zone is refused.
pub(super) fn refusal_text(identifier: Option<&str>, fault: &Fault) -> String {
    let identifier = identifier.unwrap_or("without identifier");
    let hint = fault
        .hint
        .as_deref()
        .map_or_else(String::new, |hint| format!("; {hint}"));
    format!(
        "refused {identifier}: {}: {} ({}){hint}",
        fault.pointer, fault.message, fault.code
    )
}

//! What is closed before the failure: zones from a file, and what an operator closes on the command line.

use super::clock;
use super::files;
use super::names;
use super::output::Output;
use super::stop::Stop;
use crate::airspace::{Airspace, Change, Closure, DEFAULT_MARGIN_M, Zone};
use crate::formats::{CloseTarget, FeedTerms, ForeignFormat, miss_hint, read_feed, read_zones};
use crate::geo::Frame;
use crate::network::{NodeIx, SegmentIx, Topology};
use clap::Args;
use jiff::{SignedDuration, Timestamp};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Id of the closure that `--close`, or `close` in a line of requests, puts where no zone has it.
const OPERATOR_CLOSURE: &str = "close";
/// A command works on one topology, so any number does.
const TOPOLOGY_REVISION: u64 = 1;

/// What is closed, and when it counts.
#[derive(Debug, Args)]
#[command(next_help_heading = "Airspace")]
pub(super) struct AirspaceArguments {
    /// No-fly zones: GeoJSON, ED-269, ED-318, KML or a plan of QGroundControl; can be given more
    /// than once
    #[arg(long, value_name = "FILE")]
    zones: Vec<PathBuf>,
    /// Close a node or a segment before the failure: a node id, a segment id, or A,B; can be given more than once
    #[arg(long, value_name = "SEGMENT|NODE")]
    close: Vec<String>,
    /// The time, for zones with windows, in RFC 3339 such as 2026-11-27T18:00:00Z [default: now]
    #[arg(long, value_name = "TIME")]
    at: Option<Timestamp>,
    /// A zone counts when a window of it meets the time from --at on: seconds, or such as 90min
    #[arg(long, value_name = "DURATION", default_value = "60min", value_parser = duration)]
    horizon: SignedDuration,
}

impl AirspaceArguments {
    /// The airspace with all of this applied.
    pub(super) fn open(&self, topology: &Arc<Topology>, output: &Output) -> Result<Airspace, Stop> {
        self.open_at(topology, None, output)
    }

    /// The same at another time where it names none itself.
    pub(super) fn open_at(
        &self,
        topology: &Arc<Topology>,
        otherwise: Option<Timestamp>,
        output: &Output,
    ) -> Result<Airspace, Stop> {
        let as_of = self.at.or(otherwise).unwrap_or_else(clock::now);
        let mut changes = Vec::new();
        for zone in zones_in(&self.zones, topology.frame())? {
            let closure = Closure::of_zone(topology, zone.clone());
            let meets_nothing = closure.hits.segments.is_empty() && closure.hits.nodes.is_empty();
            if meets_nothing && zone.terms().closes() {
                let hint = miss_hint(&zone, topology);
                output.warn(&format!("zone '{}': {hint}", zone.id()));
            }
            changes.push(Change::Put(Arc::new(closure)));
        }
        let targets = self.close.iter();
        let targets: Result<Vec<CloseTarget>, Stop> = targets
            .map(|target| names::close_target(topology, target))
            .collect();
        let open = Airspace::open(topology.clone(), TOPOLOGY_REVISION, as_of, self.horizon);
        Ok(closing(&open.apply(&changes, as_of), &targets?))
    }
}

/// Reads the zones of files, in their order.
pub(super) fn zones_in(paths: &[PathBuf], frame: &Frame) -> Result<Vec<Arc<Zone>>, Stop> {
    let mut zones: Vec<Arc<Zone>> = Vec::new();
    for path in paths {
        for zone in zones_in_file(path, frame)? {
            if zones.iter().any(|other| other.id() == zone.id()) {
                let problem = format!(
                    "{}: the id '{}' is that of a zone of another file; ids are unique",
                    path.display(),
                    zone.id()
                );
                return Err(Stop::failed(problem));
            }
            zones.push(Arc::new(zone));
        }
    }
    Ok(zones)
}

fn zones_in_file(path: &Path, frame: &Frame) -> Result<Vec<Zone>, Stop> {
    let text = files::read_text(path)?;
    if ForeignFormat::of_text(&text).is_some_and(ForeignFormat::has_zones) {
        return zones_in_feed(path, &text, frame);
    }
    read_zones(&text, frame).map_err(|problems| {
        let source = path.display().to_string();
        Stop::all_of(&source, &problems)
    })
}

/// The zones of a feed, of which none may be refused: nothing was in force before that could stay.
fn zones_in_feed(path: &Path, text: &str, frame: &Frame) -> Result<Vec<Zone>, Stop> {
    let source = path.display().to_string();
    let terms = FeedTerms {
        feed: &source,
        prefix: "",
        margin_m: DEFAULT_MARGIN_M,
    };
    let feed = read_feed(text, &terms, frame)
        .map_err(|problem| Stop::all_of(&source, std::slice::from_ref(&problem)))?;
    let (mut zones, mut problems) = (Vec::new(), Vec::new());
    for zone in feed.zones {
        match zone.outcome {
            Ok(read) => zones.extend(read),
            Err(found) => problems.extend(found),
        }
    }
    match problems.is_empty() {
        true => Ok(zones),
        false => Err(Stop::all_of(&source, &problems)),
    }
}

/// The airspace with more closed by an operator; the same one where that is nothing.
pub(super) fn closing(airspace: &Airspace, targets: &[CloseTarget]) -> Airspace {
    if targets.is_empty() {
        return airspace.clone();
    }
    let (mut nodes, mut segments): (Vec<NodeIx>, Vec<SegmentIx>) = Default::default();
    for target in targets {
        match target {
            CloseTarget::Node(node) => nodes.push(*node),
            CloseTarget::Segment(segment) => segments.push(*segment),
        }
    }
    let mut id = OPERATOR_CLOSURE.to_owned();
    while airspace.closure(&id).is_some() {
        id.push('\'');
    }
    let reason = "closed on the command line".to_owned();
    let closure = Closure::of_operator(id, reason, nodes, segments);
    airspace.apply(&[Change::Put(Arc::new(closure))], airspace.as_of())
}

/// A duration as seconds, or with its units.
pub(super) fn duration(text: &str) -> Result<SignedDuration, String> {
    let duration = match text.parse::<f64>() {
        Ok(seconds) => {
            SignedDuration::try_from_secs_f64(seconds).map_err(|error| error.to_string())
        }
        Err(_) => text
            .parse::<SignedDuration>()
            .map_err(|_| "give seconds, or a duration such as 60min or 1h30m".to_owned()),
    }?;
    match duration.is_negative() {
        true => Err("a duration cannot be negative".to_owned()),
        false => Ok(duration),
    }
}

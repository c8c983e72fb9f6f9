//! `skyway zone import --check`: what is in a feed and what of it is in force at a time, without an
//! edge.

use super::import::{Import, note_text, refusal_text, verdict};
use crate::airspace::DEFAULT_MARGIN_M;
use crate::airspace::{Airspace, Change, Closure};
use crate::cli::clock;
use crate::cli::output::Output;
use crate::cli::stop::{Stop, Verdict};
use crate::formats::{FeedTerms, ZoneFeed, read_feed, zone_to_feature};
use crate::network::Topology;
use crate::wire::Fault;
use jiff::SignedDuration;
use serde_json::{Value, json};
use std::sync::Arc;

/// Reads a feed over a network and tells what becomes of each zone.
pub(super) fn check(import: &Import, text: &str, output: &Output) -> Result<Verdict, Stop> {
    let network = import.network.load(output)?;
    let topology = &network.topology;
    let feed_name = import.feed();
    let terms = FeedTerms {
        feed: &feed_name,
        prefix: &import.prefix,
        margin_m: DEFAULT_MARGIN_M,
    };
    let mut feed = read_feed(text, &terms, topology.frame())
        .map_err(|problem| Stop::failed(format!("{}: {problem}", import.file.display())))?;
    feed.authorize(&import.authorized);
    let at = import.at.unwrap_or_else(clock::now);
    let changes = feed
        .zones
        .iter()
        .flat_map(|zone| zone.outcome.iter().flatten());
    let changes: Vec<Change> = changes
        .map(|zone| Closure::of_zone(topology, Arc::new(zone.clone())))
        .map(|closure| Change::Put(Arc::new(closure)))
        .collect();
    // What counts now, and nothing that is to come.
    let airspace = Airspace::open(topology.clone(), 1, at, SignedDuration::ZERO);
    let airspace = airspace.apply(&changes, at);
    let refused = feed
        .zones
        .iter()
        .filter(|zone| zone.outcome.is_err())
        .count();
    match import.json {
        true => output.json(&told(&feed, &airspace, topology))?,
        false => tell(&feed, &airspace, output)?,
    }
    Ok(verdict(refused))
}

fn told(feed: &ZoneFeed, airspace: &Airspace, topology: &Topology) -> Value {
    let zones: Vec<Value> = feed
        .zones
        .iter()
        .flat_map(|zone| zone.outcome.iter().flatten())
        .map(|zone| json!({"zone": zone_to_feature(zone), "in_force": airspace.is_in_force(zone.id())}))
        .collect();
    let refused: Vec<Value> = feed
        .zones
        .iter()
        .filter_map(|zone| {
            let problems = zone.outcome.as_ref().err()?;
            let faults: Vec<Fault> = problems.iter().map(fault).collect();
            Some(json!({"identifier": zone.identifier, "pointer": zone.pointer, "faults": faults}))
        })
        .collect();
    let notes: Vec<Value> = feed
        .notes
        .iter()
        .map(|note| json!({"identifier": note.identifier, "pointer": note.pointer, "message": note.message}))
        .collect();
    let closed = airspace.closed();
    let nodes = topology.nodes().filter(|&node| closed.closes_node(node));
    let segments = topology
        .segments()
        .filter(|&segment| closed.closes_segment(segment));
    json!({
        "format": feed.format.name(),
        "at": airspace.as_of().to_string(),
        "zones": zones,
        "refused": refused,
        "notes": notes,
        "further_notes": feed.further_notes,
        "closed_nodes": nodes.map(|node| topology.node_id(node)).collect::<Vec<&str>>(),
        "closed_segments": segments.map(|segment| topology.segment_id(segment)).collect::<Vec<_>>(),
    })
}

fn tell(feed: &ZoneFeed, airspace: &Airspace, output: &Output) -> Result<(), Stop> {
    for note in &feed.notes {
        output.note(&note_text(
            note.identifier.as_deref(),
            &note.pointer,
            &note.message,
        ));
    }
    let (mut imported, mut refused) = (0, 0);
    for zone in &feed.zones {
        match &zone.outcome {
            Ok(zones) => {
                imported += 1;
                for zone in zones {
                    let terms = zone.terms();
                    let force = match (terms.closes(), airspace.is_in_force(zone.id())) {
                        (true, true) => "in force",
                        (true, false) => "not in force",
                        (false, _) if terms.is_authorized => "authorized",
                        (false, _) => "shown",
                    };
                    output.line(&format!("{}: {}, {force}", zone.id(), terms.kind.name()))?;
                }
            }
            Err(problems) => {
                refused += 1;
                for problem in problems {
                    output.warn(&refusal_text(zone.identifier.as_deref(), &fault(problem)));
                }
            }
        }
    }
    let at = airspace.as_of();
    output.line(&format!(
        "{}: imported: {imported}, refused: {refused}, at {at}",
        feed.format.name()
    ))
}

fn fault(problem: &crate::formats::ZoneProblem) -> Fault {
    Fault {
        code: problem.code.to_owned(),
        pointer: problem.pointer.clone(),
        message: problem.message.clone(),
        hint: problem.hint.clone(),
    }
}

//! What a plan rests on, told to a reader who compares it with the world: every figure of it.

use super::written::WrittenRules;
use super::{FlightDocument, FlightDocumentFault};
use crate::flight::{Airframe, FlightRules, TimedClosure};
use crate::network::{NodeIx, Topology};
use jiff::{SignedDuration, Timestamp};
use serde_json::Value;

/// Pads and legs of other plans told one by one.
const TOLD_MAX: usize = 10;

/// A figure of rules or airframe that is not what is bundled.
#[derive(Clone, Debug, PartialEq)]
pub struct DifferingPremise {
    /// Its place in the document: `rules.time_margin_s`.
    pub name: String,
    /// What the document says.
    pub value: Value,
    /// What the default rules say, or the bundled airframe of that name; of another name, the default one. Null
    /// where that has no such figure.
    pub default: Value,
}

/// Every premise that differs from the default rules and the bundled airframe.
///
/// # Errors
/// Where a figure cannot be written.
pub fn differing_premises(
    document: &FlightDocument,
) -> Result<Vec<DifferingPremise>, FlightDocumentFault> {
    let bundled = [Airframe::phantom3(), Airframe::m100()];
    let of_this_name = bundled
        .iter()
        .find(|bundled| bundled.name == document.airframe.name);
    let [airframe, default] =
        [&document.airframe, of_this_name.unwrap_or(&bundled[0])].map(serde_json::to_value);
    let [rules, default_rules] = [&document.rules, &FlightRules::default()]
        .map(|rules| serde_json::to_value(WrittenRules::of(rules)));
    let mut premises = Vec::new();
    let written = |value: serde_json::Result<Value>| {
        value.map_err(|error| FlightDocumentFault::Unreadable {
            reason: error.to_string(),
        })
    };
    differences(
        "airframe",
        &written(airframe)?,
        &written(default)?,
        &mut premises,
    );
    differences(
        "rules",
        &written(rules)?,
        &written(default_rules)?,
        &mut premises,
    );
    Ok(premises)
}

fn differences(path: &str, value: &Value, default: &Value, premises: &mut Vec<DifferingPremise>) {
    if let Value::Object(members) = value {
        for (name, member) in members {
            let path = format!("{path}.{name}");
            differences(&path, member, &default[name.as_str()], premises);
        }
    } else if value != default {
        premises.push(DifferingPremise {
            name: path.to_owned(),
            value: value.clone(),
            default: default.clone(),
        });
    }
}

/// What a plan rests on, line by line; all but what differs from the defaults, which
/// [`differing_premises`] tells.
pub fn premises_lines(document: &FlightDocument, topology: &Topology) -> Vec<String> {
    let at = |seconds_s: f64| instant(document.zero, seconds_s);
    let start = &document.start;
    let mut lines = vec![
        format!(
            "{} with {} kg and {} of its battery",
            document.airframe.name, document.payload_kg, start.battery
        ),
        format!(
            "from node '{}' at {}, {}, in a plan that began at {}",
            topology.node_id(start.node),
            at(start.at_s),
            if start.on_ground {
                "on the ground"
            } else {
                "in flight"
            },
            at(document.began_s),
        ),
        format!(
            "landed by {}, and never less than {} of the battery",
            at(document.deadline_s),
            document.reserve
        ),
    ];
    if start.flown_m != 0.0 || start.drawn != 0.0 {
        lines.push(format!(
            "after {} m flown and {} of the battery drawn before",
            start.flown_m, start.drawn
        ));
    }
    lines.extend(winds(document));
    lines.extend(in_the_way(document, topology));
    lines
}

fn winds(document: &FlightDocument) -> impl Iterator<Item = String> {
    let calm = |east_mps: f64, north_mps: f64| {
        if east_mps == 0.0 && north_mps == 0.0 {
            "no wind".to_owned()
        } else {
            format!("wind of {east_mps} m/s to the east and {north_mps} m/s to the north")
        }
    };
    let base = calm(document.wind.base.east_mps, document.wind.base.north_mps);
    let patches = document.wind.patches.iter().map(move |patch| {
        let wind = calm(patch.wind.east_mps, patch.wind.north_mps);
        let window = window(document.zero, patch.from_s, patch.until_s);
        format!("{wind} {window}")
    });
    std::iter::once(base).chain(patches)
}

fn in_the_way(document: &FlightDocument, topology: &Topology) -> Vec<String> {
    let zero = document.zero;
    let situation = &document.situation;
    let closures = situation.closures.iter().zip(&document.closure_ids);
    let mut lines: Vec<String> = closures
        .map(|(closure, id)| {
            let margins = if closure.widened { ", widened" } else { "" };
            let window = window(zero, closure.from_s, closure.until_s);
            let closes = closes(closure, topology);
            format!("closure '{id}' {window}{margins}, of {closes}")
        })
        .collect();
    if lines.is_empty() {
        lines.push("nothing closed".to_owned());
    }
    let stays = situation.reservations.iter().map(|stay| {
        format!(
            "pad {} of node '{}' reserved {}",
            stay.pad,
            topology.node_id(stay.node),
            window(zero, stay.from_s, stay.until_s)
        )
    });
    lines.extend(told(stays, "reserved pads"));
    let legs = situation.traffic.iter().map(|leg| {
        format!(
            "another plan on segment '{}' from node '{}' {}",
            topology.segment_id(leg.segment),
            topology.node_id(leg.from),
            window(zero, leg.enters_s, leg.leaves_s)
        )
    });
    lines.extend(told(legs, "legs of other plans"));
    let stations = situation.swap_stations.iter();
    let stations: Vec<&str> = stations.map(|&node| topology.node_id(node)).collect();
    if !stations.is_empty() {
        lines.push(format!("batteries swapped at {}", stations.join(", ")));
    }
    let closed = document.closed_segments.iter();
    lines.extend(closed.map(|&segment| {
        let id = topology.segment_id(segment);
        format!("segment '{id}' closed for this plan alone")
    }));
    lines
}

/// What a closure closes: a plan whose closures close less proves less.
fn closes(closure: &TimedClosure, topology: &Topology) -> String {
    let segments = closure.segments.iter();
    let segments = segments.map(|&segment| topology.segment_id(segment).into_owned());
    let ids = |nodes: &[NodeIx]| -> Vec<String> {
        let ids = nodes.iter().map(|&node| topology.node_id(node).to_owned());
        ids.collect()
    };
    let all = [
        ("segments", segments.collect()),
        ("nodes", ids(&closure.nodes)),
        ("pads at", ids(&closure.pads)),
    ];
    let some = all.iter().filter(|(_, ids)| !ids.is_empty());
    let told: Vec<String> = some
        .map(|(what, ids)| {
            let first = &ids[..ids.len().min(TOLD_MAX)];
            match ids.len() - first.len() {
                0 => format!("{what} {}", first.join(", ")),
                more => format!("{what} {} and {more} more", first.join(", ")),
            }
        })
        .collect();
    match told.is_empty() {
        true => "nothing".to_owned(),
        false => told.join("; "),
    }
}

/// The first entries, and how many there are beyond them.
fn told(entries: impl ExactSizeIterator<Item = String>, what: &str) -> Vec<String> {
    let beyond = entries.len().saturating_sub(TOLD_MAX);
    let mut lines: Vec<String> = entries.take(TOLD_MAX).collect();
    if beyond > 0 {
        lines.push(format!("{beyond} more {what}, which --json lists"));
    }
    lines
}

fn window(zero: Timestamp, from_s: f64, until_s: f64) -> String {
    match (from_s.is_finite(), until_s.is_finite()) {
        (true, true) => format!(
            "from {} to {}",
            instant(zero, from_s),
            instant(zero, until_s)
        ),
        (true, false) => format!("from {} on", instant(zero, from_s)),
        (false, true) => format!("until {}", instant(zero, until_s)),
        (false, false) => "at all times".to_owned(),
    }
}

/// An instant to the millisecond, in RFC 3339 where that has a year for it.
fn instant(zero: Timestamp, seconds_s: f64) -> String {
    if seconds_s == f64::INFINITY {
        return "any time".to_owned();
    }
    let since = SignedDuration::try_from_secs_f64((seconds_s * 1000.0).round() / 1000.0);
    let instant = since.ok().and_then(|since| zero.checked_add(since).ok());
    instant.map_or_else(
        || format!("{seconds_s} s after {zero}"),
        |instant| instant.to_string(),
    )
}

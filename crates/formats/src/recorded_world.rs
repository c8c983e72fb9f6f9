//! The world of a recorded answer, put together again from what was written down of it.

use crate::airspace::{Airspace, Cause, Change, Closure, Hits};
use crate::network::Topology;
use crate::report::{ReadReport, read_report};
use crate::wire::{Record, RecordedClosure, RecordedWorld};
use crate::zones::{ZoneId, zone_from_feature};
use jiff::{SignedDuration, Timestamp};
use std::sync::Arc;
use thiserror::Error;

/// Why a record cannot be computed again.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum RecordError {
    /// A part of it cannot be read.
    #[error("{what} of the record cannot be read: {message}")]
    Unreadable {
        /// Which part.
        what: &'static str,
        /// What is wrong with it.
        message: String,
    },
    /// A closure names something that the network does not have.
    #[error("closure {closure} of the record names {name}, which the network does not have")]
    Missing {
        /// The closure.
        closure: String,
        /// What it names.
        name: String,
    },
}

impl RecordError {
    fn unreadable(what: &'static str, error: &dyn std::fmt::Display) -> Self {
        Self::Unreadable {
            what,
            message: error.to_string(),
        }
    }
}

/// The airspace and the report that a recorded answer was computed from.
///
/// # Errors
/// When the record cannot be read, or is of another network.
pub fn recorded_question(
    record: &Record<'_>,
    topology: &Arc<Topology>,
) -> Result<(Airspace, ReadReport), RecordError> {
    let mut airspace = recorded_airspace(&record.world, topology)?;
    if record.world.flight.is_some() {
        // An answer in flight looks at what has begun when it is given.
        let answered_at = record.answered_at.parse::<Timestamp>();
        let answered_at =
            answered_at.map_err(|error| RecordError::unreadable("the time", &error))?;
        airspace = airspace.apply(&[], answered_at);
    }
    let report = serde_json::to_value(&record.settled_report)
        .map_err(|error| RecordError::unreadable("the report", &error))?;
    let read = read_report(&report, &airspace)
        .map_err(|error| RecordError::unreadable("the report", &error))?;
    Ok((airspace, read))
}

fn recorded_airspace(
    world: &RecordedWorld<'_>,
    topology: &Arc<Topology>,
) -> Result<Airspace, RecordError> {
    let as_of: Timestamp = world
        .as_of
        .parse()
        .map_err(|error| RecordError::unreadable("the time", &error))?;
    let horizon = SignedDuration::try_from_secs_f64(world.horizon_s);
    let horizon = horizon.map_err(|error| RecordError::unreadable("the horizon", &error))?;
    let closures = world.closures.iter();
    let closures: Result<Vec<Change>, RecordError> = closures
        .map(|closure| Ok(Change::Put(Arc::new(closure_of(closure, topology)?))))
        .collect();
    let open = Airspace::open(topology.clone(), world.topology_revision, as_of, horizon);
    Ok(open.apply(&closures?, as_of))
}

fn closure_of(recorded: &RecordedClosure<'_>, topology: &Topology) -> Result<Closure, RecordError> {
    let id = recorded.id.to_string();
    if let Some(feature) = &recorded.zone {
        let zone = zone_from_feature(feature, ZoneId::Fixed(&id), topology.frame());
        let zone = zone.map_err(|problems| {
            let first = problems.first().map(ToString::to_string);
            let message = format!("zone {id}: {}", first.unwrap_or_default());
            RecordError::unreadable("a zone", &message)
        })?;
        return Ok(Closure::of_zone(topology, Arc::new(zone)));
    }
    let missing = |name: &str| RecordError::Missing {
        closure: id.clone(),
        name: name.to_owned(),
    };
    let segments = recorded.segments.iter().map(|segment| {
        topology
            .find_segment(segment)
            .ok_or_else(|| missing(segment))
    });
    let find_node = |node: &crate::wire::Id<'_>| {
        let name = node.text();
        topology.node(name).ok_or_else(|| missing(name))
    };
    Ok(Closure {
        hits: Hits::new(
            segments.collect::<Result<_, _>>()?,
            recorded
                .nodes
                .iter()
                .map(find_node)
                .collect::<Result<_, _>>()?,
        ),
        pads: recorded
            .pads
            .iter()
            .map(find_node)
            .collect::<Result<_, _>>()?,
        // It counted; for how long is of no matter here.
        windows: Vec::new(),
        cause: Cause::Operator {
            reason: String::new(),
        },
        id: id.clone(),
    })
}

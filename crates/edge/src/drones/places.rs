//! Whether a place that a drone states counts: one rule for telemetry, and for what it says of its
//! plan.
//!
//! A receiver without a fix, or with swapped coordinates, states a place at which the drone cannot
//! be. Such a place moves no plan. Three of them in a row that agree with each other are believed:
//! then it was the last accepted place that was wrong.

use super::{Doubt, Sighting, progress};
use crate::Edge;
use crate::plans::entry::PlanEntry;
use crate::snapshot::Snapshot;
use skyway_engine::flight::{ImpossiblePlace, LastPlace, check_place};
use skyway_engine::network::Topology;
use std::fmt;
use std::sync::Arc;

/// How many places in a row that agree with each other are believed.
const BELIEVED_AT: u32 = 3;

/// Why a place is not taken.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Untaken {
    /// A later one is known.
    Outdated,
    /// The drone cannot be there.
    Impossible(ImpossiblePlace),
}

impl Untaken {
    /// The code of the warning.
    pub(crate) fn code(self) -> &'static str {
        match self {
            Self::Outdated => "position_outdated",
            Self::Impossible(_) => "location_doubtful",
        }
    }
}

impl fmt::Display for Untaken {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Outdated => write!(formatter, "a later position of this drone is known"),
            Self::Impossible(why) => write!(
                formatter,
                "'location' {why}; it is not taken until {BELIEVED_AT} in a row agree with each other"
            ),
        }
    }
}

impl Edge {
    /// Judges the place of a sighting against the last accepted one, or without one against the leg
    /// of the drone's plan and the network.
    ///
    /// # Errors
    /// Why it does not count.
    pub(crate) fn judge_place(
        &self,
        snapshot: &Snapshot,
        plan: Option<&Arc<PlanEntry>>,
        drone: &str,
        sighting: &Sighting,
    ) -> Result<(), Untaken> {
        let topology = snapshot.topology();
        let before = self.drones.last(drone);
        if before
            .as_ref()
            .is_some_and(|before| before.seen_at > sighting.seen_at)
        {
            return Err(Untaken::Outdated);
        }
        let last = before.map(|before| last_place(topology, &before, sighting));
        let leg = plan.filter(|_| last.is_none()).and_then(|plan| {
            let progress = progress::progress(topology, plan, &self.drones, sighting.seen_at)?;
            Some(progress::leg_ahead(plan, &progress).0)
        });
        let place = sighting.position(topology.frame());
        let Err(why) = check_place(topology, place, last, leg) else {
            return Ok(());
        };
        let in_a_row = self.drones.doubt(drone, |earlier| {
            let Some(earlier) = earlier else {
                return Doubt::first(sighting.clone());
            };
            if earlier.last.seen_at >= sighting.seen_at {
                // Sent twice.
                return earlier.clone();
            }
            let last = last_place(topology, &earlier.last, sighting);
            let agrees = check_place(topology, place, Some(last), None).is_ok();
            Doubt {
                in_a_row: if agrees { earlier.in_a_row + 1 } else { 1 },
                last: sighting.clone(),
            }
        });
        match in_a_row >= BELIEVED_AT {
            true => Ok(()),
            false => Err(Untaken::Impossible(why)),
        }
    }
}

fn last_place(topology: &Topology, before: &Sighting, sighting: &Sighting) -> LastPlace {
    LastPlace {
        point: before.position(topology.frame()),
        before_s: sighting
            .seen_at
            .duration_since(before.seen_at)
            .as_secs_f64(),
    }
}

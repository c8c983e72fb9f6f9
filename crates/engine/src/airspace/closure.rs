//! Closures: a cause that makes segments, nodes or pads unusable, and from when until when.

use super::hits::Hits;
use super::schedule::merged;
use super::zone::{Window, Zone, ZoneFault};
use crate::network::{Correspondence, NodeIx, SegmentIx, Topology};
use jiff::{SignedDuration, Timestamp};
use std::sync::Arc;

/// Why something is closed.
#[derive(Clone, Debug, PartialEq)]
pub enum Cause {
    /// A no-fly zone meets it.
    Zone(Arc<Zone>),
    /// A drone reported a failure there.
    Report {
        /// Id of the failure report.
        report: String,
    },
    /// An operator said so.
    Operator {
        /// The operator's words.
        reason: String,
    },
}

/// A cause with what it closes. Things are open when their last cause has ended.
#[derive(Clone, Debug, PartialEq)]
pub struct Closure {
    /// Unique among the closures of an airspace; that of a zone is the zone's.
    pub id: String,
    /// Why.
    pub cause: Cause,
    /// When; empty for always. An airspace makes those of a zone's schedules for the days around
    /// its time; until then they are all that may count.
    pub windows: Vec<Window>,
    /// The segments and nodes it closes, worked out beforehand on the topology of the airspace.
    pub hits: Hits,
    /// The nodes whose recharging pads it closes, though they can be overflown.
    pub pads: Vec<NodeIx>,
}

impl Closure {
    /// The closure of a zone on a topology. This is where geometry is decided; it belongs outside the writer.
    pub fn of_zone(topology: &Topology, zone: Arc<Zone>) -> Self {
        Self {
            id: zone.id().to_owned(),
            windows: zone.windows().to_vec(),
            hits: Hits::of(topology, &zone),
            pads: Vec::new(),
            cause: Cause::Zone(zone),
        }
    }

    /// Whether one of its windows meets the time from an instant on, for so long.
    pub(super) fn meets(&self, now: Timestamp, ahead: SignedDuration) -> bool {
        self.windows.iter().any(|window| window.counts(now, ahead))
    }

    /// The same closure on another network: the ground that a zone covers there, else what is left of what it names.
    ///
    /// # Errors
    /// When a zone cannot be laid on the other network's plane.
    pub fn over(
        &self,
        topology: &Topology,
        correspondence: &Correspondence,
        same_plane: bool,
    ) -> Result<Self, Vec<ZoneFault>> {
        if let Some(zone) = self.zone() {
            let zone = match same_plane {
                true => zone.clone(),
                false => Arc::new(zone.on(topology.frame())?),
            };
            // Its windows may have been changed since by more than the zone says.
            let windows = self.windows.clone();
            return Ok(Self {
                windows,
                ..Self::of_zone(topology, zone)
            });
        }
        let segments = self.hits.segments.iter();
        let nodes = self.hits.nodes.iter();
        let pads = self.pads.iter();
        Ok(Self {
            hits: Hits::new(
                segments
                    .filter_map(|&segment| correspondence.segment(segment))
                    .collect(),
                nodes
                    .filter_map(|&node| correspondence.node(node))
                    .collect(),
            ),
            pads: pads.filter_map(|&node| correspondence.node(node)).collect(),
            ..self.clone()
        })
    }

    /// An operator's closure of nodes and segments, without end.
    pub fn of_operator(
        id: String,
        reason: String,
        nodes: Vec<NodeIx>,
        segments: Vec<SegmentIx>,
    ) -> Self {
        Self {
            id,
            cause: Cause::Operator { reason },
            windows: Vec::new(),
            hits: Hits::new(segments, nodes),
            pads: Vec::new(),
        }
    }

    /// Whether a zone with schedules is its cause, so that it ends again and again.
    pub fn recurs(&self) -> bool {
        self.zone().is_some_and(|zone| zone.recurs())
    }

    /// The same closure with the windows of its zone's schedules around these instants.
    pub(super) fn around(
        &self,
        zone: &Zone,
        instants: impl IntoIterator<Item = Timestamp>,
    ) -> Self {
        let windows = instants
            .into_iter()
            .flat_map(|instant| zone.windows_around(instant));
        Self {
            windows: merged(windows.collect()),
            ..self.clone()
        }
    }

    /// The zone behind it, if a zone is the cause.
    pub fn zone(&self) -> Option<&Arc<Zone>> {
        match &self.cause {
            Cause::Zone(zone) => Some(zone),
            Cause::Report { .. } | Cause::Operator { .. } => None,
        }
    }
}

/// When the windows have ended that count from an instant on without a gap; `None` where they do not end.
pub fn counts_until(
    windows: &[Window],
    now: Timestamp,
    horizon: SignedDuration,
) -> Option<Timestamp> {
    let mut end = now;
    loop {
        let counting = windows.iter().filter(|window| window.counts(end, horizon));
        let ends: Option<Vec<Timestamp>> = counting.map(Window::until).collect();
        let last = ends?.into_iter().max()?;
        if last <= end {
            return Some(end);
        }
        end = last;
    }
}

//! A plan: whose it is, what its drone says that it flies, and what it is to fly instead.

use super::stretches::Stretch;
use crate::planner::{FlightOrder, Version};
use jiff::Timestamp;
use serde::{Deserialize, Serialize};
use skyway_contract as wire;
use skyway_engine::network::NodeIx;
use std::sync::Arc;
use std::sync::atomic::{AtomicU32, Ordering};

/// What holds of a plan beside its state.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct PlanFlags {
    /// Something ahead of its drone has closed, or the wind leaves it short.
    pub(crate) affected: bool,
    /// Nothing has been heard of its end, some time after its arrival.
    pub(crate) overdue: bool,
    /// A wanted version was not acknowledged in its time.
    pub(crate) unacknowledged: bool,
    /// Nothing was heard of its drone in flight for long.
    pub(crate) silent: bool,
    /// Its drone has told in flight where it is: from then on hearing nothing of it means something.
    pub(crate) heard: bool,
}

impl PlanFlags {
    /// What still holds once its drone has said what it flies.
    pub(crate) fn of_taken_up(self) -> Self {
        Self {
            heard: self.heard,
            ..Self::default()
        }
    }

    /// The same of a plan that is affected.
    pub(crate) fn and_affected(self) -> Self {
        Self {
            affected: true,
            ..self
        }
    }
}

/// The priority of a plan that asks for none, of those from 0 to 100.
pub(crate) const PRIORITY: u8 = 50;

/// The pad on which a drone stands since it has landed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct LandedOn {
    pub(crate) node: NodeIx,
    /// Counted from 0.
    pub(crate) pad: u16,
    pub(crate) since: Timestamp,
}

/// The delivery at the registry that a plan is flown for, and how far it is, in memory and in the plan's row.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct FlownFor {
    /// The id of the delivery.
    pub(crate) delivery: Arc<str>,
    /// At how many stops it is to be served.
    pub(crate) stops: u32,
    /// At how many of them, in order, it has been.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub(crate) served: u32,
    /// The id of the node that its drone has landed on.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) landed_on: Option<Arc<str>>,
}

/// Whether a count is left out of a row.
pub(crate) fn is_zero(number: &u32) -> bool {
    *number == 0
}

/// A composition plan.
#[derive(Clone, Debug)]
pub(crate) struct PlanEntry {
    pub(crate) id: Arc<str>,
    /// Whose it is.
    pub(crate) subject: Arc<str>,
    pub(crate) drone_id: Option<Arc<str>>,
    /// The delivery at the registry that it is flown for, if it is for one.
    pub(crate) flown_for: Option<FlownFor>,
    pub(crate) source: NodeIx,
    pub(crate) destination: NodeIx,
    pub(crate) payload_kg: f64,
    pub(crate) airspeed_mps: f64,
    /// From 0 to 100: of those that reach what closed at the same time, the highest is answered first.
    pub(crate) priority: u8,
    /// What was asked for of its flight, where the flight model was on.
    pub(crate) order: Option<FlightOrder>,
    pub(crate) state: wire::PlanState,
    /// What became of it, once it has ended.
    pub(crate) ended_as: Option<wire::EndedAs>,
    pub(crate) flags: PlanFlags,
    /// What the drone says it flies.
    pub(crate) reported: Arc<Version>,
    /// What it is to fly instead, where that is another one.
    pub(crate) wanted: Option<Arc<Version>>,
    /// Further versions that were sent since the reported one: the drone may have taken any of them over.
    pub(crate) sent: Vec<Arc<Version>>,
    /// Whether it has ended, and its drone may still be on its ways or its last pad: they stay taken.
    pub(crate) holds: bool,
    /// The pad that its drone has taken at its end, until it is known to have left.
    pub(crate) landed_on: Option<LandedOn>,
    /// Until when it is a quote: a plan that no drone is named for takes nothing.
    pub(crate) expires_at: Option<Timestamp>,
    /// How often its drone has declined since it last took something over.
    pub(crate) declined: u32,
    /// Ids of the closures that block the reported version.
    pub(crate) affected_by: Vec<String>,
    /// The number of the next version; shared by all states of the plan, as answers take numbers without the writer.
    pub(crate) next_version: Arc<AtomicU32>,
}

// Two states of a plan are the same where all is that a restart needs.
impl PartialEq for PlanEntry {
    fn eq(&self, other: &Self) -> bool {
        // Maps of two snapshots share most plans, and are compared by each value of a leaf that has changed.
        if std::ptr::eq(self, other) {
            return true;
        }
        let numbers = [self, other].map(|plan| plan.next_version.load(Ordering::Relaxed));
        (&self.id, &self.subject, &self.drone_id) == (&other.id, &other.subject, &other.drone_id)
            && self.flown_for == other.flown_for
            && (self.source, self.destination) == (other.source, other.destination)
            && (self.payload_kg, self.airspeed_mps) == (other.payload_kg, other.airspeed_mps)
            && (&self.order, self.priority) == (&other.order, other.priority)
            && (self.state, self.ended_as) == (other.state, other.ended_as)
            && (self.flags, self.holds, self.declined) == (other.flags, other.holds, other.declined)
            && (self.landed_on, self.expires_at) == (other.landed_on, other.expires_at)
            && self.sent == other.sent
            && self.reported == other.reported
            && self.wanted == other.wanted
            && self.affected_by == other.affected_by
            && numbers[0] == numbers[1]
    }
}

impl PlanEntry {
    /// The same but for a change.
    pub(crate) fn with(&self, change: impl FnOnce(&mut Self)) -> Self {
        let mut changed = self.clone();
        change(&mut changed);
        changed
    }

    /// Whether it is still flown, or about to be.
    pub(crate) fn is_active(&self) -> bool {
        self.state != wire::PlanState::Ended
    }

    /// Whether it is only a quote: no drone flies it, and it takes nothing.
    pub(crate) fn is_quote(&self) -> bool {
        self.expires_at.is_some()
    }

    /// Whether it is active and nothing ahead of its drone has closed.
    pub(crate) fn is_as_planned(&self) -> bool {
        self.is_active() && !self.flags.affected
    }

    /// Every version that its drone may be flying, or may take over yet; in their order.
    pub(crate) fn versions(&self) -> impl Iterator<Item = &Arc<Version>> {
        let sent = self.sent.iter();
        std::iter::once(&self.reported)
            .chain(sent)
            .chain(&self.wanted)
    }

    /// What its drone is to fly instead of the reported version; where that is nothing, what it may have taken over before it
    /// was withdrawn.
    pub(crate) fn to_fly(&self) -> impl Iterator<Item = &Version> {
        let withdrawn = self.sent.iter().filter(|_| self.wanted.is_none());
        self.wanted
            .iter()
            .chain(withdrawn)
            .map(|version| &**version)
    }

    /// Whether its drone may be flying a version, or take it over yet.
    pub(crate) fn has_version(&self, number: u32) -> bool {
        self.versions().any(|version| version.number == number)
    }

    /// Whether its drone stands on a pad: it has not departed, or a stay covers the time.
    pub(crate) fn stands_at(&self, now: Timestamp) -> bool {
        let now_s = now.as_microsecond() as f64 / 1e6;
        let stays = self.reported.reservations();
        let covers = |from_s: f64, until_s: f64| from_s <= now_s && now_s <= until_s;
        now < self.reported.departs_at || stays.iter().any(|stay| covers(stay.from_s, stay.until_s))
    }

    /// Whether its drone may simply go on flying the reported version: it leads where the plan goes, and the drone
    /// knows it. A change of the network may leave a version of which neither is true.
    pub(crate) fn may_go_on(&self) -> bool {
        let current = &self.reported;
        let is_known = current.acknowledge_by.is_none();
        is_known && !self.ends_early()
    }

    /// The node at which its drone stays that has no way on: it holds there, or is served there and knows no way after that.
    pub(crate) fn waits_at(&self) -> Option<NodeIx> {
        let version = &self.reported;
        let leads_on = |stretch: &Stretch| stretch.leg().is_some();
        let stays =
            version.composition.legs.is_empty() && !version.stretch.as_ref().is_some_and(leads_on);
        let has_more = self.ends_early() || version.ends_at_stop();
        version
            .holds_at()
            .or_else(|| version.last_node().filter(|_| stays && has_more))
    }

    /// Whether the reported version ends at a stop of the delivery, and its drone has yet to come there.
    pub(crate) fn comes_to_stop(&self, now: Timestamp) -> bool {
        self.reported.ends_at_stop() && now < self.reported.arrives_at()
    }

    /// Whether the reported version ends before the destination though no drone was told to divert.
    pub(crate) fn ends_early(&self) -> bool {
        let last = self.reported.composition.way.nodes.last();
        !self.reported.is_diversion() && last != Some(&self.destination)
    }
}

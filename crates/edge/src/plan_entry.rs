//! A plan: whose it is, what its drone says that it flies, and what it is to fly instead.

use super::planner::{FlightOrder, Version};
use super::stretches::Stretch;
use jiff::Timestamp;
use skyway_contract as wire;
use skyway_engine::network::NodeIx;
use std::sync::Arc;
use std::sync::atomic::{AtomicU32, Ordering};

/// What holds of a plan beside its state.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct PlanFlags {
    /// Something ahead of its drone has closed, or the wind leaves it short.
    pub(super) affected: bool,
    /// Nothing has been heard of its end, some time after its arrival.
    pub(super) overdue: bool,
    /// A wanted version was not acknowledged in its time.
    pub(super) unacknowledged: bool,
    /// Nothing was heard of its drone in flight for long.
    pub(super) silent: bool,
}

impl PlanFlags {
    /// The same of a plan that is affected.
    pub(super) fn and_affected(self) -> Self {
        Self {
            affected: true,
            ..self
        }
    }
}

/// The priority of a plan that asks for none, of those from 0 to 100.
pub(super) const PRIORITY: u8 = 50;

/// The pad on which a drone stands since it has landed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct LandedOn {
    pub(super) node: NodeIx,
    /// Counted from 0.
    pub(super) pad: u16,
    pub(super) since: Timestamp,
}

/// The delivery at the registry that a plan is flown for, and how far it is.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct FlownFor {
    /// The id of the delivery.
    pub(super) delivery: Arc<str>,
    /// At how many stops it is to be served.
    pub(super) stops: u32,
    /// At how many of them, in order, it has been.
    pub(super) served: u32,
    /// The id of the node that its drone has landed on.
    pub(super) landed_on: Option<Arc<str>>,
}

/// A composition plan.
#[derive(Clone, Debug)]
pub(super) struct PlanEntry {
    pub(super) id: Arc<str>,
    /// Whose it is.
    pub(super) subject: Arc<str>,
    pub(super) drone_id: Option<Arc<str>>,
    /// The delivery at the registry that it is flown for, if it is for one.
    pub(super) flown_for: Option<FlownFor>,
    pub(super) source: NodeIx,
    pub(super) destination: NodeIx,
    pub(super) payload_kg: f64,
    pub(super) airspeed_mps: f64,
    /// From 0 to 100: of those that reach what closed at the same time, the highest is answered first.
    pub(super) priority: u8,
    /// What was asked for of its flight, where the flight model was on.
    pub(super) order: Option<FlightOrder>,
    pub(super) state: wire::PlanState,
    /// What became of it, once it has ended.
    pub(super) ended_as: Option<wire::EndedAs>,
    pub(super) flags: PlanFlags,
    /// What the drone says it flies.
    pub(super) reported: Arc<Version>,
    /// What it is to fly instead, where that is another one.
    pub(super) wanted: Option<Arc<Version>>,
    /// Further versions that were sent since the reported one: the drone may have taken any of them over.
    pub(super) sent: Vec<Arc<Version>>,
    /// Whether it has ended, and its drone may still be on its ways or its last pad: they stay taken.
    pub(super) holds: bool,
    /// The pad that its drone has taken at its end, until it is known to have left.
    pub(super) landed_on: Option<LandedOn>,
    /// Until when it is a quote: a plan that no drone is named for takes nothing.
    pub(super) expires_at: Option<Timestamp>,
    /// How often its drone has declined since it last took something over.
    pub(super) declined: u32,
    /// Ids of the closures that block the reported version.
    pub(super) affected_by: Vec<String>,
    /// The number of the next version; shared by all states of the plan, as answers take numbers without the writer.
    pub(super) next_version: Arc<AtomicU32>,
}

// Two states of a plan are the same where all is that a restart needs.
impl PartialEq for PlanEntry {
    fn eq(&self, other: &Self) -> bool {
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
    /// Whether it is still flown, or about to be.
    pub(super) fn is_active(&self) -> bool {
        self.state != wire::PlanState::Ended
    }

    /// Whether it is only a quote: no drone flies it, and it takes nothing.
    pub(super) fn is_quote(&self) -> bool {
        self.expires_at.is_some()
    }

    /// Whether it is active and nothing ahead of its drone has closed.
    pub(super) fn is_as_planned(&self) -> bool {
        self.is_active() && !self.flags.affected
    }

    /// Every version that its drone may be flying, or may take over yet; in their order.
    pub(super) fn versions(&self) -> impl Iterator<Item = &Arc<Version>> {
        let sent = self.sent.iter();
        std::iter::once(&self.reported)
            .chain(sent)
            .chain(&self.wanted)
    }

    /// Whether its drone may be flying a version, or take it over yet.
    pub(super) fn has_version(&self, number: u32) -> bool {
        self.versions().any(|version| version.number == number)
    }

    /// Whether its drone stands on a pad: it has not departed, or a stay covers the time.
    pub(super) fn stands_at(&self, now: Timestamp) -> bool {
        let now_s = now.as_microsecond() as f64 / 1e6;
        let stays = self.reported.reservations();
        let covers = |from_s: f64, until_s: f64| from_s <= now_s && now_s <= until_s;
        now < self.reported.departs_at || stays.iter().any(|stay| covers(stay.from_s, stay.until_s))
    }

    /// Whether its drone may simply go on flying the reported version: it leads where the plan goes, and the drone
    /// knows it. A change of the network may leave a version of which neither is true.
    pub(super) fn may_go_on(&self) -> bool {
        let current = &self.reported;
        let is_known = current.acknowledge_by.is_none();
        is_known && !self.ends_early()
    }

    /// The node at which its drone stays that has no way on: it holds there, or is served there and knows no way after that.
    pub(super) fn waits_at(&self) -> Option<NodeIx> {
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
    pub(super) fn comes_to_stop(&self, now: Timestamp) -> bool {
        self.reported.ends_at_stop() && now < self.reported.arrives_at()
    }

    /// Whether the reported version ends before the destination though no drone was told to divert.
    pub(super) fn ends_early(&self) -> bool {
        let last = self.reported.composition.way.nodes.last();
        !self.reported.is_diversion() && last != Some(&self.destination)
    }
}

//! The airspace: one immutable snapshot of what is closed, and the one function that makes the next.
//!
//! A reader holds one snapshot for a whole request. A single writer applies [`Change`]s, which share the
//! topology and all that did not change with the snapshot before.

use super::bits::Bits;
use super::closed::ClosedSet;
use super::closure::Closure;
use super::counts::Counts;
use super::zone::Window;
use crate::network::{NodeIx, SegmentIx, Topology};
use jiff::{SignedDuration, Timestamp};
use std::collections::BTreeMap;
use std::ops::Bound;
use std::sync::{Arc, OnceLock};

/// How far the time may go from the instant that the windows of schedules were made around.
const SCHEDULES_STAND_FOR: SignedDuration = SignedDuration::from_hours(24);

/// The one vocabulary of change: what is not a `Change` cannot alter an airspace.
#[derive(Clone, Debug, PartialEq)]
pub enum Change {
    /// Puts a closure, in place of the one with its id if there is one. Putting the same twice changes nothing.
    Put(Arc<Closure>),
    /// Lifts the closure of an id; lifting what is not there changes nothing.
    Lift(String),
}

/// A closure in an airspace, and whether it counts at the snapshot's time.
#[derive(Clone, Debug)]
struct Held {
    closure: Arc<Closure>,
    in_force: bool,
    /// Of what recurs.
    recurring: Option<Recurring>,
}

/// A closure whose zone has schedules.
#[derive(Clone, Debug)]
struct Recurring {
    /// As it was put.
    put: Arc<Closure>,
    /// The instants that its windows were made around: those of both clocks.
    around: Option<[Timestamp; 2]>,
}

impl Held {
    fn new(closure: Arc<Closure>) -> Self {
        let recurring = closure.recurs().then(|| Recurring {
            put: closure.clone(),
            around: None,
        });
        Self {
            closure,
            in_force: false,
            recurring,
        }
    }

    /// As it was put.
    fn put(&self) -> &Arc<Closure> {
        self.recurring
            .as_ref()
            .map_or(&self.closure, |recurring| &recurring.put)
    }

    /// Makes the windows of schedules anew, once the instants are a day away from those that they
    /// were made around.
    fn follow_schedules(&mut self, instants: [Timestamp; 2]) {
        let Some(recurring) = &mut self.recurring else {
            return;
        };
        let is_near = |(made, now): (Timestamp, Timestamp)| {
            made.duration_since(now).abs() < SCHEDULES_STAND_FOR
        };
        if let Some(made) = recurring.around
            && made.into_iter().zip(instants).all(is_near)
        {
            return;
        }
        if let Some(zone) = recurring.put.zone() {
            self.closure = Arc::new(recurring.put.around(zone, instants));
            recurring.around = Some(instants);
        }
    }
}

/// One immutable snapshot of network and closures.
#[derive(Clone, Debug)]
pub struct Airspace {
    topology: Arc<Topology>,
    topology_revision: u64,
    revision: u64,
    opened_at: u64,
    as_of: Timestamp,
    horizon: SignedDuration,
    /// How far a second clock is ahead, by which windows count as well.
    apart: Option<SignedDuration>,
    /// The next instant at which a window turns, once somebody has asked: it is asked for more often than it changes.
    next_change: OnceLock<Option<Timestamp>>,
    closures: BTreeMap<Arc<str>, Held>,
    closed: ClosedSet,
    closed_pads: Bits,
    segment_causes: Counts,
    node_causes: Counts,
    pad_causes: Counts,
}

impl Airspace {
    /// An open airspace over a topology, at revision 0.
    ///
    /// Until a search computes arrival times, a closure counts when one of its windows meets
    /// `[as_of, as_of + horizon]`.
    pub fn open(
        topology: Arc<Topology>,
        topology_revision: u64,
        as_of: Timestamp,
        horizon: SignedDuration,
    ) -> Self {
        Self {
            closed: ClosedSet::empty(&topology),
            closed_pads: Bits::empty(topology.node_count()),
            segment_causes: Counts::zero(topology.segment_count()),
            node_causes: Counts::zero(topology.node_count()),
            pad_causes: Counts::zero(topology.node_count()),
            topology,
            topology_revision,
            revision: 0,
            opened_at: 0,
            as_of,
            horizon,
            apart: None,
            next_change: OnceLock::new(),
            closures: BTreeMap::new(),
        }
    }

    /// The next snapshot: changes in their order, then windows that have opened or closed by `now`.
    ///
    /// Where nothing changes but the time, the revision stays. Costs what the changes hit, plus a pass
    /// over the closures; see `docs/results/engine.md`.
    pub fn apply(&self, changes: &[Change], now: Timestamp) -> Self {
        let mut next = self.clone();
        next.as_of = now;
        let mut effect = Effect::default();
        for change in changes {
            match change {
                Change::Put(closure) => next.put(closure, &mut effect),
                Change::Lift(id) => next.lift(id, &mut effect),
            }
        }
        next.follow_windows(&mut effect);
        next.next_change = OnceLock::new();
        if effect.changed {
            next.revision += 1;
        }
        if effect.opened {
            next.opened_at = next.revision;
        }
        next
    }

    /// The same airspace, one revision later: something else has changed that answers depend on.
    #[must_use]
    pub fn at_next_revision(&self) -> Self {
        Self {
            revision: self.revision + 1,
            ..self.clone()
        }
    }

    /// The same airspace over another network, with what its closures close there.
    ///
    /// The closures have to be those of this airspace, worked out on the other network. They count as before:
    /// the time stays.
    pub fn over(
        &self,
        topology: Arc<Topology>,
        closures: impl IntoIterator<Item = Arc<Closure>>,
    ) -> Self {
        let topology_revision = self.topology_revision + 1;
        let mut next = Self::open(topology, topology_revision, self.as_of, self.horizon);
        next.revision = self.revision + 1;
        // Another network may open ways that no closure closed.
        next.opened_at = next.revision;
        next.apart = self.apart;
        let held = closures.into_iter().map(|closure| {
            let id = Arc::from(closure.id.as_str());
            (id, Held::new(closure))
        });
        next.closures = held.collect();
        next.follow_windows(&mut Effect::default());
        next
    }

    /// The same closures with another look ahead, by one clock: costs a pass over them, and what turns.
    #[must_use]
    pub fn looking_ahead(&self, horizon: SignedDuration) -> Self {
        let mut next = self.beside_clock(None);
        next.horizon = horizon;
        next.follow_windows(&mut Effect::default());
        next
    }

    /// The same airspace beside a second clock that is so far ahead of the time, or behind it: from the next
    /// [`Airspace::apply`] on a window counts if it does by either of them. `None` leaves the time alone.
    #[must_use]
    pub fn beside_clock(&self, apart: Option<SignedDuration>) -> Self {
        let mut beside = self.clone();
        beside.apart = apart;
        beside.next_change = OnceLock::new();
        beside
    }

    /// The network.
    pub fn topology(&self) -> &Arc<Topology> {
        &self.topology
    }

    /// Changes with nodes and segments.
    pub fn topology_revision(&self) -> u64 {
        self.topology_revision
    }

    /// Changes with everything: network, zones, closures, windows that open or close.
    pub fn revision(&self) -> u64 {
        self.revision
    }

    /// The revision of the last change that opened anything.
    pub fn opened_at(&self) -> u64 {
        self.opened_at
    }

    /// The time this snapshot was made for.
    pub fn as_of(&self) -> Timestamp {
        self.as_of
    }

    /// How far ahead a window counts as closing already.
    pub fn horizon(&self) -> SignedDuration {
        self.horizon
    }

    /// What is closed.
    pub fn closed(&self) -> &ClosedSet {
        &self.closed
    }

    /// True when a node's recharging pads are closed, or the node is.
    pub fn closes_pads(&self, node: NodeIx) -> bool {
        self.closed_pads.contains(node.0) || self.closed.nodes.contains(node.0)
    }

    /// The closure of an id, in force or not.
    pub fn closure(&self, id: &str) -> Option<&Arc<Closure>> {
        self.closures.get(id).map(|held| &held.closure)
    }

    /// How many closures there are, in force or not.
    pub fn closure_count(&self) -> usize {
        self.closures.len()
    }

    /// Whether the closure of an id counts now.
    pub fn is_in_force(&self, id: &str) -> bool {
        self.closures.get(id).is_some_and(|held| held.in_force)
    }

    /// Whether one of a closure's windows holds an instant, by either clock; one without windows always is active.
    pub fn is_active(&self, closure: &Closure, now: Timestamp) -> bool {
        let other = self.apart.and_then(|apart| now.saturating_add(apart).ok());
        let mut clocks = std::iter::once(now).chain(other);
        closure.windows.is_empty() || clocks.any(|now| closure.meets(now, SignedDuration::ZERO))
    }

    /// From when a closure that is not active yet counts, which is the horizon before its next window; `None` where it is
    /// active, or nothing of it is to come.
    pub fn closes_from(&self, closure: &Closure, now: Timestamp) -> Option<Timestamp> {
        if self.is_active(closure, now) {
            return None;
        }
        let begins = closure.windows.iter().filter_map(Window::from);
        let next = begins.filter(|&begins| begins > now).min()?;
        Some(next.saturating_sub(self.horizon).unwrap_or(Timestamp::MIN))
    }

    /// All closures by id, each with whether it counts now.
    pub fn closures(&self) -> impl Iterator<Item = (&Arc<Closure>, bool)> {
        let all = self.closures.values();
        all.map(|held| (&held.closure, held.in_force))
    }

    /// The closures by id, from one id on.
    pub fn closures_from(&self, from: Bound<&str>) -> impl Iterator<Item = &Arc<Closure>> {
        let held = self.closures.range::<str, _>((from, Bound::Unbounded));
        held.map(|(_, held)| &held.closure)
    }

    /// The closures that count now, by id.
    pub fn in_force(&self) -> impl Iterator<Item = &Arc<Closure>> {
        let counting = self.closures().filter(|&(_, in_force)| in_force);
        counting.map(|(closure, _)| closure)
    }

    /// The next instant after this snapshot's time at which a window begins or ceases to count.
    pub fn next_change(&self) -> Option<Timestamp> {
        *self.next_change.get_or_init(|| self.seek_next_change())
    }

    fn seek_next_change(&self) -> Option<Timestamp> {
        let apart = [Some(SignedDuration::ZERO), self.apart];
        let changes = apart.into_iter().flatten().filter_map(|apart| {
            let other = self.as_of.saturating_add(apart).ok()?;
            let change = self.next_change_by(other)?;
            change.saturating_sub(apart).ok()
        });
        changes.min()
    }

    fn next_change_by(&self, now: Timestamp) -> Option<Timestamp> {
        let windows = self
            .closures
            .values()
            .flat_map(|held| &held.closure.windows);
        windows
            .filter_map(|window| window.next_change_after(now, self.horizon))
            .min()
    }

    fn put(&mut self, closure: &Arc<Closure>, effect: &mut Effect) {
        if self
            .closures
            .get(closure.id.as_str())
            .is_some_and(|held| held.put() == closure)
        {
            return;
        }
        self.lift(&closure.id, effect);
        let held = Held::new(closure.clone());
        self.closures.insert(Arc::from(closure.id.as_str()), held);
        effect.changed = true;
    }

    fn lift(&mut self, id: &str, effect: &mut Effect) {
        if let Some(held) = self.closures.remove(id) {
            if held.in_force {
                self.release(&held.closure);
                effect.opened = true;
            }
            effect.changed = true;
        }
    }

    fn follow_windows(&mut self, effect: &mut Effect) {
        let (now, horizon) = (self.as_of, self.horizon);
        let other = self.apart.and_then(|apart| now.saturating_add(apart).ok());
        let counts_now = |window: &Window| {
            window.counts(now, horizon) || other.is_some_and(|other| window.counts(other, horizon))
        };
        let mut turned = Vec::new();
        for held in self.closures.values_mut() {
            held.follow_schedules([now, other.unwrap_or(now)]);
            let windows = &held.closure.windows;
            let counts = windows.is_empty() || windows.iter().any(counts_now);
            if counts != held.in_force {
                held.in_force = counts;
                turned.push((held.closure.clone(), counts));
            }
        }
        for (closure, counts) in turned {
            match counts {
                true => self.engage(&closure),
                false => self.release(&closure),
            }
            effect.changed = true;
            effect.opened |= !counts;
        }
    }

    fn engage(&mut self, closure: &Closure) {
        for &segment in &closure.hits.segments {
            if self.segment_causes.raise(segment.0) {
                self.closed.segments.insert(segment.0);
                self.block(segment);
            }
        }
        let topology = self.topology.clone();
        for &node in &closure.hits.nodes {
            if self.node_causes.raise(node.0) {
                self.closed.nodes.insert(node.0);
                self.closed.closed_nodes += 1;
                for arc in topology.arcs(node) {
                    self.block(arc.segment);
                }
            }
        }
        for &node in &closure.pads {
            if self.pad_causes.raise(node.0) {
                self.closed_pads.insert(node.0);
            }
        }
    }

    fn release(&mut self, closure: &Closure) {
        for &segment in &closure.hits.segments {
            if self.segment_causes.lower(segment.0) {
                self.closed.segments.remove(segment.0);
                self.unblock_if_open(segment);
            }
        }
        let topology = self.topology.clone();
        for &node in &closure.hits.nodes {
            if self.node_causes.lower(node.0) {
                self.closed.nodes.remove(node.0);
                self.closed.closed_nodes -= 1;
                for arc in topology.arcs(node) {
                    self.unblock_if_open(arc.segment);
                }
            }
        }
        for &node in &closure.pads {
            if self.pad_causes.lower(node.0) {
                self.closed_pads.remove(node.0);
            }
        }
    }

    fn block(&mut self, segment: SegmentIx) {
        if self.closed.blocked.insert(segment.0) {
            self.closed.blocked_segments += 1;
        }
    }

    fn unblock_if_open(&mut self, segment: SegmentIx) {
        let ends = self.topology.segment(segment);
        let is_open = !self.closed.segments.contains(segment.0)
            && !self.closed.nodes.contains(ends.from.0)
            && !self.closed.nodes.contains(ends.to.0);
        if is_open && self.closed.blocked.remove(segment.0) {
            self.closed.blocked_segments -= 1;
        }
    }
}

/// What applying changes has done so far.
#[derive(Debug, Default)]
struct Effect {
    changed: bool,
    opened: bool,
}

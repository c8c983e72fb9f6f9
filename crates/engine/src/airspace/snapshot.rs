//! The airspace: one immutable snapshot of what is closed, and the one function that makes the next.
//!
//! A reader holds one snapshot for a whole request. A single writer applies [`Change`]s, which share the
//! topology and all that did not change with the snapshot before.

use super::bits::Bits;
use super::closed::ClosedSet;
use super::closure::Closure;
use super::counts::Counts;
use super::held::Held;
use super::zone::Window;
use crate::network::{NodeIx, SegmentIx, Topology};
use imbl::OrdMap;
use imbl::ordmap::DiffItem;
use jiff::{SignedDuration, Timestamp};
use std::ops::Bound;
use std::sync::{Arc, OnceLock};

/// The one vocabulary of change: what is not a `Change` cannot alter an airspace.
#[derive(Clone, Debug, PartialEq)]
pub enum Change {
    /// Puts a closure, in place of the one with its id if there is one. Putting the same twice changes nothing.
    Put(Arc<Closure>),
    /// Lifts the closure of an id; lifting what is not there changes nothing.
    Lift(String),
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
    /// Whether windows have yet to be looked at by a second clock, or without it.
    has_other_clock: bool,
    closures: OrdMap<Arc<str>, Held>,
    /// How many of them recur.
    recurring: usize,
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
            has_other_clock: false,
            closures: OrdMap::new(),
            recurring: 0,
        }
    }

    /// The next snapshot: changes in their order, then windows that have opened or closed by `now`.
    ///
    /// Where nothing changes but the time, the revision stays. Costs what the changes hit, plus a pass
    /// over the closures where a window may have turned; see `docs/results/engine.md`.
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
        next.follow_windows_since(self, &mut effect);
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
        let recurring = next
            .closures
            .values()
            .filter(|held| held.recurring.is_some());
        next.recurring = recurring.count();
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

    /// What [`Airspace::looking_ahead`] makes of this airspace, from what it made of an earlier one on the same network: costs
    /// what has come and gone between the two, and what turns.
    #[must_use]
    pub fn looking_ahead_after(&self, before: &Self, looked: &Self) -> Self {
        let mut next = looked.clone();
        next.as_of = self.as_of;
        next.revision = self.revision;
        next.opened_at = self.opened_at;
        let mut effect = Effect::default();
        for change in before.closures.diff(&self.closures) {
            match change {
                DiffItem::Remove(id, _) => next.lift(id, &mut effect),
                DiffItem::Add(id, held)
                | DiffItem::Update {
                    new: (id, held), ..
                } => {
                    let held = Held {
                        in_force: false,
                        ..held.clone()
                    };
                    next.put_held(id, held, &mut effect);
                }
            }
        }
        next.follow_windows_since(looked, &mut effect);
        next
    }

    /// The closures that went since an earlier airspace and those that came, by id; one that has changed did both.
    pub fn changes_since<'a>(
        &'a self,
        before: &'a Self,
    ) -> impl Iterator<Item = (Option<&'a Arc<Closure>>, Option<&'a Arc<Closure>>)> {
        let changes = before.closures.diff(&self.closures);
        changes.map(|change| match change {
            DiffItem::Add(_, held) => (None, Some(&held.closure)),
            DiffItem::Update { old, new } => (Some(&old.1.closure), Some(&new.1.closure)),
            DiffItem::Remove(_, held) => (Some(&held.closure), None),
        })
    }

    /// The same airspace beside a second clock that is so far ahead of the time, or behind it: from the next
    /// [`Airspace::apply`] on a window counts if it does by either of them. `None` leaves the time alone.
    #[must_use]
    pub fn beside_clock(&self, apart: Option<SignedDuration>) -> Self {
        let mut beside = self.clone();
        beside.apart = apart;
        beside.next_change = OnceLock::new();
        beside.has_other_clock = true;
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
        let held = self.closures.range::<_, str>((from, Bound::Unbounded));
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
        self.seek_change_of(&|| self.closures.values())
    }

    /// The next instant after this snapshot's time at which a window of these turns, by either clock.
    fn seek_change_of<'a, I>(&self, closures: &dyn Fn() -> I) -> Option<Timestamp>
    where
        I: Iterator<Item = &'a Held>,
    {
        let apart = [Some(SignedDuration::ZERO), self.apart];
        let changes = apart.into_iter().flatten().filter_map(|apart| {
            let other = self.as_of.saturating_add(apart).ok()?;
            let windows = closures().flat_map(|held| &held.closure.windows);
            let change = windows.filter_map(|window| window.next_change_after(other, self.horizon));
            change.min()?.saturating_sub(apart).ok()
        });
        changes.min()
    }

    fn put(&mut self, closure: &Arc<Closure>, effect: &mut Effect) {
        if self
            .closures
            .get(closure.id.as_str())
            .is_some_and(|held| held.put() == closure)
        {
            return;
        }
        let id = Arc::from(closure.id.as_str());
        self.put_held(&id, Held::new(closure.clone()), effect);
    }

    fn put_held(&mut self, id: &Arc<str>, held: Held, effect: &mut Effect) {
        self.lift(id, effect);
        self.recurring += usize::from(held.recurring.is_some());
        self.closures.insert(id.clone(), held);
        effect.put.push(id.clone());
        effect.changed = true;
    }

    fn lift(&mut self, id: &str, effect: &mut Effect) {
        if let Some(held) = self.closures.remove(id) {
            if held.in_force {
                self.release(&held.closure);
                effect.opened = true;
            }
            self.recurring -= usize::from(held.recurring.is_some());
            effect.has_lifted_windows |= !held.closure.windows.is_empty();
            effect.changed = true;
        }
    }

    /// Follows the windows from the state before on, of which this is a copy but for what was put and lifted since.
    fn follow_windows_since(&mut self, before: &Self, effect: &mut Effect) {
        if !before.stands_until(self.as_of) {
            self.next_change = OnceLock::new();
            self.follow_windows(effect);
            return;
        }
        let put = std::mem::take(&mut effect.put);
        let held = put
            .iter()
            .filter_map(|id| self.closures.get_key_value(&**id));
        let turned = self.turned(held);
        self.turn(turned, effect);
        // What was to change next still is, unless that was lifted.
        let of_these =
            self.seek_change_of(&|| put.iter().filter_map(|id| self.closures.get(&**id)));
        let next = before.next_change().into_iter().chain(of_these).min();
        self.next_change = match effect.has_lifted_windows {
            true => OnceLock::new(),
            false => OnceLock::from(next),
        };
    }

    /// Whether nothing turns by itself from its own time until an instant.
    fn stands_until(&self, now: Timestamp) -> bool {
        !self.has_other_clock
            && self.recurring == 0
            && self.as_of <= now
            && self.next_change().is_none_or(|change| change > now)
    }

    fn follow_windows(&mut self, effect: &mut Effect) {
        let turned = self.turned(&self.closures);
        self.turn(turned, effect);
        self.has_other_clock = false;
    }

    /// What of these closures has turned, as it is now.
    fn turned<'a>(
        &self,
        closures: impl IntoIterator<Item = (&'a Arc<str>, &'a Held)>,
    ) -> Vec<(Arc<str>, Held)> {
        let (now, horizon) = (self.as_of, self.horizon);
        let other = self.apart.and_then(|apart| now.saturating_add(apart).ok());
        let counts_now = |window: &Window| {
            window.counts(now, horizon) || other.is_some_and(|other| window.counts(other, horizon))
        };
        let instants = [now, other.unwrap_or(now)];
        let turned = closures.into_iter().filter_map(|(id, held)| {
            let turned = held.turned(instants, counts_now)?;
            Some((id.clone(), turned))
        });
        turned.collect()
    }

    fn turn(&mut self, turned: Vec<(Arc<str>, Held)>, effect: &mut Effect) {
        for (id, held) in turned {
            let before = self.closures.insert(id, held.clone());
            let did_count = before.is_some_and(|before| before.in_force);
            match (did_count, held.in_force) {
                (false, true) => self.engage(&held.closure),
                (true, false) => self.release(&held.closure),
                _ => continue,
            }
            effect.changed = true;
            effect.opened |= did_count;
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
    /// The ids of what was put.
    put: Vec<Arc<str>>,
    /// Whether anything with windows was lifted, or replaced.
    has_lifted_windows: bool,
}

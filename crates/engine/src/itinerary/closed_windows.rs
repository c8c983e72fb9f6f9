//! Closures with their windows, so that those of a segment, a node or its pads are found at once.

use crate::airspace::{Bits, Lists};
use crate::flight::TimedClosure;
use crate::network::{NodeIx, SegmentIx, Topology};
use imbl::OrdMap;
use std::sync::Arc;

/// From when until when something is closed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct ClosedWindow {
    /// The number of its closure.
    pub(super) closure: u32,
    pub(super) from_s: f64,
    pub(super) until_s: f64,
    pub(super) widened: bool,
}

/// Which closure. Those of an airspace come first, by id and window, and then those that a request brings.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum ClosureKey {
    /// A closure of an airspace, by its id, and which of its windows, counted from 0.
    Standing(Arc<str>, u32),
    /// One without an id, counted from 0.
    Unnamed(u32),
}

/// Closures with their windows. Those that differ in a few closures share the rest: one more, or one less, costs what it
/// closes.
#[derive(Clone, Debug)]
pub struct ClosedWindows {
    by_segment: Lists<ClosedWindow>,
    by_node: Lists<ClosedWindow>,
    by_pads: Lists<ClosedWindow>,
    /// Segments whose entry may be forbidden at some time.
    segments: Bits,
    by_number: OrdMap<u32, (ClosureKey, Arc<TimedClosure>)>,
    by_key: OrdMap<ClosureKey, u32>,
    /// The number of the closure that is added next.
    next: u32,
    /// No closure here ends before, in seconds.
    first_end_s: f64,
}

impl ClosedWindows {
    /// Nothing is closed.
    pub fn none(topology: &Topology) -> Self {
        Self {
            by_segment: Lists::empty(topology.segment_count()),
            by_node: Lists::empty(topology.node_count()),
            by_pads: Lists::empty(topology.node_count()),
            segments: Bits::empty(topology.segment_count()),
            by_number: OrdMap::new(),
            by_key: OrdMap::new(),
            next: 0,
            first_end_s: f64::INFINITY,
        }
    }

    /// Closures without ids, numbered by their places.
    pub fn of(topology: &Topology, closures: &[TimedClosure]) -> Self {
        Self::none(topology).with(topology, closures.to_vec())
    }

    /// The same with closures without ids beside them.
    #[must_use]
    pub fn with(mut self, topology: &Topology, closures: Vec<TimedClosure>) -> Self {
        let unnamed = ClosureKey::Unnamed(0);
        let known = self.by_key.range(unnamed..).count() as u32;
        let numbered = (known..).map(ClosureKey::Unnamed).zip(closures);
        self.add(topology, numbered.collect());
        self
    }

    /// Adds closures whose keys are new.
    pub fn add(&mut self, topology: &Topology, closures: Vec<(ClosureKey, TimedClosure)>) {
        let (mut segments, mut nodes, mut pads) = (Vec::new(), Vec::new(), Vec::new());
        for (key, closure) in closures {
            let window = ClosedWindow {
                closure: self.next,
                from_s: closure.from_s,
                until_s: closure.until_s,
                widened: closure.widened,
            };
            segments.extend(closure.segments.iter().map(|segment| (segment.0, window)));
            nodes.extend(closure.nodes.iter().map(|node| (node.0, window)));
            pads.extend(closure.pads.iter().map(|node| (node.0, window)));
            for &segment in &closure.segments {
                self.segments.insert(segment.0);
            }
            for segment in around(topology, &closure) {
                self.segments.insert(segment.0);
            }
            self.first_end_s = self.first_end_s.min(closure.until_s);
            self.by_key.insert(key.clone(), self.next);
            self.by_number.insert(self.next, (key, Arc::new(closure)));
            self.next += 1;
        }
        self.by_segment.add(segments);
        self.by_node.add(nodes);
        self.by_pads.add(pads);
    }

    /// Removes all windows of a closure of an airspace.
    pub fn remove(&mut self, topology: &Topology, id: &Arc<str>) {
        let [first, last] = [0, u32::MAX].map(|window| ClosureKey::Standing(id.clone(), window));
        let numbers: Vec<u32> = self
            .by_key
            .range(first..=last)
            .map(|(_, number)| *number)
            .collect();
        for number in numbers {
            self.remove_window(topology, number);
        }
    }

    /// Removes what has ended by an instant.
    pub fn remove_ended(&mut self, topology: &Topology, by_s: f64) {
        if by_s < self.first_end_s {
            return;
        }
        let all = self.by_number.iter();
        let ended = all.filter(|(_, (_, closure))| closure.until_s <= by_s);
        let ended: Vec<u32> = ended.map(|(number, _)| *number).collect();
        for number in ended {
            self.remove_window(topology, number);
        }
        let ends_s = self.by_number.values().map(|(_, closure)| closure.until_s);
        self.first_end_s = ends_s.fold(f64::INFINITY, f64::min);
    }

    fn remove_window(&mut self, topology: &Topology, number: u32) {
        let Some((key, closure)) = self.by_number.remove(&number) else {
            return;
        };
        self.by_key.remove(&key);
        let is_meant = |window: &ClosedWindow| window.closure == number;
        for segment in &closure.segments {
            self.by_segment.remove(segment.0, is_meant);
        }
        for node in &closure.nodes {
            self.by_node.remove(node.0, is_meant);
        }
        for node in &closure.pads {
            self.by_pads.remove(node.0, is_meant);
        }
        let hit = closure.segments.iter().copied();
        for segment in hit.chain(around(topology, &closure)) {
            let ends = topology.segment(segment);
            if self.is_open(segment.0, ends.from, ends.to) {
                self.segments.remove(segment.0);
            }
        }
    }

    /// Whether there is a number for one more closure of this many.
    pub fn has_numbers_for(&self, closures: usize) -> bool {
        (u32::MAX - self.next) as usize > closures
    }

    /// The closure of a number.
    pub fn closure(&self, number: usize) -> Option<(&ClosureKey, &TimedClosure)> {
        let found = self.by_number.get(&u32::try_from(number).ok()?)?;
        Some((&found.0, &found.1))
    }

    /// All closures by their keys, each with its number.
    pub fn closures(&self) -> impl Iterator<Item = (usize, &ClosureKey, &TimedClosure)> {
        self.by_key.iter().filter_map(|(key, number)| {
            let (_, closure) = self.by_number.get(number)?;
            Some((*number as usize, key, &**closure))
        })
    }

    /// Numbers of closures by their keys.
    pub(super) fn in_order(&self, numbers: impl IntoIterator<Item = usize>) -> Vec<usize> {
        let mut numbers: Vec<usize> = numbers.into_iter().collect();
        numbers.sort_by_key(|&number| self.closure(number).map(|(key, _)| key));
        numbers
    }

    /// True when a segment, and the nodes at its ends, are never closed.
    #[inline]
    pub(super) fn is_open(&self, segment: u32, from: NodeIx, to: NodeIx) -> bool {
        !self.by_segment.has(segment) && !self.by_node.has(from.0) && !self.by_node.has(to.0)
    }

    #[inline]
    pub(super) fn of_segment(&self, segment: u32) -> &[ClosedWindow] {
        self.by_segment.of_index(segment)
    }

    #[inline]
    pub(super) fn of_node(&self, node: NodeIx) -> &[ClosedWindow] {
        self.by_node.of_index(node.0)
    }

    pub(super) fn of_pads(&self, node: NodeIx) -> &[ClosedWindow] {
        self.by_pads.of_index(node.0)
    }

    /// The nodes whose pads are closed at some time, rising.
    pub(super) fn nodes_with_closed_pads(&self) -> impl Iterator<Item = NodeIx> + '_ {
        self.by_pads.indices().iter().map(NodeIx)
    }

    /// The segments whose entry may be forbidden at some time, one bit each.
    pub(super) fn segments(&self) -> &Bits {
        &self.segments
    }
}

/// The segments at the nodes of a closure.
fn around<'a>(
    topology: &'a Topology,
    closure: &'a TimedClosure,
) -> impl Iterator<Item = SegmentIx> + 'a {
    let nodes = closure.nodes.iter();
    nodes.flat_map(|&node| topology.arcs(node).iter().map(|arc| arc.segment))
}

#[cfg(test)]
impl ClosedWindows {
    /// All that is to be found here, in words that do not depend on how closures are numbered.
    pub(crate) fn told(&self) -> Vec<String> {
        let mut told: Vec<String> = self
            .closures()
            .map(|(_, key, closure)| format!("{key:?}: {closure:?}"))
            .collect();
        let mut tell = |what: &str, lists: &Lists<ClosedWindow>| {
            for index in lists.indices().iter() {
                let windows = lists.of_index(index).iter().map(|window| {
                    let key = self.closure(window.closure as usize).map(|(key, _)| key);
                    (key, format!("{:?} {:?}", window.from_s, window.until_s))
                });
                let mut windows: Vec<_> = windows.collect();
                windows.sort();
                told.push(format!("{what} {index}: {windows:?}"));
            }
        };
        tell("segment", &self.by_segment);
        tell("node", &self.by_node);
        tell("pads", &self.by_pads);
        told.push(format!("{:?}", self.segments));
        told
    }
}

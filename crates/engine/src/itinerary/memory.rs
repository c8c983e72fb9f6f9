//! What a search scribbles on: labels by node, the queue, the ways walked. Reused by the next search.

use super::active_traffic::ActiveTraffic;
use super::charging_label::ChargingLabel;
use super::expander::SearchBuffers;
use super::forbidden_times::ForbiddenTimes;
use super::label::{How, Label, NO_LABEL};
use super::release_times::ReleaseTimes;
use super::request::Value;
use crate::airspace::Bits;
use crate::network::{NodeIx, Topology};
use std::cmp::Ordering;
use std::collections::BinaryHeap;

/// A label, or a node, in a queue, the smallest key first; the earlier label on ties.
#[derive(Clone, Copy, Debug)]
pub(super) struct Queued {
    pub(super) key: Value,
    pub(super) label: u32,
}

impl Ord for Queued {
    fn cmp(&self, other: &Self) -> Ordering {
        let by_weight = other.key.weight.total_cmp(&self.key.weight);
        let by_arrival = || other.key.arrives_s.total_cmp(&self.key.arrives_s);
        let by_age = || other.label.cmp(&self.label);
        by_weight.then_with(by_arrival).then_with(by_age)
    }
}

impl PartialOrd for Queued {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for Queued {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl Eq for Queued {}

/// A family under way on a walk.
#[derive(Clone, Copy, Debug)]
pub(super) struct Descent {
    pub(super) family: ChargingLabel,
    pub(super) how: How,
    pub(super) parent: u32,
}

/// The nodes that can be reached from the starts, and those from which the destination can be: both grow in turn until they
/// meet or one of them is complete, so that a small enclosed part is found out soon, whichever end lies in it.
#[derive(Debug)]
pub(super) struct ReachedFromBothEnds {
    pub(super) onwards: Reached,
    pub(super) backwards: Reached,
    pub(super) intervals: Vec<(f64, f64)>,
}

/// Nodes that were reached from one end.
#[derive(Debug)]
pub(super) struct Reached {
    pub(super) nodes: Bits,
    listed: Vec<NodeIx>,
    /// Those whose legs are still to be looked at, the most promising first.
    pub(super) queue: BinaryHeap<Queued>,
}

impl Reached {
    /// Room for so many nodes.
    fn none(node_count: usize) -> Self {
        Self {
            nodes: Bits::empty(node_count),
            listed: Vec::new(),
            queue: BinaryHeap::new(),
        }
    }

    pub(super) fn clear(&mut self) {
        self.queue.clear();
        for node in self.listed.drain(..) {
            self.nodes.remove(node.0);
        }
    }

    /// Adds a node from which so much is left at least, unless it is there or nothing leads on.
    pub(super) fn add(&mut self, node: NodeIx, left: f64) {
        if left.is_finite() && self.nodes.insert(node.0) {
            self.listed.push(node);
            let key = Value {
                weight: left,
                arrives_s: 0.0,
            };
            self.queue.push(Queued { key, label: node.0 });
        }
    }
}

impl ReachedFromBothEnds {
    /// Room for a network of so many nodes.
    pub(super) fn for_nodes(node_count: usize) -> Self {
        Self {
            onwards: Reached::none(node_count),
            backwards: Reached::none(node_count),
            intervals: Vec::new(),
        }
    }
}

/// The memory of searches on one topology. One thread uses it at a time.
#[derive(Debug)]
pub struct ItineraryScratch {
    pub(super) labels: Vec<Label>,
    pub(super) queue: BinaryHeap<Queued>,
    heads: Vec<u32>,
    marks: Vec<u32>,
    generation: u32,
    pub(super) walked: Vec<Descent>,
    pub(super) offers: Vec<(ChargingLabel, How)>,
    pub(super) intervals: Vec<(f64, f64)>,
    pub(super) forbidden: ForbiddenTimes,
    pub(super) openings: ReleaseTimes,
    pub(super) closed: Bits,
    pub(super) active: ActiveTraffic,
    pub(super) both_ends: ReachedFromBothEnds,
    segments: usize,
    pub(super) route: Vec<u32>,
    /// How the best real plan goes, from its start to the destination.
    pub(super) best: Vec<How>,
    /// How the best plan of the relaxation goes.
    pub(super) relaxed: Vec<How>,
    /// The way of the plan that the last search found.
    pub(super) way_found: u64,
}

impl ItineraryScratch {
    /// How many plans that searches here found have met others so far. Where a search has added none, others are not why
    /// it found nothing.
    pub fn met_others(&self) -> u64 {
        self.active.met()
    }

    /// Room for searches on a topology.
    pub fn new(topology: &Topology) -> Self {
        Self {
            labels: Vec::new(),
            queue: BinaryHeap::new(),
            heads: vec![NO_LABEL; topology.node_count()],
            marks: vec![0; topology.node_count()],
            generation: 0,
            walked: Vec::new(),
            offers: Vec::new(),
            intervals: Vec::new(),
            forbidden: ForbiddenTimes::default(),
            openings: ReleaseTimes::for_nodes(topology.node_count()),
            closed: Bits::empty(topology.segment_count()),
            active: ActiveTraffic::nowhere(topology),
            both_ends: ReachedFromBothEnds::for_nodes(topology.node_count()),
            segments: topology.segment_count(),
            route: Vec::new(),
            best: Vec::new(),
            relaxed: Vec::new(),
            way_found: 0,
        }
    }

    /// Begins a request: forgets what forbade legs in the one before, and makes room again where the topology is another one.
    pub(super) fn begin(&mut self, topology: &Topology) {
        let counts = (topology.node_count(), topology.segment_count());
        if (self.heads.len(), self.segments) != counts {
            *self = Self::new(topology);
        }
        self.forbidden.clear();
    }

    /// Forgets the labels of the search before.
    pub(super) fn clear(&mut self) {
        self.labels.clear();
        self.queue.clear();
        self.openings.clear();
        self.generation = self.generation.wrapping_add(1);
        if self.generation == 0 {
            self.marks.fill(0);
            self.generation = 1;
        }
    }

    /// What a label is expanded with.
    pub(super) fn buffers<'a>(
        &'a mut self,
        offers: &'a mut Vec<(ChargingLabel, How)>,
    ) -> SearchBuffers<'a> {
        SearchBuffers {
            closed: &self.closed,
            active: &self.active,
            intervals: &mut self.intervals,
            forbidden: &mut self.forbidden,
            offers,
        }
    }

    /// The first label at a node.
    #[inline]
    pub(super) fn head(&self, node: NodeIx) -> u32 {
        match self.marks[node.at()] == self.generation {
            true => self.heads[node.at()],
            false => NO_LABEL,
        }
    }

    /// Takes a label out of its node's list; `before` is the one in front of it.
    pub(super) fn unlink(&mut self, before: u32, label: u32) {
        let after = self.labels[label as usize].next;
        self.labels[label as usize].is_dead = true;
        match self.labels.get_mut(before as usize) {
            Some(before) => before.next = after,
            None => {
                let node = self.labels[label as usize].node;
                self.heads[node.at()] = after;
            }
        }
    }

    /// Takes a label out of its node's list, wherever it is in that.
    pub(super) fn remove(&mut self, label: u32) {
        let (mut before, mut other) = (NO_LABEL, self.head(self.labels[label as usize].node));
        while other != NO_LABEL && other != label {
            (before, other) = (other, self.labels[other as usize].next);
        }
        self.unlink(before, label);
    }

    /// Adds a label to its node's list and to the queue.
    pub(super) fn push(&mut self, mut label: Label, key: Value) {
        let place = self.labels.len() as u32;
        label.next = self.head(label.node);
        self.marks[label.node.at()] = self.generation;
        self.heads[label.node.at()] = place;
        self.labels.push(label);
        self.queue.push(Queued { key, label: place });
    }

    /// Adds a label that is only the parent of others.
    pub(super) fn keep_aside(&mut self, label: Label) {
        self.labels.push(label);
    }

    /// How a label came about, step by step from its start, into `steps`.
    pub(super) fn history(labels: &[Label], label: u32, steps: &mut Vec<How>) {
        steps.clear();
        let mut at = label;
        while let Some(label) = labels.get(at as usize) {
            steps.push(label.how);
            at = label.parent;
        }
        steps.reverse();
    }
}

//! The one entry: a failure report in, a recomposition out.

use super::answer::{Fallback, Outcome, Recomposition, Warning};
use super::explanation::Stage;
use super::extent::Extent;
use super::holding::held_at;
use super::local::Gap;
use super::plan::{first_loop, old_plan, open_rest, to_destination};
use super::repair::{LocalMemory, RepairOrder, Repaired, repair};
use super::request::{LocalStrategy, Method, Request, Strategy};
use super::safety::Flag;
use super::starts::{self, Leg, Starts};
use crate::airspace::{Airspace, Closed, RequestClosures};
use crate::flight::{Aloft, FailureType, Reentry, StretchKind};
use crate::network::{NodeIx, Topology};
use crate::planted::{self, Bug};
use crate::routing::{
    Arrival, Baseline, ClosureEpoch, DestinationTree, Path, Searcher, Start, TreeCache,
};

/// What a recomposition is computed on.
#[derive(Clone, Copy, Debug)]
pub struct World<'a> {
    /// The snapshot, held for the whole request.
    pub airspace: &'a Airspace,
    /// Trees of destinations in use; without the one needed, A* answers at once.
    pub trees: Option<&'a TreeCache>,
}

impl World<'_> {
    /// Which standing closures this world has, as far as trees need to know.
    pub fn standing(&self) -> ClosureEpoch {
        ClosureEpoch {
            topology: self.airspace.topology_revision(),
            sequence: self.airspace.revision(),
            opened_at: self.airspace.opened_at(),
        }
    }
}

/// What a recomposition scribbles on, reused by the next one; one thread uses it at a time.
#[derive(Debug)]
pub struct Scratch {
    pub(super) searcher: Searcher,
    pub(super) closures: RequestClosures,
    /// Never closes anything: the world before the report.
    nothing: RequestClosures,
    pub(super) starts: Starts,
    plan: Path,
    local: LocalMemory,
    nodes: usize,
    segments: usize,
    /// Of the topology that it is for: density grids are counted on it.
    layout: u64,
}

impl Scratch {
    /// Room for recompositions on a topology.
    pub fn new(topology: &Topology) -> Self {
        Self {
            searcher: Searcher::new(topology),
            closures: RequestClosures::new(topology),
            nothing: RequestClosures::new(topology),
            starts: Starts::default(),
            plan: Path::default(),
            local: LocalMemory::new(topology),
            nodes: topology.node_count(),
            segments: topology.segment_count(),
            layout: topology.layout(),
        }
    }

    /// Makes room again where the topology is another one than before; [`recompose`] does so by itself.
    pub fn fit(&mut self, topology: &Topology) {
        let counts = (topology.node_count(), topology.segment_count());
        if (self.nodes, self.segments) != counts || self.layout != topology.layout() {
            *self = Self::new(topology);
        }
    }

    /// The searcher, for trees and searches beside recompositions.
    pub fn searcher(&mut self) -> &mut Searcher {
        &mut self.searcher
    }
}

/// Closes what the report closes: the leg where its type does, and what a zone brought along covers.
pub(super) fn close_for_request(
    request: &Request,
    airspace: &Airspace,
    closures: &mut RequestClosures,
) {
    let topology = airspace.topology();
    let standing = airspace.closed();
    let (from, to) = request.report.leg;
    if request.report.failure.closes_leg()
        && let Some(segment) = topology.segment_between(from, to)
    {
        closures.close_segment(segment, standing);
    }
    if let Some(brought) = &request.zone {
        for &segment in &brought.hits.segments {
            closures.close_segment(segment, standing);
        }
        for &node in &brought.hits.nodes {
            closures.close_node(node, topology, standing);
        }
    }
}

/// Answers a failure report.
///
/// Exact unless another strategy is asked for. Never fails: what cannot be answered as asked is answered
/// by `exact`, and the answer says why.
pub fn recompose(world: &World<'_>, request: &Request, scratch: &mut Scratch) -> Recomposition {
    let aloft = match request.circumstances.aloft {
        _ if planted::is(Bug::GroundSentUp) => Aloft::Airborne,
        aloft => aloft,
    };
    let mut answer = recompose_as(world, request, aloft, scratch);
    if aloft == Aloft::Unknown && answer.outcome == Outcome::Hold {
        let airborne = recompose_as(world, request, Aloft::Airborne, scratch);
        answer.if_airborne = Some(Box::new(airborne));
    }
    answer
}

/// Answers a failure report of a drone that is in the air, or on the ground.
fn recompose_as(
    world: &World<'_>,
    request: &Request,
    aloft: Aloft,
    scratch: &mut Scratch,
) -> Recomposition {
    let airspace = world.airspace;
    let topology: &Topology = airspace.topology();
    scratch.fit(topology);
    let destination = request.report.destination;
    let tree = world
        .trees
        .and_then(|trees| trees.get(destination, world.standing()));
    let Scratch {
        searcher,
        closures,
        nothing,
        starts,
        plan,
        local,
        ..
    } = scratch;
    closures.reset();
    close_for_request(request, airspace, closures);
    let closed = Closed::new(topology, airspace.closed(), closures);
    let leg = Leg::of(request, topology);
    let mut task = Task {
        request,
        airspace,
        closed,
        before: Closed::new(topology, airspace.closed(), nothing),
        leg,
        tree: tree.as_deref(),
        searcher,
        starts,
        plan,
        local,
        answer: Recomposition::without_path(request.strategy),
    };
    let held = match aloft {
        Aloft::Airborne => None,
        Aloft::Grounded | Aloft::Unknown => held_at(request, airspace, &task.leg),
    };
    match held {
        Some(node) => task.hold(node),
        None => task.answer(),
    }
    task.answer
}

/// One recomposition under way.
pub(super) struct Task<'a> {
    pub(super) request: &'a Request,
    pub(super) airspace: &'a Airspace,
    pub(super) closed: Closed<'a>,
    /// The world before the report.
    before: Closed<'a>,
    pub(super) leg: Leg,
    tree: Option<&'a DestinationTree>,
    pub(super) searcher: &'a mut Searcher,
    pub(super) starts: &'a mut Starts,
    /// The nodes of the old plan, from the start of the leg on; its segments mean nothing.
    plan: &'a mut Path,
    local: &'a mut LocalMemory,
    pub(super) answer: Recomposition,
}

impl Task<'_> {
    fn answer(&mut self) {
        if self.leg.segment.is_none() {
            self.answer.warnings.push(Warning::UnknownSegment);
        }
        starts::find(
            self.request,
            self.airspace,
            &self.closed,
            &self.leg,
            self.starts,
            &mut self.answer.warnings,
        );
        let failure = self.request.report.failure;
        match self.request.method() {
            _ if self.starts.ways.is_empty() => {
                self.count_global_search();
                self.give_up();
            }
            _ if failure == FailureType::Operational => self.divert_drone_in_need(),
            Method::Exact => self.answer_exactly(),
            Method::Global(baseline) => self.answer_globally(baseline),
            Method::Local(_) if !failure.closes_leg() => {
                self.fall_back(Fallback::NothingClosed);
            }
            Method::Local(_) if self.starts.off_leg => self.fall_back(Fallback::OffLeg),
            Method::Local(strategy) => self.answer_locally(strategy),
        }
        if self.request.optimum {
            self.measure_optima();
        }
    }

    /// The gap that areas over the whole network are counted by.
    fn gap(&self) -> Gap<'_> {
        Gap {
            closed: self.closed,
            from: self.leg.from,
            to: self.leg.to,
        }
    }

    fn destination(&self) -> NodeIx {
        self.request.report.destination
    }

    fn fall_back(&mut self, reason: Fallback) {
        self.answer.strategy_used = Strategy::Exact;
        self.answer.fallback = Some(reason);
        self.answer_exactly();
    }

    pub(super) fn search_exactly(&mut self) -> Option<Arrival> {
        let destination = self.destination();
        let (closed, ways) = (&self.closed, &self.starts.ways);
        to_destination(closed, ways, destination, self.tree, self.searcher)
    }

    fn answer_exactly(&mut self) {
        let arrival = self.search_exactly();
        self.count_global_search();
        self.conclude(arrival);
    }

    fn answer_globally(&mut self, baseline: Baseline) {
        let (destination, ways) = (self.destination(), &self.starts.ways);
        let arrival = self
            .searcher
            .shortest(&self.closed, ways, destination, baseline, None);
        self.count_global_search();
        self.conclude(arrival);
    }

    pub(super) fn count_global_search(&mut self) {
        let extent = Extent::everything(&self.gap());
        self.answer.stage = Stage::Global;
        self.answer.searches += 1;
        self.answer.area_nodes = extent.nodes;
        self.answer.area_segments = extent.segments;
        self.answer.settled_nodes += self.searcher.settled();
    }

    /// Fills in the path of a search from the drone to the destination, or what is left without one.
    fn conclude(&mut self, arrival: Option<Arrival>) {
        let Some(arrival) = arrival else {
            self.divert_or_give_up();
            return;
        };
        self.take_path(arrival, Outcome::Rerouted);
        if self.starts.leaves_zone || self.starts.cannot_stop {
            return;
        }
        let may_be_untouched =
            !self.request.report.failure.closes_leg() || self.only_starts_ahead();
        if may_be_untouched {
            self.prefer_old_plan();
        }
    }

    pub(super) fn take_path(&mut self, arrival: Arrival, outcome: Outcome) {
        let number = self
            .searcher
            .append_way(arrival, self.tree, &mut self.answer.path);
        let mut reentry = self.starts.ways[number];
        if planted::is(Bug::SwappedStart) {
            reentry.stretch.length_m = self.leg.length_m - reentry.stretch.length_m;
        }
        self.answer.outcome = outcome;
        self.begin_with(reentry);
        let first_stretch_m = reentry.stretch.length_m;
        self.answer.recomposed_length_m = Some(arrival.length_m - first_stretch_m);
        self.answer.remaining_length_m = Some(arrival.length_m);
    }

    /// Says how the drone comes to the first node of the path.
    fn begin_with(&mut self, reentry: Reentry) {
        self.answer.first_stretch_m = reentry.stretch.length_m;
        self.answer.reentry = Some(reentry);
        self.answer.flags.clear();
        if self.starts.leaves_zone {
            self.answer.flags.push(Flag::LeavingZone);
        }
        if self.starts.cannot_stop {
            self.answer.flags.push(Flag::CannotStop);
        }
        if reentry.stretch.kind == StretchKind::Straight {
            self.answer.flags.push(Flag::Unverified);
        }
        if planted::is(Bug::FlagWithoutGround) && !self.starts.leaves_zone {
            self.answer.flags.insert(0, Flag::LeavingZone);
        }
        if planted::is(Bug::StretchForgotten) {
            self.answer.reentry = Some(Reentry::at_node(reentry.node, reentry.stretch.begin, None));
            self.answer.first_stretch_m = 0.0;
        }
    }

    /// True when the cause lies behind the drone: the leg's end is the one way on.
    fn only_starts_ahead(&self) -> bool {
        matches!(self.starts.ways.as_slice(), [only] if only.node == self.leg.to)
    }

    fn recall_plan(&mut self) {
        let (request, leg, before, tree) = (self.request, &self.leg, &self.before, self.tree);
        old_plan(request, leg, before, tree, self.searcher, self.plan);
    }

    /// Says `unaffected` where nothing ahead is touched and the answer found is not shorter than the old plan.
    fn prefer_old_plan(&mut self) {
        self.recall_plan();
        let at_leg_start =
            |way: &&Reentry| way.node == self.leg.from && way.stretch.length_m == 0.0;
        let (first, way_in) = match self.starts.ways.iter().find(at_leg_start) {
            Some(&way_in) => (0, way_in),
            None => match self.starts.ways.iter().find(|way| way.node == self.leg.to) {
                Some(&way_in) => (1, way_in),
                None => return,
            },
        };
        let Some(way) = open_rest(&self.closed, &self.plan.nodes, first) else {
            return;
        };
        let reaches_goal = way.nodes.last() == Some(&self.destination());
        let rest_m = way.length_m(self.closed.topology());
        let old_length_m = way_in.stretch.length_m + rest_m;
        let found_m = self.answer.remaining_length_m.unwrap_or(f64::INFINITY);
        if reaches_goal && found_m >= old_length_m * (1.0 - 1e-12) {
            self.answer.outcome = Outcome::Unaffected;
            self.answer.path = way;
            self.begin_with(way_in);
            self.answer.recomposed_length_m = Some(rest_m);
            self.answer.remaining_length_m = Some(old_length_m);
        }
    }

    fn answer_locally(&mut self, strategy: LocalStrategy) {
        self.recall_plan();
        let plan = &self.plan.nodes;
        let leads_there = plan.last() == Some(&self.destination());
        let Some(&way_in) = self.starts.ways.first() else {
            self.fall_back(Fallback::OffLeg);
            return;
        };
        let first = usize::from(way_in.node != self.leg.from);
        let order = RepairOrder {
            closed: self.closed,
            plan: plan.get(first..).unwrap_or_default(),
            strategy,
            parameters: &self.request.parameters,
            explain: self.request.explain,
        };
        match repair(&order, self.searcher, self.local) {
            Err(reason) => self.fall_back(reason),
            Ok(repaired) if repaired.complete && leads_there => {
                self.take_repaired(repaired, way_in);
            }
            Ok(repaired) => self.give_up_repairing(repaired),
        }
    }

    fn take_repaired(&mut self, repaired: Repaired, way_in: Reentry) {
        let nothing_repaired = repaired.repairs.is_empty();
        let remaining_m = way_in.stretch.length_m + repaired.way.length_m(self.closed.topology());
        if let Some(node) = first_loop(&repaired.way, self.local.area()) {
            self.answer.warnings.push(Warning::Loop { node });
        }
        let flies_on = nothing_repaired && !self.starts.leaves_zone && !self.starts.cannot_stop;
        self.answer.outcome = match flies_on {
            true => Outcome::Unaffected,
            false => Outcome::Rerouted,
        };
        self.begin_with(way_in);
        self.answer.recomposed_length_m = Some(repaired.new_length_m);
        self.answer.remaining_length_m = Some(remaining_m);
        self.take_figures(&repaired);
        self.answer.path = repaired.way;
        self.answer.stages = repaired.stages;
        if repaired.repairs.len() > 1 {
            self.answer.repairs = repaired.repairs;
        }
    }

    fn take_figures(&mut self, repaired: &Repaired) {
        self.answer.stage = repaired.stage;
        self.answer.searches = repaired.searches;
        self.answer.area_nodes = repaired.extent.nodes;
        self.answer.area_segments = repaired.extent.segments;
        self.answer.settled_nodes = repaired.settled;
    }

    /// No repair reconnects the old plan: `exact` may still reach the destination some other way.
    fn give_up_repairing(&mut self, repaired: Repaired) {
        self.take_figures(&repaired);
        match self.search_exactly() {
            Some(arrival) => {
                self.answer.strategy_used = Strategy::Exact;
                self.answer.fallback = Some(Fallback::RepairFailed);
                self.count_global_search();
                self.conclude(Some(arrival));
            }
            None => self.divert_or_give_up(),
        }
        self.answer.stages = repaired.stages;
        self.answer.repairs = repaired.repairs;
    }

    fn measure_optima(&mut self) {
        let destination = self.destination();
        let at_leg_start = [Start {
            node: self.leg.from,
            offset_m: 0.0,
        }];
        let closed = &self.closed;
        let length = |arrival: Option<Arrival>| arrival.map(|arrival| arrival.length_m);
        let astar = Baseline::AStar;
        let local = self
            .searcher
            .shortest(closed, &at_leg_start, self.leg.to, astar, None);
        self.answer.local_optimum_m = length(local);
        let searcher = &mut *self.searcher;
        let global = to_destination(closed, &at_leg_start, destination, self.tree, searcher);
        self.answer.global_optimum_m = length(global);
        let ways = &self.starts.ways;
        let remaining = to_destination(closed, ways, destination, self.tree, searcher);
        self.answer.remaining_optimum_m = length(remaining);
    }
}

//! Local recomposition: every run of closed legs of the old plan is repaired, and the rest is kept.

use super::answer::{Fallback, Repair};
use super::cell_density::{self, CellMemory};
use super::connectivity::Connectivity;
use super::explanation::{Stage, StageRecord};
use super::extent::Extent;
use super::local::{Gap, LocalProblem, LocalResult};
use super::plan::open_leg;
use super::radius;
use super::request::{LocalStrategy, Parameters};
use super::two_phased::{self, GrowthMemory};
use crate::airspace::Closed;
use crate::network::{DensityGrid, NodeIx, Topology};
use crate::routing::{Area, Path, Searcher};

/// Room for this many nodes more than the old plan had; most detours need fewer.
const DETOUR_NODES: usize = 16;

/// What local strategies scribble on.
#[derive(Debug)]
pub(super) struct LocalMemory {
    area: Area,
    union: Area,
    connectivity: Connectivity,
    cells: CellMemory,
    growth: GrowthMemory,
    /// The last grid counted for a cell size that is not the default.
    grid: Option<DensityGrid>,
}

impl LocalMemory {
    pub(super) fn new(topology: &Topology) -> Self {
        Self {
            area: Area::new(topology),
            union: Area::new(topology),
            connectivity: Connectivity::new(topology),
            cells: CellMemory::default(),
            growth: GrowthMemory::default(),
            grid: None,
        }
    }

    /// An area to scribble on between repairs.
    pub(super) fn area(&mut self) -> &mut Area {
        &mut self.area
    }
}

/// The sum of all repairs of one request.
#[derive(Debug)]
pub(super) struct Repaired {
    pub(super) way: Path,
    /// Length of the new parts, in metres.
    pub(super) new_length_m: f64,
    /// True when the plan is whole again from the drone to the destination.
    pub(super) complete: bool,
    pub(super) stage: Stage,
    pub(super) searches: u32,
    pub(super) settled: usize,
    pub(super) extent: Extent,
    pub(super) repairs: Vec<Repair>,
    pub(super) stages: Vec<StageRecord>,
}

/// What is to be repaired, and how.
pub(super) struct RepairOrder<'a> {
    pub(super) closed: Closed<'a>,
    /// The plan from the node where the drone re-enters the network.
    pub(super) plan: &'a [NodeIx],
    pub(super) strategy: LocalStrategy,
    pub(super) parameters: &'a Parameters,
    pub(super) explain: bool,
}

/// Repairs a plan.
///
/// # Errors
/// Why the strategy does not apply and `exact` has to answer.
pub(super) fn repair(
    order: &RepairOrder<'_>,
    searcher: &mut Searcher,
    memory: &mut LocalMemory,
) -> Result<Repaired, Fallback> {
    prepare(order, memory)?;
    let first = order.plan.first().copied().ok_or(Fallback::OffLeg)?;
    let mut work = Work {
        order,
        searcher,
        memory,
        everywhere: None,
        done: Repaired {
            way: beginning_at(first, order.plan.len()),
            new_length_m: 0.0,
            complete: false,
            stage: Stage::Global,
            searches: 0,
            settled: 0,
            extent: Extent {
                nodes: 0,
                segments: 0,
            },
            repairs: Vec::new(),
            stages: Vec::new(),
        },
    };
    work.memory.union.clear();
    work.done.complete = work.follow_plan()?;
    Ok(work.finish())
}

/// A way of one node with room for a plan.
fn beginning_at(first: NodeIx, plan_nodes: usize) -> Path {
    let mut way = Path {
        nodes: Vec::with_capacity(plan_nodes + DETOUR_NODES),
        segments: Vec::with_capacity(plan_nodes + DETOUR_NODES),
    };
    way.nodes.push(first);
    way
}

/// Checks parameters and counts cells where the cell size is not the default.
fn prepare(order: &RepairOrder<'_>, memory: &mut LocalMemory) -> Result<(), Fallback> {
    let parameters = order.parameters;
    if order.strategy == LocalStrategy::TwoPhased
        && !(parameters.val_ratio.is_finite() && parameters.val_ratio > 0.0)
    {
        let message = format!(
            "val_ratio is {}; it must be finite and above 0",
            parameters.val_ratio
        );
        return Err(Fallback::Parameter { message });
    }
    if order.strategy != LocalStrategy::CellDensity {
        return Ok(());
    }
    let Some(cell_size_m) = parameters.cell_size_m else {
        memory.grid = None;
        return Ok(());
    };
    let is_counted = |grid: &DensityGrid| grid.cell_size_m() == cell_size_m;
    if !memory.grid.as_ref().is_some_and(is_counted) {
        let topology = order.closed.topology();
        let counted = DensityGrid::count(topology.positions(), topology.bounds(), cell_size_m);
        let refused = |error: crate::network::CellSizeError| Fallback::Parameter {
            message: error.to_string(),
        };
        memory.grid = Some(counted.map_err(refused)?);
    }
    Ok(())
}

struct Work<'a> {
    order: &'a RepairOrder<'a>,
    searcher: &'a mut Searcher,
    memory: &'a mut LocalMemory,
    /// The last gap whose search went over the whole network.
    everywhere: Option<Gap<'a>>,
    done: Repaired,
}

impl Work<'_> {
    /// Follows the plan, repairing what is closed; false when a run of closed legs cannot be bridged.
    fn follow_plan(&mut self) -> Result<bool, Fallback> {
        let plan = self.order.plan;
        let mut at = 0;
        while at + 1 < plan.len() {
            if let Some(segment) = open_leg(&self.order.closed, plan, at) {
                self.done.way.push(segment, plan[at + 1]);
                at += 1;
                continue;
            }
            match self.bridge(at)? {
                Some(next) => at = next,
                None => return Ok(false),
            }
        }
        Ok(true)
    }

    /// Bridges the run of closed legs that begins at a place of the plan; gives the place it rejoins the plan.
    fn bridge(&mut self, at: usize) -> Result<Option<usize>, Fallback> {
        let (plan, closed) = (self.order.plan, &self.order.closed);
        let mut end = at + 1;
        while end + 1 < plan.len() && open_leg(closed, plan, end).is_none() {
            end += 1;
        }
        // The run's own end is tried even where it is closed, which only a plan's last node can be.
        let run_end = end;
        while end < plan.len() {
            let may_be_tried = end == run_end || !closed.closes_node(plan[end]);
            if may_be_tried && self.attempt(plan[at], plan[end])? {
                return Ok(Some(end));
            }
            end += 1;
        }
        Ok(None)
    }

    /// Tries to reconnect two nodes; true when that worked.
    fn attempt(&mut self, from: NodeIx, to: NodeIx) -> Result<bool, Fallback> {
        let closed = self.order.closed;
        let gap = Gap { closed, from, to };
        let result = self.search(gap)?;
        let extent = match result.everywhere {
            true => Extent::everything(&gap),
            false => Extent::of(&self.memory.area, &gap),
        };
        match result.everywhere {
            true => self.everywhere = Some(gap),
            false => {
                for &node in self.memory.area.nodes() {
                    self.memory.union.insert(node);
                }
            }
        }
        let done = &mut self.done;
        done.stage = result.stage;
        done.searches += result.searches;
        done.settled += result.settled;
        done.repairs.push(Repair {
            from,
            to,
            length_m: result.arrival.map(|arrival| arrival.length_m),
            stage: result.stage,
            searches: result.searches,
            area_nodes: extent.nodes,
            area_segments: extent.segments,
            settled_nodes: result.settled,
        });
        done.extent = extent;
        if let Some(arrival) = result.arrival {
            self.searcher.append_way(arrival, None, &mut done.way);
            done.new_length_m += arrival.length_m;
        }
        Ok(result.arrival.is_some())
    }

    fn search(&mut self, gap: Gap<'_>) -> Result<LocalResult, Fallback> {
        let Self {
            order,
            searcher,
            memory,
            done,
            ..
        } = self;
        let parameters = order.parameters;
        let inside = match order.strategy {
            LocalStrategy::Baseline(baseline) => baseline,
            _ => parameters.inside,
        };
        let stages = order.explain.then_some(&mut done.stages);
        let mut problem = LocalProblem::new(gap, inside, searcher, &mut memory.area, stages);
        let connectivity = &mut memory.connectivity;
        let extent_m = gap.position(gap.from).distance_m(gap.position(gap.to));
        let has_extent = extent_m > 0.0 && gap.topology().size_m() > 0.0;
        match order.strategy {
            LocalStrategy::Baseline(_) => Ok(problem.search_as_baseline()),
            _ if !has_extent => Err(Fallback::NoExtent),
            LocalStrategy::Radius => Ok(radius::recompose(&mut problem, parameters)),
            LocalStrategy::CellDensity => {
                let grid = memory.grid.as_ref();
                let grid = grid.unwrap_or_else(|| gap.topology().density());
                let cells = &mut memory.cells;
                Ok(cell_density::recompose(
                    &mut problem,
                    parameters,
                    grid,
                    cells,
                    connectivity,
                ))
            }
            LocalStrategy::TwoPhased => Ok(two_phased::recompose(
                &mut problem,
                parameters,
                &mut memory.growth,
                connectivity,
            )),
        }
    }

    /// Works out the union of the areas where there were several.
    fn finish(mut self) -> Repaired {
        if let [first, _, ..] = self.done.repairs.as_slice() {
            let gap = Gap {
                closed: self.order.closed,
                from: first.from,
                to: self.everywhere.map_or(first.to, |gap| gap.to),
            };
            self.done.extent = match self.everywhere {
                Some(_) => Extent::everything(&gap),
                None => Extent::of(&self.memory.union, &gap),
            };
        }
        self.done
    }
}

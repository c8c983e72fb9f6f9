//! The oracle's whole recomposition: a report with the drone at A and its leg closed, the old plan
//! repaired run by run, and the exact answer where that fails.

use std::collections::BTreeSet;

use super::cells::cell_density;
use super::local::{LocalAnswer, local_baseline};
use super::network::{OracleNetwork, World};
use super::radius::radius;
use super::search::shortest;
use super::two_phased::two_phased;

/// A strategy with its parameters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Strategy {
    Exact,
    Radius,
    /// Cells of this side in metres, a sixteenth of the network size by default.
    CellDensity {
        cell_m: Option<f64>,
        /// Whether whole cells are taken rather than squares about nodes.
        slices: bool,
    },
    /// Half the rectangle's width as a ratio of `|AB|` (0.5 by default), and whether stages are
    /// skipped.
    TwoPhased {
        val_ratio: f64,
        stage_skipping: bool,
    },
    /// A baseline on the local problem.
    LocalBaseline,
    /// A baseline on the global problem.
    GlobalBaseline,
}

impl Strategy {
    /// Whether the strategy lays out an area by `|AB|` and the network size, which must not be 0.
    fn lays_out_areas(self) -> bool {
        matches!(
            self,
            Strategy::Radius | Strategy::CellDensity { .. } | Strategy::TwoPhased { .. }
        )
    }

    /// The answer for one pair; `None` for the strategies that do not work on pairs.
    fn on_pair(self, world: &World, a: usize, b: usize) -> Option<LocalAnswer> {
        match self {
            Strategy::Radius => Some(radius(world, a, b)),
            Strategy::CellDensity { cell_m, slices } => {
                Some(cell_density(world, a, b, cell_m, slices))
            }
            Strategy::TwoPhased {
                val_ratio,
                stage_skipping,
            } => Some(two_phased(world, a, b, val_ratio, stage_skipping)),
            Strategy::LocalBaseline => Some(local_baseline(world, a, b)),
            Strategy::Exact | Strategy::GlobalBaseline => None,
        }
    }
}

/// Why the exact strategy was turned to instead of a local one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Fallback {
    /// All nodes are in one place.
    NetworkHasNoSize,
    /// The two ends of a run are in one place.
    EndsCoincide,
    /// No open node of the old plan can be reached from the start of a run.
    NoRepair,
    /// The old plan was repaired, but it does not reach the destination.
    PlanEndsEarly,
}

/// What is asked: what was closed before, the leg that failed (and closes), and the destination.
#[derive(Clone, Debug)]
pub(crate) struct Report<'a> {
    pub(crate) network: &'a OracleNetwork,
    pub(crate) standing_closed_nodes: BTreeSet<usize>,
    pub(crate) standing_closed_segments: BTreeSet<usize>,
    /// A and B of the failed leg.
    pub(crate) failed: (usize, usize),
    pub(crate) destination: usize,
}

impl<'a> Report<'a> {
    /// What was open before the report.
    pub(crate) fn world_before(&self) -> World<'a> {
        World {
            network: self.network,
            closed_nodes: self.standing_closed_nodes.clone(),
            closed_segments: self.standing_closed_segments.clone(),
        }
    }

    /// What is open for this request: the failed leg is closed too.
    pub(crate) fn world_now(&self) -> World<'a> {
        let mut world = self.world_before();
        world
            .closed_segments
            .extend(self.network.segments_between(self.failed.0, self.failed.1));
        world
    }
}

/// One attempt to repair a run of closed legs.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Repair {
    pub(crate) from: usize,
    pub(crate) to: usize,
    pub(crate) answer: LocalAnswer,
}

/// The answer to a report.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct OracleAnswer {
    /// The whole remaining path from A, `None` where there is none.
    pub(crate) path: Option<Vec<usize>>,
    /// The length of `path`.
    pub(crate) remaining_length_m: Option<f64>,
    /// The new part: the repairs, or the whole of an exact path.
    pub(crate) recomposed_length_m: Option<f64>,
    pub(crate) strategy_used: Strategy,
    /// Why `exact` was turned to, even where it found no path either.
    pub(crate) fallback: Option<Fallback>,
    pub(crate) stage: &'static str,
    pub(crate) searches: usize,
    pub(crate) area: BTreeSet<usize>,
    pub(crate) area_segments: usize,
    /// Every attempt in order, the failed ones included.
    pub(crate) repairs: Vec<Repair>,
    /// The plan that was repaired.
    pub(crate) old_plan: Vec<usize>,
    /// The shortest way between the ends of the first run of closed legs.
    pub(crate) local_optimum_m: Option<f64>,
    /// The shortest way from A to the destination.
    pub(crate) global_optimum_m: Option<f64>,
}

/// The old plan where none is given: A -> B, then the shortest way from B to the destination over
/// what was open before the report. `None` where there was no such way.
pub(crate) fn old_plan(report: &Report) -> Option<Vec<usize>> {
    let (a, b) = report.failed;
    let (_, onwards) = shortest(&report.world_before(), b, report.destination, None)?;
    Some([vec![a], onwards].concat())
}

/// Answers a report; `remaining_path` runs from A. Without it and without an old plan, the leg is
/// all that is known of the plan.
pub(crate) fn recompose(
    report: &Report,
    remaining_path: Option<Vec<usize>>,
    strategy: Strategy,
) -> OracleAnswer {
    let plan = remaining_path.or_else(|| old_plan(report));
    let plan = plan.unwrap_or_else(|| vec![report.failed.0, report.failed.1]);
    recompose_plan(report, &plan, strategy)
}

/// Answers a report with the old plan given, its first node A. Ties between old plans of one length
/// are left to the caller in this way.
pub(crate) fn recompose_plan(report: &Report, plan: &[usize], strategy: Strategy) -> OracleAnswer {
    let world = report.world_now();
    let work = Work {
        report,
        world: &world,
        plan,
        strategy,
    };
    if matches!(strategy, Strategy::Exact | Strategy::GlobalBaseline) {
        return work.exact(strategy, None, Vec::new());
    }
    if strategy.lays_out_areas() && report.network.size_m() == 0.0 {
        return work.exact(
            Strategy::Exact,
            Some(Fallback::NetworkHasNoSize),
            Vec::new(),
        );
    }

    let mut repairs = Vec::new();
    let mut path = vec![plan[0]];
    let mut at = 0;
    while at + 1 < plan.len() {
        if work.leg_is_open(at) {
            at += 1;
            path.push(plan[at]);
            continue;
        }
        match work.repair_run(at, &mut repairs) {
            Ok(reached) => {
                let repair: &Repair = repairs.last().expect("a run was just repaired");
                path.extend(repair.answer.path.iter().flatten().skip(1));
                at = reached;
            }
            Err(Fallback::EndsCoincide) => {
                return work.exact(Strategy::Exact, Some(Fallback::EndsCoincide), Vec::new());
            }
            Err(reason) => return work.exact_after_failure(reason, repairs),
        }
    }
    if path.last() != Some(&report.destination) {
        return work.exact_after_failure(Fallback::PlanEndsEarly, repairs);
    }
    work.repaired(Some(path), None, repairs)
}

/// One report at work on one plan.
struct Work<'w> {
    report: &'w Report<'w>,
    world: &'w World<'w>,
    plan: &'w [usize],
    strategy: Strategy,
}

impl Work<'_> {
    /// Whether the leg from the plan's node `at` to the next is open. The drone is at the plan's
    /// first node, which is therefore never required to be open.
    fn leg_is_open(&self, at: usize) -> bool {
        let (from, to) = (self.plan[at], self.plan[at + 1]);
        let leaves = at == 0 || self.world.node_is_open(from);
        let arrives = self.world.node_is_open(to);
        let between = self.report.network.segments_between(from, to);
        leaves
            && arrives
            && between
                .iter()
                .any(|segment| !self.world.closed_segments.contains(segment))
    }

    /// The plan index at which the maximal run of closed legs that begins at `at` ends.
    fn end_of_run(&self, at: usize) -> usize {
        let mut end = at;
        while end + 1 < self.plan.len() && !self.leg_is_open(end) {
            end += 1;
        }
        end
    }

    /// Tries the end of the run, then every later open node of the plan; the plan index reached.
    fn repair_run(&self, at: usize, repairs: &mut Vec<Repair>) -> Result<usize, Fallback> {
        let end = self.end_of_run(at);
        let later =
            (end + 1..self.plan.len()).filter(|&index| self.world.node_is_open(self.plan[index]));
        for index in std::iter::once(end).chain(later) {
            let (from, to) = (self.plan[at], self.plan[index]);
            if self.strategy.lays_out_areas() && self.report.network.straight_m(from, to) == 0.0 {
                return Err(Fallback::EndsCoincide);
            }
            let answer = self
                .strategy
                .on_pair(self.world, from, to)
                .expect("a local strategy works on pairs");
            let found = answer.path.is_some();
            repairs.push(Repair { from, to, answer });
            if found {
                return Ok(index);
            }
        }
        Err(Fallback::NoRepair)
    }

    /// The exact answer after attempts that did not reach the destination, all of them counted, those
    /// that went well too; where there is no path at all, the figures of the attempts stand.
    fn exact_after_failure(&self, reason: Fallback, repairs: Vec<Repair>) -> OracleAnswer {
        let exact = self.exact(Strategy::Exact, Some(reason), repairs.clone());
        if exact.path.is_some() {
            exact
        } else {
            self.repaired(None, Some(reason), repairs)
        }
    }

    /// One search over everything from A to the destination, after these attempts.
    fn exact(
        &self,
        used: Strategy,
        fallback: Option<Fallback>,
        repairs: Vec<Repair>,
    ) -> OracleAnswer {
        let (start, destination) = (self.plan[0], self.report.destination);
        let (length_m, path) = shortest(self.world, start, destination, None).unzip();
        let before = repairs.iter().map(|repair| repair.answer.searches);
        let area = self
            .world
            .counted_nodes(self.report.failed.0, self.report.failed.1);
        OracleAnswer {
            path,
            remaining_length_m: length_m,
            recomposed_length_m: length_m,
            strategy_used: used,
            fallback,
            stage: "global",
            searches: before.sum::<usize>() + 1,
            area_segments: self.world.count_area_segments(&area, start),
            area,
            repairs,
            old_plan: self.plan.to_vec(),
            local_optimum_m: self.local_optimum_m(),
            global_optimum_m: length_m,
        }
    }

    /// The answer of the strategy that was asked for: the sum of the attempts' searches, the union
    /// of their areas, the last one's stage.
    fn repaired(
        &self,
        path: Option<Vec<usize>>,
        fallback: Option<Fallback>,
        repairs: Vec<Repair>,
    ) -> OracleAnswer {
        let (start, destination) = (self.plan[0], self.report.destination);
        let area: BTreeSet<usize> = repairs
            .iter()
            .flat_map(|repair| repair.answer.area.iter().copied())
            .collect();
        let repaired_m = repairs
            .iter()
            .filter_map(|repair| repair.answer.length_m)
            .sum();
        OracleAnswer {
            remaining_length_m: path
                .as_ref()
                .and_then(|nodes| self.world.path_length_m(nodes)),
            recomposed_length_m: path.as_ref().map(|_| repaired_m),
            path,
            strategy_used: self.strategy,
            fallback,
            stage: repairs
                .last()
                .map_or("global", |repair| repair.answer.stage),
            searches: repairs.iter().map(|repair| repair.answer.searches).sum(),
            area_segments: self.world.count_area_segments(&area, start),
            area,
            repairs,
            old_plan: self.plan.to_vec(),
            local_optimum_m: self.local_optimum_m(),
            global_optimum_m: shortest(self.world, start, destination, None)
                .map(|(length_m, _)| length_m),
        }
    }

    fn local_optimum_m(&self) -> Option<f64> {
        let first = (0..self.plan.len() - 1).find(|&at| !self.leg_is_open(at))?;
        let (from, to) = (self.plan[first], self.plan[self.end_of_run(first)]);
        shortest(self.world, from, to, None).map(|(length_m, _)| length_m)
    }
}

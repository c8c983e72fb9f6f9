//! What is asked: a failure report, the strategy to answer it with, and how much to tell.

use super::explanation::Stage;
use crate::airspace::{Hits, Zone};
use crate::flight::{Circumstances, FailedPads, FailureReport, FailureType, ServiceStop};
use crate::network::NodeIx;
use crate::routing::Baseline;
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// How the new path is found.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Strategy {
    /// The true optimum from the drone to its destination.
    #[default]
    Exact,
    /// Paper, Algorithm 3.
    TwoPhased,
    /// Paper, Algorithm 2.
    CellDensity,
    /// Paper, Algorithm 1.
    Radius,
    /// Dijkstra's algorithm; the paper's baseline.
    Dijkstra,
    /// A* with the straight line.
    Astar,
    /// Bellman-Ford.
    BellmanFord,
}

impl Strategy {
    /// All strategies, the default first.
    pub const ALL: [Self; 7] = [
        Self::Exact,
        Self::TwoPhased,
        Self::CellDensity,
        Self::Radius,
        Self::Dijkstra,
        Self::Astar,
        Self::BellmanFord,
    ];

    /// The name on the wire.
    pub fn name(self) -> &'static str {
        match self {
            Self::Exact => "exact",
            Self::TwoPhased => "two_phased",
            Self::CellDensity => "cell_density",
            Self::Radius => "radius",
            Self::Dijkstra => "dijkstra",
            Self::Astar => "astar",
            Self::BellmanFord => "bellman_ford",
        }
    }
}

/// What reconnects the two ends of a failed leg.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum LocalStrategy {
    TwoPhased,
    CellDensity,
    Radius,
    Baseline(Baseline),
}

/// A strategy with its scope settled.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Method {
    Exact,
    Global(Baseline),
    Local(LocalStrategy),
}

/// Which problem a baseline solves.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Scope {
    /// From the start of the failed leg to its end, then on as planned.
    Local,
    /// From the drone to its destination.
    #[default]
    Global,
}

/// How the two-phased strategy finds out which nodes lie in its areas.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum AreaTest {
    /// By where a node lies along the leg and off it: a few multiplications.
    #[default]
    Frame,
    /// By polygons that are built for every request, as the paper measures it.
    Polygon,
}

/// What the cell density-based strategy searches about a node.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Default)]
pub enum CellArea {
    /// A square about the node's own position.
    #[default]
    Squares,
    /// Whole cells: those up to a number of columns and rows from the node's own, as the indices of the
    /// paper's pseudocode can be read.
    Slices,
}

/// Numbers that the paper leaves open.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Parameters {
    /// Side of the cells of the cell density-based strategy, in metres; `None` is the network size / 16.
    pub cell_size_m: Option<f64>,
    /// What the cell density-based strategy searches about each node.
    pub cell_area: CellArea,
    /// Half the height of the two-phased strategy's rectangle, as a share of the leg.
    pub val_ratio: f64,
    /// Whether the two-phased strategy skips stages with few nodes.
    pub stage_skipping: bool,
    /// How the two-phased strategy decides which nodes lie in an area.
    pub area_test: AreaTest,
    /// Whether Dijkstra as a baseline settles everything.
    pub full_tree: bool,
    /// What local strategies run inside their areas.
    pub inside: Baseline,
    /// Stages up to this one are passed over: their answers are known and of no use.
    pub after: Option<Stage>,
}

impl Default for Parameters {
    fn default() -> Self {
        Self {
            cell_size_m: None,
            cell_area: CellArea::Squares,
            val_ratio: 0.5,
            stage_skipping: true,
            area_test: AreaTest::Frame,
            full_tree: false,
            inside: Baseline::AStar,
            after: None,
        }
    }
}

impl Parameters {
    /// True for a stage that is passed over.
    pub(super) fn passes_over(&self, stage: Stage) -> bool {
        let place = |stage: Stage| match stage {
            Stage::Triangle => 0,
            Stage::Rhombus => 1,
            Stage::Rectangle => 2,
            Stage::Circle | Stage::Cells | Stage::Grown => 3,
            Stage::Local | Stage::Global => 4,
        };
        self.after.is_some_and(|after| place(stage) <= place(after))
    }
}

/// A zone that a report brings along: it binds this request alone.
#[derive(Clone, Debug, PartialEq)]
pub struct BroughtZone {
    /// The zone.
    pub zone: Arc<Zone>,
    /// What it closes.
    pub hits: Hits,
}

/// A request to recompose.
#[derive(Clone, Debug, PartialEq)]
pub struct Request {
    /// What failed, and where.
    pub report: FailureReport,
    /// What else is known of the drone.
    pub circumstances: Circumstances,
    /// Where a delivery with stops goes from the report's destination on, which is its next stop and the first of these; where
    /// it ends, and nothing is served, is the last. Empty where the report's destination is the end.
    pub onward: Vec<ServiceStop>,
    /// A zone that a regulatory report brings along.
    pub zone: Option<BroughtZone>,
    /// How to answer it.
    pub strategy: Strategy,
    /// For baselines: which problem they solve.
    pub scope: Scope,
    /// Numbers that the paper leaves open.
    pub parameters: Parameters,
    /// Also tell the optima that the answer is measured against.
    pub optimum: bool,
    /// Also tell the search areas by stage.
    pub explain: bool,
}

impl Request {
    /// What the strategy and its scope come down to.
    pub(super) fn method(&self) -> Method {
        let baseline = match self.strategy {
            Strategy::Exact => return Method::Exact,
            Strategy::TwoPhased => return Method::Local(LocalStrategy::TwoPhased),
            Strategy::CellDensity => return Method::Local(LocalStrategy::CellDensity),
            Strategy::Radius => return Method::Local(LocalStrategy::Radius),
            Strategy::Dijkstra => Baseline::Dijkstra {
                full_tree: self.parameters.full_tree,
            },
            Strategy::Astar => Baseline::AStar,
            Strategy::BellmanFord => Baseline::BellmanFord,
        };
        match self.scope {
            Scope::Local => Method::Local(LocalStrategy::Baseline(baseline)),
            Scope::Global => Method::Global(baseline),
        }
    }

    /// The pads that have failed; `None` where the report is about something else.
    pub fn failed_pads(&self) -> Option<FailedPads> {
        let is_about_pads = self.report.failure == FailureType::Infrastructure;
        let at_end = FailedPads {
            node: self.report.leg.1,
            count: None,
        };
        is_about_pads.then(|| self.circumstances.failed_pads.unwrap_or(at_end))
    }

    /// Leads a delivery with stops to the first of the places where it goes on to; without any nothing changes.
    pub fn lead_by(&mut self, onward: Vec<ServiceStop>) {
        let Some(next) = onward.first().map(|stop| stop.node) else {
            return;
        };
        let path = self.report.remaining_path.take();
        self.report.remaining_path = path.and_then(|path| up_to(path, next));
        self.report.destination = next;
        self.onward = onward;
    }

    /// A request answered by `exact`, without extras.
    pub fn exact(report: FailureReport) -> Self {
        Self {
            report,
            circumstances: Circumstances::default(),
            onward: Vec::new(),
            zone: None,
            strategy: Strategy::Exact,
            scope: Scope::Global,
            parameters: Parameters::default(),
            optimum: false,
            explain: false,
        }
    }
}

/// A path from the start of a leg on up to where it comes to a node first; `None` where it does not.
fn up_to(mut path: Vec<NodeIx>, node: NodeIx) -> Option<Vec<NodeIx>> {
    let place = path.iter().skip(1).position(|&passed| passed == node)?;
    path.truncate(place + 2);
    Some(path)
}

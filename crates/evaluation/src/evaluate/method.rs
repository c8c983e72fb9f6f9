//! What is compared: every approach, over the leg or over the rest of the route, with what it runs inside.

use crate::flight::{FailureReport, FailureType, Location};
use crate::network::NodeIx;
use crate::recompose::{AreaTest, CellArea, Parameters, Request, Scope, Strategy};
use crate::routing::Baseline;

/// How a new path is found.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Approach {
    /// `exact`, with the table of the destination or without.
    Exact {
        /// Whether the table is there.
        warm: bool,
    },
    /// The two-phased strategy, areas decided in the leg's frame.
    TwoPhased,
    /// The same with polygons.
    TwoPhasedPolygons,
    /// The same without polygons, every stage searched.
    TwoPhasedAllStages,
    /// The cell density-based strategy.
    CellDensity,
    /// The radius-based strategy.
    Radius,
    /// Dijkstra's algorithm.
    Dijkstra {
        /// Whether it settles everything it can reach.
        full_tree: bool,
    },
    /// A* with the straight line.
    AStar,
    /// Bellman-Ford, by rounds over all segments.
    BellmanFord,
    /// Bellman-Ford with a queue, as NetworkX has it; its answers are those of the other.
    QueueBellmanFord,
}

/// What a strategy with areas searches them with.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Inside {
    /// A* with the straight line.
    AStar,
    /// Dijkstra's algorithm, stopped at the goal.
    Dijkstra,
}

/// Between which nodes a new way is looked for, and areas are spanned.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Span {
    /// From A to B; the rest of the plan is kept.
    Leg,
    /// From A to the destination.
    Route,
}

/// Side of the cell density-based strategy's cells as a multiple of the usual one, and what is searched.
const CELLS: [(&str, f64, CellArea); 4] = [
    ("", 1.0, CellArea::Squares),
    (".cells8", 2.0, CellArea::Squares),
    (".cells32", 0.5, CellArea::Squares),
    (".slices", 1.0, CellArea::Slices),
];

/// Half the height of the two-phased strategy's rectangle as a share of the leg.
const VALS: [(&str, f64); 3] = [("", 0.5), (".val0.25", 0.25), (".val1", 1.0)];

/// An approach with its choices.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Method {
    /// How a path is found.
    pub approach: Approach,
    /// What is run inside areas; of no meaning without areas, and then A*.
    pub inside: Inside,
    /// Between which nodes.
    pub span: Span,
    /// Which of the numbers that the paper leaves open: 0 is the usual one.
    pub variant: usize,
}

impl Approach {
    /// True for the strategies of the paper, which search in areas.
    pub fn has_areas(self) -> bool {
        matches!(
            self,
            Self::TwoPhased
                | Self::TwoPhasedPolygons
                | Self::TwoPhasedAllStages
                | Self::CellDensity
                | Self::Radius
        )
    }

    /// The name in plots and tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::Exact { warm: true } => "exact, warm",
            Self::Exact { warm: false } => "exact, cold",
            Self::TwoPhased => "two-phased",
            Self::TwoPhasedPolygons => "two-phased, polygons",
            Self::TwoPhasedAllStages => "two-phased, no skipping",
            Self::CellDensity => "cell density",
            Self::Radius => "radius",
            Self::Dijkstra { full_tree: false } => "Dijkstra",
            Self::Dijkstra { full_tree: true } => "Dijkstra, full tree",
            Self::AStar => "A*",
            Self::BellmanFord => "Bellman-Ford",
            Self::QueueBellmanFord => "Bellman-Ford, queue",
        }
    }

    /// The name in raw rows.
    fn id(self) -> &'static str {
        match self {
            Self::Exact { warm: true } => "exact_warm",
            Self::Exact { warm: false } => "exact_cold",
            Self::TwoPhased => "two_phased",
            Self::TwoPhasedPolygons => "two_phased_polygons",
            Self::TwoPhasedAllStages => "two_phased_all_stages",
            Self::CellDensity => "cell_density",
            Self::Radius => "radius",
            Self::Dijkstra { full_tree: false } => "dijkstra",
            Self::Dijkstra { full_tree: true } => "dijkstra_full_tree",
            Self::AStar => "astar",
            Self::BellmanFord => "bellman_ford",
            Self::QueueBellmanFord => "bellman_ford_queue",
        }
    }

    /// What the paper leaves open, as it is named in raw rows.
    fn variants(self) -> Vec<&'static str> {
        match self {
            Self::CellDensity => CELLS.map(|(name, ..)| name).to_vec(),
            Self::TwoPhased | Self::TwoPhasedPolygons | Self::TwoPhasedAllStages => {
                VALS.map(|(name, _)| name).to_vec()
            }
            _ => vec![""],
        }
    }
}

impl Method {
    /// `exact`.
    pub const fn exact(warm: bool) -> Self {
        Self::baseline(Approach::Exact { warm }, Span::Route)
    }

    /// An approach without areas.
    pub const fn baseline(approach: Approach, span: Span) -> Self {
        Self {
            approach,
            inside: Inside::AStar,
            span,
            variant: 0,
        }
    }

    /// An approach of the paper at its best: A* inside, areas about the leg.
    pub const fn of_paper(approach: Approach) -> Self {
        Self::baseline(approach, Span::Leg)
    }

    /// All that is measured, `exact` first.
    pub fn all() -> Vec<Self> {
        let mut methods = vec![Self::exact(true), Self::exact(false)];
        let strategies = [
            Approach::TwoPhased,
            Approach::TwoPhasedPolygons,
            Approach::CellDensity,
            Approach::Radius,
        ];
        for span in [Span::Leg, Span::Route] {
            for approach in strategies {
                for inside in [Inside::AStar, Inside::Dijkstra] {
                    methods.extend((0..approach.variants().len()).map(|variant| Self {
                        approach,
                        inside,
                        span,
                        variant,
                    }));
                }
            }
        }
        methods.extend((0..VALS.len()).map(|variant| Self {
            variant,
            ..Self::of_paper(Approach::TwoPhasedAllStages)
        }));
        let baselines = [
            Approach::Dijkstra { full_tree: false },
            Approach::Dijkstra { full_tree: true },
            Approach::AStar,
            Approach::BellmanFord,
            Approach::QueueBellmanFord,
        ];
        for approach in baselines {
            methods.extend([Span::Leg, Span::Route].map(|span| Self::baseline(approach, span)));
        }
        methods
    }

    /// The name in raw rows, such as `two_phased.astar.leg`.
    pub fn id(self) -> String {
        let approach = self.approach.id();
        let span = match self.span {
            Span::Leg => "leg",
            Span::Route => "route",
        };
        let inside = match self.inside {
            Inside::AStar => "astar",
            Inside::Dijkstra => "dijkstra",
        };
        let variants = self.approach.variants();
        let variant = variants.get(self.variant).unwrap_or(&"");
        match self.approach.has_areas() {
            true => format!("{approach}.{inside}.{span}{variant}"),
            false => format!("{approach}.{span}"),
        }
    }

    /// The method of such a name.
    pub fn from_id(id: &str) -> Option<Self> {
        Self::all().into_iter().find(|method| method.id() == id)
    }

    /// The request that answers a failure by this method.
    ///
    /// `rest` is the plan from A on. Over the route, areas are spanned between A and the destination: the
    /// strategy is told of a plan that goes straight there, which has no segment and is to be bridged. The side
    /// of the network's usual cells is in metres.
    pub(super) fn request(
        self,
        leg: (NodeIx, NodeIx),
        rest: &[NodeIx],
        usual_cell_m: f64,
    ) -> Request {
        let destination = rest.last().copied().unwrap_or(leg.1);
        let spans_route = self.approach.has_areas() && self.span == Span::Route;
        let report = FailureReport {
            failure: FailureType::Navigational,
            leg,
            location: Location::LegStart,
            cause_location: None,
            destination,
            remaining_path: Some(match spans_route {
                true => vec![leg.0, destination],
                false => rest.to_vec(),
            }),
        };
        let strategy = match self.approach {
            Approach::Exact { .. } => Strategy::Exact,
            Approach::TwoPhased | Approach::TwoPhasedPolygons | Approach::TwoPhasedAllStages => {
                Strategy::TwoPhased
            }
            Approach::CellDensity => Strategy::CellDensity,
            Approach::Radius => Strategy::Radius,
            Approach::Dijkstra { .. } => Strategy::Dijkstra,
            Approach::AStar => Strategy::Astar,
            Approach::BellmanFord | Approach::QueueBellmanFord => Strategy::BellmanFord,
        };
        Request {
            strategy,
            scope: match self.span {
                Span::Leg => Scope::Local,
                Span::Route => Scope::Global,
            },
            parameters: self.parameters(usual_cell_m),
            ..Request::exact(report)
        }
    }

    fn parameters(self, usual_cell_m: f64) -> Parameters {
        let usual = Parameters::default();
        let (cell_size_m, cell_area, val_ratio) = match self.approach {
            Approach::CellDensity => {
                let (_, sides, area) = CELLS[self.variant];
                // The network has counted its usual cells itself; others are counted when they are asked for.
                let cell_size_m = (sides != 1.0).then_some(sides * usual_cell_m);
                (cell_size_m, area, usual.val_ratio)
            }
            Approach::TwoPhased | Approach::TwoPhasedPolygons | Approach::TwoPhasedAllStages => {
                (None, usual.cell_area, VALS[self.variant].1)
            }
            _ => (None, usual.cell_area, usual.val_ratio),
        };
        Parameters {
            cell_size_m,
            cell_area,
            val_ratio,
            stage_skipping: self.approach != Approach::TwoPhasedAllStages,
            area_test: match self.approach {
                Approach::TwoPhasedPolygons => AreaTest::Polygon,
                _ => AreaTest::Frame,
            },
            full_tree: self.approach == Approach::Dijkstra { full_tree: true },
            inside: match self.inside {
                Inside::AStar => Baseline::AStar,
                Inside::Dijkstra => Baseline::Dijkstra { full_tree: false },
            },
            ..usual
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_method_has_a_name_of_its_own_by_which_it_is_found() {
        for method in Method::all() {
            assert_eq!(Method::from_id(&method.id()), Some(method));
        }
        assert_eq!(Method::from_id("telepathy.route"), None);
    }
}

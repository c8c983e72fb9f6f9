//! Plots over a variable of Table 1, and what all plots say of themselves.

use super::super::cells::Cell;
use super::super::design::Sweep;
use super::super::record::{Axis, Figure, Reference, Scale, Series};
use super::{Content, FigurePlan, Over, Span, basis};

impl FigurePlan {
    /// A plot over a variable: at each of its values all cells that have it.
    pub(super) fn by_variable(&self, cells: &[&Cell], sweep: Sweep, seed: u64) -> Option<Figure> {
        let (label, scale) = match sweep {
            Sweep::Nodes => ("nodes", Scale::Log),
            Sweep::Neighbours => ("most neighbours of a node", Scale::Linear),
            Sweep::Reach => ("longest segment, as a share of the map", Scale::Linear),
        };
        let variables = cells.iter().filter_map(|cell| cell.plan.variable(sweep));
        let mut variables: Vec<f64> = variables.collect();
        variables.sort_by(f64::total_cmp);
        variables.dedup();
        let series = self.methods().iter().map(|&method| Series {
            name: self.series_name(method),
            points: variables
                .iter()
                .filter_map(|&x| {
                    let at = |cell: &&Cell| cell.plan.variable(sweep) == Some(x);
                    let cells: Vec<&Cell> = cells.iter().copied().filter(at).collect();
                    self.point(method, &cells, x, seed)
                })
                .collect(),
        });
        let x = Axis {
            label: label.to_owned(),
            scale,
        };
        Some(Figure {
            series: series.collect(),
            ..self.frame(cells, x)
        })
    }

    /// The axis of values, and the line to compare with.
    pub(super) fn upright(&self) -> (Axis, Option<Reference>) {
        let (label, scale, line) = match self.content {
            Content::RelativeTime(_, Span::Leg) => (
                "time / time of Dijkstra A → B",
                Scale::Log,
                Some("Dijkstra, A → B, early exit"),
            ),
            Content::RelativeTime(_, Span::Route) => (
                "time / time of Dijkstra A → destination",
                Scale::Log,
                Some("Dijkstra, A → destination, early exit"),
            ),
            Content::Overhead(_) => ("longer than the shortest route, %", Scale::Linear, None),
            Content::NodeShare(_) => ("nodes searched, % of the network", Scale::Log, None),
            Content::SegmentShare(_) => ("segments searched, % of the network", Scale::Log, None),
            Content::Times(_) => ("time, µs", Scale::Log, None),
            Content::Settled(_) => ("nodes settled", Scale::Log, None),
            Content::Skipping => (
                "with skipping / without",
                Scale::Linear,
                Some("every stage searched"),
            ),
        };
        let axis = Axis {
            label: label.to_owned(),
            scale,
        };
        let reference = line.map(|label| Reference {
            y: 1.0,
            label: label.to_owned(),
        });
        (axis, reference)
    }

    pub(super) fn caption(&self, cells: &[&Cell]) -> String {
        let what = match (self.content, self.over) {
            (Content::RelativeTime(_, Span::Leg), _) => {
                "Median over failures of each method's time over that of Dijkstra's algorithm from A to B: all solve the same problem"
            }
            (Content::RelativeTime(_, Span::Route), _) => {
                "Median over failures of each method's time over that of Dijkstra's algorithm from A to the destination; strategies with areas solve A to B alone"
            }
            (Content::Overhead(_), _) => {
                "Mean over failures of how much longer the route from A to the destination is than the shortest"
            }
            (Content::NodeShare(_), _) => {
                "Mean share of the network's nodes in the last area searched; without an area, of the nodes settled"
            }
            (Content::SegmentShare(_), _) => {
                "Mean share of the network's segments in the last area searched; without an area, of those at the nodes settled"
            }
            (Content::Times(_), _) => "Median time of a recomposition",
            (Content::Settled(_), _) => {
                "Mean number of nodes settled by all searches of a recomposition"
            }
            (_, Over::Skipping { effective: true }) => {
                "Failures in which no skipped stage holds a path: means with skipping over means with every stage searched"
            }
            _ => {
                "Failures in which a skipped stage holds a path: means with skipping over means with every stage searched"
            }
        };
        let areas = match self
            .methods()
            .iter()
            .any(|method| method.approach.has_areas())
        {
            true => "; areas lie about A and B, A* runs inside, and the rest of the plan is kept",
            false => "",
        };
        let joined = match self.over {
            Over::Sweep(_) => ", joined at random",
            _ => "",
        };
        format!(
            "{what}{areas}. {}{joined}; 95 % intervals over networks and failures, bands from the first to the third quartile.",
            basis(cells)
        )
    }
}

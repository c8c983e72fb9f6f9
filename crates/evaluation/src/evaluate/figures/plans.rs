//! The list of all plots.

use super::super::design::Sweep;
use super::super::method::{Approach, Method, Span};
use super::{Content, FigurePlan};

const WARM: Method = Method::exact(true);
const COLD: Method = Method::exact(false);
const TWO_PHASED: Method = Method::of_paper(Approach::TwoPhased);
const POLYGONS: Method = Method::of_paper(Approach::TwoPhasedPolygons);
const CELL_DENSITY: Method = Method::of_paper(Approach::CellDensity);
const RADIUS: Method = Method::of_paper(Approach::Radius);
const FULL_TREE: Method = Method::baseline(Approach::Dijkstra { full_tree: true }, Span::Route);
const DIJKSTRA: Method = Method::baseline(Approach::Dijkstra { full_tree: false }, Span::Route);
const ASTAR: Method = Method::baseline(Approach::AStar, Span::Route);
const BELLMAN_FORD: Method = Method::baseline(Approach::BellmanFord, Span::Route);

const RADIUS_TIMES: &[Method] = &[WARM, COLD, RADIUS, FULL_TREE];
const AREA_TIMES: &[Method] = &[WARM, COLD, TWO_PHASED, POLYGONS, CELL_DENSITY, FULL_TREE];
const TEXTBOOK_TIMES: &[Method] = &[WARM, COLD, TWO_PHASED, ASTAR, BELLMAN_FORD, FULL_TREE];
const EVERYTHING: &[Method] = &[
    WARM,
    COLD,
    TWO_PHASED,
    POLYGONS,
    CELL_DENSITY,
    RADIUS,
    ASTAR,
    DIJKSTRA,
    FULL_TREE,
    BELLMAN_FORD,
];
const RIVALS: &[Method] = &[
    COLD,
    TWO_PHASED,
    POLYGONS,
    CELL_DENSITY,
    RADIUS,
    ASTAR,
    DIJKSTRA,
];

const AREAS: &[Method] = &[WARM, TWO_PHASED, CELL_DENSITY];

const fn paper(
    slug: &'static str,
    number: u32,
    title: &'static str,
    sweep: Sweep,
    content: Content,
) -> FigurePlan {
    FigurePlan {
        slug,
        paper: Some(number),
        title,
        sweep,
        content,
    }
}

const fn own(
    slug: &'static str,
    title: &'static str,
    sweep: Sweep,
    content: Content,
) -> FigurePlan {
    FigurePlan {
        slug,
        paper: None,
        title,
        sweep,
        content,
    }
}

/// Those of the paper in its order, then ours.
const PLANS: &[FigurePlan] = &[
    paper(
        "radius-time",
        7,
        "Radius-based: time",
        Sweep::Nodes,
        Content::RelativeTime(RADIUS_TIMES),
    ),
    paper(
        "radius-distance",
        8,
        "Radius-based: distance",
        Sweep::Nodes,
        Content::Overhead(&[WARM, RADIUS]),
    ),
    paper(
        "time-by-size",
        9,
        "Time over network size",
        Sweep::Nodes,
        Content::RelativeTime(AREA_TIMES),
    ),
    paper(
        "time-by-density",
        9,
        "Time over the number of neighbours",
        Sweep::Neighbours,
        Content::RelativeTime(AREA_TIMES),
    ),
    paper(
        "distance-by-size",
        10,
        "Distance overhead over network size",
        Sweep::Nodes,
        Content::Overhead(AREAS),
    ),
    paper(
        "distance-by-density",
        10,
        "Distance overhead over the number of neighbours",
        Sweep::Neighbours,
        Content::Overhead(AREAS),
    ),
    paper(
        "node-compression",
        11,
        "Share of the nodes searched",
        Sweep::Nodes,
        Content::NodeShare(AREAS),
    ),
    paper(
        "edge-compression",
        12,
        "Share of the segments searched",
        Sweep::Nodes,
        Content::SegmentShare(AREAS),
    ),
    paper(
        "textbook-time",
        13,
        "Two-phased beside A* and Bellman-Ford: time",
        Sweep::Nodes,
        Content::RelativeTime(TEXTBOOK_TIMES),
    ),
    paper(
        "textbook-distance",
        14,
        "Two-phased beside A* and Bellman-Ford: distance",
        Sweep::Nodes,
        Content::Overhead(&[WARM, TWO_PHASED, ASTAR, BELLMAN_FORD]),
    ),
    paper(
        "skipping-ineffective",
        15,
        "Ineffective skipping of stages",
        Sweep::Everything,
        Content::Skipping { effective: false },
    ),
    paper(
        "skipping-effective",
        16,
        "Effective skipping of stages",
        Sweep::Everything,
        Content::Skipping { effective: true },
    ),
    paper(
        "sydney-time",
        17,
        "Sydney CBD: time",
        Sweep::Real,
        Content::RelativeTime(EVERYTHING),
    ),
    paper(
        "sydney-distance",
        18,
        "Sydney CBD: distance",
        Sweep::Real,
        Content::Overhead(&[WARM, TWO_PHASED, CELL_DENSITY, RADIUS]),
    ),
    own(
        "median-times",
        "Time to a whole new route, network by network",
        Sweep::Everything,
        Content::Times(EVERYTHING),
    ),
    own(
        "time-by-reach",
        "Time over the reach of a segment",
        Sweep::Reach,
        Content::RelativeTime(AREA_TIMES),
    ),
    own(
        "time-by-map",
        "Time over the size of the map",
        Sweep::Map,
        Content::RelativeTime(AREA_TIMES),
    ),
    own(
        "settled-by-size",
        "Nodes settled over network size",
        Sweep::Nodes,
        Content::Settled(EVERYTHING),
    ),
    own(
        "break-even",
        "Queries to a destination after which its table has paid",
        Sweep::Nodes,
        Content::BreakEven(RIVALS),
    ),
];

/// All plots: those of the paper in its order, then ours.
pub fn figure_plans() -> Vec<FigurePlan> {
    PLANS.to_vec()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_plot_has_a_name_of_its_own() {
        let mut slugs: Vec<&str> = figure_plans().iter().map(|plan| plan.slug).collect();
        let count = slugs.len();
        slugs.sort_unstable();
        slugs.dedup();
        assert_eq!(slugs.len(), count);
    }
}

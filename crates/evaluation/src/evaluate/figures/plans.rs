//! The list of all plots.

use super::super::design::Sweep;
use super::super::method::{Approach, Method, Span};
use super::{Content, FigurePlan, Over};

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

const LEG_DIJKSTRA: Method = Method::baseline(Approach::Dijkstra { full_tree: false }, Span::Leg);
const LEG_FULL_TREE: Method = Method::baseline(Approach::Dijkstra { full_tree: true }, Span::Leg);
const LEG_ASTAR: Method = Method::baseline(Approach::AStar, Span::Leg);
const LEG_BELLMAN_FORD: Method = Method::baseline(Approach::BellmanFord, Span::Leg);

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
const SAME_PROBLEM: &[Method] = &[
    WARM,
    TWO_PHASED,
    POLYGONS,
    CELL_DENSITY,
    RADIUS,
    LEG_ASTAR,
    LEG_DIJKSTRA,
    LEG_FULL_TREE,
    LEG_BELLMAN_FORD,
];
const AREA_TIMES: &[Method] = &[WARM, COLD, TWO_PHASED, POLYGONS, CELL_DENSITY, FULL_TREE];
const AREA_TIMES_SAME: &[Method] = &[WARM, TWO_PHASED, POLYGONS, CELL_DENSITY, LEG_ASTAR];
const AREAS: &[Method] = &[WARM, TWO_PHASED, CELL_DENSITY];

const NODES: Over = Over::Sweep(Sweep::Nodes);
const NEIGHBOURS: Over = Over::Sweep(Sweep::Neighbours);
const REACH: Over = Over::Sweep(Sweep::Reach);
const SAME: Span = Span::Leg;
const ROUTE: Span = Span::Route;

/// What the paper says of a series.
type Says = &'static [(&'static str, Option<usize>, f64)];

const FIG_7: Says = &[("radius", None, 0.91)];
const FIG_9: Says = &[
    ("cell density", None, 0.21),
    ("two-phased, polygons", None, 0.4),
    ("two-phased", None, 0.07),
];
const FIG_10: Says = &[("cell density", None, 11.21), ("two-phased", None, 9.81)];
const FIG_11: Says = &[("cell density", None, 20.0), ("two-phased", None, 4.0)];
const FIG_13: Says = &[
    ("A*", None, 0.935),
    ("two-phased", None, 0.84),
    ("Bellman-Ford", None, 5.0),
];
const FIG_17: Says = &[
    ("two-phased, polygons", None, 2.0),
    ("cell density", None, 0.44),
    ("two-phased", None, 0.26),
];

const fn paper(
    slug: &'static str,
    number: u32,
    title: &'static str,
    over: Over,
    content: Content,
    says: Says,
) -> FigurePlan {
    FigurePlan {
        slug,
        paper: Some(number),
        title,
        over,
        content,
        says,
    }
}

const fn own(slug: &'static str, title: &'static str, over: Over, content: Content) -> FigurePlan {
    FigurePlan {
        slug,
        paper: None,
        title,
        over,
        content,
        says: &[],
    }
}

/// Those of the paper in its order, then ours.
const PLANS: &[FigurePlan] = &[
    paper(
        "radius-time",
        7,
        "Radius-based: time",
        NODES,
        Content::RelativeTime(&[WARM, COLD, RADIUS, FULL_TREE], ROUTE),
        FIG_7,
    ),
    paper(
        "radius-time-same",
        7,
        "Radius-based: time, the same problem",
        NODES,
        Content::RelativeTime(&[WARM, RADIUS, LEG_ASTAR], SAME),
        FIG_7,
    ),
    paper(
        "radius-distance",
        8,
        "Radius-based: distance",
        NODES,
        Content::Overhead(&[WARM, RADIUS]),
        &[("radius", None, 14.0)],
    ),
    paper(
        "time-by-size",
        9,
        "Time over network size",
        NODES,
        Content::RelativeTime(AREA_TIMES, ROUTE),
        FIG_9,
    ),
    paper(
        "time-by-size-same",
        9,
        "Time over network size, the same problem",
        NODES,
        Content::RelativeTime(AREA_TIMES_SAME, SAME),
        FIG_9,
    ),
    paper(
        "time-by-density",
        9,
        "Time over the number of neighbours, the same problem",
        NEIGHBOURS,
        Content::RelativeTime(AREA_TIMES_SAME, SAME),
        FIG_9,
    ),
    paper(
        "distance-by-size",
        10,
        "Distance overhead over network size",
        NODES,
        Content::Overhead(AREAS),
        FIG_10,
    ),
    paper(
        "distance-by-density",
        10,
        "Distance overhead over the number of neighbours",
        NEIGHBOURS,
        Content::Overhead(AREAS),
        FIG_10,
    ),
    paper(
        "node-compression",
        11,
        "Share of the nodes searched",
        NODES,
        Content::NodeShare(AREAS),
        FIG_11,
    ),
    paper(
        "edge-compression",
        12,
        "Share of the segments searched",
        NODES,
        Content::SegmentShare(AREAS),
        FIG_11,
    ),
    paper(
        "textbook-time",
        13,
        "Two-phased beside A* and Bellman-Ford: time",
        NODES,
        Content::RelativeTime(
            &[WARM, COLD, TWO_PHASED, ASTAR, BELLMAN_FORD, FULL_TREE],
            ROUTE,
        ),
        FIG_13,
    ),
    paper(
        "textbook-time-same",
        13,
        "Two-phased beside A* and Bellman-Ford: time, the same problem",
        NODES,
        Content::RelativeTime(&[WARM, TWO_PHASED, LEG_ASTAR, LEG_BELLMAN_FORD], SAME),
        FIG_13,
    ),
    paper(
        "textbook-distance",
        14,
        "Two-phased beside A* and Bellman-Ford: distance",
        NODES,
        Content::Overhead(&[WARM, TWO_PHASED, ASTAR, BELLMAN_FORD]),
        &[("two-phased", None, 1.2)],
    ),
    paper(
        "skipping-ineffective",
        15,
        "Ineffective skipping of stages",
        Over::Skipping { effective: false },
        Content::Skipping,
        &[("two-phased", Some(0), 2.13)],
    ),
    paper(
        "skipping-effective",
        16,
        "Effective skipping of stages",
        Over::Skipping { effective: true },
        Content::Skipping,
        // The paper's 0.68 compares effective skipping with ineffective, and not with none.
        &[],
    ),
    paper(
        "sydney-time",
        17,
        "Sydney CBD: time",
        Over::Methods,
        Content::RelativeTime(EVERYTHING, ROUTE),
        FIG_17,
    ),
    paper(
        "sydney-time-same",
        17,
        "Sydney CBD: time, the same problem",
        Over::Methods,
        Content::RelativeTime(SAME_PROBLEM, SAME),
        FIG_17,
    ),
    paper(
        "sydney-distance",
        18,
        "Sydney CBD: distance",
        Over::Methods,
        Content::Overhead(&[WARM, TWO_PHASED, CELL_DENSITY, RADIUS]),
        &[("two-phased", None, 11.0), ("cell density", None, 14.0)],
    ),
    own(
        "distance-by-generator",
        "Distance overhead by generator",
        Over::Generators,
        Content::Overhead(&[WARM, TWO_PHASED, CELL_DENSITY, RADIUS]),
    ),
    own(
        "time-by-generator",
        "Time by generator, the same problem",
        Over::Generators,
        Content::RelativeTime(SAME_PROBLEM, SAME),
    ),
    own(
        "median-times",
        "Time to a whole new route, by generator",
        Over::Generators,
        Content::Times(EVERYTHING),
    ),
    own(
        "distance-by-reach",
        "Distance overhead over the reach of a segment",
        REACH,
        Content::Overhead(&[WARM, TWO_PHASED, CELL_DENSITY, RADIUS]),
    ),
    own(
        "settled-by-size",
        "Nodes settled over network size",
        NODES,
        Content::Settled(EVERYTHING),
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

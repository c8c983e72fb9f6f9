//! Failures in which the two-phased strategy skipped a stage, each beside itself without skipping.

use super::cells::{Cell, by_network};
use super::failures::Placing;
use super::method::{Approach, Method};
use super::rows::Row;

/// What a search looked at.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Extent {
    /// Nodes of the last area.
    pub(super) nodes: f64,
    /// Segments of the last area.
    pub(super) segments: f64,
    /// Nodes of all areas that were searched, added up.
    pub(super) searched_nodes: f64,
    /// Segments of all areas that were searched, added up.
    pub(super) searched_segments: f64,
    /// Nodes settled by all searches.
    pub(super) settled: f64,
    /// Areas examined.
    pub(super) searches: f64,
    /// The time, in microseconds.
    pub(super) time_us: f64,
}

/// One failure in which a stage was skipped.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Case {
    /// True when no skipped stage holds a path.
    pub(super) is_effective: bool,
    /// What was looked at with skipping.
    pub(super) with_skipping: Extent,
    /// What was looked at without.
    pub(super) without: Extent,
    /// What `exact`, warm, looked at.
    pub(super) exact: Extent,
}

/// The failures in which a stage was skipped, by network, under a height of the rectangle.
pub(super) fn cases(cells: &[&Cell], placing: Placing, variant: usize) -> Vec<Vec<Case>> {
    let method = |approach| Method {
        variant,
        ..Method::of_paper(approach)
    };
    let methods = [
        method(Approach::TwoPhased),
        method(Approach::TwoPhasedAllStages),
        Method::exact(true),
    ];
    by_network(cells, methods, |failure, [own, all_stages, exact]| {
        let is_case = failure.placing == placing && !own.skipped.is_empty();
        is_case.then(|| Case {
            is_effective: own
                .skipped
                .split('+')
                .all(|stage| stage != all_stages.stage),
            with_skipping: extent(own),
            without: extent(all_stages),
            exact: extent(exact),
        })
    })
}

fn extent(row: &Row) -> Extent {
    Extent {
        nodes: row.area_nodes as f64,
        segments: row.area_segments as f64,
        searched_nodes: row.searched_nodes.unwrap_or(row.area_nodes) as f64,
        searched_segments: row.searched_segments.unwrap_or(row.area_segments) as f64,
        settled: row.settled_nodes as f64,
        searches: f64::from(row.searches),
        time_us: row.time_us,
    }
}

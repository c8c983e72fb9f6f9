//! Failures in which the two-phased strategy skipped a stage, each beside itself without skipping.

use super::cells::Cell;
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
    /// Nodes settled by all searches.
    pub(super) settled: f64,
    /// Areas examined.
    pub(super) searches: f64,
}

/// One failure in which a stage was skipped.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Case {
    /// The stages skipped, with `+` between them.
    pub(super) skipped: String,
    /// True when no skipped stage holds a path.
    pub(super) is_effective: bool,
    /// What was looked at with skipping.
    pub(super) with_skipping: Extent,
    /// What was looked at without.
    pub(super) without: Extent,
    /// What `exact`, warm, settled.
    pub(super) exact_settled: f64,
}

/// The failures of a cell in which a stage was skipped.
pub(super) fn cases(cell: &Cell) -> Vec<Case> {
    let rows = |method: Method| cell.figures.rows.get(&method).into_iter().flatten();
    let with_skipping = rows(Method::of_paper(Approach::TwoPhased));
    let without = rows(Method::of_paper(Approach::TwoPhasedAllStages));
    let exact = rows(Method::exact(true));
    let together = with_skipping.zip(without).zip(exact);
    together
        .filter(|((one, _), _)| !one.skipped.is_empty())
        .map(|((one, all_stages), exact)| Case {
            skipped: one.skipped.clone(),
            is_effective: one
                .skipped
                .split('+')
                .all(|stage| stage != all_stages.stage),
            with_skipping: extent(one),
            without: extent(all_stages),
            exact_settled: exact.settled_nodes as f64,
        })
        .collect()
}

fn extent(row: &Row) -> Extent {
    Extent {
        nodes: row.area_nodes as f64,
        segments: row.area_segments as f64,
        searched_nodes: row.searched_nodes.unwrap_or(row.area_nodes) as f64,
        settled: row.settled_nodes as f64,
        searches: f64::from(row.searches),
    }
}

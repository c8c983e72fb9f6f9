//! Closures as operators send them, and as edges forward what drones reported.

use super::fields::Faults;
use crate::airspace::Hits;
use crate::network::{NodeIx, Topology};
use crate::refusal::{Code, Refusal};
use crate::wire;
use jiff::Timestamp;

/// At most this many things in one closure.
const THINGS_MAX: usize = 10_000;
/// The longest reason, in bytes.
const REASON_BYTES_MAX: usize = 1_000;
/// Prefixes of the ids of closures from reports; operators' closures have others.
const OF_REPORTS: [&str; 2] = ["report:", "pads:"];

/// Which ids a closure may have.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ClosureIds {
    /// Those of operators: none that a report's closure has.
    OfOperators,
    /// Those of reports.
    OfReports,
}

/// A closure as it is understood on a topology.
#[derive(Clone, Debug, PartialEq)]
pub struct ReadClosure {
    /// The segments and nodes it closes.
    pub hits: Hits,
    /// The nodes whose pads it closes.
    pub pads: Vec<NodeIx>,
    pub from: Timestamp,
    pub until: Option<Timestamp>,
}

/// Reads a closure; one that states no beginning begins now.
///
/// # Errors
/// Everything wrong with it.
pub fn read_closure(
    draft: &wire::ClosureDraft,
    topology: &Topology,
    now: Timestamp,
    ids: ClosureIds,
) -> Result<ReadClosure, Refusal> {
    let mut faults = Faults::default();
    check_id(draft, ids, &mut faults);
    faults.text("/reason", draft.reason.as_deref(), REASON_BYTES_MAX);
    let count = draft.segments.len() + draft.nodes.len() + draft.pads.len();
    if count == 0 || count > THINGS_MAX {
        let message = format!("{count} things are to be closed, not 1 to {THINGS_MAX}");
        let hint = "name 'segments', 'nodes' or 'pads'".to_owned();
        faults.add("closure_extent", "", message, Some(hint));
        return Err(faults.refusal(Code::ClosureInvalid, "closure"));
    }
    let segments = (0..).zip(&draft.segments);
    let segments = segments.filter_map(|(place, id): (usize, &String)| {
        faults.segment(&format!("/segments/{place}"), topology, id)
    });
    let segments = segments.collect();
    let nodes = find_nodes(topology, "nodes", &draft.nodes, &mut faults);
    let pads = find_nodes(topology, "pads", &draft.pads, &mut faults);
    let from = faults.instant("/from", draft.from.as_deref());
    let from = from.unwrap_or(now);
    let until = faults.instant("/until", draft.until.as_deref());
    check_end(from, until, now, &mut faults);
    faults.check(Code::ClosureInvalid, "closure")?;
    Ok(ReadClosure {
        hits: Hits::new(segments, nodes),
        pads,
        from,
        until,
    })
}

fn check_id(draft: &wire::ClosureDraft, ids: ClosureIds, faults: &mut Faults) {
    faults.id("/id", draft.id.as_deref());
    let id = draft.id.as_deref().unwrap_or_default();
    let is_of_report = OF_REPORTS.iter().any(|prefix| id.starts_with(prefix));
    let prefixes = OF_REPORTS.join(" or ");
    match ids {
        ClosureIds::OfOperators if is_of_report => {
            let message = format!("ids that begin with {prefixes} are those of reports");
            faults.add("id_reserved", "/id", message, None);
        }
        ClosureIds::OfReports if !is_of_report => {
            let message = format!("the id of a report's closure begins with {prefixes}");
            faults.add("id_reserved", "/id", message, None);
        }
        _ => {}
    }
}

fn check_end(from: Timestamp, until: Option<Timestamp>, now: Timestamp, faults: &mut Faults) {
    if let Some(until) = until.filter(|until| *until <= from || *until <= now) {
        let message = format!("the closure ends at {until}, not after it begins, or in the past");
        faults.add("window_reversed", "/until", message, None);
    }
}

fn find_nodes(
    topology: &Topology,
    name: &str,
    ids: &[wire::Id<'_>],
    faults: &mut Faults,
) -> Vec<NodeIx> {
    let ids = (0_usize..).zip(ids);
    let nodes =
        ids.filter_map(|(place, id)| faults.node(&format!("/{name}/{place}"), topology, id));
    nodes.collect()
}

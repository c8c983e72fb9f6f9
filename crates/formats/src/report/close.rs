//! What a line of a requests file closes beforehand: node ids, segment ids, and `[A, B]` for segments.

use super::known::CloseTarget;
use super::problem::{ReadWarning, ReportProblem};
use crate::identifier::{find_node, id_text};
use crate::network::Topology;
use serde_json::Value;

/// The things that `close` names; those that it does not name are passed over with one warning.
pub(crate) fn find_close_targets(
    topology: &Topology,
    entries: Option<&[Value]>,
    warnings: &mut Vec<ReadWarning>,
) -> Vec<CloseTarget> {
    let entries = entries.unwrap_or_default();
    let targets: Vec<CloseTarget> = entries
        .iter()
        .filter_map(|entry| close_target(topology, entry))
        .collect();
    let unknown = entries.len() - targets.len();
    if unknown > 0 {
        let message = format!("'close' has {unknown} entries that name nothing; they are ignored");
        warnings.push(ReadWarning::new("close_ignored", message));
    }
    targets
}

/// Checks that everything under `close` names something, as an operator's word should.
///
/// # Errors
/// [`ReportProblem::CannotClose`] at the first that does not.
pub(crate) fn check_close(topology: &Topology, value: Option<&Value>) -> Result<(), ReportProblem> {
    let entries = match value {
        None | Some(Value::Null) => return Ok(()),
        Some(Value::Array(entries)) => entries.as_slice(),
        Some(_) => {
            let pointer = "/close".to_owned();
            return Err(ReportProblem::CannotClose { pointer });
        }
    };
    let unknown = entries
        .iter()
        .position(|entry| close_target(topology, entry).is_none());
    match unknown {
        Some(index) => Err(ReportProblem::CannotClose {
            pointer: format!("/close/{index}"),
        }),
        None => Ok(()),
    }
}

fn close_target(topology: &Topology, entry: &Value) -> Option<CloseTarget> {
    if let Value::Array(ends) = entry {
        let [from, to] = ends.as_slice() else {
            return None;
        };
        let (from, to) = find_node(topology, from).zip(find_node(topology, to))?;
        let segment = topology.segment_between(from, to)?;
        return Some(CloseTarget::Segment(segment));
    }
    if let Some(node) = find_node(topology, entry) {
        return Some(CloseTarget::Node(node));
    }
    let segment = topology.find_segment(&id_text(entry)?)?;
    Some(CloseTarget::Segment(segment))
}

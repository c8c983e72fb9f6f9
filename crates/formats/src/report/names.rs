//! The nodes that a failure report names, found in the network.

use super::problem::{ReadWarning, ReportProblem, cut, reasons};
use crate::network::{NodeIx, Topology};
use crate::wire::{FailureReport, Id};

/// The node of an id on the wire.
pub(crate) fn find_named(topology: &Topology, id: &Id<'_>) -> Option<NodeIx> {
    topology.node(id.text())
}

/// The nodes that locate the drone, as far as the network has them.
#[derive(Debug)]
pub(crate) struct Names {
    pub(crate) from: Option<NodeIx>,
    pub(crate) to: Option<NodeIx>,
    pub(crate) path: NamedPath,
    pub(crate) destination: Option<NodeIx>,
    /// The first name at `service` that the network does not have: its pointer and its id.
    unknown: Option<(&'static str, String)>,
}

/// `remaining_path`, as far as the network has its nodes.
#[derive(Debug, Default)]
pub(crate) struct NamedPath {
    /// All of it, where all nodes are known and there are at least two.
    pub(crate) whole: Option<Vec<NodeIx>>,
    /// Of a path with unknown nodes: its first leg, where that is known.
    pub(crate) first_leg: Option<(NodeIx, NodeIx)>,
    /// The first node that is known.
    pub(crate) first: Option<NodeIx>,
    /// The last entry, where it is known.
    pub(crate) end: Option<NodeIx>,
}

impl Names {
    pub(crate) fn find(
        topology: &Topology,
        report: &FailureReport,
        warnings: &mut Vec<ReadWarning>,
    ) -> Self {
        let mut unknown = None;
        let mut end = |id: Option<&Id<'_>>, pointer: &'static str| {
            let id = id?;
            let node = find_named(topology, id);
            if node.is_none() {
                let text = cut(id.text());
                let message = format!(
                    "the node '{text}' at {pointer} is not a node of the network and is ignored"
                );
                warnings.push(ReadWarning::new("unknown_node", message));
                unknown.get_or_insert((pointer, text));
            }
            node
        };
        let service = report.service.as_ref();
        let from = end(
            service.and_then(|service| service.from.as_ref()),
            "/service/from",
        );
        let to = end(
            service.and_then(|service| service.to.as_ref()),
            "/service/to",
        );
        Self {
            from,
            to,
            path: find_path(topology, report.remaining_path.as_deref(), warnings),
            destination: find_destination(topology, report.destination.as_ref(), warnings),
            unknown,
        }
    }

    /// The leg that `service` names by its nodes.
    pub(crate) fn service_leg(&self) -> Option<(NodeIx, NodeIx)> {
        self.from.zip(self.to)
    }

    /// Where the delivery goes, as far as the report says without its leg.
    pub(crate) fn stated_end(&self) -> Option<NodeIx> {
        self.destination.or(self.path.end)
    }

    /// What is wrong with a report of which nothing locates the drone.
    ///
    /// `warnings` say why what it names does not count.
    pub(crate) fn problem(self, warnings: &[ReadWarning]) -> ReportProblem {
        let why = reasons(warnings);
        match self.unknown {
            Some((pointer, id)) => ReportProblem::UnknownNode {
                pointer: pointer.to_owned(),
                id,
                why,
            },
            None => ReportProblem::NotLocated { why },
        }
    }
}

fn find_path(
    topology: &Topology,
    ids: Option<&[Id<'_>]>,
    warnings: &mut Vec<ReadWarning>,
) -> NamedPath {
    let Some(ids) = ids else {
        return NamedPath::default();
    };
    let mut whole = Vec::with_capacity(ids.len());
    whole.extend(ids.iter().map_while(|id| find_named(topology, id)));
    let is_known = whole.len() == ids.len();
    if is_known && whole.len() >= 2 {
        return NamedPath {
            first: whole.first().copied(),
            end: whole.last().copied(),
            whole: Some(whole),
            first_leg: None,
        };
    }
    if !is_known {
        warnings.push(ReadWarning::new(
            "remaining_path_ignored",
            "'remaining_path' is not a list of nodes of this network and is ignored",
        ));
    }
    let first_leg = match whole.as_slice() {
        [from, to, ..] => Some((*from, *to)),
        _ => None,
    };
    let mut known = ids.iter().filter_map(|id| find_named(topology, id));
    NamedPath {
        whole: None,
        first_leg,
        first: known.next(),
        end: ids.last().and_then(|id| find_named(topology, id)),
    }
}

fn find_destination(
    topology: &Topology,
    id: Option<&Id<'_>>,
    warnings: &mut Vec<ReadWarning>,
) -> Option<NodeIx> {
    let id = id?;
    let node = find_named(topology, id);
    if node.is_none() {
        let message = format!(
            "the destination '{}' is not a node of the network; the end of the plan is taken",
            cut(id.text())
        );
        warnings.push(ReadWarning::new("unknown_destination", message));
    }
    node
}

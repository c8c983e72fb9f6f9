//! Which leg a drone was on, what lay ahead of it, and where it goes: from what a report says, then from what is known.

use super::known::KnownPlan;
use super::names::Names;
use super::nearest::{leg_from, nearest_leg, nearest_node, nearest_segment, oriented};
use super::place::Spot;
use super::problem::{ReadWarning, ReportProblem};
use crate::network::{NodeIx, Topology};

/// A drone within this many metres of a segment may well be on it.
const ON_SEGMENT_WITHIN_M: f64 = 50.0;

/// What tells the leg.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum LegSource {
    /// `service` by its nodes.
    Service,
    /// The start of `remaining_path`.
    Path,
    /// This leg of the known plan.
    Plan(usize),
    /// Where the drone is.
    Place,
    /// A node beside which nothing is known.
    Node,
}

/// The failed leg and what lies ahead of it.
#[derive(Debug)]
pub(crate) struct SettledLeg {
    pub(crate) nodes: (NodeIx, NodeIx),
    pub(crate) source: LegSource,
    pub(crate) remaining_path: Option<Vec<NodeIx>>,
    /// `None` where nothing says where the delivery goes.
    pub(crate) destination: Option<NodeIx>,
}

/// All there is to find a leg by.
pub(crate) struct Clues<'a> {
    pub(crate) topology: &'a Topology,
    pub(crate) names: Names,
    /// Which leg of its plan the report names.
    pub(crate) stated_leg: Option<u32>,
    /// A plan of at least one leg.
    pub(crate) plan: Option<KnownPlan<'a>>,
    /// Where the drone is, by the report or else by its telemetry.
    pub(crate) spot: Option<Spot>,
}

impl Clues<'_> {
    /// Finds the leg.
    ///
    /// # Errors
    /// When there is nothing at all to find it by.
    pub(crate) fn settle(
        mut self,
        warnings: &mut Vec<ReadWarning>,
    ) -> Result<SettledLeg, ReportProblem> {
        let Some((nodes, source)) = self.leg(warnings) else {
            return Err(self.names.problem(warnings));
        };
        let stated_path = self.names.path.whole.take();
        let is_stated = stated_path.is_some();
        let aligned = stated_path.and_then(|path| align(path, nodes, warnings));
        let warns = is_stated && aligned.is_some();
        let ahead = aligned.or_else(|| self.rest_of_plan(nodes, source));
        let planned_end = ahead.as_ref().and_then(|path| path.last().copied());
        let path_end = match source {
            LegSource::Service | LegSource::Plan(_) => None,
            LegSource::Path | LegSource::Place | LegSource::Node => self.names.path.end,
        };
        let plan_end = self.plan.and_then(|plan| plan.nodes.last().copied());
        let leg_end = (source == LegSource::Service).then_some(nodes.1);
        let destination = self
            .names
            .destination
            .or(planned_end)
            .or(path_end)
            .or(plan_end)
            .or(leg_end);
        let remaining_path = match destination {
            Some(end) if planned_end.is_some_and(|planned| planned != end) => {
                let cut = ahead.and_then(|path| cut_at(path, end));
                if cut.is_none() && warns {
                    ignore_path(warnings, "does not lead to the destination");
                }
                cut
            }
            _ => ahead,
        };
        Ok(SettledLeg {
            nodes,
            source,
            remaining_path,
            destination,
        })
    }

    fn leg(&self, warnings: &mut Vec<ReadWarning>) -> Option<((NodeIx, NodeIx), LegSource)> {
        if let Some((plan, stated)) = self.plan.zip(self.stated_leg) {
            return Some(stated_leg_of(plan, stated, warnings));
        }
        let path = &self.names.path;
        let path_leg = match path.whole.as_deref() {
            Some([from, to, ..]) => Some((*from, *to)),
            _ => path.first_leg,
        };
        self.names
            .service_leg()
            .map(|leg| (leg, LegSource::Service))
            .or(path_leg.map(|leg| (leg, LegSource::Path)))
            .or_else(|| self.leg_of_plan(warnings))
            .or_else(|| self.leg_at_place(warnings))
            .or_else(|| self.leg_at_node(warnings))
    }

    /// The leg of the plan that telemetry tells, else the one nearest to the drone, else the first.
    fn leg_of_plan(
        &self,
        warnings: &mut Vec<ReadWarning>,
    ) -> Option<((NodeIx, NodeIx), LegSource)> {
        let plan = self.plan?;
        if let Some(leg) = plan.before {
            return Some((leg, LegSource::Service));
        }
        if let Some(index) = plan.leg
            && let Some(leg) = plan.at(index)
        {
            return Some((leg, LegSource::Plan(index)));
        }
        let nearest = self
            .spot
            .and_then(|spot| nearest_leg(self.topology, plan.nodes, spot.point));
        let (index, why) = match nearest {
            Some((index, off_m)) => (index, near_or_far("the leg of its plan", off_m)),
            None => (0, "the first leg of its plan".to_owned()),
        };
        let leg = plan.at(index)?;
        self.warn_of_assumed(leg, &why, warnings);
        Some((leg, LegSource::Plan(index)))
    }

    fn leg_at_place(
        &self,
        warnings: &mut Vec<ReadWarning>,
    ) -> Option<((NodeIx, NodeIx), LegSource)> {
        let spot = self.spot?;
        let goal = self.names.stated_end();
        let (leg, why) = match spot.node() {
            Some(node) => {
                let leg = leg_from(self.topology, node, goal);
                (leg, "a segment at the node where the drone is".to_owned())
            }
            None => match nearest_segment(self.topology, spot.point) {
                Some((segment, off_m)) => {
                    let leg = oriented(self.topology, segment, goal);
                    (leg, near_or_far("the segment", off_m))
                }
                None => {
                    let node = nearest_node(self.topology, spot.point)?;
                    ((node, node), "as the network has no segments".to_owned())
                }
            },
        };
        self.warn_of_assumed(leg, &why, warnings);
        Some((leg, LegSource::Place))
    }

    fn leg_at_node(
        &self,
        warnings: &mut Vec<ReadWarning>,
    ) -> Option<((NodeIx, NodeIx), LegSource)> {
        let names = &self.names;
        let node = names.from.or(names.to).or(names.path.first)?;
        let leg = leg_from(self.topology, node, names.stated_end());
        self.warn_of_assumed(leg, "a segment at the one node that is known", warnings);
        Some((leg, LegSource::Node))
    }

    fn warn_of_assumed(
        &self,
        (from, to): (NodeIx, NodeIx),
        why: &str,
        warnings: &mut Vec<ReadWarning>,
    ) {
        let [from, to] = [from, to].map(|node| self.topology.node_id(node));
        let message =
            format!("the report does not tell the leg; '{from}' to '{to}' is assumed, {why}");
        warnings.push(ReadWarning::new("leg_assumed", message));
    }

    /// The known plan from the leg on, where the leg is one of its own.
    fn rest_of_plan(&self, leg: (NodeIx, NodeIx), source: LegSource) -> Option<Vec<NodeIx>> {
        let nodes = self.plan?.nodes;
        let first = match source {
            LegSource::Plan(index) => index,
            _ => place_of(nodes, leg)?,
        };
        nodes.get(first..).map(<[NodeIx]>::to_vec)
    }
}

/// The leg of a plan that a report names by its number; one beyond the plan is the leg that telemetry tells, or the last.
fn stated_leg_of(
    plan: KnownPlan<'_>,
    stated: u32,
    warnings: &mut Vec<ReadWarning>,
) -> ((NodeIx, NodeIx), LegSource) {
    let stated_index = usize::try_from(stated).unwrap_or(usize::MAX);
    if let Some(leg) = plan.at(stated_index) {
        return (leg, LegSource::Plan(stated_index));
    }
    let last = plan.nodes.len().saturating_sub(2);
    let (index, taken) = match plan.leg.filter(|&leg| leg <= last) {
        Some(index) => (index, "the leg that its telemetry tells"),
        None => (last, "the last"),
    };
    let message =
        format!("the plan has legs 0 to {last} and none {stated}; {taken}, {index}, is taken");
    warnings.push(ReadWarning::new("unknown_leg", message));
    let leg = (plan.nodes[index], plan.nodes[index + 1]);
    (leg, LegSource::Plan(index))
}

fn near_or_far(what: &str, off_m: f64) -> String {
    match off_m <= ON_SEGMENT_WITHIN_M {
        true => format!("{what} nearest to the drone"),
        false => format!("{what} nearest to the drone, which is {off_m:.0} m off it"),
    }
}

/// Where a path flies a leg.
fn place_of(path: &[NodeIx], (from, to): (NodeIx, NodeIx)) -> Option<usize> {
    path.windows(2).position(|leg| leg == [from, to])
}

/// The stated path from the leg on, the leg first.
fn align(
    mut path: Vec<NodeIx>,
    leg: (NodeIx, NodeIx),
    warnings: &mut Vec<ReadWarning>,
) -> Option<Vec<NodeIx>> {
    match place_of(&path, leg) {
        Some(0) => return Some(path),
        Some(first) => return Some(path.split_off(first)),
        None => {}
    }
    if path.first() == Some(&leg.1) {
        path.insert(0, leg.0);
        return Some(path);
    }
    ignore_path(warnings, "does not contain the failed leg");
    None
}

/// A path that goes on beyond the destination ends there; one that never comes there is no path to it.
fn cut_at(mut path: Vec<NodeIx>, destination: NodeIx) -> Option<Vec<NodeIx>> {
    let place = path.iter().skip(1).position(|&node| node == destination)?;
    path.truncate(place + 2);
    Some(path)
}

fn ignore_path(warnings: &mut Vec<ReadWarning>, why: &str) {
    let message = format!("'remaining_path' {why} and is ignored");
    warnings.push(ReadWarning::new("remaining_path_ignored", message));
}

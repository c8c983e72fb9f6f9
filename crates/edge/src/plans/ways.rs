//! What a plan has beside the search, for an answer that does not pass.

use super::entry::PlanEntry;
use skyway_engine::checked::Alternatives;
use skyway_engine::compose::Contingency;
use skyway_engine::flight::FailureReport;
use skyway_engine::network::NodeIx;

/// The ways that a plan has beside the search, from the start of the leg that its drone is on.
#[derive(Default)]
pub(crate) struct PlanWays {
    reported: Option<Vec<NodeIx>>,
    if_closed: Option<Vec<NodeIx>>,
    alternate: Option<Vec<NodeIx>>,
}

impl PlanWays {
    /// Those of who reports: of its plan, else what the report states.
    pub(crate) fn of(report: &FailureReport, plan: Option<&PlanEntry>) -> Self {
        let stated = report.remaining_path.clone();
        let by_plan = plan.and_then(|plan| Self::of_plan(plan, report.leg));
        by_plan.unwrap_or(Self {
            reported: stated,
            ..Self::default()
        })
    }

    /// Those of a plan whose drone is on a leg between these nodes.
    pub(crate) fn of_plan(plan: &PlanEntry, ends: (NodeIx, NodeIx)) -> Option<Self> {
        let composition = &plan.reported.composition;
        let mut legs = composition.legs.iter();
        let number = legs.position(|leg| (leg.from, leg.to) == ends)?;
        let leg = &composition.legs[number];
        // Up to where its drone is served next: that comes before what follows.
        let flight = plan.reported.flight.iter();
        let mut stops = flight.flat_map(|flight| &flight.composition.plan.stops);
        let next = stops.find(|stop| stop.service_s.is_some() && stop.before_leg > number);
        let end = next.map_or(composition.legs.len(), |stop| stop.before_leg);
        let ahead = &composition.way.nodes[number..=end];
        Some(Self {
            reported: Some(ahead.to_vec()),
            if_closed: leg.if_closed.as_ref().and_then(|it| rejoined(it, ahead)),
            alternate: leg.safe.as_ref().map(|safe| safe.nodes.clone()),
        })
    }

    pub(crate) fn alternatives(&self) -> Alternatives<'_> {
        Alternatives {
            reported: self.reported.as_deref(),
            if_closed: self.if_closed.as_deref(),
            alternate: self.alternate.as_deref(),
        }
    }
}

/// A detour with what is flown after it.
fn rejoined(detour: &Contingency, ahead: &[NodeIx]) -> Option<Vec<NodeIx>> {
    let rejoins = detour.rejoins?;
    let place = ahead.iter().rposition(|node| *node == rejoins)?;
    let mut nodes = detour.nodes.clone();
    nodes.extend_from_slice(&ahead[place + 1..]);
    Some(nodes)
}

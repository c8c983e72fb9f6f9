//! What to tell a drone: the best plan, to wait, the best alternate, or what cuts it off.

use super::alternate::{NoAlternate, find_alternate};
use super::blocking_causes::{FlightCause, causes};
use super::memory::ItineraryScratch;
use super::potentials::Potentials;
use super::request::{FlightAnswer, FlightRequest, Limits, Objective};
use super::search::find;
use super::setting::FlightSetting;
use crate::flight::{FlightPlan, FlightStart, StopKind, Tariff};
use crate::network::{NodeIx, SegmentIx};

/// A first stay that waits longer than this, in seconds, is told as `hold`.
const LEAST_HOLD_S: f64 = 1.0;
/// Where no plan keeps the deadline, one that lands up to this much later, in seconds, is looked for.
const LOOK_AHEAD_S: f64 = 86_400.0;

/// Where there is no plan: when there would be one, why there is none, and two alternates.
const SEARCHES_WITHOUT_PLAN: usize = 4;
/// For a drone that stands on a pad the search for an alternate takes one part in so many of that.
const STANDING_SHARE: usize = 4;

/// What is asked for: a request that takes its margins from the setting's rules.
#[derive(Clone, Debug)]
pub struct FlightOrder<'a> {
    /// Where the plan may begin.
    pub starts: &'a [FlightStart],
    /// Where it leads.
    pub destination: NodeIx,
    /// What is made least.
    pub objective: Objective,
    /// When the plan began, in seconds.
    pub began_s: f64,
    /// The latest landing, in seconds.
    pub deadline_s: f64,
    /// Segments closed for this request alone.
    pub closed_segments: &'a [SegmentIx],
    /// True for a drone in flight: where the destination cannot be reached an alternate is looked for, with the floor if the reserve
    /// does not suffice.
    pub in_flight: bool,
    /// Whether an answer without a plan to the destination says why: two searches more.
    pub explain: bool,
    /// An alternate's pad has to be free for so many seconds from the landing on.
    pub refuge_stay_s: f64,
    /// How much the search may spend. Where it finds no plan, what is looked for then may spend as much again, in all.
    pub limits: Limits<'a>,
}

/// What to do.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum FlightOutcome {
    /// The plan.
    Planned,
    /// Wait on a pad where the plan begins, then the plan.
    Hold {
        /// Where.
        node: NodeIx,
        /// On which pad, counted from 0.
        pad: u16,
        /// Until when, in seconds.
        until_s: f64,
    },
    /// The destination cannot be reached: the plan leads to an alternate.
    Diverted {
        /// Which.
        node: NodeIx,
        /// True where the battery falls below the reserve on the way, though not below the floor.
        reserve_used: bool,
    },
    /// Nothing can be reached.
    NoRoute,
}

/// A plan that would land after the deadline.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FlightOpening {
    /// When it would enter its first leg, in seconds.
    pub leaves_s: f64,
    /// When it would land.
    pub arrives_s: f64,
}

/// What to tell a drone, and why.
#[derive(Clone, Debug)]
pub struct FlightDecision {
    /// What to do.
    pub outcome: FlightOutcome,
    /// The answer with the plan. Where there is no route it has none, and says whether that is proved.
    pub answer: FlightAnswer,
    /// What cuts the drone off; empty with a plan to the destination, or where nobody asked.
    pub causes: Vec<FlightCause>,
    /// The earliest plan to the destination without the deadline, where only that forbids it.
    pub opens: Option<FlightOpening>,
}

/// Decides what a drone is told.
///
/// The potentials are those of the order's destination and objective, on the setting's table of legs.
pub fn decide(
    setting: &FlightSetting,
    order: &FlightOrder<'_>,
    potentials: &Potentials,
    scratch: &mut ItineraryScratch,
) -> FlightDecision {
    // Who comes flying with less than the reserve must not go on as if it had it.
    let reserve = setting.rules().reserve;
    let may_begin = |start: &&FlightStart| start.on_ground || start.battery >= reserve;
    let starts: Vec<FlightStart> = order.starts.iter().filter(may_begin).copied().collect();
    let request = FlightRequest {
        starts: &starts,
        destination: order.destination,
        objective: order.objective,
        began_s: order.began_s,
        deadline_s: order.deadline_s,
        reserve,
        closed_segments: order.closed_segments,
        limits: order.limits,
    };
    let world = setting.world();
    let answer = find(&world, &request, potentials, scratch);
    if let Some(plan) = &answer.plan {
        return FlightDecision {
            outcome: held(setting, plan, &request).unwrap_or(FlightOutcome::Planned),
            answer,
            causes: Vec::new(),
            opens: None,
        };
    }
    let request = FlightRequest {
        limits: order.limits.share(SEARCHES_WITHOUT_PLAN),
        ..request
    };
    let met = scratch.active.met_legs().to_vec();
    let (opens, causes) = match order.explain {
        true => (
            opening(setting, &request, potentials, scratch),
            causes(setting, &request, (potentials, met), scratch),
        ),
        false => (None, Vec::new()),
    };
    let alternate = order
        .in_flight
        .then(|| diverted(setting, order, &request, scratch));
    let (outcome, answer) = match alternate {
        Some(Ok((outcome, alternate))) => (outcome, alternate),
        Some(Err(none)) => (FlightOutcome::NoRoute, without(answer, none)),
        None => (FlightOutcome::NoRoute, answer),
    };
    FlightDecision {
        outcome,
        answer,
        causes,
        opens,
    }
}

/// A plan that begins with waiting on a pad.
fn held(
    setting: &FlightSetting,
    plan: &FlightPlan,
    request: &FlightRequest<'_>,
) -> Option<FlightOutcome> {
    let first = plan.stops.first().filter(|stop| stop.before_leg == 0)?;
    let figures = setting.figures(plan, request.began_s, request.reserve, Tariff::default());
    let waits_s = figures.stops.first()?.waits_s;
    let is_swap = first.kind == StopKind::Swap;
    (waits_s > LEAST_HOLD_S && !is_swap).then_some(FlightOutcome::Hold {
        node: first.node,
        pad: first.pad,
        until_s: first.takes_off_s,
    })
}

/// The earliest landing without the deadline.
fn opening(
    setting: &FlightSetting,
    request: &FlightRequest<'_>,
    potentials: &Potentials,
    scratch: &mut ItineraryScratch,
) -> Option<FlightOpening> {
    let later = FlightRequest {
        deadline_s: request.deadline_s + LOOK_AHEAD_S,
        ..request.clone()
    };
    let plan = find(&setting.world(), &later, potentials, scratch).plan?;
    Some(FlightOpening {
        leaves_s: plan.legs.first()?.enters_s,
        arrives_s: plan.arrives_s,
    })
}

/// The best alternate, with the reserve, or else with the floor.
fn diverted(
    setting: &FlightSetting,
    order: &FlightOrder<'_>,
    request: &FlightRequest<'_>,
    scratch: &mut ItineraryScratch,
) -> Result<(FlightOutcome, FlightAnswer), NoAlternate> {
    // One on the ground is safe there: it neither draws on the reserve nor is an alternate looked for at length.
    let stands = order.starts.iter().all(|start| start.on_ground);
    let request = &FlightRequest {
        limits: request
            .limits
            .share(if stands { STANDING_SHARE } else { 1 }),
        ..request.clone()
    };
    let by_reserve = find_alternate(setting, request, order.refuge_stay_s, scratch);
    let reserve_used = by_reserve.is_err();
    let alternate = by_reserve.or_else(|none| {
        if stands {
            return Err(none);
        }
        let to_the_floor = FlightRequest {
            starts: order.starts,
            reserve: setting.rules().floor,
            ..request.clone()
        };
        let found = find_alternate(setting, &to_the_floor, order.refuge_stay_s, scratch);
        found.map_err(|other| NoAlternate {
            reason: other.reason.or(none.reason),
        })
    })?;
    let outcome = FlightOutcome::Diverted {
        node: alternate.node,
        reserve_used,
    };
    Ok((outcome, alternate.answer))
}

/// That there is no plan is certain only where it is of the alternates, too.
fn without(answer: FlightAnswer, none: NoAlternate) -> FlightAnswer {
    let reason = answer.reason.or(none.reason);
    FlightAnswer {
        proved: reason.is_none(),
        reason,
        ..answer
    }
}

//! What a report closes for its own request: a zone that it brings, pads that it says have failed, and the leg.

use super::flight_failure::FlightFailure;
use super::skies::FlightEnvironment;
use super::world::DeliveryWorld;
use crate::airspace::{Cause, Closure};
use crate::flight::{Reservation, TimedClosure};
use crate::itinerary::{FlightCause, FlightSetting, timed_closures};
use crate::network::SegmentIx;
use crate::recompose::Request;
use std::sync::Arc;

/// The world as a report has it.
#[derive(Debug, Default)]
pub(super) struct OwnWorld {
    changed: Option<(FlightEnvironment, FlightSetting)>,
}

impl OwnWorld {
    /// A world with what a report brings; with its leg, where that is wanted and the type of the failure closes it.
    pub(super) fn of(world: &DeliveryWorld<'_>, request: &Request, with_leg: bool) -> Self {
        let mut closures = brought_closures(world.skies, request);
        if with_leg && request.report.failure.closes_leg() {
            let (from, to) = request.report.leg;
            let segment = world.setting.topology().segment_between(from, to);
            closures.extend(segment.map(for_good));
        }
        let taken = failed_pads(world.skies, request);
        if closures.is_empty() && taken.is_empty() {
            return Self::default();
        }
        let skies = world.skies.with(closures, &taken);
        let setting = world.setting.among(skies.closed(), skies.others().clone());
        Self {
            changed: Some((skies, setting)),
        }
    }

    /// That world, beside the one that it was made of.
    pub(super) fn world<'a>(&'a self, world: &DeliveryWorld<'a>) -> DeliveryWorld<'a> {
        match &self.changed {
            Some((skies, setting)) => DeliveryWorld {
                skies,
                setting,
                ..*world
            },
            None => *world,
        }
    }
}

fn for_good(segment: SegmentIx) -> TimedClosure {
    TimedClosure {
        from_s: f64::NEG_INFINITY,
        until_s: f64::INFINITY,
        segments: vec![segment],
        nodes: Vec::new(),
        pads: Vec::new(),
        widened: false,
    }
}

/// What a report closes for its own request, beside its leg.
fn brought_closures(skies: &FlightEnvironment, request: &Request) -> Vec<TimedClosure> {
    let mut closures = Vec::new();
    let failed = request.failed_pads().filter(|pads| {
        let has = skies.topology().pads(pads.node);
        pads.count.is_none_or(|count| count >= has)
    });
    if let Some(failed) = failed {
        closures.push(TimedClosure {
            from_s: f64::NEG_INFINITY,
            until_s: f64::INFINITY,
            segments: Vec::new(),
            nodes: Vec::new(),
            pads: vec![failed.node],
            widened: false,
        });
    }
    if let Some(brought) = &request.zone {
        let closure = Closure {
            id: brought.zone.id().to_owned(),
            windows: brought.zone.windows().to_vec(),
            hits: brought.hits.clone(),
            pads: Vec::new(),
            cause: Cause::Zone(Arc::clone(&brought.zone)),
        };
        closures.extend(timed_closures(&closure, skies.zero()));
    }
    closures
}

/// Some of a node's pads that a report says have failed: the last of them count as taken for good.
fn failed_pads(skies: &FlightEnvironment, request: &Request) -> Vec<Reservation> {
    let Some((node, count)) = request
        .failed_pads()
        .and_then(|pads| Some((pads.node, pads.count?)))
    else {
        return Vec::new();
    };
    let has = skies.topology().pads(node);
    if count >= has {
        return Vec::new();
    }
    let taken = (has - count..has).map(|pad| Reservation {
        node,
        pad,
        from_s: f64::NEG_INFINITY,
        until_s: f64::INFINITY,
    });
    taken.collect()
}

/// All that closes the leg or its ends now, for a drone that may go to neither.
pub(super) fn causes_of_leg(
    skies: &FlightEnvironment,
    failure: &FlightFailure<'_>,
) -> Vec<FlightCause> {
    let (from, to) = failure.request.report.leg;
    let segment = skies.topology().segment_between(from, to);
    let meets = |closure: &TimedClosure| {
        let is_now = closure.from_s <= failure.at_s && failure.at_s <= closure.until_s;
        let meets_leg = segment.is_some_and(|segment| closure.segments.contains(&segment));
        let meets_end = closure.nodes.contains(&from) || closure.nodes.contains(&to);
        is_now && (meets_leg || meets_end)
    };
    let closing = skies.closed().closures();
    let closing = closing.filter(|(_, _, closure)| meets(closure));
    let mut causes: Vec<FlightCause> = closing
        .map(|(number, ..)| FlightCause::Closure(number))
        .collect();
    let closes_leg = failure.request.report.failure.closes_leg();
    causes.extend(segment.filter(|_| closes_leg).map(FlightCause::Request));
    if causes.is_empty() {
        causes.push(FlightCause::Network);
    }
    causes
}

/// The report with what its airframe takes to turn; `None` where that is what every drone takes.
pub fn with_airframe(setting: &FlightSetting, request: &Request) -> Option<Request> {
    let airframe = setting.airframe();
    let known = &request.circumstances;
    let turns = (airframe.reaction_s, airframe.acceleration_mps2);
    (turns != (known.reaction_s, known.braking_mps2)).then(|| {
        let mut own = request.clone();
        own.circumstances.reaction_s = airframe.reaction_s;
        own.circumstances.braking_mps2 = airframe.acceleration_mps2;
        own
    })
}

//! Flights when the network changes: flown on as they are timed where their ways are as they were.

use super::FlownVersion;
use skyway_engine::compose::{Change, Composition};
use skyway_engine::delivery::{FlightComposition, Hold};
use skyway_engine::flight::{FlightPlan, FlightStart, FlownLeg, Reservation, Stop};
use skyway_engine::itinerary::PlanFigures;
use skyway_engine::network::NodeIx;
use std::ops::Range;

impl FlownVersion {
    /// These legs of it on another network, with their stops at the same times; `None` where any of that is gone.
    pub(crate) fn carried_over(&self, change: &Change<'_>, legs: Range<usize>) -> Option<Self> {
        let composition = &self.composition;
        let node = |node: NodeIx| change.correspondence.node(node);
        let is_whole = legs == (0..composition.plan.legs.len());
        let plan = plan_carried(&composition.plan, change, legs.clone())?;
        let destination = match plan.legs.last().filter(|_| !is_whole) {
            Some(last) => last.to,
            None => node(composition.destination)?,
        };
        let closed = composition.closed_segments.iter();
        let figures = &composition.figures;
        let stops = composition.plan.stops.iter().zip(&figures.stops);
        let kept = stops.filter(|(stop, _)| legs.contains(&stop.before_leg));
        let figures = PlanFigures {
            legs: figures.legs.get(legs.clone())?.to_vec(),
            stops: kept.map(|(_, figures)| *figures).collect(),
            ..figures.clone()
        };
        let pad_carried = |stay: Reservation| -> Option<Reservation> {
            let node = node(stay.node)?;
            let has_pad = stay.pad < change.to.pads(node);
            has_pad.then_some(Reservation { node, ..stay })
        };
        let hold = self.hold.filter(|_| legs.start == 0);
        let hold = hold.and_then(|hold| {
            Some(Hold {
                node: node(hold.node)?,
                ..hold
            })
        });
        Some(Self {
            airframe: self.airframe.clone(),
            ends: self.ends.get(legs.clone()).unwrap_or_default().to_vec(),
            hold,
            alternate: self.alternate.filter(|_| is_whole).and_then(pad_carried),
            composition: FlightComposition {
                destination,
                closed_segments: closed
                    .filter_map(|&segment| change.correspondence.unchanged(segment))
                    .collect(),
                leg_costs_usd: composition.leg_costs_usd.get(legs)?.to_vec(),
                plan,
                figures,
                ..composition.clone()
            },
            ..self.clone()
        })
    }

    /// Gives a way on another network the times of this flight, which is carried over to it.
    pub(crate) fn time(&self, way: &mut Composition) {
        let plan = &self.composition.plan;
        for (leg, flown) in way.legs.iter_mut().zip(&plan.legs) {
            leg.departure_s = flown.enters_s;
            leg.arrival_s = flown.leaves_s;
        }
        way.flight_time_s = plan.arrives_s;
    }
}

fn plan_carried(plan: &FlightPlan, change: &Change<'_>, legs: Range<usize>) -> Option<FlightPlan> {
    let node = |node: NodeIx| change.correspondence.node(node);
    let is_whole = legs == (0..plan.legs.len());
    let flown: Option<Vec<FlownLeg>> = plan
        .legs
        .get(legs.clone())?
        .iter()
        .map(|leg| {
            Some(FlownLeg {
                from: node(leg.from)?,
                to: node(leg.to)?,
                segment: change.correspondence.unchanged(leg.segment)?,
                ..*leg
            })
        })
        .collect();
    let flown = flown?;
    let stops = plan.stops.iter();
    let kept = stops.filter(|stop| legs.contains(&stop.before_leg));
    let stops: Option<Vec<Stop>> = kept
        .map(|stop| {
            let node = node(stop.node)?;
            let has_pad = stop.pad < change.to.pads(node);
            has_pad.then_some(Stop {
                node,
                before_leg: stop.before_leg - legs.start,
                ..*stop
            })
        })
        .collect();
    let start = match flown.first().filter(|_| legs.start > 0) {
        Some(first) => FlightStart {
            node: first.from,
            at_s: first.enters_s,
            battery: first.battery_before,
            on_ground: false,
            pad: None,
            flown_m: 0.0,
            drawn: 0.0,
            stretch: None,
        },
        None => FlightStart {
            node: node(plan.start.node)?,
            ..plan.start
        },
    };
    let last = flown.last().filter(|_| !is_whole);
    Some(FlightPlan {
        start,
        arrives_s: last.map_or(plan.arrives_s, |leg| leg.leaves_s),
        battery_at_arrival: last.map_or(plan.battery_at_arrival, |leg| leg.battery_after),
        stops: stops?,
        legs: flown,
        ..plan.clone()
    })
}

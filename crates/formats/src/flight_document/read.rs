//! Reading a plan with its premises.

use super::written::{
    Written, WrittenClosure, WrittenKind, WrittenLeg, WrittenPlan, WrittenReservation, WrittenStop,
    WrittenTraffic, WrittenWind,
};
use super::{FORMAT, FlightDocument, FlightDocumentFault};
use crate::flight::{
    Airframe, FlightPlan, FlightStart, FlownLeg, Reservation, Situation, Stop, StopKind,
    TimedClosure, TrafficLeg, Wind, WindField, WindPatch,
};
use crate::identifier::find_node;
use crate::network::{NodeIx, SegmentIx, Topology};
use jiff::Timestamp;
use serde_json::Value;

/// Reads a document, its names found in the network.
///
/// # Errors
/// The first thing that cannot be read, or that belongs to another network.
pub fn read_flight_document(
    text: &str,
    topology: &Topology,
) -> Result<FlightDocument, FlightDocumentFault> {
    let written: Written =
        serde_json::from_str(text).map_err(|error| FlightDocumentFault::Unreadable {
            reason: error.to_string(),
        })?;
    if written.format != FORMAT {
        let format = &written.format;
        return Err(FlightDocumentFault::Unreadable {
            reason: format!("its format is '{format}', and {FORMAT} is read"),
        });
    }
    if written.network_sha256 != topology.fingerprint_text() {
        return Err(FlightDocumentFault::OtherNetwork {
            stated: written.network_sha256,
        });
    }
    let airframe = Airframe::from_json(&written.airframe.to_string()).map_err(|fault| {
        FlightDocumentFault::Airframe {
            reason: fault.to_string(),
        }
    })?;
    let zero = written.zero.parse::<Timestamp>();
    let zero = zero.map_err(|error| FlightDocumentFault::Unreadable {
        reason: error.to_string(),
    })?;
    Reader { topology }.document(&written, zero, airframe)
}

/// Finds what is named in a network.
pub(crate) struct Reader<'a> {
    pub(crate) topology: &'a Topology,
}

type Read<T> = Result<T, FlightDocumentFault>;

impl Reader<'_> {
    fn document(
        &self,
        written: &Written,
        zero: Timestamp,
        airframe: Airframe,
    ) -> Read<FlightDocument> {
        let closure_ids = written.closures.iter();
        let closure_ids = closure_ids.map(|closure| closure.id.clone());
        let situation = self.situation(
            &written.closures,
            &written.reservations,
            &written.traffic,
            &written.swap_stations,
        )?;
        let start = &written.start;
        let start = FlightStart {
            node: self.node("start", &start.node)?,
            at_s: start.at_s,
            battery: start.battery_fraction,
            on_ground: start.on_ground,
            pad: None,
            flown_m: start.flown_m,
            drawn: start.drawn_fraction,
            stretch: None,
        };
        Ok(FlightDocument {
            zero,
            airframe,
            payload_kg: written.payload_kg,
            wind: wind(&written.wind),
            rules: written.rules.read(),
            situation,
            closure_ids: closure_ids.collect(),
            start,
            destination: self.node("destination", &written.destination)?,
            began_s: written.began_s,
            deadline_s: written.deadline_s.unwrap_or(f64::INFINITY),
            reserve: written.reserve_fraction,
            closed_segments: self.segments("closed_segments", &written.closed_segments)?,
            plan: self.plan(&written.plan, start)?,
        })
    }

    /// What is in the way.
    pub(crate) fn situation(
        &self,
        closures: &[WrittenClosure],
        reservations: &[WrittenReservation],
        traffic: &[WrittenTraffic],
        swap_stations: &[Value],
    ) -> Read<Situation> {
        let closures = closures.iter().map(|one| self.closure(one));
        let reservations = reservations.iter().map(|one| self.reservation(one));
        let traffic = traffic.iter().map(|one| self.traffic(one));
        Ok(Situation {
            closures: closures.collect::<Read<_>>()?,
            reservations: reservations.collect::<Read<_>>()?,
            traffic: traffic.collect::<Read<_>>()?,
            swap_stations: self.nodes("swap_stations", swap_stations)?,
        })
    }

    pub(crate) fn node(&self, field: &'static str, id: &Value) -> Read<NodeIx> {
        find_node(self.topology, id).ok_or_else(|| FlightDocumentFault::UnknownNode {
            field,
            id: id.to_string(),
        })
    }

    pub(crate) fn nodes(&self, field: &'static str, ids: &[Value]) -> Read<Vec<NodeIx>> {
        ids.iter().map(|id| self.node(field, id)).collect()
    }

    fn segment(&self, field: &'static str, id: &str) -> Read<SegmentIx> {
        let found = self.topology.find_segment(id);
        found.ok_or_else(|| FlightDocumentFault::UnknownSegment {
            field,
            id: id.to_owned(),
        })
    }

    fn segments(&self, field: &'static str, ids: &[String]) -> Read<Vec<SegmentIx>> {
        ids.iter().map(|id| self.segment(field, id)).collect()
    }

    fn closure(&self, closure: &WrittenClosure) -> Read<TimedClosure> {
        Ok(TimedClosure {
            from_s: closure.from_s.unwrap_or(f64::NEG_INFINITY),
            until_s: closure.until_s.unwrap_or(f64::INFINITY),
            segments: self.segments("closures", &closure.segments)?,
            nodes: self.nodes("closures", &closure.nodes)?,
            pads: self.nodes("closures", &closure.pads)?,
            widened: closure.widened,
        })
    }

    fn reservation(&self, stay: &WrittenReservation) -> Read<Reservation> {
        Ok(Reservation {
            node: self.node("reservations", &stay.node)?,
            pad: stay.pad,
            from_s: stay.from_s,
            until_s: stay.until_s.unwrap_or(f64::INFINITY),
        })
    }

    fn traffic(&self, leg: &WrittenTraffic) -> Read<TrafficLeg> {
        Ok(TrafficLeg {
            segment: self.segment("traffic", &leg.segment)?,
            from: self.node("traffic", &leg.from)?,
            enters_s: leg.enters_s,
            leaves_s: leg.leaves_s,
        })
    }

    fn plan(&self, plan: &WrittenPlan, start: FlightStart) -> Read<FlightPlan> {
        let legs = plan.legs.iter().map(|leg| self.leg(leg));
        let stops = plan.stops.iter().map(|stop| self.stop(stop));
        Ok(FlightPlan {
            start,
            legs: legs.collect::<Read<_>>()?,
            stops: stops.collect::<Read<_>>()?,
            arrives_s: plan.arrives_s,
            battery_at_arrival: plan.battery_at_arrival_fraction,
            distance_m: plan.distance_m,
            energy: plan.energy_fraction,
        })
    }

    fn leg(&self, leg: &WrittenLeg) -> Read<FlownLeg> {
        Ok(FlownLeg {
            from: self.node("plan.legs", &leg.from)?,
            to: self.node("plan.legs", &leg.to)?,
            segment: self.segment("plan.legs", &leg.segment)?,
            enters_s: leg.enters_s,
            leaves_s: leg.leaves_s,
            battery_before: leg.battery_before_fraction,
            battery_after: leg.battery_after_fraction,
        })
    }

    fn stop(&self, stop: &WrittenStop) -> Read<Stop> {
        Ok(Stop {
            kind: match stop.kind {
                WrittenKind::Start => StopKind::Start,
                WrittenKind::Charge => StopKind::Charge,
                WrittenKind::Swap => StopKind::Swap,
            },
            before_leg: stop.before_leg,
            node: self.node("plan.stops", &stop.node)?,
            pad: stop.pad,
            lands_s: stop.lands_s,
            takes_off_s: stop.takes_off_s,
            battery_before: stop.battery_before_fraction,
            battery_after: stop.battery_after_fraction,
            service_s: stop.service_s,
        })
    }
}

/// The first statement is what blows where nothing else is stated.
fn wind(written: &[WrittenWind]) -> WindField {
    let wind = |stated: &WrittenWind| Wind {
        east_mps: stated.east_mps,
        north_mps: stated.north_mps,
    };
    let patches = written.iter().skip(1).map(|stated| WindPatch {
        area: None,
        from_s: stated.from_s.unwrap_or(f64::NEG_INFINITY),
        until_s: stated.until_s.unwrap_or(f64::INFINITY),
        wind: wind(stated),
    });
    WindField {
        base: written.first().map_or(Wind::CALM, wind),
        patches: patches.collect(),
    }
}

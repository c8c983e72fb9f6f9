//! Writing a plan with its premises.

use super::written::{
    Written, WrittenClosure, WrittenKind, WrittenLeg, WrittenPlan, WrittenReservation,
    WrittenRules, WrittenStart, WrittenStop, WrittenTraffic, WrittenWind,
};
use super::{FORMAT, FlightDocumentFault};
use crate::delivery::{FlightComposition, FlightEnvironment};
use crate::flight::{FlightPlan, FlightStart, Situation, StopKind, WindField};
use crate::identifier::node_id_json;
use crate::itinerary::FlightSetting;
use crate::network::{NodeIx, SegmentIx, Topology};
use crate::recompose::Severance;
use serde_json::Value;

/// Writes a composition with everything that it was made for; instants are seconds from `zero`.
///
/// # Errors
/// [`FlightDocumentFault::WindArea`] where the wind is stated for an area.
pub fn write_flight_document(
    skies: &FlightEnvironment,
    setting: &FlightSetting,
    composition: &FlightComposition,
) -> Result<String, FlightDocumentFault> {
    let writer = Writer {
        topology: skies.topology(),
    };
    let situation = skies.situation();
    let written = Written {
        format: FORMAT.to_owned(),
        network_sha256: writer.topology.fingerprint_text().to_owned(),
        zero: skies.zero().to_string(),
        airframe: serde_json::to_value(setting.airframe()).map_err(|error| unwritable(&error))?,
        payload_kg: setting.payload_kg(),
        wind: winds(setting.wind())?,
        rules: WrittenRules::of(setting.rules()),
        closures: writer.closures(&situation, &skies.causes()),
        reservations: writer.reservations(&situation),
        traffic: writer.traffic(&situation),
        swap_stations: writer.ids(&situation.swap_stations),
        start: writer.start(&composition.plan.start),
        destination: writer.id(composition.destination),
        began_s: composition.began_s,
        deadline_s: finite(composition.deadline_s),
        reserve_fraction: composition.reserve,
        closed_segments: writer.segments(&composition.closed_segments),
        plan: writer.plan(&composition.plan),
    };
    let text = serde_json::to_string_pretty(&written);
    text.map(|text| text + "\n")
        .map_err(|error| unwritable(&error))
}

fn unwritable(error: &serde_json::Error) -> FlightDocumentFault {
    FlightDocumentFault::Unreadable {
        reason: error.to_string(),
    }
}

fn finite(number: f64) -> Option<f64> {
    number.is_finite().then_some(number)
}

fn winds(field: &WindField) -> Result<Vec<WrittenWind>, FlightDocumentFault> {
    let mut winds = vec![WrittenWind {
        from_s: None,
        until_s: None,
        east_mps: field.base.east_mps,
        north_mps: field.base.north_mps,
    }];
    for patch in &field.patches {
        if patch.area.is_some() {
            return Err(FlightDocumentFault::WindArea);
        }
        winds.push(WrittenWind {
            from_s: finite(patch.from_s),
            until_s: finite(patch.until_s),
            east_mps: patch.wind.east_mps,
            north_mps: patch.wind.north_mps,
        });
    }
    Ok(winds)
}

/// Writes what a network names.
pub(crate) struct Writer<'a> {
    pub(crate) topology: &'a Topology,
}

impl Writer<'_> {
    pub(crate) fn id(&self, node: NodeIx) -> Value {
        node_id_json(self.topology, node)
    }

    pub(crate) fn ids(&self, nodes: &[NodeIx]) -> Vec<Value> {
        nodes.iter().map(|&node| self.id(node)).collect()
    }

    fn segment(&self, segment: SegmentIx) -> String {
        self.topology.segment_id(segment).into_owned()
    }

    fn segments(&self, segments: &[SegmentIx]) -> Vec<String> {
        let segments = segments.iter();
        segments.map(|&segment| self.segment(segment)).collect()
    }

    pub(crate) fn closures(
        &self,
        situation: &Situation,
        causes: &[Severance],
    ) -> Vec<WrittenClosure> {
        let closures = situation.closures.iter().enumerate();
        closures
            .map(|(number, closure)| WrittenClosure {
                id: match causes.get(number) {
                    Some(Severance::Closure(id)) => id.clone(),
                    _ => "report".to_owned(),
                },
                from_s: finite(closure.from_s),
                until_s: finite(closure.until_s),
                segments: self.segments(&closure.segments),
                nodes: self.ids(&closure.nodes),
                pads: self.ids(&closure.pads),
                widened: closure.widened,
            })
            .collect()
    }

    pub(crate) fn reservations(&self, situation: &Situation) -> Vec<WrittenReservation> {
        let reservations = situation.reservations.iter();
        reservations
            .map(|stay| WrittenReservation {
                node: self.id(stay.node),
                pad: stay.pad,
                from_s: stay.from_s,
                until_s: finite(stay.until_s),
            })
            .collect()
    }

    pub(crate) fn traffic(&self, situation: &Situation) -> Vec<WrittenTraffic> {
        let traffic = situation.traffic.iter();
        traffic
            .map(|leg| WrittenTraffic {
                segment: self.segment(leg.segment),
                from: self.id(leg.from),
                enters_s: leg.enters_s,
                leaves_s: leg.leaves_s,
            })
            .collect()
    }

    fn start(&self, start: &FlightStart) -> WrittenStart {
        WrittenStart {
            node: self.id(start.node),
            at_s: start.at_s,
            battery_fraction: start.battery,
            on_ground: start.on_ground,
            flown_m: start.flown_m,
            drawn_fraction: start.drawn,
        }
    }

    fn plan(&self, plan: &FlightPlan) -> WrittenPlan {
        let legs = plan.legs.iter().map(|leg| WrittenLeg {
            from: self.id(leg.from),
            to: self.id(leg.to),
            segment: self.segment(leg.segment),
            enters_s: leg.enters_s,
            leaves_s: leg.leaves_s,
            battery_before_fraction: leg.battery_before,
            battery_after_fraction: leg.battery_after,
        });
        let stops = plan.stops.iter().map(|stop| WrittenStop {
            kind: match stop.kind {
                StopKind::Start => WrittenKind::Start,
                StopKind::Charge => WrittenKind::Charge,
                StopKind::Swap => WrittenKind::Swap,
            },
            before_leg: stop.before_leg,
            node: self.id(stop.node),
            pad: stop.pad,
            lands_s: stop.lands_s,
            takes_off_s: stop.takes_off_s,
            battery_before_fraction: stop.battery_before,
            battery_after_fraction: stop.battery_after,
            service_s: stop.service_s,
        });
        WrittenPlan {
            legs: legs.collect(),
            stops: stops.collect(),
            arrives_s: plan.arrives_s,
            battery_at_arrival_fraction: plan.battery_at_arrival,
            distance_m: plan.distance_m,
            energy_fraction: plan.energy,
        }
    }
}

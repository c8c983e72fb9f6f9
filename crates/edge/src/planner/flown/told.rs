//! How a version of a plan is flown, in the words of the wire.

use super::{DetourEnd, FlownVersion};
use crate::planner::later;
use crate::words::{instant, node_id, text};
use jiff::Timestamp;
use skyway_contract as wire;
use skyway_engine::flight::StopKind;
use skyway_engine::itinerary::{Objective, Value};
use skyway_engine::network::Topology;
use std::borrow::Cow;

impl FlownVersion {
    /// The whole flight of a version that departs at an instant; `None` where it is unknown whether the battery suffices.
    pub(crate) fn told(
        &self,
        topology: &Topology,
        departs_at: Timestamp,
    ) -> Option<wire::Flight<'static>> {
        let composition = &self.composition;
        let proof = &composition.proof;
        let hold = self.hold.map(|hold| wire::PadHold {
            node: node_id(topology, hold.node),
            pad: hold.pad,
            until: instant(later(departs_at, hold.until_s)),
        });
        self.is_energy_checked.then(|| wire::Flight {
            airframe: text(&self.airframe),
            objective: Cow::Borrowed(composition.objective.name()),
            battery_at_departure_fraction: composition.plan.start.battery,
            battery_at_arrival_fraction: composition.plan.battery_at_arrival,
            energy_wh: composition.figures.energy_wh,
            cost_usd: composition.figures.cost_usd,
            reserve_fraction: composition.reserve,
            reserve_used: self.reserve_used,
            proved: proof.proved,
            value: self.measured(proof.value),
            lower_bound: self.measured(proof.lower_bound).max(0.0),
            unproved_reason: proof.reason.map(|reason| Cow::Borrowed(reason.name())),
            hold,
            stops: self.stops(topology, departs_at),
        })
    }

    /// A value in the unit of the objective.
    fn measured(&self, value: Value) -> f64 {
        match self.composition.objective {
            Objective::Distance => value.weight,
            Objective::Time => value.arrives_s - self.composition.began_s,
            Objective::Energy => value.weight * self.battery_wh,
        }
    }

    fn stops(&self, topology: &Topology, departs_at: Timestamp) -> Vec<wire::Stop<'static>> {
        let composition = &self.composition;
        let stops = composition
            .plan
            .stops
            .iter()
            .zip(&composition.figures.stops);
        let stops = stops.map(|(stop, figures)| wire::Stop {
            node: node_id(topology, stop.node),
            pad: stop.pad,
            kind: match stop.kind {
                StopKind::Start => wire::StopKind::Start,
                StopKind::Charge => wire::StopKind::Charge,
                StopKind::Swap => wire::StopKind::Swap,
            },
            before_leg: u32::try_from(stop.before_leg).unwrap_or(u32::MAX),
            lands_at: instant(later(departs_at, stop.lands_s)),
            takes_off_at: instant(later(departs_at, stop.takes_off_s)),
            waits_s: figures.waits_s,
            battery_before_fraction: stop.battery_before,
            battery_after_fraction: stop.battery_after,
            reservation: match self.is_confirmed {
                true => wire::PadReservation::Confirmed,
                false => wire::PadReservation::Unconfirmed,
            },
            service_s: stop.service_s,
        });
        stops.collect()
    }

    /// A leg of it.
    pub(crate) fn leg(
        &self,
        topology: &Topology,
        number: usize,
    ) -> Option<wire::LegFlight<'static>> {
        let legs = self.composition.plan.legs.get(number);
        let leg = legs.filter(|_| self.is_energy_checked)?;
        let figures = self.composition.figures.legs.get(number)?;
        let cost_usd = self.composition.leg_costs_usd.get(number)?;
        Some(wire::LegFlight {
            service_id: Cow::Owned(format!(
                "{}#{}",
                topology.segment_id(leg.segment),
                number + 1
            )),
            time_s: figures.time_s,
            airspeed_mps: figures.airspeed_mps,
            ground_speed_mps: figures.ground_speed_mps,
            energy_wh: figures.energy_wh,
            battery_before_fraction: leg.battery_before,
            battery_after_fraction: leg.battery_after,
            payload_kg: self.payload_kg,
            cost_usd: *cost_usd,
        })
    }
}

impl DetourEnd {
    /// The end of a contingency of a version that departs at an instant.
    pub(crate) fn told(&self, departs_at: Timestamp) -> wire::DetourFlight<'static> {
        wire::DetourFlight {
            arrives_at: instant(later(departs_at, self.arrives_s)),
            battery_at_arrival_fraction: self.battery,
            reserve_used: self.reserve_used,
        }
    }
}

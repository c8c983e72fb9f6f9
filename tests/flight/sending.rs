//! Plans of small worlds, shown to the checker that looks at answers before they are sent.

use crate::world::World;
use skyway::airspace::Airspace;
use skyway::checker::{
    Claim, ClosedTimes, Drone, Fault, Flags, FlightClaim, FlightSky, Need, OwnClosures, Sky,
    Stretch, StretchKind, Told, Whereabouts, check_flight,
};
use skyway::flight::{FlightLegs, FlightPlan};
use skyway::network::{NodeIx, SegmentIx};

impl World {
    /// What that checker says of a plan; it does not look at traffic and at the deadline.
    pub(crate) fn check_before_sending(&self, plan: &FlightPlan) -> Result<(), Fault> {
        let now = jiff::Timestamp::UNIX_EPOCH;
        let horizon = jiff::SignedDuration::from_mins(10);
        let airspace = Airspace::open(self.topology.clone(), 1, now, horizon);
        let legs = FlightLegs::of(
            &self.topology,
            &self.airframe,
            self.payload_kg,
            &self.wind,
            &self.rules,
        );
        let reservations = &self.situation.reservations;
        let is_taken = |node: NodeIx, pad: u16, from_s: f64, until_s: f64| {
            let mut stays = reservations.iter();
            stays.any(|stay| {
                let is_there = (stay.node, stay.pad) == (node, pad);
                is_there && from_s < stay.until_s && stay.from_s < until_s
            })
        };
        let flight_sky = FlightSky {
            legs: &legs,
            airframe: &self.airframe,
            rules: &self.rules,
            closed: &ClosedTimes::of_timed(&self.topology, &self.situation.closures, now),
            swaps: &|node| self.situation.swap_stations.contains(&node),
            is_taken: &is_taken,
            refuge_stay_s: 0.0,
        };
        let sky = Sky {
            airspace: &airspace,
            own: OwnClosures::default(),
            flight: Some(&flight_sky),
        };
        let mut nodes = vec![plan.start.node];
        nodes.extend(plan.legs.iter().map(|leg| leg.to));
        let segments: Vec<SegmentIx> = plan.legs.iter().map(|leg| leg.segment).collect();
        let flight = FlightClaim {
            start: plan.start,
            plan,
            began_s: self.began_s,
            alternate: None,
            reserve: self.reserve,
            is_energy_checked: true,
        };
        let claim = Claim {
            told: Told::Rerouted,
            stretch: Some(Stretch {
                kind: StretchKind::None,
                leg: None,
                enters: plan.start.node,
                length_m: plan.start.flown_m,
                overrun_m: 0.0,
            }),
            nodes: &nodes,
            segments: &segments,
            length_m: Some(plan.distance_m),
            flags: Flags::default(),
            has_unsafe_way: false,
            waits_until: None,
            flight: Some(&flight),
        };
        let drone = Drone {
            leg: (plan.start.node, plan.start.node),
            at: Whereabouts::LegStart,
            drift_m: 0.0,
            stopping_m: 0.0,
            stands_at: None,
            destination: self.destination,
            onward: &[],
            planned: None,
            need: Need::Nothing,
            at_s: f64::NEG_INFINITY,
            battery: None,
        };
        check_flight(&claim, &drone, &sky)
    }
}

//! The checker beside what it checks: a flown plan, by how many legs and stays it has.

use crate::percentiles::Percentiles;
use crate::workload::{Query, Workload};
use jiff::{SignedDuration, Timestamp};
use skyway::airspace::Airspace;
use skyway::checker::{
    Claim, ClosedTimes, Drone, Flags, FlightClaim, FlightSky, Need, OwnClosures, Sky, Stretch,
    StretchKind, Told, Whereabouts, check,
};
use skyway::flight::{FlightPlan, Reservation};
use skyway::itinerary::{ItineraryScratch, Objective, find};
use skyway::network::{NodeIx, SegmentIx};

/// How many legs and stays the plans have that are checked, from and to.
const STEPS: [(usize, usize); 4] = [(9, 11), (18, 22), (28, 32), (45, 55)];

/// A plan with the lists that an answer states beside it.
struct Flown {
    plan: FlightPlan,
    nodes: Vec<NodeIx>,
    segments: Vec<SegmentIx>,
    destination: NodeIx,
}

impl Flown {
    fn steps(&self) -> usize {
        self.plan.legs.len() + self.plan.stops.len()
    }

    fn claim<'a>(&'a self, flight: &'a FlightClaim<'a>) -> Claim<'a> {
        Claim {
            told: Told::Rerouted,
            stretch: Some(Stretch {
                kind: StretchKind::None,
                leg: None,
                enters: self.plan.start.node,
                length_m: 0.0,
                overrun_m: 0.0,
            }),
            nodes: &self.nodes,
            segments: &self.segments,
            length_m: Some(self.plan.distance_m),
            flags: Flags::default(),
            has_unsafe_way: false,
            waits_until: None,
            flight: Some(flight),
        }
    }

    /// The drone that stands where the plan starts.
    fn drone(&self) -> Drone<'_> {
        let start = &self.plan.start;
        Drone {
            leg: (self.nodes[0], self.nodes[1]),
            at: Whereabouts::LegStart,
            drift_m: 0.0,
            stopping_m: 0.0,
            stands_at: Some(start.node),
            destination: self.destination,
            onward: &[],
            planned: None,
            need: Need::Nothing,
            at_s: start.at_s,
            battery: Some(start.battery),
        }
    }
}

/// Every plan of the requests that begin on a pad, with its reserve.
fn plans(workload: &Workload, objective: Objective) -> Vec<Flown> {
    let mut scratch = ItineraryScratch::new(&workload.topology);
    let world = workload.world();
    let tables = &workload.potentials[objective as usize];
    let mut flown = |query: &Query| {
        let request = workload.request(query, objective);
        let plan = find(&world, &request, &tables[query.destination], &mut scratch).plan?;
        let first = std::iter::once(plan.start.node);
        let nodes = first.chain(plan.legs.iter().map(|leg| leg.to)).collect();
        let segments = plan.legs.iter().map(|leg| leg.segment).collect();
        let is_path = !plan.legs.is_empty();
        is_path.then_some(Flown {
            nodes,
            segments,
            destination: request.destination,
            plan,
        })
    };
    let queries = workload.easy.iter().chain(&workload.two);
    queries.filter_map(&mut flown).collect()
}

/// Prints what the check of a plan takes, by its legs and stays.
pub(crate) fn measure(workload: &Workload, objective: Objective) {
    println!("\n| the check alone, flown | plans | p50 µs | p99 µs | mean µs |");
    println!("|---|---:|---:|---:|---:|");
    let now = Timestamp::UNIX_EPOCH;
    let airspace = Airspace::open(
        workload.topology.clone(),
        1,
        now,
        SignedDuration::from_mins(10),
    );
    let mut stays: Vec<Reservation> = workload.situation.reservations.clone();
    stays.sort_by_key(|stay| stay.node);
    let is_taken = |node: NodeIx, pad: u16, from_s: f64, until_s: f64| {
        let first = stays.partition_point(|stay| stay.node < node);
        let mut there = stays[first..].iter().take_while(|stay| stay.node == node);
        there.any(|stay| stay.pad == pad && from_s < stay.until_s && stay.from_s < until_s)
    };
    let flight_sky = FlightSky {
        legs: &workload.legs,
        airframe: &workload.airframe,
        rules: &workload.rules,
        closed: &ClosedTimes::of_timed(&workload.topology, &workload.situation.closures, now),
        swaps: &|_| false,
        is_taken: &is_taken,
        refuge_stay_s: 0.0,
    };
    let sky = Sky {
        airspace: &airspace,
        own: OwnClosures::default(),
        flight: Some(&flight_sky),
    };
    let plans = plans(workload, objective);
    for (least, most) in STEPS {
        let plans: Vec<&Flown> = plans
            .iter()
            .filter(|plan| (least..=most).contains(&plan.steps()))
            .collect();
        if plans.is_empty() {
            continue;
        }
        let times = Percentiles::of(plans.len(), |index| {
            let flown = plans[index];
            let flight = FlightClaim {
                start: flown.plan.start,
                plan: &flown.plan,
                began_s: flown.plan.start.at_s,
                alternate: None,
                reserve: workload.rules.reserve,
                is_energy_checked: true,
            };
            let passed = check(&flown.claim(&flight), &flown.drone(), &sky);
            assert!(passed.is_ok(), "{passed:?}: {:?}", flown.plan);
        });
        println!(
            "| {least} to {most} legs and stays | {} | {:.2} | {:.2} | {:.2} |",
            plans.len(),
            times.at_us(0.5),
            times.at_us(0.99),
            times.mean_us(),
        );
    }
}

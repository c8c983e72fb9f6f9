//! What a search keeps for the next one does not show in answers.

use crate::world::{Draw, Kind, crowded, world};
use skyway::itinerary::{
    ClosedWindows, FlightRequest, FlightSetting, ItineraryScratch, Limits, Objective, Occupancy,
    OccupiedLeg, OthersOccupancy, Owner, find,
};
use skyway::network::{SegmentIx, Topology};
use std::sync::Arc;

const PLANS: [&str; 3] = ["own", "one", "other"];
/// Second 0 of the searches, on the clock of the plans: as of today it has few digits after the point.
const ZERO_S: f64 = 1_795_860_000.3;

fn drawn_leg(draw: &mut Draw, topology: &Topology, segment: SegmentIx) -> OccupiedLeg {
    let ends = topology.segment(segment);
    let enters_s = ZERO_S + draw.between(-100.0, 4_000.0);
    OccupiedLeg {
        plan: Owner::from(Arc::from(PLANS[draw.below(PLANS.len())])),
        version: 1,
        leg: draw.below(20) as u32,
        from: [ends.from, ends.to][draw.below(2)],
        enters_s,
        leaves_s: enters_s + draw.between(30.0, 300.0),
        is_uncertain: draw.chance(0.1),
    }
}

/// Legs come and go, the drone's own among them; the one memory has seen all of them, the other nothing.
#[test]
fn legs_that_come_and_go_between_searches_leave_nothing_behind() {
    let (mut met, mut changed) = (0, 0);
    for seed in 0..60 {
        let world = crowded(seed, world(seed, Kind::Continuous));
        let topology = &world.topology;
        let setting = FlightSetting::new(
            topology.clone(),
            world.airframe.clone(),
            world.payload_kg,
            world.wind.clone(),
            world.rules,
            &world.situation,
        );
        let closed = Arc::new(ClosedWindows::of(topology, &world.situation.closures));
        let mut draw = Draw::new(seed);
        let (mut occupancy, mut of_others) = (Occupancy::default(), Occupancy::default());
        let mut kept = ItineraryScratch::new(topology);
        let mut before = None;
        for step in 0..30 {
            for _ in 0..if step == 0 { 200 } else { 3 } {
                let segment = SegmentIx(draw.below(topology.segment_count()) as u32);
                let leg = drawn_leg(&mut draw, topology, segment);
                let is_own = *leg.plan == *PLANS[0];
                let puts = draw.chance(0.7);
                let concerned = [
                    Some(&mut occupancy),
                    Some(&mut of_others).filter(|_| !is_own),
                ];
                for occupancy in concerned.into_iter().flatten() {
                    match puts {
                        true => occupancy.put_leg(segment, leg.clone()),
                        false => occupancy.remove_leg(segment, &leg.plan, 1, leg.leg),
                    }
                }
            }
            let own = Some(Arc::from(PLANS[0]));
            let without_own = OthersOccupancy::of(of_others.clone(), [None, None], ZERO_S);
            let without_own = setting.among(&closed, without_own);
            let others = OthersOccupancy::of(occupancy.clone(), [own, None], ZERO_S);
            let setting = setting.among(&closed, others);
            let objective = Objective::ALL[draw.below(3)];
            let potentials = setting.potentials(world.destination, objective);
            let limits = Limits {
                checks: [2_000, Limits::THOROUGH.checks][draw.below(2)],
                ..Limits::THOROUGH
            };
            let request = FlightRequest {
                limits,
                ..world.request(objective)
            };
            let search = |setting: &FlightSetting, scratch: &mut ItineraryScratch| {
                find(&setting.world(), &request, &potentials, scratch)
            };
            let mut fresh = ItineraryScratch::new(topology);
            let answer = search(&setting, &mut fresh);
            let place = format!("seed {seed}, step {step}");
            // What the first of them looks at, the second gathers, and the third finds.
            for _ in 0..3 {
                assert_eq!(answer, search(&setting, &mut kept), "{place}");
            }
            if answer.proved {
                let without_own = search(&without_own, &mut fresh);
                assert_eq!(answer.plan, without_own.plan, "{place}");
            }
            met += usize::from(fresh.met_others() > 0);
            let value = answer.value;
            changed += usize::from(before.replace(value) != Some(value));
        }
    }
    assert!(
        met > 200 && changed > 200,
        "{met} have met others, {changed} were new"
    );
}

//! The checker refuses what cannot be flown: plans of the search, changed in one place each.

use crate::world::{Draw, Kind, World, world};
use skyway::flight::{FlightPlan, Reservation, StopKind, TrafficLeg};
use skyway::itinerary::Objective;
use skyway::verify::FlightFault;

/// A change to a plan or its world; false where it cannot be made.
type Mutation = fn(&mut FlightPlan, &mut World, &mut Draw) -> bool;

fn raise_battery(plan: &mut FlightPlan, _: &mut World, draw: &mut Draw) -> bool {
    let Some(count) = plan.legs.len().checked_sub(1) else {
        return false;
    };
    plan.legs[draw.below(count + 1)].battery_after += 0.01;
    true
}

fn raise_battery_throughout(plan: &mut FlightPlan, _: &mut World, _: &mut Draw) -> bool {
    for leg in &mut plan.legs {
        leg.battery_before += 0.01;
        leg.battery_after += 0.01;
    }
    for stop in &mut plan.stops {
        stop.battery_before += 0.01;
        stop.battery_after += 0.01;
    }
    plan.battery_at_arrival += 0.01;
    !plan.legs.is_empty()
}

fn begin_with_less(plan: &mut FlightPlan, world: &mut World, _: &mut Draw) -> bool {
    for start in &mut world.starts {
        start.battery -= 0.01;
    }
    plan.start.battery -= 0.01;
    !plan.legs.is_empty()
}

fn book_the_pad_twice(plan: &mut FlightPlan, world: &mut World, draw: &mut Draw) -> bool {
    let stays: Vec<_> = plan.stops.iter().collect();
    if stays.is_empty() {
        return false;
    }
    let stop = stays[draw.below(stays.len())];
    let long_s = stop.takes_off_s - stop.lands_s;
    world.situation.reservations.push(Reservation {
        node: stop.node,
        pad: stop.pad,
        from_s: stop.lands_s + long_s * 0.4,
        until_s: stop.lands_s + long_s * 0.6,
    });
    long_s > 0.1
}

fn take_a_pad_that_is_not_there(plan: &mut FlightPlan, world: &mut World, _: &mut Draw) -> bool {
    match plan.stops.first_mut() {
        Some(stop) => {
            stop.pad = world.topology.pads(stop.node);
            true
        }
        None => false,
    }
}

fn shift_a_leg(plan: &mut FlightPlan, _: &mut World, draw: &mut Draw) -> bool {
    if plan.legs.is_empty() {
        return false;
    }
    let place = draw.below(plan.legs.len());
    plan.legs[place].enters_s += 0.5;
    plan.legs[place].leaves_s += 0.5;
    true
}

/// All times earlier, as if the drone had been there before it was.
fn shift_everything(plan: &mut FlightPlan, _: &mut World, _: &mut Draw) -> bool {
    for leg in &mut plan.legs {
        leg.enters_s -= 1.0;
        leg.leaves_s -= 1.0;
    }
    for stop in &mut plan.stops {
        stop.lands_s -= 1.0;
        stop.takes_off_s -= 1.0;
    }
    plan.arrives_s -= 1.0;
    !plan.legs.is_empty()
}

fn fly_faster(plan: &mut FlightPlan, _: &mut World, _: &mut Draw) -> bool {
    match plan.legs.last_mut() {
        Some(leg) => {
            leg.leaves_s -= 1.0;
            plan.arrives_s -= 1.0;
            true
        }
        None => false,
    }
}

fn stay_too_short(plan: &mut FlightPlan, world: &mut World, _: &mut Draw) -> bool {
    world.rules.stop_s += 3_000.0;
    world.rules.swap_s += 3_000.0;
    plan.stops
        .iter()
        .any(|stop| stop.kind != StopKind::Start && stop.takes_off_s - stop.lands_s < 3_000.0)
}

fn leave_out_a_leg(plan: &mut FlightPlan, _: &mut World, draw: &mut Draw) -> bool {
    if plan.legs.len() < 2 {
        return false;
    }
    plan.legs.remove(draw.below(plan.legs.len()));
    true
}

fn close_a_leg(plan: &mut FlightPlan, world: &mut World, draw: &mut Draw) -> bool {
    if plan.legs.is_empty() {
        return false;
    }
    let leg = plan.legs[draw.below(plan.legs.len())];
    world.situation.closures.push(skyway::flight::TimedClosure {
        from_s: (leg.enters_s + leg.leaves_s) / 2.0,
        until_s: leg.leaves_s,
        segments: vec![leg.segment],
        nodes: Vec::new(),
        pads: Vec::new(),
        widened: false,
    });
    true
}

fn fly_against_another(plan: &mut FlightPlan, world: &mut World, _: &mut Draw) -> bool {
    let Some(leg) = plan.legs.first() else {
        return false;
    };
    world.situation.traffic.push(TrafficLeg {
        segment: leg.segment,
        from: leg.to,
        enters_s: leg.leaves_s - 1.0,
        leaves_s: leg.leaves_s + 60.0,
    });
    world.rules.headway_s > 0.0
}

fn keep_a_higher_reserve(plan: &mut FlightPlan, world: &mut World, _: &mut Draw) -> bool {
    let levels = plan.legs.iter().map(|leg| leg.battery_after);
    let lowest = levels.fold(f64::INFINITY, f64::min);
    world.reserve = lowest + 0.001;
    lowest.is_finite()
}

fn claim_a_shorter_way(plan: &mut FlightPlan, _: &mut World, _: &mut Draw) -> bool {
    plan.distance_m -= 1.0;
    true
}

fn be_late(plan: &mut FlightPlan, world: &mut World, _: &mut Draw) -> bool {
    world.deadline_s = plan.arrives_s - 0.001;
    true
}

const MUTATIONS: &[(&str, Mutation)] = &[
    ("a battery raised", raise_battery),
    ("all batteries raised", raise_battery_throughout),
    ("less to begin with", begin_with_less),
    ("a pad booked twice", book_the_pad_twice),
    ("a pad that is not there", take_a_pad_that_is_not_there),
    ("a leg shifted in time", shift_a_leg),
    ("everything shifted in time", shift_everything),
    ("a faster leg", fly_faster),
    ("stays too short", stay_too_short),
    ("a leg left out", leave_out_a_leg),
    ("a leg closed", close_a_leg),
    ("another plan ahead", fly_against_another),
    ("a higher reserve", keep_a_higher_reserve),
    ("a shorter way claimed", claim_a_shorter_way),
    ("a deadline missed", be_late),
];

/// What the checker of answers does not look at, or sees by the drone and the path rather than by the flight.
const NOT_OF_THE_PLAN_ALONE: [&str; 7] = [
    "all batteries raised",
    "less to begin with",
    "everything shifted in time",
    "another plan ahead",
    "a higher reserve",
    "a shorter way claimed",
    "a deadline missed",
];

#[test]
fn every_mutation_of_a_plan_is_refused() {
    let mut refused = vec![0; MUTATIONS.len()];
    for seed in 0..150 {
        for (place, (name, mutate)) in MUTATIONS.iter().enumerate() {
            let mut world = world(seed, Kind::Continuous);
            let objective = Objective::ALL[place % 3];
            let Some(mut plan) = world.answer(objective, false).plan else {
                continue;
            };
            assert_eq!(world.check(&plan), Ok(()), "seed {seed}");
            let mut draw = Draw::new(seed);
            if !mutate(&mut plan, &mut world, &mut draw) {
                continue;
            }
            let verdict = world.check(&plan);
            assert!(verdict.is_err(), "seed {seed}, {name}: {plan:?}\n{world}");
            let sent = world.check_before_sending(&plan);
            let is_seen = sent.is_err() || NOT_OF_THE_PLAN_ALONE.contains(name);
            assert!(is_seen, "seed {seed}, {name}: {plan:?}\n{world}");
            refused[place] += 1;
        }
    }
    for ((name, _), refused) in MUTATIONS.iter().zip(refused) {
        assert!(refused >= 10, "{name}: {refused} refused");
    }
}

#[test]
fn faults_say_what_is_wrong_and_where() {
    let mut seen = 0;
    for seed in 0..60 {
        let mut world = world(seed, Kind::Continuous);
        let Some(mut plan) = world.answer(Objective::Distance, false).plan else {
            continue;
        };
        let mut draw = Draw::new(seed);
        if !book_the_pad_twice(&mut plan, &mut world, &mut draw) {
            continue;
        }
        let fault = world.check(&plan).expect_err("the pad is booked twice");
        assert!(matches!(fault, FlightFault::PadTaken { .. }), "{fault}");
        assert!(
            fault.to_string().contains(": the pad is taken from "),
            "{fault}"
        );
        seen += 1;
    }
    assert!(seen > 0);
}

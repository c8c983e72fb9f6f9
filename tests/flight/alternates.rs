//! Where drones land that cannot go on, against brute force.

use crate::decisions::{STAY_S, setting};
use crate::events::Events;
use crate::world::{Kind, World, world};
use skyway::itinerary::{ItineraryScratch, Objective, find_alternate, find_near, find_nearest};
use skyway::network::NodeIx;
use skyway::verify::verify_flight;

/// All walks without a stop to a node with a pad that is free long enough: the least that is drawn.
struct Refuges<'a> {
    world: &'a World,
    events: Events<'a>,
    needs_pad: bool,
    least: Option<f64>,
}

impl Refuges<'_> {
    fn from(&mut self, at: NodeIx, at_s: f64, battery: f64, drawn: f64, is_start: bool) {
        if self.least.is_some_and(|least| drawn >= least) {
            return;
        }
        let lands_s = at_s + self.events.vertical_s(at);
        let stays_long = !self.needs_pad
            || self
                .events
                .gaps(at, lands_s)
                .iter()
                .any(|&until_s| until_s >= lands_s + STAY_S);
        if stays_long && !(is_start && self.lands_in_a_closed_one(at, at_s, lands_s)) {
            self.least = Some(drawn);
            return;
        }
        for arc in self.world.topology.arcs(at).to_vec() {
            let leg = (at, arc.to, arc.segment);
            let Some((time_s, energy)) = self.events.cost(leg, at_s) else {
                continue;
            };
            let forbidden = self
                .events
                .forbidden(leg, time_s, (is_start.then_some(false), false));
            let is_closed = self.world.closed_segments.contains(&arc.segment)
                || forbidden.iter().any(|span| span.0 < at_s && at_s < span.1);
            let battery = battery - energy;
            if !is_closed && battery >= self.world.reserve {
                self.from(arc.to, at_s + time_s, battery, drawn + energy, false);
            }
        }
    }

    fn lands_in_a_closed_one(&self, at: NodeIx, at_s: f64, lands_s: f64) -> bool {
        let rules = &self.world.rules;
        let closures = self.world.situation.closures.iter();
        closures.filter(|one| one.nodes.contains(&at)).any(|one| {
            let since_s = lands_s - self.world.began_s;
            let margin_s = match one.widened {
                true => rules.time_margin_s + rules.time_margin_growth * since_s,
                false => 0.0,
            };
            one.from_s - margin_s < lands_s && at_s < one.until_s + margin_s
        })
    }
}

#[test]
fn no_alternate_is_reached_with_more() {
    let (mut found, mut none) = (0, 0);
    for seed in 0..1_500 {
        let world = world(seed, Kind::Continuous);
        if world.starts.iter().any(|start| start.on_ground) {
            continue;
        }
        let setting = setting(&world);
        let mut scratch = ItineraryScratch::new(&world.topology);
        let request = world.request(Objective::Time);
        let ours = find_alternate(&setting, &request, STAY_S, &mut scratch).ok();
        let mut alternates = Refuges {
            world: &world,
            events: Events::new(&world, Objective::Energy, 0),
            needs_pad: true,
            least: None,
        };
        for start in &world.starts {
            alternates.from(start.node, start.at_s, start.battery, start.drawn, true);
        }
        let drawn = ours.as_ref().map(|alternate| alternate.answer.value.weight);
        let is_same = match (drawn, alternates.least) {
            (Some(ours), Some(theirs)) => (ours - theirs).abs() < 1e-9,
            (ours, theirs) => ours.is_none() && theirs.is_none(),
        };
        assert!(
            is_same,
            "seed {seed}: {ours:?}, and {:?}\n{world}",
            alternates.least
        );
        if let Some(alternate) = ours {
            let plan = alternate.answer.plan.expect("it leads there");
            let mut premises = world.premises();
            premises.destination = alternate.node;
            premises.deadline_s = f64::INFINITY;
            assert_eq!(verify_flight(&plan, &premises), Ok(()), "seed {seed}");
            found += 1;
        } else {
            none += 1;
        }
    }
    assert!(found > 100 && none > 20, "{found} found, {none} not");
}

#[test]
fn whoever_has_to_land_is_led_to_what_takes_least_whatever_its_battery() {
    let (mut found, mut none) = (0, 0);
    for seed in 0..1_500 {
        // Below empty, but not so far that brute force never ends.
        let world = World {
            reserve: -0.3,
            ..world(seed, Kind::Continuous)
        };
        if world.starts.iter().any(|start| start.on_ground) {
            continue;
        }
        let setting = setting(&world);
        let mut scratch = ItineraryScratch::new(&world.topology);
        let request = world.request(Objective::Time);
        let with_pad = find_alternate(&setting, &request, STAY_S, &mut scratch).ok();
        let any = find_nearest(&setting, &request, &mut scratch).ok();
        let near = find_near(&setting, &request, STAY_S, (9, true), &mut scratch);
        for (needs_pad, ours) in [(true, &with_pad), (false, &any)] {
            let mut alternates = Refuges {
                world: &world,
                events: Events::new(&world, Objective::Energy, 0),
                needs_pad,
                least: None,
            };
            for start in &world.starts {
                alternates.from(start.node, start.at_s, start.battery, start.drawn, true);
            }
            let drawn = ours.as_ref().map(|alternate| alternate.answer.value.weight);
            match (drawn, alternates.least) {
                (Some(ours), Some(theirs)) => assert!((ours - theirs).abs() < 1e-9, "{seed}"),
                (ours, theirs) => assert_eq!(ours.is_none(), theirs.is_none(), "{seed}\n{world}"),
            }
        }
        let nearest = any.as_ref().map(|nearest| nearest.answer.value.weight);
        if let Some(least) = nearest {
            let first = near.first().expect("the nearest of all");
            assert!(
                (first.flight.energy - least).abs() < 1e-6,
                "{seed}: {near:?}"
            );
        }
        let rising = near
            .windows(2)
            .all(|two| two[0].flight.energy <= two[1].flight.energy);
        assert!(rising, "{seed}: {near:?}");
        for one in &near {
            let mut premises = world.premises();
            premises.reserve = f64::NEG_INFINITY;
            premises.destination = one.node;
            premises.deadline_s = f64::INFINITY;
            assert_eq!(verify_flight(&one.flight, &premises), Ok(()), "seed {seed}");
        }
        found += usize::from(any.is_some());
        none += usize::from(any.is_none());
    }
    assert!(found > 300, "{found} found, {none} not");
}

#[test]
fn a_drone_that_stands_is_not_told_to_land_where_it_takes_off() {
    let (mut stays, mut flies) = (0, 0);
    for seed in 0..3_000 {
        let world = world(seed, Kind::Continuous);
        if world.starts.iter().any(|start| !start.on_ground) {
            continue;
        }
        let setting = setting(&world);
        let mut scratch = ItineraryScratch::new(&world.topology);
        let request = world.request(Objective::Time);
        let Ok(alternate) = find_alternate(&setting, &request, STAY_S, &mut scratch) else {
            continue;
        };
        let plan = alternate.answer.plan.expect("it leads there");
        let mut premises = world.premises();
        premises.destination = alternate.node;
        premises.deadline_s = f64::INFINITY;
        assert_eq!(verify_flight(&plan, &premises), Ok(()), "seed {seed}");
        match plan.legs.is_empty() {
            true => {
                let start = &plan.start;
                let ends = (plan.arrives_s, plan.battery_at_arrival);
                assert_eq!(ends, (start.at_s, start.battery), "seed {seed}\n{world}");
                stays += 1;
            }
            false => flies += 1,
        }
    }
    assert!(stays > 20 && flies > 20, "{stays} stay, {flies} fly");
}

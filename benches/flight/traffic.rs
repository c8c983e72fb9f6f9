//! Requests among the plans of others: deliveries composed one after another, each keeping off all
//! that came before.

use crate::percentiles::Percentiles;
use crate::workload::{PAYLOAD_KG, Random, SEED};
use skyway::delivery::DEFAULT_REFUGE_STAY_S;
use skyway::flight::{
    Airframe, FlightPlan, FlightRules, FlightStart, Reservation, Situation, TrafficLeg, Wind,
    WindField,
};
use skyway::itinerary::{
    Effort, FlightAnswer, FlightRequest, FlightSetting, ItineraryScratch, Limits, Objective,
    Potentials, find, find_alternate,
};
use skyway::network::{Components, NodeIx, SegmentIx, Topology};
use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Instant;

/// Every so many requests are asked by the other objectives and on the way, too.
const SAMPLED: usize = 10;
const DEADLINE_S: f64 = 2.5 * 3_600.0;

/// Searches of one kind: what each took.
#[derive(Default)]
struct Row {
    times_ns: Vec<f64>,
    efforts: Vec<Effort>,
    proved: usize,
    found: usize,
}

impl Row {
    fn add(&mut self, begun: Instant, effort: Effort, is_proved: bool, is_found: bool) {
        self.times_ns.push(begun.elapsed().as_nanos() as f64);
        self.efforts.push(effort);
        self.proved += usize::from(is_proved);
        self.found += usize::from(is_found);
    }

    fn print(self, name: &str) {
        let count = self.efforts.len();
        if count == 0 {
            return;
        }
        let ranked = |of: fn(&Effort) -> usize| {
            let mut sorted: Vec<usize> = self.efforts.iter().map(of).collect();
            sorted.sort_unstable();
            let rank = |share: f64| sorted[((count - 1) as f64 * share).round() as usize];
            format!("{} / {} / {}", rank(0.5), rank(0.99), rank(1.0))
        };
        let (labels, checks) = (
            ranked(|effort| effort.labels),
            ranked(|effort| effort.checks),
        );
        let total: usize = self.efforts.iter().map(|effort| effort.checks).sum();
        let times = Percentiles::taken(self.times_ns);
        println!(
            "| {name} | {count} | {:.1} / {:.1} / {:.1} | {labels} | {checks} | {total} | {} | {} |",
            times.at_us(0.5),
            times.at_us(0.99),
            times.at_us(1.0),
            self.found,
            self.proved,
        );
    }
}

/// A fleet that grows, and the requests that are asked in it.
struct Fleet {
    setting: FlightSetting,
    scratch: ItineraryScratch,
    tables: BTreeMap<(NodeIx, u8), Arc<Potentials>>,
    situation: Situation,
    is_bounded: bool,
}

impl Fleet {
    fn new(topology: &Arc<Topology>, is_bounded: bool) -> Self {
        let setting = FlightSetting::new(
            topology.clone(),
            Airframe::phantom3(),
            PAYLOAD_KG,
            WindField::uniform(Wind::coming_from(270.0, 5.0)),
            FlightRules::default(),
            &Situation::default(),
        );
        Self {
            setting,
            scratch: ItineraryScratch::new(topology),
            tables: BTreeMap::new(),
            situation: Situation::default(),
            is_bounded,
        }
    }

    fn limits(&self, objective: Objective) -> Limits<'static> {
        match self.is_bounded {
            true => Limits::of_request(objective, Limits::CHECKS_PER_S),
            false => Limits::THOROUGH,
        }
    }

    fn table(&mut self, destination: NodeIx, objective: Objective) -> Arc<Potentials> {
        let setting = &self.setting;
        let table = self.tables.entry((destination, objective as u8));
        let table = table.or_insert_with(|| Arc::new(setting.potentials(destination, objective)));
        table.clone()
    }

    fn ask(
        &mut self,
        row: &mut Row,
        start: FlightStart,
        (destination, objective): (NodeIx, Objective),
        closed_segments: &[SegmentIx],
    ) -> FlightAnswer {
        let table = self.table(destination, objective);
        let starts = [start];
        let request = FlightRequest {
            starts: &starts,
            destination,
            objective,
            began_s: start.at_s,
            deadline_s: start.at_s + DEADLINE_S,
            reserve: self.setting.rules().reserve,
            closed_segments,
            limits: self.limits(objective),
        };
        let begun = Instant::now();
        let answer = find(&self.setting.world(), &request, &table, &mut self.scratch);
        row.add(begun, answer.effort, answer.proved, answer.plan.is_some());
        answer
    }

    fn ask_for_alternate(&mut self, row: &mut Row, start: FlightStart) {
        let starts = [start];
        let request = FlightRequest {
            starts: &starts,
            destination: start.node,
            objective: Objective::Energy,
            began_s: start.at_s,
            deadline_s: start.at_s + DEADLINE_S,
            reserve: self.setting.rules().reserve,
            closed_segments: &[],
            limits: self.limits(Objective::Energy),
        };
        let begun = Instant::now();
        let stay_s = DEFAULT_REFUGE_STAY_S;
        let found = find_alternate(&self.setting, &request, stay_s, &mut self.scratch).ok();
        let effort = found.as_ref().map(|found| found.answer.effort);
        let is_proved = found.as_ref().is_none_or(|found| found.answer.proved);
        row.add(
            begun,
            effort.unwrap_or_default(),
            is_proved,
            found.is_some(),
        );
    }

    /// The next ones have to keep off a plan.
    fn keep(&mut self, plan: &FlightPlan) {
        let legs = plan.legs.iter().map(|leg| TrafficLeg {
            segment: leg.segment,
            from: leg.from,
            enters_s: leg.enters_s,
            leaves_s: leg.leaves_s,
        });
        self.situation.traffic.extend(legs);
        let stays = plan.stops.iter().map(|stop| Reservation {
            node: stop.node,
            pad: stop.pad,
            from_s: stop.lands_s,
            until_s: stop.takes_off_s,
        });
        self.situation.reservations.extend(stays);
        self.setting = self.setting.with_situation(&self.situation);
    }

    fn print(&self, name: &str, rows: [Row; 5]) {
        let legs = self.situation.traffic.len();
        let stays = self.situation.reservations.len();
        let bounds = if self.is_bounded {
            "bounded"
        } else {
            "thorough"
        };
        println!(
            "\n| in traffic, {bounds}: {name}, {legs} legs and {stays} stays at the end | searches | µs p50 / p99 / most | labels p50 / p99 / most | checks p50 / p99 / most | checks in all | found | proved |"
        );
        println!("|---|---:|---:|---:|---:|---:|---:|---:|");
        let names = [
            "distance",
            "time",
            "energy",
            "detour by distance",
            "alternate",
        ];
        for (row, name) in rows.into_iter().zip(names) {
            row.print(name);
        }
    }
}

/// Composes so many plans that depart within a time, one after another, and prints what the
/// searches took.
pub(crate) fn measure(
    name: &str,
    topology: &Arc<Topology>,
    (plans, within_s): (usize, f64),
    is_bounded: bool,
) {
    let mut random = Random::of(SEED);
    let connected: Vec<NodeIx> = Components::of(topology).largest().collect();
    let mut fleet = Fleet::new(topology, is_bounded);
    let mut rows: [Row; 5] = Default::default();
    for number in 0..plans {
        let [by_distance, by_time, by_energy, detours, alternates] = &mut rows;
        let (source, destination) = (random.pick(&connected), random.pick(&connected));
        let start = FlightStart {
            node: source,
            at_s: random.share() * within_s,
            battery: fleet.setting.airframe().full_charge,
            on_ground: true,
            pad: None,
            flown_m: 0.0,
            drawn: 0.0,
            stretch: None,
        };
        let is_sampled = number % SAMPLED == 0;
        if is_sampled {
            fleet.ask(by_time, start, (destination, Objective::Time), &[]);
            fleet.ask(by_energy, start, (destination, Objective::Energy), &[]);
        }
        let to = (destination, Objective::Distance);
        let Some(plan) = fleet.ask(by_distance, start, to, &[]).plan else {
            continue;
        };
        for leg in plan.legs.iter().filter(|_| is_sampled) {
            let at_leg = FlightStart {
                node: leg.from,
                at_s: leg.enters_s,
                battery: leg.battery_before,
                on_ground: false,
                pad: None,
                ..start
            };
            fleet.ask(detours, at_leg, to, &[leg.segment]);
            fleet.ask_for_alternate(alternates, at_leg);
        }
        fleet.keep(&plan);
    }
    fleet.print(
        &format!("{name}, {plans} requests within {within_s} s"),
        rows,
    );
}

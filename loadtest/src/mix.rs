//! Which request comes next: drawn by weight, written beforehand where that can be.

use crate::arrivals::Chance;
use crate::fleet::Fleet;
use crate::load::{Asked, Reading, Source, Standing};
use crate::measures::Seen;
use crate::requests::{self, Question};
use crate::scenario::{Dialect, Operation, Share};
use crate::transport::{Told, Wanted};
use skyway::wire::{DeliveryRequest, Id, Place, TelemetryEntry};
use std::cell::{Cell, RefCell};
use std::collections::VecDeque;

/// One answer of this many is read as a client would read it; of the others, that they are answers.
const READ_EVERY: u64 = 64;
/// Different batches that are written beforehand.
const BATCHES: usize = 100;
/// Readers ask for these many different things in turn.
const QUESTIONS: u64 = 5;

/// One kind of request.
struct Kind {
    share: Share,
    /// The weights up to here.
    until_weight: f64,
    /// What is written beforehand, asked in turn.
    written: Vec<Wanted>,
    turn: Cell<u64>,
}

/// All kinds of a scenario in one dialect.
pub(crate) struct Mix {
    dialect: Dialect,
    kinds: Vec<Kind>,
    fleet: Fleet,
    chance: RefCell<Chance>,
    number: Cell<u64>,
    /// Ids of this process: an edge that runs already may have those of an earlier one.
    process: u32,
    /// What was made and is to be removed later, oldest first.
    plans: RefCell<VecDeque<Standing>>,
    zones: RefCell<VecDeque<Standing>>,
    closures: RefCell<VecDeque<Standing>>,
}

impl Mix {
    pub(crate) fn new(dialect: Dialect, shares: &[Share], fleet: Fleet, seed: u64) -> Self {
        let mut until_weight = 0.0;
        let kind = |share: &Share| {
            until_weight += share.weight;
            Kind {
                until_weight,
                written: written(dialect, share, &fleet),
                share: share.clone(),
                turn: Cell::new(0),
            }
        };
        let kinds = shares.iter().map(kind).collect();
        Self {
            dialect,
            kinds,
            fleet,
            chance: RefCell::new(Chance::of(seed)),
            number: Cell::new(0),
            process: std::process::id(),
            plans: RefCell::default(),
            zones: RefCell::default(),
            closures: RefCell::default(),
        }
    }

    pub(crate) fn fleet(&self) -> &Fleet {
        &self.fleet
    }

    fn kind(&self) -> &Kind {
        let all = self.kinds.last().map_or(0.0, |kind| kind.until_weight);
        let at = self.chance.borrow_mut().unit() * all;
        let place = self.kinds.partition_point(|kind| kind.until_weight <= at);
        &self.kinds[place.min(self.kinds.len() - 1)]
    }

    fn below(&self, count: usize) -> usize {
        self.chance.borrow_mut().below(count)
    }

    fn next_id(&self, what: &str) -> String {
        self.number.set(self.number.get() + 1);
        format!("{what}-{}-{}", self.process, self.number.get())
    }

    fn recompose(&self, kind: &Kind) -> Asked {
        if kind.share.publish {
            if let Some(removal) = self.removal(&self.closures, kind.share.live, "lift_closure") {
                return removal;
            }
            let report = self
                .fleet
                .to_publish(self.below(self.fleet.plans.len()), self.below(1 << 16));
            return Asked {
                name: "publish",
                wanted: requests::failure(self.dialect, &report),
                reading: Reading::Publication,
            };
        }
        let is_read = kind.turn.get().is_multiple_of(READ_EVERY);
        let (name, reading) = match kind.share.batch {
            1 => ("recompose", Reading::Recomposition),
            _ => ("recompose_batch", Reading::Batch),
        };
        Asked {
            name,
            wanted: kind.next_written(),
            reading: if is_read { reading } else { Reading::Nothing },
        }
    }

    fn compose(&self, kind: &Kind) -> Asked {
        if let Some(removal) = self.removal(&self.plans, kind.share.live, "cancel_plan") {
            return removal;
        }
        let plan = self.next_id("composed");
        // Between the ends of a plan that is flown there is a way.
        let nodes = &self.fleet.plans[self.below(self.fleet.plans.len())].nodes;
        let request = DeliveryRequest {
            id: Some(plan.clone()),
            source: nodes[0].clone(),
            destination: Some(nodes[nodes.len() - 1].clone()),
            stops: None,
            start_time: None,
            payload_kg: None,
            drone_id: Some(plan.clone()),
            airspeed_mps: None,
            airframe: None,
            battery_fraction: None,
            objective: None,
            deadline: None,
            priority: None,
            delivery_id: None,
        };
        Asked {
            name: "compose",
            wanted: requests::delivery(self.dialect, &request),
            reading: Reading::Composed { plan },
        }
    }

    fn zone(&self, kind: &Kind) -> Asked {
        if let Some(removal) = self.removal(&self.zones, kind.share.live, "lift_zone") {
            return removal;
        }
        let zone = self.next_id("posted");
        let [west, south, east, north] = self.fleet.bounds;
        let (x, y) = {
            let mut chance = self.chance.borrow_mut();
            (chance.unit(), chance.unit())
        };
        let centre = [west + x * (east - west), south + y * (north - south)];
        Asked {
            name: "post_zone",
            wanted: requests::zone(&zone, centre),
            reading: Reading::Posted { zone },
        }
    }

    fn question_of_a_reader(&self, kind: &Kind) -> Asked {
        let turn = kind.next_turn();
        let nodes = &self.fleet.nodes;
        let place = self.below(nodes.len());
        let question = match turn % QUESTIONS {
            0 => Question::Node(&nodes[place]),
            1 => Question::Nearest(self.fleet.places[place]),
            2 if !self.fleet.plans.is_empty() => {
                Question::Plan(&self.fleet.plans[self.below(self.fleet.plans.len())].id)
            }
            3 => Question::Closures,
            _ => Question::Zones,
        };
        self.question("read", &question)
    }

    fn question(&self, name: &'static str, question: &Question<'_>) -> Asked {
        Asked {
            name,
            wanted: requests::question(self.dialect, question),
            reading: Reading::Nothing,
        }
    }

    /// Removes the oldest of what stands, where that is as much as is to stand.
    fn removal(
        &self,
        standing: &RefCell<VecDeque<Standing>>,
        most: usize,
        name: &'static str,
    ) -> Option<Asked> {
        let mut standing = standing.borrow_mut();
        if standing.len() < most {
            return None;
        }
        let oldest = standing.pop_front()?;
        Some(Asked {
            name,
            wanted: requests::removal(&oldest),
            reading: Reading::Removed(oldest),
        })
    }

    fn stands(&self, standing: Standing) {
        let list = match &standing {
            Standing::Plan(_) => &self.plans,
            Standing::Zone { .. } => &self.zones,
            Standing::Closure(_) => &self.closures,
        };
        let mut list = list.borrow_mut();
        // A closure that is reported again is renewed under its id.
        if !list.contains(&standing) {
            list.push_back(standing);
        }
    }
}

impl Source for Mix {
    fn next(&self) -> Asked {
        let kind = self.kind();
        match kind.share.operation {
            Operation::Recompose => self.recompose(kind),
            Operation::Compose => self.compose(kind),
            Operation::Zone => self.zone(kind),
            Operation::Read => self.question_of_a_reader(kind),
            Operation::History => self.question("history", &Question::History),
            Operation::Telemetry => Asked {
                name: "telemetry",
                wanted: kind.next_written(),
                reading: Reading::Nothing,
            },
        }
    }

    fn read(&self, asked: &Asked, told: &Told) -> Seen {
        match &asked.reading {
            Reading::Nothing | Reading::Removed(_) => Seen::default(),
            Reading::Recomposition => {
                let read = requests::recomposition(self.dialect, told);
                read.map_or_else(unreadable, |(seen, _)| Seen {
                    published: None,
                    ..seen
                })
            }
            Reading::Batch => requests::batch(self.dialect, told).unwrap_or_else(unreadable),
            Reading::Publication => {
                let Some((seen, closure)) = requests::recomposition(self.dialect, told) else {
                    return unreadable();
                };
                if let Some(closure) = closure {
                    self.stands(Standing::Closure(closure));
                }
                seen
            }
            Reading::Composed { plan } => {
                self.stands(Standing::Plan(plan.clone()));
                Seen::default()
            }
            Reading::Posted { zone } => {
                if let Some(etag) = told.etag.clone() {
                    let id = zone.clone();
                    self.stands(Standing::Zone { id, etag });
                }
                Seen::default()
            }
        }
    }

    fn had_no_success(&self, asked: Asked) {
        if let Reading::Removed(standing) = asked.reading {
            self.stands(standing);
        }
    }
}

/// An answer that cannot be read counts as one that leads nowhere.
fn unreadable() -> Seen {
    Seen {
        answers: 1,
        ..Seen::default()
    }
}

impl Kind {
    fn next_turn(&self) -> u64 {
        let turn = self.turn.get();
        self.turn.set(turn + 1);
        turn
    }

    fn next_written(&self) -> Wanted {
        let turn = self.next_turn() as usize;
        self.written[turn % self.written.len()].clone()
    }
}

/// The requests of a kind that are the same each time.
fn written(dialect: Dialect, share: &Share, fleet: &Fleet) -> Vec<Wanted> {
    match share.operation {
        Operation::Recompose if !share.publish && share.batch == 1 => {
            let reports = fleet.reports.iter();
            reports
                .map(|report| requests::failure(dialect, report))
                .collect()
        }
        Operation::Recompose if !share.publish => {
            let mut reports = fleet.reports.iter().cycle().cloned();
            let mut batch = || -> Vec<_> { reports.by_ref().take(share.batch).collect() };
            let batches = (0..BATCHES).map(|_| requests::failures(dialect, &batch()));
            batches.collect()
        }
        Operation::Telemetry => {
            let mut positions = positions(fleet);
            let mut batch = || -> Vec<_> { positions.by_ref().take(share.batch).collect() };
            let batches = (0..BATCHES).map(|_| requests::telemetry(dialect, batch()));
            batches.collect()
        }
        _ => Vec::new(),
    }
}

/// Drones somewhere on their plans, without end; each stays where it is, as a place that it cannot
/// have come to is refused.
fn positions(fleet: &Fleet) -> impl Iterator<Item = TelemetryEntry> {
    let plans = fleet.plans.iter().enumerate().cycle();
    plans.map(|(number, plan)| {
        let node: &Id<'static> = &plan.nodes[number % plan.nodes.len()];
        TelemetryEntry {
            drone_id: plan.drone.clone(),
            location: Place::Node(node.clone()),
            timestamp: None,
            altitude_m: None,
            altitude_reference: None,
            airborne: None,
            leg: None,
            fraction: None,
            battery_fraction: Some(0.8),
            ground_speed_mps: None,
            heading_deg: None,
        }
    })
}

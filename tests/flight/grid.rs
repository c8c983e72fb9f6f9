//! Brute force on a grid of times: everything a drone can do at every step, in the plainest way.
//!
//! A plan on the grid is a plan; so the search may be better, never worse. Where batteries are swapped only, the best plan is on the
//! grid, and the search has to find its value.

use crate::events::{Outcome, beats};
use crate::world::{GRID_S, World};
use skyway::flight::Vertical;
use skyway::itinerary::Objective;
use skyway::network::{NodeIx, SegmentIx};

/// A drone in the air, just arrived.
#[derive(Clone, Copy, Debug)]
struct Air {
    node: NodeIx,
    battery: f64,
    weight: f64,
    is_start: bool,
}

/// A drone on a pad.
#[derive(Clone, Copy, Debug)]
struct Parked {
    node: NodeIx,
    pad: u16,
    battery: f64,
    weight: f64,
    handling_s: f64,
    swaps: bool,
    is_start: bool,
    may_stay: bool,
}

pub(crate) struct Grid<'a> {
    world: &'a World,
    objective: Objective,
    vertical: Vertical,
    air: Vec<Vec<Air>>,
    parked: Vec<Vec<Parked>>,
    best: Option<Outcome>,
}

impl<'a> Grid<'a> {
    /// The best outcome on the grid.
    pub(crate) fn best(world: &'a World, objective: Objective) -> Option<Outcome> {
        let steps = ((world.deadline_s - world.began_s) / GRID_S) as usize + 1;
        let mut grid = Grid {
            world,
            objective,
            vertical: Vertical::of(&world.topology, 0.0),
            air: vec![Vec::new(); steps],
            parked: vec![Vec::new(); steps + 1],
            best: None,
        };
        grid.begin();
        for step in 0..steps {
            let mut parked = std::mem::take(&mut grid.parked[step]);
            for drone in std::mem::take(&mut grid.air[step]) {
                grid.in_the_air(drone, step, &mut parked);
            }
            for drone in parked {
                grid.on_a_pad(drone, step);
            }
        }
        grid.best
    }

    fn at_s(&self, step: usize) -> f64 {
        self.world.began_s + GRID_S * step as f64
    }

    fn begin(&mut self) {
        let start = self.world.starts[0];
        let weight = match self.objective {
            Objective::Distance => start.flown_m,
            Objective::Energy => start.drawn,
            Objective::Time => 0.0,
        };
        let air = Air {
            node: start.node,
            battery: start.battery,
            weight,
            is_start: true,
        };
        if !start.on_ground || start.node == self.world.destination {
            self.air[0].push(air);
            return;
        }
        let parked = Parked {
            node: start.node,
            pad: 0,
            battery: start.battery,
            weight,
            handling_s: 0.0,
            swaps: false,
            is_start: true,
            may_stay: false,
        };
        self.parked[0].push(parked);
        for pad in 0..self.world.topology.pads(start.node) {
            let swaps = self.world.situation.swap_stations.contains(&start.node);
            let parked = Parked {
                pad,
                may_stay: true,
                ..parked
            };
            // A battery that waits at a swap station neither charges nor is swapped by itself.
            let rate = if swaps { f64::NEG_INFINITY } else { 0.0 };
            self.parked[0].push(Parked {
                handling_s: rate,
                ..parked
            });
            if swaps {
                self.parked[0].push(Parked {
                    handling_s: self.world.rules.swap_s,
                    swaps,
                    is_start: false,
                    ..parked
                });
            }
        }
    }

    fn in_the_air(&mut self, drone: Air, step: usize, parked: &mut Vec<Parked>) {
        if drone.node == self.world.destination {
            let outcome = (drone.weight, self.at_s(step));
            if self.best.is_none_or(|best| beats(outcome, best)) {
                self.best = Some(outcome);
            }
            return;
        }
        self.fly(drone, step);
        let swaps = self.world.situation.swap_stations.contains(&drone.node);
        for pad in 0..self.world.topology.pads(drone.node) {
            parked.push(Parked {
                node: drone.node,
                pad,
                battery: drone.battery,
                weight: drone.weight,
                handling_s: match swaps {
                    true => self.world.rules.swap_s,
                    false => self.world.rules.stop_s,
                },
                swaps,
                is_start: false,
                may_stay: true,
            });
        }
    }

    fn fly(&mut self, drone: Air, step: usize) {
        let World {
            topology,
            airframe,
            wind,
            payload_kg,
            ..
        } = self.world;
        for arc in topology.arcs(drone.node) {
            let leg = (drone.node, arc.to, arc.segment);
            let cost = airframe.leg(topology, &self.vertical, wind, *payload_kg, leg, 0.0);
            let Ok(cost) = cost else {
                continue;
            };
            let enters_s = self.at_s(step);
            let battery = drone.battery - cost.energy;
            let is_closed = self.is_closed(leg, enters_s, cost.time_s, drone.is_start);
            if is_closed || battery < self.world.reserve - 1e-12 {
                continue;
            }
            let arrives = step + (cost.time_s / GRID_S).round() as usize;
            let weight = drone.weight
                + match self.objective {
                    Objective::Distance => arc.length_m,
                    Objective::Energy => cost.energy,
                    Objective::Time => 0.0,
                };
            let arrived = Air {
                node: arc.to,
                battery,
                weight,
                is_start: false,
            };
            if let Some(there) = self.air.get_mut(arrives) {
                let covers = |one: &Air, other: &Air| {
                    one.node == other.node
                        && one.battery >= other.battery
                        && one.weight <= other.weight
                        && one.is_start == other.is_start
                };
                if !there.iter().any(|other| covers(other, &arrived)) {
                    there.retain(|other| !covers(&arrived, other));
                    there.push(arrived);
                }
            }
        }
    }

    fn is_closed(
        &self,
        (from, to, segment): (NodeIx, NodeIx, SegmentIx),
        enters_s: f64,
        time_s: f64,
        leaves_start: bool,
    ) -> bool {
        let stands = self.world.starts[0].on_ground;
        let hits = |closure: &&skyway::flight::TimedClosure| {
            let lets_out = leaves_start && !(stands && closure.widened);
            closure.segments.contains(&segment)
                || closure.nodes.contains(&to)
                || (closure.nodes.contains(&from) && !lets_out)
        };
        let mut closures = self.world.situation.closures.iter().filter(hits);
        self.world.closed_segments.contains(&segment)
            || closures
                .any(|closure| enters_s + time_s > closure.from_s && enters_s < closure.until_s)
    }

    fn on_a_pad(&mut self, drone: Parked, step: usize) {
        if drone.handling_s <= 0.0 {
            let air = Air {
                node: drone.node,
                battery: drone.battery,
                weight: drone.weight,
                is_start: drone.is_start,
            };
            self.fly(air, step);
        }
        let (from_s, until_s) = (self.at_s(step), self.at_s(step + 1));
        let overlaps = |from: f64, until: f64| from < until_s && until > from_s;
        let situation = &self.world.situation;
        let is_reserved = situation.reservations.iter().any(|taken| {
            taken.node == drone.node
                && taken.pad == drone.pad
                && overlaps(taken.from_s, taken.until_s)
        });
        let is_closed = situation.closures.iter().any(|closure| {
            closure.pads.contains(&drone.node) && overlaps(closure.from_s, closure.until_s)
        });
        if is_reserved || is_closed || !drone.may_stay {
            return;
        }
        let mut stayed = drone;
        if drone.handling_s > 0.0 {
            stayed.handling_s -= GRID_S;
            if stayed.handling_s <= 0.0 && drone.swaps {
                stayed.battery = self.world.airframe.full_charge;
            }
        } else if drone.handling_s == 0.0 && !drone.swaps {
            let airframe = &self.world.airframe;
            let charged = 1.0 - (1.0 - drone.battery) * (-GRID_S / airframe.charge_tau_s).exp();
            stayed.battery = charged.min(airframe.full_charge).max(drone.battery);
        }
        let covers = |other: &Parked| {
            other.node == stayed.node
                && other.pad == stayed.pad
                && other.handling_s == stayed.handling_s
                && other.swaps == stayed.swaps
                && other.is_start == stayed.is_start
                && other.battery >= stayed.battery
                && other.weight <= stayed.weight
        };
        if !self.parked[step + 1].iter().any(covers) {
            self.parked[step + 1].push(stayed);
        }
    }
}

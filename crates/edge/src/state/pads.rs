//! Pads beyond the planned times: what a plan may still take, and what a drone takes that has
//! landed.
//!
//! A pad passes from the plan to the drone when that lands, and is free again when the drone is
//! known to have left: by its telemetry, by the departure of its next plan, or because an operator
//! says so.

use super::State;
use crate::planner::{Concern, stays};
use crate::plans::entry::{LandedOn, PlanEntry};
use jiff::Timestamp;
use skyway_contract::{AlarmKind, EndedAs};
use skyway_engine::itinerary::OccupiedPad;
use skyway_engine::network::NodeIx;
use std::sync::Arc;

/// How long a pad stays taken that is not known to be free, in seconds.
const FOR_LONG_S: f64 = 1e9;
/// Versions are counted from 1: the stay of a drone that has landed is of none.
const OF_NO_VERSION: u32 = 0;

impl State {
    /// The last pad that each version of a plan takes stays taken.
    pub(super) fn hold_pads(&mut self, plan: &PlanEntry) {
        for version in plan.versions() {
            let last = stays(&plan.id, version);
            let last = last.max_by(|left, right| left.1.until_s.total_cmp(&right.1.until_s));
            if let Some((node, stay)) = last {
                let stay = OccupiedPad {
                    until_s: stay.until_s + FOR_LONG_S,
                    ..stay
                };
                self.next.occupancy.put_stay(node, stay);
            }
        }
    }

    /// Alarms an operator about a plan that is overdue where no pad is free: its drone may stand in
    /// the way of the next one, or have had nowhere to land.
    pub(super) fn alarm_at_full_pads(&mut self, plan: &PlanEntry) {
        let counts_pads = self.planner.minds(Concern::Traffic, None);
        let Some(node) = plan.reported.last_node().filter(|_| counts_pads) else {
            return;
        };
        let now_s = unix_s(self.now);
        let pads = self.next.topology().pads(node);
        let is_taken = |pad: u16| {
            let mut there = self.next.traffic().stays_at(node).iter();
            there.any(|stay| stay.pad == pad && stay.from_s <= now_s && now_s < stay.until_s)
        };
        if pads == 0 || !(0..pads).all(is_taken) {
            return;
        }
        let message = format!(
            "plan '{}' is overdue at node '{}', where no pad is free: say what became of it, or clear a pad",
            plan.id,
            self.next.topology().node_id(node)
        );
        self.raise_plan_alarm(AlarmKind::Overdue, plan, message);
    }

    /// The pad on which the drone of a plan stands that has landed at a node: that of its plan
    /// where it has one there, else one that no drone stands on, and that the next one wants last.
    /// `None` where pads are not counted, and where there is none.
    pub(super) fn pad_landed_on(&self, plan: &PlanEntry, node: NodeIx) -> Option<LandedOn> {
        let is_counted = self.planner.minds(Concern::Traffic, Some(&plan.reported));
        plan.drone_id.as_ref().filter(|_| is_counted)?;
        let now_s = unix_s(self.now);
        let mut stays = plan.reported.reservations().into_iter();
        let own = stays.rfind(|stay| stay.node == node);
        let wanted_from = |pad: u16| {
            let others = self.next.traffic().stays_at(node).iter();
            let others = others
                .filter(|stay| stay.pad == pad && stay.until_s > now_s && stay.plan != plan.id);
            others.map(|stay| stay.from_s).fold(f64::INFINITY, f64::min)
        };
        let is_stood_on = |pad: &u16| {
            let mut there = self.next.traffic().stays_at(node).iter();
            there.any(|stay| stay.version == OF_NO_VERSION && stay.pad == *pad)
        };
        let pads = 0..self.next.topology().pads(node);
        let free = pads.filter(|pad| !is_stood_on(pad));
        let rank = |pad: u16| (own.is_some_and(|own| own.pad == pad), wanted_from(pad));
        let best = free.rev().max_by(|&one, &other| {
            let (one, other) = (rank(one), rank(other));
            one.0.cmp(&other.0).then(one.1.total_cmp(&other.1))
        })?;
        Some(LandedOn {
            node,
            pad: best,
            since: self.now,
        })
    }

    /// What an ended plan still takes is taken again: after a restart, or on another network.
    pub(super) fn hold_again(&mut self, plan: &PlanEntry) {
        if plan.landed_on.is_some() {
            self.take_landed(plan);
        } else if plan.holds {
            if plan.ended_as != Some(EndedAs::Lost) {
                for version in plan.versions() {
                    self.occupy(&plan.id, version);
                }
            }
            self.hold_pads(plan);
        }
    }

    /// Takes the pad that the drone of an ended plan stands on.
    pub(super) fn take_landed(&mut self, plan: &PlanEntry) {
        let (Some(landed), Some(drone)) = (plan.landed_on, &plan.drone_id) else {
            return;
        };
        self.next.landed.insert(drone.clone(), plan.id.clone());
        let from_s = unix_s(landed.since);
        let stay = OccupiedPad {
            plan: plan.id.clone(),
            version: OF_NO_VERSION,
            number: 0,
            pad: landed.pad,
            from_s,
            until_s: from_s + FOR_LONG_S,
        };
        self.next.occupancy.put_stay(landed.node, stay);
    }

    /// The pad of an ended plan's drone is free, if it has one.
    pub(super) fn leave_landed(&mut self, plan: &PlanEntry) {
        let (Some(landed), Some(drone)) = (plan.landed_on, &plan.drone_id) else {
            return;
        };
        let occupancy = &mut self.next.occupancy;
        occupancy.remove_stay(landed.node, &plan.id, OF_NO_VERSION, 0);
        if self.next.landed.get(drone) == Some(&plan.id) {
            self.next.landed.remove(drone);
        }
    }

    /// A drone has left the pad on which it stood since it landed.
    pub(super) fn leave_pad(&mut self, drone: &str) {
        let landed = self.next.landed.get(drone).cloned();
        let Some(plan) = landed.and_then(|id| self.next.plans.get(&id).cloned()) else {
            return;
        };
        self.leave_landed(&plan);
        self.keep_plan(PlanEntry {
            landed_on: None,
            holds: false,
            ..(*plan).clone()
        });
        self.forget_later(&plan.id);
    }

    /// A drone that begins another plan is not in the air on one that was cancelled. The pad on
    /// which it stands is its own until that departs, and one that was lost is found by who says
    /// so.
    pub(super) fn free_air_held_by(&mut self, drone: &str) {
        let is_held = |plan: &&Arc<PlanEntry>| {
            let is_own = plan.drone_id.as_deref() == Some(drone);
            plan.holds && is_own && plan.ended_as == Some(EndedAs::Cancelled)
        };
        let plans = self.next.plans.values();
        let held: Vec<Arc<PlanEntry>> = plans.filter(is_held).cloned().collect();
        for plan in held {
            self.amend_end(&plan, EndedAs::Cancelled, None);
        }
    }
}

fn unix_s(instant: Timestamp) -> f64 {
    instant.as_microsecond() as f64 / 1e6
}

//! The air of a drone that has not said which version it flies: cut off from its edge it flies what
//! it reported, and where its own senses close a leg, the contingency of that leg. Until it is
//! heard of both are taken.

use super::State;
use crate::drones::progress;
use crate::planner::{Version, occupied};
use crate::plans::entry::PlanEntry;
use skyway_engine::compose::{Leg, Occupation};
use skyway_engine::itinerary::OccupiedLeg;
use skyway_engine::network::{NodeIx, Topology};
use std::sync::Arc;

/// The number of no version: marks what is taken for contingencies among what versions take.
const OF_NO_VERSION: u32 = u32::MAX;

impl State {
    /// Takes the contingencies of the legs that the drone of a plan may be on while it is
    /// unacknowledged or silent, and lets them go once it is not.
    pub(super) fn guard(&mut self, plan: &PlanEntry) {
        let is_due = plan.is_active() && (plan.flags.unacknowledged || plan.flags.silent);
        if !is_due {
            self.guard_no_more(&plan.id);
            return;
        }
        if self.guarded.contains_key(&plan.id) {
            return;
        }
        let topology = self.next.topology().clone();
        let progress = progress::progress(&topology, plan, &self.drones, self.now);
        let from_leg = progress.map_or(0, |progress| progress.leg);
        let taken = contingent(&topology, &plan.reported, from_leg, plan.airspeed_mps);
        let mut segments = Vec::with_capacity(taken.len());
        for (number, leg) in taken.into_iter().enumerate() {
            let leg = Occupation { leg: number, ..leg };
            let taken = OccupiedLeg {
                // Of what it would do only the first and the last instant are known.
                is_uncertain: true,
                ..occupied(&leg, plan.id.clone().into(), OF_NO_VERSION)
            };
            self.next.occupancy.put_leg(leg.segment, taken);
            segments.push(leg.segment);
        }
        self.guarded.insert(plan.id.clone(), segments);
    }

    /// Lets go what is taken for the contingencies of a plan.
    pub(super) fn guard_no_more(&mut self, plan: &Arc<str>) {
        let taken = self.guarded.remove(plan);
        for (number, segment) in (0..).zip(taken.into_iter().flatten()) {
            let occupancy = &mut self.next.occupancy;
            occupancy.remove_leg(segment, plan, OF_NO_VERSION, number);
        }
    }
}

/// When a drone may be on the segments of the contingencies of a version's legs from one on.
fn contingent(
    topology: &Topology,
    version: &Version,
    from_leg: usize,
    airspeed_mps: f64,
) -> Vec<Occupation> {
    let departs_s = version.departs_at.as_microsecond() as f64 / 1e6;
    let legs = version.composition.legs.iter().enumerate();
    let ahead = legs.filter(|(number, _)| *number >= from_leg);
    let taken = ahead.flat_map(|(number, leg)| {
        let safe = leg.safe.as_ref().map(|safe| safe.nodes.as_slice());
        let detour = leg.if_closed.as_ref().map(|detour| detour.nodes.as_slice());
        let ways = [detour.unwrap_or_default(), safe.unwrap_or_default()];
        let begun = Begun::of(leg, departs_s);
        let back = Occupation {
            segment: leg.segment,
            from: leg.to,
            leg: number,
            enters_s: begun.first_s,
            leaves_s: begun.last_s,
        };
        let on_ways = ways
            .into_iter()
            .flat_map(move |way| flown(topology, way, (number, begun), airspeed_mps));
        let on_ways: Vec<Occupation> = on_ways.collect();
        std::iter::once(back).chain(on_ways)
    });
    taken.collect()
}

/// When a drone may be back at the start of a leg that it finds closed: at once, or after it has
/// turned at its end.
#[derive(Clone, Copy)]
struct Begun {
    first_s: f64,
    last_s: f64,
}

impl Begun {
    fn of(leg: &Leg, departs_s: f64) -> Self {
        let time_s = leg.arrival_s - leg.departure_s;
        Self {
            first_s: departs_s + leg.departure_s,
            last_s: departs_s + leg.arrival_s + time_s,
        }
    }
}

fn flown(
    topology: &Topology,
    way: &[NodeIx],
    (leg, begun): (usize, Begun),
    airspeed_mps: f64,
) -> Vec<Occupation> {
    let mut flown_s = 0.0;
    let mut taken = Vec::new();
    for ends in way.windows(2) {
        let (from, to) = (ends[0], ends[1]);
        let Some(segment) = topology.segment_between(from, to) else {
            return taken;
        };
        let time_s = topology.segment(segment).length_m / airspeed_mps.max(0.1);
        taken.push(Occupation {
            segment,
            from,
            leg,
            enters_s: begun.first_s + flown_s,
            leaves_s: begun.last_s + flown_s + time_s,
        });
        flown_s += time_s;
    }
    taken
}

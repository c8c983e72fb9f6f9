//! What follows a label at a node with pads: stops.

use super::charging_label::ChargingLabel;
use super::expander::{Expander, SearchBuffers};
use super::label::How;
use crate::network::NodeIx;

impl Expander<'_> {
    /// The real families after a stop, added to the offers: one for the earliest landing, and one for every later
    /// instant at which a longer stay becomes possible.
    pub(super) fn stop(&self, family: &ChargingLabel, node: NodeIx, room: &mut SearchBuffers<'_>) {
        let pads = self.world.pads;
        let descent_s = self.world.legs.vertical_s(node);
        let lands_s = family.lo_s + descent_s;
        let stays_until_s = pads.stay_until_s(node, lands_s);
        self.stay(family, node, lands_s, stays_until_s, room);
        for (rises_s, until_s) in pads.rises(node) {
            if rises_s > lands_s && rises_s <= family.hi_s + descent_s {
                self.stay(family, node, rises_s, until_s, room);
            }
        }
    }

    fn stay(
        &self,
        family: &ChargingLabel,
        node: NodeIx,
        lands_s: f64,
        stays_until_s: f64,
        room: &mut SearchBuffers<'_>,
    ) {
        let vertical_s = self.world.legs.vertical_s(node);
        let arrived_s = lands_s - vertical_s;
        let climb = self.world.legs.climb_energy(node);
        let weight = family.weight + self.energy_weight(climb);
        let until_s = (stays_until_s + vertical_s).min(self.latest_s(node));
        let swaps = self.world.pads.swaps(node);
        let ready_s = lands_s + self.handling_s(node) + vertical_s;
        if ready_s > until_s {
            return;
        }
        let charging = self.world.charging;
        let departing = match swaps {
            true => ChargingLabel::waiting(weight, charging.full - climb, ready_s, until_s),
            false => {
                let level = family.battery(arrived_s, self.tau_s);
                ChargingLabel::charging(weight, level, ready_s, until_s, climb, charging)
            }
        };
        room.offers.push((departing, How::Stop { arrived_s }));
    }

    /// The relaxed family after a stop: the earliest landing that leaves time for a stop, and no end of the stay.
    pub(super) fn stop_relaxed(
        &self,
        family: &ChargingLabel,
        node: NodeIx,
        room: &mut SearchBuffers<'_>,
    ) {
        let pads = self.world.pads;
        let lands_s = family.lo_s + self.world.legs.vertical_s(node);
        let handling_s = self.handling_s(node);
        let suffices = |lands_s: f64, until_s: f64| until_s >= lands_s + handling_s;
        let at_once = suffices(lands_s, pads.stay_until_s(node, lands_s)).then_some(lands_s);
        let lands_s = at_once.or_else(|| {
            let mut later = pads.rises(node).filter(|&(at_s, _)| at_s > lands_s);
            later
                .find(|&(at_s, until_s)| suffices(at_s, until_s))
                .map(|(at_s, _)| at_s)
        });
        if let Some(lands_s) = lands_s {
            self.stay(family, node, lands_s, f64::INFINITY, room);
        }
    }
}

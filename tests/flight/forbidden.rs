//! When a leg may not be entered, straight from what is stated.

use crate::events::Events;
use skyway::flight::TrafficLeg;
use skyway::network::{NodeIx, SegmentIx};

impl Events<'_> {
    /// Open intervals of entry times, straight from what is stated.
    pub(crate) fn forbidden(
        &self,
        (from, to, segment): (NodeIx, NodeIx, SegmentIx),
        time_s: f64,
        (leaves_start, takes_off): (Option<bool>, bool),
    ) -> Vec<(f64, f64)> {
        let rules = &self.world.rules;
        let (before_s, after_s) = (self.vertical_s(from), time_s + self.vertical_s(to));
        let mut intervals = Vec::new();
        for closure in &self.world.situation.closures {
            let hits = closure.segments.contains(&segment)
                || closure.nodes.contains(&to)
                || (closure.nodes.contains(&from)
                    && leaves_start.is_none_or(|on_ground| on_ground && closure.widened));
            if !hits {
                continue;
            }
            let growth = if closure.widened {
                rules.time_margin_growth
            } else {
                0.0
            };
            let margin_s = if closure.widened {
                rules.time_margin_s
            } else {
                0.0
            };
            let began_s = self.world.began_s;
            let first_s = (closure.from_s - margin_s + growth * began_s) / (1.0 + growth) - after_s;
            let last_s = (closure.until_s + margin_s + before_s + growth * (after_s - began_s))
                / (1.0 - growth);
            intervals.push((first_s, last_s));
        }
        if rules.headway_s > 0.0 {
            for other in &self.world.situation.traffic {
                self.too_near(
                    other,
                    (from, to, segment),
                    (time_s, takes_off),
                    &mut intervals,
                );
            }
        }
        intervals
    }

    /// When a leg of another plan forbids an entry.
    fn too_near(
        &self,
        other: &TrafficLeg,
        (from, to, segment): (NodeIx, NodeIx, SegmentIx),
        (time_s, takes_off): (f64, bool),
        intervals: &mut Vec<(f64, f64)>,
    ) {
        let rules = &self.world.rules;
        if other.segment == segment {
            let apart_s = rules.headway_s + 1e-3;
            intervals.push(match other.from == from {
                true => (other.enters_s - apart_s, other.enters_s + apart_s),
                false => (other.enters_s - time_s, other.leaves_s),
            });
        }
        let ends = self.world.topology.segment(other.segment);
        let other_to = if other.from == ends.from {
            ends.to
        } else {
            ends.from
        };
        let apart_s = rules.node_headway_s;
        for (node, passes_s) in [(other.from, other.enters_s), (other_to, other.leaves_s)] {
            if apart_s > 0.0 && node == to {
                intervals.push((passes_s - apart_s - time_s, passes_s + apart_s - time_s));
            }
            if apart_s > 0.0 && node == from && takes_off {
                intervals.push((passes_s - apart_s, passes_s + apart_s));
            }
        }
        for crossing in self.crossings.on(segment) {
            if crossing.other != other.segment {
                continue;
            }
            let is_ahead = self.world.topology.segment(segment).from == from;
            let own = if is_ahead {
                crossing.own
            } else {
                crossing.own.reversed()
            };
            let is_ahead = ends.from == other.from;
            let near = if is_ahead {
                crossing.others
            } else {
                crossing.others.reversed()
            };
            let other_s = other.leaves_s - other.enters_s;
            // Both are there when each comes before the other leaves.
            let first_s = other.enters_s + near.enters * other_s - own.leaves * time_s;
            let last_s = other.enters_s + near.leaves * other_s - own.enters * time_s;
            // Who is near it at the end of a leg is there a while longer.
            let apart_s = if crossing.is_at_node { apart_s } else { 0.0 };
            intervals.push((first_s - apart_s, last_s + apart_s));
        }
    }
}

//! Conflicts: two plans on one segment at nearly the same time.
//!
//! In opposite directions two plans conflict when both are on the segment at some moment: one may enter when
//! the other leaves. In the same direction they conflict when they enter it within the headway of each
//! other, the headway itself included. As far as times are known: they are nominal.

use crate::network::{NodeIx, SegmentIx};
use rustc_hash::FxHashMap;

/// Stays on a segment that overlap by less, in seconds, are one behind the other: instants are rounded.
const OVERLAP_S: f64 = 1e-3;

/// When a plan is on one of its segments. Times are seconds on one clock that all plans share.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Occupation {
    /// The segment.
    pub segment: SegmentIx,
    /// The node it is entered from.
    pub from: NodeIx,
    /// The leg of the plan, counted from 0.
    pub leg: usize,
    /// When the leg starts.
    pub enters_s: f64,
    /// When it ends.
    pub leaves_s: f64,
}

/// How two plans on one segment fly.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Direction {
    /// Towards each other.
    Opposite,
    /// One behind the other.
    Same,
}

impl Direction {
    /// The name on the wire.
    pub fn name(self) -> &'static str {
        match self {
            Self::Opposite => "opposite",
            Self::Same => "same",
        }
    }
}

/// A leg of one plan that comes too near to a leg of another.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Conflict {
    /// The leg of the plan asked about, counted from 0.
    pub leg: usize,
    /// The leg of the other plan, counted from 0.
    pub other_leg: usize,
    /// The segment of both.
    pub segment: SegmentIx,
    /// How they fly it.
    pub direction: Direction,
    /// Seconds between their entries in the same direction; 0 in opposite ones, where both are on it at once.
    pub gap_s: f64,
}

/// The conflicts between two plans, by leg of the first and then of the other.
///
/// `headway_s` is what plans keep between their entries in the same direction, in seconds. Costs the legs of
/// both and the pairs on one segment.
pub fn conflicts(own: &[Occupation], other: &[Occupation], headway_s: f64) -> Vec<Conflict> {
    let mut by_segment: FxHashMap<SegmentIx, Vec<&Occupation>> = FxHashMap::default();
    for occupation in other {
        let there = by_segment.entry(occupation.segment).or_default();
        there.push(occupation);
    }
    let pairs = own.iter().flat_map(|one| {
        let there = by_segment.get(&one.segment).into_iter().flatten();
        there.map(move |other| (one, *other))
    });
    let mut found: Vec<Conflict> = pairs
        .filter_map(|(one, other)| conflict(one, other, headway_s))
        .collect();
    found.sort_by_key(|conflict| (conflict.leg, conflict.other_leg));
    found
}

/// The conflict of two occupations of one segment, if they are too near.
fn conflict(own: &Occupation, other: &Occupation, headway_s: f64) -> Option<Conflict> {
    let direction = match own.from == other.from {
        true => Direction::Same,
        false => Direction::Opposite,
    };
    let (is_too_near, gap_s) = match direction {
        Direction::Same => {
            let between_entries_s = (own.enters_s - other.enters_s).abs();
            (between_entries_s <= headway_s, between_entries_s)
        }
        Direction::Opposite => {
            let overlap = own.enters_s + OVERLAP_S < other.leaves_s
                && other.enters_s + OVERLAP_S < own.leaves_s;
            (overlap, 0.0)
        }
    };
    is_too_near.then_some(Conflict {
        leg: own.leg,
        other_leg: other.leg,
        segment: own.segment,
        direction,
        gap_s,
    })
}

//! Repairs to foreign data, each of them listed: what other tools tolerate and a skyway does not.

use super::draft::{Coordinates, NetworkDraft};
use crate::geo::{LocalPlane, Point};
use rustc_hash::FxHashMap;
use std::fmt;

/// Nodes of a zero-length segment closer than this, in metres, are one place: file coordinates are rounded.
const COINCIDENT_M: f64 = 0.5;

/// One repair.
#[derive(Clone, Debug, PartialEq)]
pub enum Repair {
    /// Of parallel segments the shortest was kept.
    Parallel {
        /// One node.
        from: String,
        /// The other.
        to: String,
        /// Length of the one that was dropped, in metres, where stated.
        dropped_m: Option<f64>,
    },
    /// Coincident nodes joined by a segment of length zero became one; the other id leads to it.
    Merged {
        /// The node kept.
        kept: String,
        /// The node merged into it.
        merged: String,
    },
}

impl fmt::Display for Repair {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Parallel {
                from,
                to,
                dropped_m,
            } => {
                write!(
                    formatter,
                    "kept the shortest of parallel segments '{from}' - '{to}'"
                )?;
                match dropped_m {
                    Some(length_m) => write!(formatter, ", dropped one of {length_m} m"),
                    None => Ok(()),
                }
            }
            Self::Merged { kept, merged } => write!(
                formatter,
                "merged node '{merged}' into '{kept}': a segment of length 0 joins them in one place"
            ),
        }
    }
}

impl NetworkDraft {
    /// Merges coincident nodes joined by a zero-length segment, then keeps the shortest of parallel segments.
    ///
    /// What else is wrong is left for [`Topology::build`](super::Topology::build) to refuse.
    pub fn repair(&mut self) -> Vec<Repair> {
        let mut repairs = Vec::new();
        self.merge_coincident(&mut repairs);
        self.drop_parallel(&mut repairs);
        repairs
    }

    fn merge_coincident(&mut self, repairs: &mut Vec<Repair>) {
        let zero_length: Vec<(String, String)> = self
            .segments
            .iter()
            .filter(|segment| segment.length_m == Some(0.0) && segment.from != segment.to)
            .map(|segment| (segment.from.clone(), segment.to.clone()))
            .collect();
        for (from, to) in zero_length {
            let (kept, merged) = (
                self.survivor(&from).to_owned(),
                self.survivor(&to).to_owned(),
            );
            if kept == merged || !self.coincide(&kept, &merged) {
                continue;
            }
            self.nodes.retain(|node| node.id != merged);
            for segment in &mut self.segments {
                for end in [&mut segment.from, &mut segment.to] {
                    if *end == merged {
                        kept.clone_into(end);
                    }
                }
            }
            // Between the two there is nothing to fly any more.
            self.segments
                .retain(|segment| !(segment.from == kept && segment.to == kept));
            self.aliases.push((merged.clone(), kept.clone()));
            repairs.push(Repair::Merged { kept, merged });
        }
    }

    /// The id that an id goes by after the merges so far.
    fn survivor<'a>(&'a self, id: &'a str) -> &'a str {
        let mut id = id;
        while let Some((_, kept)) = self.aliases.iter().find(|(merged, _)| merged == id) {
            id = kept;
        }
        id
    }

    fn coincide(&self, one: &str, other: &str) -> bool {
        let position = |id: &str| {
            let node = self.nodes.iter().find(|node| node.id == id);
            node.map(|node| node.position)
        };
        match position(one).zip(position(other)) {
            Some((one, other)) => self.straight_line_m(one, other) <= COINCIDENT_M,
            None => false,
        }
    }

    fn straight_line_m(&self, one: [f64; 2], other: [f64; 2]) -> f64 {
        match self.coordinates {
            Coordinates::Planar => {
                Point::new(one[0], one[1]).distance_m(Point::new(other[0], other[1]))
            }
            Coordinates::Geographic => {
                let plane = LocalPlane::about(one[0], one[1]);
                let at_origin = plane.project(one[0], one[1]);
                at_origin.distance_m(plane.project(other[0], other[1]))
            }
        }
    }

    fn drop_parallel(&mut self, repairs: &mut Vec<Repair>) {
        let position_of: FxHashMap<&str, [f64; 2]> = self
            .nodes
            .iter()
            .map(|node| (node.id.as_str(), node.position))
            .collect();
        let lengths_m: Vec<Option<f64>> = self
            .segments
            .iter()
            .map(|segment| {
                let from = *position_of.get(segment.from.as_str())?;
                let to = *position_of.get(segment.to.as_str())?;
                let straight_m = || self.straight_line_m(from, to);
                Some(segment.length_m.unwrap_or_else(straight_m))
            })
            .collect();
        let mut shortest: FxHashMap<(String, String), usize> = FxHashMap::default();
        let mut dropped = vec![false; self.segments.len()];
        for (index, segment) in self.segments.iter().enumerate() {
            if segment.from == segment.to || lengths_m[index].is_none() {
                continue;
            }
            let mut ends = [segment.from.clone(), segment.to.clone()];
            ends.sort();
            let [first, second] = ends;
            let kept = shortest.entry((first, second)).or_insert(index);
            if *kept == index {
                continue;
            }
            let worse = match lengths_m[index] < lengths_m[*kept] {
                true => std::mem::replace(kept, index),
                false => index,
            };
            dropped[worse] = true;
            repairs.push(Repair::Parallel {
                from: segment.from.clone(),
                to: segment.to.clone(),
                dropped_m: self.segments[worse].length_m,
            });
        }
        let mut is_dropped = dropped.into_iter();
        self.segments
            .retain(|_| !is_dropped.next().unwrap_or(false));
    }
}

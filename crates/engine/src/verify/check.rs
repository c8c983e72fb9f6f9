//! The conditions of the proof, each a comparison that a reader can redo with pencil and paper.

use super::claim::Claim;
use super::facts::NetworkFacts;
use super::fault::{CertificateFault, Step};

/// Share of `max(1 m, D)` that every comparison allows, for what rounding does to sums.
const RELATIVE_TOLERANCE: f64 = 1e-9;

/// Checks every condition; the first that does not hold is the fault.
pub(super) fn check(claim: &Claim, network: &NetworkFacts) -> Result<(), CertificateFault> {
    let check = Check::new(claim, network);
    check.starts()?;
    check.bounds()?;
    match claim.length_m {
        Some(length_m) => {
            check.labels()?;
            check.nothing_is_shorter(length_m)?;
            check.path(length_m)
        }
        None => {
            check.labels()?;
            check.nothing_gets_through()
        }
    }
}

/// A direction of a segment that the certificate's closures leave open.
#[derive(Clone, Copy)]
struct Flight {
    segment: usize,
    from: usize,
    to: usize,
    length_m: f64,
}

struct Check<'a> {
    claim: &'a Claim,
    network: &'a NetworkFacts,
    /// By node.
    is_start: Vec<bool>,
    tolerance_m: f64,
}

impl<'a> Check<'a> {
    fn new(claim: &'a Claim, network: &'a NetworkFacts) -> Self {
        let mut is_start = vec![false; network.node_ids.len()];
        for &(node, _) in &claim.starts {
            is_start[node] = true;
        }
        // Without a way no number bears on the proof: the largest one says what rounding does to them.
        let magnitude_m = claim.length_m.unwrap_or_else(|| {
            let numbers = claim.label_m.iter().chain(&claim.bound_m);
            numbers.copied().flatten().fold(0.0, f64::max)
        });
        Self {
            claim,
            network,
            is_start,
            tolerance_m: RELATIVE_TOLERANCE * magnitude_m.max(1.0),
        }
    }

    fn id(&self, node: usize) -> String {
        self.network.node_ids[node].clone()
    }

    fn step(&self, segment: usize, from: usize, to: usize) -> Step {
        Step {
            segment: self.network.segments[segment].id.clone(),
            from: self.id(from),
            to: self.id(to),
        }
    }

    fn step_of(&self, flight: Flight) -> Step {
        self.step(flight.segment, flight.from, flight.to)
    }

    /// A closed node is never entered; it is left by the drone that starts there.
    fn is_open(&self, segment: usize, from: usize, to: usize) -> bool {
        let may_leave = !self.claim.closes_node[from] || self.is_start[from];
        let may_enter = !self.claim.closes_node[to];
        may_leave && may_enter && !self.claim.closes_segment[segment]
    }

    fn open_flights(&self) -> impl Iterator<Item = Flight> + '_ {
        let segments = self.network.segments.iter().enumerate();
        let flights = segments.flat_map(|(segment, facts)| {
            let [one, other] = facts.ends;
            [(one, other), (other, one)].map(|(from, to)| Flight {
                segment,
                from,
                to,
                length_m: facts.length_m,
            })
        });
        flights.filter(|flight| self.is_open(flight.segment, flight.from, flight.to))
    }

    /// There is a start, and no first stretch is negative.
    fn starts(&self) -> Result<(), CertificateFault> {
        if self.claim.starts.is_empty() {
            return Err(CertificateFault::NoStart);
        }
        for &(node, offset_m) in &self.claim.starts {
            if offset_m < 0.0 {
                let node = self.id(node);
                return Err(CertificateFault::NegativeOffset { node, offset_m });
            }
        }
        Ok(())
    }

    /// `h` is 0 at the destination, nowhere negative, and no open segment is shorter than its ends' difference.
    fn bounds(&self) -> Result<(), CertificateFault> {
        let bound_m = &self.claim.bound_m;
        for (node, &bound_m) in bound_m.iter().enumerate() {
            if let Some(h_m) = bound_m.filter(|&h_m| h_m < 0.0) {
                let node = self.id(node);
                return Err(CertificateFault::NegativeBound { node, h_m });
            }
        }
        let at_destination_m = bound_m[self.claim.destination];
        if at_destination_m != Some(0.0) {
            return Err(CertificateFault::DestinationBound {
                node: self.id(self.claim.destination),
                h_m: at_destination_m,
            });
        }
        for flight in self.open_flights() {
            let (from_m, to_m) = match (bound_m[flight.from], bound_m[flight.to]) {
                (Some(from_m), Some(to_m)) => (from_m, to_m),
                (None, None) => continue,
                _ => {
                    let step = self.step_of(flight);
                    return Err(CertificateFault::HalfReachable { step });
                }
            };
            let difference_m = (from_m - to_m).abs();
            if difference_m > flight.length_m + self.tolerance_m {
                return Err(CertificateFault::BoundsDiffer {
                    step: self.step_of(flight),
                    difference_m,
                    length_m: flight.length_m,
                });
            }
        }
        Ok(())
    }

    /// `d` is no more than the first stretch at a start, nor than the way over another settled node.
    fn labels(&self) -> Result<(), CertificateFault> {
        for &(node, offset_m) in &self.claim.starts {
            let too_far = |&d_m: &f64| d_m > offset_m + self.tolerance_m;
            if let Some(d_m) = self.claim.label_m[node].filter(too_far) {
                let node = self.id(node);
                return Err(CertificateFault::StartLabel {
                    node,
                    d_m,
                    offset_m,
                });
            }
        }
        for flight in self.open_flights() {
            let ends_m = (
                self.claim.label_m[flight.from],
                self.claim.label_m[flight.to],
            );
            let (Some(from_m), Some(d_m)) = ends_m else {
                continue;
            };
            let through_m = from_m + flight.length_m;
            if d_m > through_m + self.tolerance_m {
                return Err(CertificateFault::Label {
                    step: self.step_of(flight),
                    through_m,
                    d_m,
                });
            }
        }
        Ok(())
    }

    /// No way from a start, and none that leaves the settled nodes, can be shorter than the length claimed.
    fn nothing_is_shorter(&self, length_m: f64) -> Result<(), CertificateFault> {
        let is_below = |value_m: f64| value_m < length_m - self.tolerance_m;
        let Claim {
            label_m, bound_m, ..
        } = self.claim;
        for &(node, offset_m) in &self.claim.starts {
            let (None, Some(h_m)) = (label_m[node], bound_m[node]) else {
                continue;
            };
            let bound_m = offset_m + h_m;
            if is_below(bound_m) {
                let node = self.id(node);
                return Err(CertificateFault::StartBelow {
                    node,
                    bound_m,
                    length_m,
                });
            }
        }
        let destination = self.claim.destination;
        if let Some(d_m) = label_m[destination].filter(|&d_m| is_below(d_m)) {
            let node = self.id(destination);
            return Err(CertificateFault::DestinationLabel {
                node,
                d_m,
                length_m,
            });
        }
        for flight in self.open_flights() {
            let (from_m, to_m) = (label_m[flight.from], label_m[flight.to]);
            let (Some(d_m), None, Some(h_m)) = (from_m, to_m, bound_m[flight.to]) else {
                continue;
            };
            let bound_m = d_m + flight.length_m + h_m;
            if is_below(bound_m) {
                return Err(CertificateFault::SegmentBelow {
                    step: self.step_of(flight),
                    bound_m,
                    length_m,
                });
            }
        }
        Ok(())
    }

    /// The path is an open walk from a start to the destination, and as long as claimed.
    fn path(&self, length_m: f64) -> Result<(), CertificateFault> {
        let nodes = &self.claim.path_nodes;
        let segments = &self.claim.path_segments;
        let (Some(&first), Some(&last), true) = (
            nodes.first(),
            nodes.last(),
            nodes.len() == segments.len() + 1,
        ) else {
            return Err(CertificateFault::PathCounts {
                nodes: nodes.len(),
                segments: segments.len(),
            });
        };
        let starts_there = self.claim.starts.iter().filter(|start| start.0 == first);
        let Some(offset_m) = starts_there.map(|start| start.1).reduce(f64::min) else {
            let node = self.id(first);
            return Err(CertificateFault::PathStart { node });
        };
        if last != self.claim.destination {
            return Err(CertificateFault::PathEnd {
                node: self.id(last),
                destination: self.id(self.claim.destination),
            });
        }
        let mut path_m = offset_m;
        for (pair, &segment) in nodes.windows(2).zip(segments) {
            let (from, to) = (pair[0], pair[1]);
            let facts = &self.network.segments[segment];
            if facts.ends != [from, to] && facts.ends != [to, from] {
                let step = self.step(segment, from, to);
                return Err(CertificateFault::PathBroken { step });
            }
            // Only the first node can be closed: this has refused to enter any other.
            if !self.is_open(segment, from, to) {
                let step = self.step(segment, from, to);
                return Err(CertificateFault::PathClosed { step });
            }
            path_m += facts.length_m;
        }
        if (path_m - length_m).abs() > self.tolerance_m {
            return Err(CertificateFault::PathLength { path_m, length_m });
        }
        Ok(())
    }

    /// The settled nodes hold every start, not the destination, and no open segment leaves them.
    fn nothing_gets_through(&self) -> Result<(), CertificateFault> {
        let label_m = &self.claim.label_m;
        if !self.claim.path_nodes.is_empty() || !self.claim.path_segments.is_empty() {
            return Err(CertificateFault::PathWithoutLength);
        }
        for &(start, _) in &self.claim.starts {
            if label_m[start].is_none() {
                let node = self.id(start);
                return Err(CertificateFault::StartNotSettled { node });
            }
        }
        if label_m[self.claim.destination].is_some() {
            let node = self.id(self.claim.destination);
            return Err(CertificateFault::DestinationSettled { node });
        }
        for flight in self.open_flights() {
            if label_m[flight.from].is_some() && label_m[flight.to].is_none() {
                let step = self.step_of(flight);
                return Err(CertificateFault::SegmentLeaves { step });
            }
        }
        Ok(())
    }
}

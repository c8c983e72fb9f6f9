//! Drawn worlds of the oracle: a planar network, zones as shapes, closures, and one drone that reports.

use crate::oracle::generate::Draw;

pub(super) type Spot = (f64, f64);

/// The map is a square with this side, in metres.
pub(super) const SIDE_M: f64 = 1_000.0;

pub(super) fn apart_m(one: Spot, other: Spot) -> f64 {
    (one.0 - other.0).hypot(one.1 - other.1)
}

pub(super) fn between(from: Spot, to: Spot, share: f64) -> Spot {
    (
        from.0 + (to.0 - from.0) * share,
        from.1 + (to.1 - from.1) * share,
    )
}

/// What a zone covers, without its margin.
#[derive(Clone, Debug)]
pub(super) enum Ground {
    Circle {
        centre: Spot,
        radius_m: f64,
    },
    /// A box by two corners, the lower left one first.
    Box {
        low: Spot,
        high: Spot,
    },
}

#[derive(Clone, Debug)]
pub(super) struct PlainZone {
    pub(super) ground: Ground,
    pub(super) margin_m: f64,
}

impl PlainZone {
    /// How far a spot is outside the margin, in metres; below 0 inside.
    pub(super) fn clearance_m(&self, spot: Spot) -> f64 {
        let off_m = match self.ground {
            Ground::Circle { centre, radius_m } => apart_m(spot, centre) - radius_m,
            Ground::Box { low, high } => {
                let across = (low.0 - spot.0).max(spot.0 - high.0);
                let up = (low.1 - spot.1).max(spot.1 - high.1);
                match across.max(up) < 0.0 {
                    true => across.max(up),
                    false => across.max(0.0).hypot(up.max(0.0)),
                }
            }
        };
        off_m - self.margin_m
    }
}

/// Where the drone says that it is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Place {
    AtStart,
    At(Spot),
    Unknown,
}

#[derive(Clone, Debug)]
pub(super) struct PlainWorld {
    pub(super) nodes: Vec<Spot>,
    /// Two nodes and the stated length.
    pub(super) segments: Vec<(usize, usize, f64)>,
    pub(super) zones: Vec<PlainZone>,
    /// The zone that the report brings along, if any; it is among the zones.
    pub(super) brought: Option<usize>,
    pub(super) closed_nodes: Vec<usize>,
    pub(super) closed_segments: Vec<usize>,
    pub(super) leg: (usize, usize),
    /// The report closes its leg; and where its cause is, if it says so.
    pub(super) closes_leg: bool,
    pub(super) cause: Option<Spot>,
    pub(super) place: Place,
    pub(super) speed_mps: f64,
    pub(super) age_s: f64,
}

impl PlainWorld {
    pub(super) fn draw(seed: u64) -> Self {
        let mut draw = Draw::new(seed ^ 0x57a2_7000);
        let count = 4 + draw.below(12);
        let nodes: Vec<Spot> = (0..count)
            .map(|_| (draw.unit() * SIDE_M, draw.unit() * SIDE_M))
            .collect();
        let mut segments = Vec::new();
        for one in 0..count {
            for other in one + 1..count {
                if other == one + 1 || draw.chance(0.2) {
                    let stated = if draw.chance(0.3) {
                        1.0 + draw.unit() * 0.5
                    } else {
                        1.0
                    };
                    segments.push((one, other, apart_m(nodes[one], nodes[other]) * stated));
                }
            }
        }
        let leg = leg(&mut draw, &segments, count);
        let ends = (nodes[leg.0], nodes[leg.1]);
        let zones: Vec<PlainZone> = (0..draw.below(4)).map(|_| zone(&mut draw, ends)).collect();
        let closes_leg = draw.chance(0.4);
        let brought = (closes_leg && !zones.is_empty() && draw.chance(0.3)).then_some(0);
        let mut some = |share: f64, count: usize| -> Vec<usize> {
            (0..count).filter(|_| draw.chance(share)).collect()
        };
        let closed_nodes = some(0.08, count);
        let closed_segments = some(0.1, segments.len());
        Self {
            cause: draw.chance(0.6).then(|| {
                let spot = between(ends.0, ends.1, draw.unit());
                (spot.0 + draw.unit() * 20.0, spot.1)
            }),
            place: place(&mut draw, ends),
            speed_mps: [2.0, 8.0, 16.0][draw.below(3)],
            age_s: [0.0, 0.0, 3.0, 20.0][draw.below(4)],
            nodes,
            segments,
            zones,
            brought,
            closed_nodes,
            closed_segments,
            leg,
            closes_leg,
        }
    }

    pub(super) fn segment_of_leg(&self) -> Option<usize> {
        let (from, to) = self.leg;
        self.segments
            .iter()
            .position(|&(one, other, _)| (one, other) == (from, to) || (other, one) == (from, to))
    }
}

/// A segment, flown either way; now and then two nodes that none joins.
fn leg(draw: &mut Draw, segments: &[(usize, usize, f64)], count: usize) -> (usize, usize) {
    if draw.chance(0.15) {
        let (from, to) = (draw.below(count), draw.below(count));
        if from != to {
            return (from, to);
        }
    }
    let (one, other, _) = segments[draw.below(segments.len())];
    match draw.chance(0.5) {
        true => (one, other),
        false => (other, one),
    }
}

/// A zone that mostly lies near the leg.
fn zone(draw: &mut Draw, ends: (Spot, Spot)) -> PlainZone {
    let on_leg = between(ends.0, ends.1, draw.unit() * 1.2 - 0.1);
    let mut aside = || (draw.unit() - 0.5) * 80.0;
    let centre = (on_leg.0 + aside(), on_leg.1 + aside());
    let size_m = 10.0 + draw.unit() * draw.unit() * 250.0;
    let ground = match draw.chance(0.5) {
        true => Ground::Circle {
            centre,
            radius_m: size_m,
        },
        false => {
            let half = (size_m * (0.3 + draw.unit()), size_m * (0.3 + draw.unit()));
            Ground::Box {
                low: (centre.0 - half.0, centre.1 - half.1),
                high: (centre.0 + half.0, centre.1 + half.1),
            }
        }
    };
    let margin_m = [0.0, 10.0, 25.0][draw.below(3)];
    PlainZone { ground, margin_m }
}

fn place(draw: &mut Draw, ends: (Spot, Spot)) -> Place {
    let aside = match draw.below(10) {
        0 => return Place::Unknown,
        1 => return Place::AtStart,
        2 => return Place::At(ends.0),
        3 => return Place::At(ends.1),
        4 => 60.0 + draw.unit() * 200.0,
        _ => draw.unit() * 30.0,
    };
    // From a little before it to a little past it.
    let spot = between(ends.0, ends.1, draw.unit() * 1.2 - 0.1);
    let length_m = apart_m(ends.0, ends.1);
    let across = (
        (ends.1.1 - ends.0.1) / length_m,
        (ends.0.0 - ends.1.0) / length_m,
    );
    Place::At((spot.0 + across.0 * aside, spot.1 + across.1 * aside))
}

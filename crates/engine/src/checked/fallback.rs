//! What is sent instead of an answer that did not pass.

use super::convert::{Known, check_answer, stands_at};
use crate::airspace::Airspace;
use crate::checker::Fault;
use crate::flight::{Aloft, Location, Reentry, StretchLeg};
use crate::geo::Point;
use crate::network::{NodeIx, Topology};
use crate::recompose::{
    Fallback, Outcome, Recomposition, Request, Scratch, Strategy, UnsafeCode, UnsafeWay, World,
    causes_of_leg, is_past_end, recompose,
};
use crate::routing::Path;

/// What was sent in place of an answer that did not pass.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FallenBackTo {
    /// The answer of the baseline.
    Baseline,
    /// The plan as it is flown.
    Reported,
    /// What the plan has for the case that its leg closes.
    Contingency,
    /// The plan's alternate.
    Alternate,
    /// Staying on the ground.
    Hold,
    /// No route.
    NoRoute,
    /// Nothing: a plan that was asked for was refused.
    Refusal,
}

impl FallenBackTo {
    /// The name on the wire.
    pub fn name(self) -> &'static str {
        match self {
            Self::Baseline => "baseline",
            Self::Reported => "reported",
            Self::Contingency => "contingency",
            Self::Alternate => "alternate",
            Self::Hold => "hold",
            Self::NoRoute => "no_route",
            Self::Refusal => "refusal",
        }
    }
}

/// An answer that did not pass, and what went instead.
#[derive(Clone, Debug, PartialEq)]
pub struct Case {
    /// The rule that it breaks, where, and by which figures.
    pub fault: Fault,
    /// What it would have told.
    pub outcome: Outcome,
    /// Where it would have led.
    pub nodes: Vec<NodeIx>,
    /// What went instead.
    pub fallback: FallenBackTo,
}

/// An answer that may be sent.
#[derive(Clone, Debug)]
pub struct Checked {
    /// It.
    pub answer: Recomposition,
    /// The one that it replaces, if one did not pass.
    pub case: Option<Case>,
}

/// Ways that a plan has beside the search, its leg's nodes first.
#[derive(Clone, Copy, Debug, Default)]
pub struct Alternatives<'a> {
    /// What is flown, from the start of the leg on.
    pub reported: Option<&'a [NodeIx]>,
    /// Where the leg closes: the way from its start to the destination.
    pub if_closed: Option<&'a [NodeIx]>,
    /// The way from its start to the alternate.
    pub alternate: Option<&'a [NodeIx]>,
}

/// Checks an answer by distance, and falls back where it does not pass.
pub fn pass(
    airspace: &Airspace,
    request: &Request,
    known: &Known,
    alternatives: Alternatives<'_>,
    answer: Recomposition,
    scratch: &mut Scratch,
) -> Checked {
    match check_answer(airspace, request, known, &answer, None) {
        Ok(()) => Checked { answer, case: None },
        Err(fault) => {
            let refused = (answer, fault);
            settle(airspace, request, known, alternatives, refused, scratch)
        }
    }
}

/// What goes instead of an answer that did not pass, by distance: the first that does.
pub fn settle(
    airspace: &Airspace,
    request: &Request,
    known: &Known,
    alternatives: Alternatives<'_>,
    (refused, fault): (Recomposition, Fault),
    scratch: &mut Scratch,
) -> Checked {
    let topology = airspace.topology();
    let passes =
        |answer: &Recomposition| check_answer(airspace, request, known, answer, None).is_ok();
    let baseline = Request {
        strategy: Strategy::Dijkstra,
        optimum: false,
        explain: false,
        ..request.clone()
    };
    let world = World {
        airspace,
        trees: None,
    };
    let ends = Ends::of(request, topology);
    let as_flown = || ends.as_flown(topology, alternatives.reported?);
    let if_closed = || ends.back(topology, alternatives.if_closed?, Outcome::Rerouted);
    let alternate = || ends.back(topology, alternatives.alternate?, Outcome::Diverted);
    let found = Some((
        recompose(&world, &baseline, scratch),
        FallenBackTo::Baseline,
    ))
    .filter(|(answer, _)| passes(answer))
    .or_else(|| Some((as_flown()?, FallenBackTo::Reported)).filter(|it| passes(&it.0)))
    .or_else(|| Some((if_closed()?, FallenBackTo::Contingency)).filter(|it| passes(&it.0)))
    .or_else(|| Some((alternate()?, FallenBackTo::Alternate)).filter(|it| passes(&it.0)));
    let no_route = || Recomposition {
        unsafe_way: refused
            .unsafe_way
            .clone()
            .or_else(|| ends.unsafe_way(topology)),
        severed_by: match refused.severed_by.is_empty() {
            true => causes_of_leg(airspace, request),
            false => refused.severed_by.clone(),
        },
        ..Recomposition::without_path(request.strategy)
    };
    let holds = || Some((stay(request, topology, no_route)?, FallenBackTo::Hold));
    let (mut answer, fallback) = found
        .or_else(|| holds().filter(|it| passes(&it.0)))
        .unwrap_or_else(|| (no_route(), FallenBackTo::NoRoute));
    answer.strategy = request.strategy;
    answer.fallback = Some(Fallback::Checker);
    let case = Case {
        fault,
        outcome: refused.outcome,
        nodes: refused.path.nodes,
        fallback,
    };
    Checked {
        answer,
        case: Some(case),
    }
}

/// A drone on the ground stays there; one that may be in the air is told that it has no way then.
fn stay(
    request: &Request,
    topology: &Topology,
    no_route: impl Fn() -> Recomposition,
) -> Option<Recomposition> {
    let node = stands_at(request, topology)?;
    let place = topology.position(node);
    let (from, to) = request.report.leg;
    let leg = StretchLeg {
        from,
        to,
        segment: topology.segment_between(from, to),
        fraction: if node == to { 1.0 } else { 0.0 },
    };
    let may_fly = request.circumstances.aloft == Aloft::Unknown;
    Some(Recomposition {
        outcome: Outcome::Hold,
        path: Path {
            nodes: vec![node],
            segments: Vec::new(),
        },
        recomposed_length_m: Some(0.0),
        remaining_length_m: Some(0.0),
        reentry: Some(Reentry::at_node(node, place, Some(leg))),
        if_airborne: may_fly.then(|| Box::new(no_route())),
        ..Recomposition::without_path(request.strategy)
    })
}

/// The drone on its leg.
struct Ends {
    leg: StretchLeg,
    length_m: f64,
    begin: Point,
    past_m: f64,
    is_known: bool,
}

impl Ends {
    fn of(request: &Request, topology: &Topology) -> Self {
        let (from, to) = request.report.leg;
        let ends = (topology.position(from), topology.position(to));
        let (fraction, begin) = match request.report.location {
            Location::At(place) => (place.fraction_along(ends.0, ends.1), place),
            Location::LegStart | Location::Unknown => (0.0, ends.0),
        };
        let (on_leg, is_past) = (ends.0.towards(ends.1, fraction), is_past_end(fraction));
        let segment = topology.segment_between(from, to);
        let straight_m = ends.0.distance_m(ends.1);
        Self {
            leg: StretchLeg {
                from,
                to,
                segment,
                fraction,
            },
            length_m: segment.map_or(straight_m, |segment| topology.segment(segment).length_m),
            begin: if is_past { begin } else { on_leg },
            past_m: if is_past {
                begin.distance_m(on_leg)
            } else {
                0.0
            },
            is_known: request.report.location != Location::Unknown,
        }
    }

    fn reentry(&self, node: NodeIx) -> Reentry {
        let share = if node == self.leg.from {
            self.leg.fraction
        } else {
            1.0 - self.leg.fraction
        };
        let along_m = if self.is_known { share } else { 1.0 } * self.length_m;
        let lengths_m = (along_m.max(self.past_m), 0.0);
        Reentry::along(node, self.leg, self.begin, lengths_m)
    }

    /// On to the end of the leg, and then as planned; from its start where the drone is still there.
    fn as_flown(&self, topology: &Topology, planned: &[NodeIx]) -> Option<Recomposition> {
        let is_at_start = self.is_known && self.leg.fraction <= 0.0;
        let ahead = if is_at_start {
            planned
        } else {
            planned.get(1..)?
        };
        self.assembled(topology, ahead, Outcome::Unaffected)
    }

    /// Back to the start of the leg, and then another way.
    fn back(
        &self,
        topology: &Topology,
        nodes: &[NodeIx],
        outcome: Outcome,
    ) -> Option<Recomposition> {
        self.assembled(topology, nodes, outcome)
    }

    fn assembled(
        &self,
        topology: &Topology,
        nodes: &[NodeIx],
        outcome: Outcome,
    ) -> Option<Recomposition> {
        let reentry = self.reentry(*nodes.first()?);
        let pairs = nodes.windows(2);
        let segments = pairs.map(|pair| topology.segment_between(pair[0], pair[1]));
        let path = Path {
            nodes: nodes.to_vec(),
            segments: segments.collect::<Option<Vec<_>>>()?,
        };
        let length_m = path.length_m(topology);
        let first_stretch_m = reentry.stretch.length_m;
        Some(Recomposition {
            outcome,
            path,
            recomposed_length_m: Some(length_m),
            remaining_length_m: Some(first_stretch_m + length_m),
            first_stretch_m,
            reentry: Some(reentry),
            ..Recomposition::without_path(Strategy::Exact)
        })
    }

    /// The nearer end of the leg.
    fn unsafe_way(&self, topology: &Topology) -> Option<UnsafeWay> {
        let back = self.reentry(self.leg.from);
        let on = self.reentry(self.leg.to);
        let nearer = if back.stretch.length_m <= on.stretch.length_m {
            back
        } else {
            on
        };
        Some(UnsafeWay {
            code: UnsafeCode::Checker,
            nodes: vec![nearer.node],
            line: vec![self.begin, topology.position(nearer.node)],
            length_m: nearer.stretch.length_m,
            battery: None,
        })
    }
}

//! Failures, drawn as the experiments ask: source and destination uniform in the largest component, and the
//! failed segment in each of three ways, as the paper does not say in which.
//!
//! Every draw counts. One after which no way leads to the destination any more is kept apart and told, and
//! no other is drawn in its place.

use super::network::Subject;
use super::oracle::Sought;
use super::random::Random;
use crate::compose::shortest_way;
use crate::network::NodeIx;
use crate::recompose::World;
use crate::routing::{Path, Searcher};
use serde::{Deserialize, Serialize};

/// How the failed segment is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Placing {
    /// Uniform among the segments of the shortest path.
    Path,
    /// By length: where a point falls that is uniform on the shortest path.
    Length,
    /// Uniform in the network; the plan leads over it, towards the destination.
    Network,
}

impl Placing {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Path, Self::Length, Self::Network];
}

/// What is drawn for one failure.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Draw {
    /// Where the delivery begins.
    pub source: NodeIx,
    /// Where it goes.
    pub destination: NodeIx,
    /// How far along what the segment is drawn from it is, in `0..1`.
    pub share: f64,
    /// How the segment is drawn.
    pub placing: Placing,
}

/// One failure on a network.
#[derive(Clone, Debug, PartialEq)]
pub struct Failed {
    /// Its number among those drawn, from 0.
    pub number: usize,
    /// How its segment was drawn.
    pub placing: Placing,
    /// Where the delivery began.
    pub source: NodeIx,
    /// The failed leg, A and B.
    pub leg: (NodeIx, NodeIx),
    /// The plan from A on.
    pub rest: Vec<NodeIx>,
    /// The way from the source to A, in metres.
    pub flown_m: f64,
    /// The shortest ways with the leg closed, from A to B and to the destination, in metres, as the oracle has
    /// them; none where the failure leaves no way.
    pub optima_m: [Option<f64>; 2],
}

impl Failed {
    /// True when a way leads to the destination all the same.
    pub fn has_detour(&self) -> bool {
        self.optima_m[1].is_some()
    }
}

/// Draws pairs of a network, and for each a failure in every way of drawing.
pub fn draw(subject: &Subject, seed: u64, network: &str, count: usize) -> Vec<Draw> {
    let mut random = Random::new(seed, &format!("failures of {network}"));
    let component = &subject.component;
    let mut draws = Vec::with_capacity(Placing::ALL.len() * count);
    for _ in 0..count {
        let source = random.below(component.len());
        // One node fewer to choose from: the destination is another one.
        let other = random.below(component.len() - 1);
        let destination = other + usize::from(other >= source);
        let share = random.share();
        draws.extend(Placing::ALL.map(|placing| Draw {
            source: component[source],
            destination: component[destination],
            share,
            placing,
        }));
    }
    draws
}

/// Works out what fails in a draw, and what the oracle says of it; `None` where no way joins the two nodes,
/// which cannot be in one component.
pub fn fail(
    subject: &Subject,
    number: usize,
    drawn: &Draw,
    searcher: &mut Searcher,
) -> Option<Failed> {
    let (flown_m, rest) = match drawn.placing {
        Placing::Path | Placing::Length => on_path(subject, drawn, searcher)?,
        Placing::Network => in_network(subject, drawn, searcher)?,
    };
    let topology = subject.topology();
    let leg = (*rest.first()?, *rest.get(1)?);
    let id = |node| topology.node_id(node).to_owned();
    let sought = Sought {
        from: id(leg.0),
        to: id(leg.1),
        destination: id(*rest.last()?),
    };
    Some(Failed {
        number,
        placing: drawn.placing,
        source: drawn.source,
        leg,
        rest,
        flown_m,
        optima_m: subject.oracle.distances_m(&sought),
    })
}

/// What was flown, in metres, and the plan from A on.
type Plan = (f64, Vec<NodeIx>);

fn way(subject: &Subject, from: NodeIx, to: NodeIx, searcher: &mut Searcher) -> Option<Path> {
    let world = World {
        airspace: &subject.airspace,
        trees: None,
    };
    shortest_way(&world, from, to, searcher)
}

/// A segment of the shortest path.
fn on_path(subject: &Subject, drawn: &Draw, searcher: &mut Searcher) -> Option<Plan> {
    let way = way(subject, drawn.source, drawn.destination, searcher)?;
    let topology = subject.topology();
    let lengths = way.segments.iter();
    let lengths_m: Vec<f64> = lengths
        .map(|&segment| topology.segment(segment).length_m)
        .collect();
    let place = match drawn.placing {
        Placing::Length => {
            let mut left_m = drawn.share * lengths_m.iter().sum::<f64>();
            let falls_on = |&length_m: &f64| {
                left_m -= length_m;
                left_m < 0.0
            };
            let found = lengths_m.iter().position(falls_on);
            found.unwrap_or(lengths_m.len().saturating_sub(1))
        }
        _ => (drawn.share * lengths_m.len() as f64) as usize,
    };
    Some((lengths_m[..place].iter().sum(), way.nodes[place..].to_vec()))
}

/// A segment of the component, flown towards the destination. Beyond the failed segment the plan is shortest;
/// the plan as a whole need not be.
fn in_network(subject: &Subject, drawn: &Draw, searcher: &mut Searcher) -> Option<Plan> {
    let topology = subject.topology();
    let degree = |node: &NodeIx| topology.arcs(*node).len();
    let arcs: usize = subject.component.iter().map(degree).sum();
    let mut place = (drawn.share * arcs as f64) as usize;
    // Every segment is listed at both its nodes, so that an arc drawn is a segment drawn.
    let node = subject.component.iter().copied().find(|node| {
        let is_here = place < degree(node);
        if !is_here {
            place -= degree(node);
        }
        is_here
    })?;
    let ends = [node, topology.arcs(node)[place].to];
    let onward = ends.map(|end| way(subject, end, drawn.destination, searcher));
    let length_m = |way: &Option<Path>| way.as_ref().map(|way| way.length_m(topology));
    let [one_m, other_m] = [&onward[0], &onward[1]].map(length_m);
    let to = usize::from(one_m? >= other_m?);
    let from = ends[1 - to];
    let flown = way(subject, drawn.source, from, searcher)?;
    let mut rest = vec![from, ends[to]];
    rest.extend(onward[to].as_ref()?.nodes.iter().skip(1));
    Some((flown.length_m(topology), rest))
}

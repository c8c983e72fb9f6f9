//! Failures, drawn as the experiments ask: source and destination uniform in the largest component, the failed
//! segment uniform on the shortest path between them.
//!
//! Every draw counts. One after which no way leads to the destination any more is kept apart and told, and
//! no other is drawn in its place.

use super::network::Subject;
use super::oracle::Sought;
use super::random::Random;
use crate::compose::shortest_way;
use crate::network::NodeIx;
use crate::recompose::World;
use crate::routing::Searcher;

/// What is drawn for one failure.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Draw {
    /// Where the delivery begins.
    pub source: NodeIx,
    /// Where it goes.
    pub destination: NodeIx,
    /// How far along the segments of the shortest path the failed one is, in `0..1`.
    pub share: f64,
}

/// One failure on a network.
#[derive(Clone, Debug, PartialEq)]
pub struct Failed {
    /// Its number among those drawn, from 0.
    pub number: usize,
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

/// Draws the failures of a cell.
pub fn draw(subject: &Subject, seed: u64, cell: &str, count: usize) -> Vec<Draw> {
    let mut random = Random::new(seed, &format!("failures of {cell}"));
    let component = &subject.component;
    let one = |random: &mut Random| {
        let source = random.below(component.len());
        // One node fewer to choose from: the destination is another one.
        let other = random.below(component.len() - 1);
        let destination = other + usize::from(other >= source);
        Draw {
            source: component[source],
            destination: component[destination],
            share: random.share(),
        }
    };
    (0..count).map(|_| one(&mut random)).collect()
}

/// Works out what fails in a draw, and what the oracle says of it; `None` where no way joins the two nodes,
/// which cannot be in one component.
pub fn fail(
    subject: &Subject,
    number: usize,
    drawn: &Draw,
    searcher: &mut Searcher,
) -> Option<Failed> {
    let topology = subject.topology();
    let world = World {
        airspace: &subject.airspace,
        trees: None,
    };
    let way = shortest_way(&world, drawn.source, drawn.destination, searcher)?;
    let place = (drawn.share * way.segments.len() as f64) as usize;
    let leg = (*way.nodes.get(place)?, *way.nodes.get(place + 1)?);
    let flown = way.segments[..place].iter();
    let id = |node| topology.node_id(node).to_owned();
    let sought = Sought {
        from: id(leg.0),
        to: id(leg.1),
        destination: id(drawn.destination),
    };
    Some(Failed {
        number,
        source: drawn.source,
        leg,
        rest: way.nodes[place..].to_vec(),
        flown_m: flown
            .map(|&segment| topology.segment(segment).length_m)
            .sum(),
        optima_m: subject.oracle.distances_m(&sought),
    })
}

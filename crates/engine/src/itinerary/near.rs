//! What is near a drone that can reach nothing safely: nodes by the energy that it takes to get there, whatever its battery.

use super::expander::Expander;
use super::label::How;
use super::memory::ItineraryScratch;
use super::potentials::Potentials;
use super::request::{Effort, FlightRequest, Objective, Value, close, reopen};
use super::run::{Goal, Mode, Run};
use super::setting::FlightSetting;
use super::trace::plan;
use crate::flight::FlightPlan;
use crate::network::NodeIx;

/// As many labels as this are looked at: what is near is found with the first of them.
const MOST_LABELS: usize = 2_000;

/// A node near a drone, and the flight to it without a stop.
#[derive(Clone, Debug, PartialEq)]
pub struct Nearby {
    /// The node.
    pub node: NodeIx,
    /// The flight; its battery may fall below 0.
    pub flight: FlightPlan,
    /// Whether a pad of it is free for the stay of an alternate.
    pub has_free_pad: bool,
}

/// The nodes that take least energy to reach without a stop, the nearest first: the nearest of all, then those with pads, at most so many.
///
/// Closures and other plans are kept off. The request's destination, objective, deadline and reserve do not matter. `stay_s` is for how
/// long a pad has to be free from the landing on.
pub fn find_near(
    setting: &FlightSetting,
    request: &FlightRequest<'_>,
    stay_s: f64,
    (most, is_among_others): (usize, bool),
    scratch: &mut ItineraryScratch,
) -> Vec<Nearby> {
    let Some(first) = request.starts.first() else {
        return Vec::new();
    };
    let world = setting.world();
    let request = FlightRequest {
        objective: Objective::Energy,
        deadline_s: f64::INFINITY,
        destination: first.node,
        reserve: FlightRequest::NO_RESERVE,
        ..request.clone()
    };
    scratch.begin(world.topology);
    let potentials = Potentials::nowhere(world.topology.node_count(), Objective::Energy);
    let terms = Expander::new(&world, &request, &potentials);
    if is_among_others {
        scratch.active.widen();
    }
    close(&mut scratch.closed, request.closed_segments);
    let mut effort = Effort::default();
    let mut run = Run {
        terms,
        mode: Mode::Earlier,
        goal: Goal::Near,
        scratch,
        effort: &mut effort,
        best: Value::NONE,
        improved: false,
        doubt: Value::NONE,
        may_tie: false,
        target: Value::LEAST,
        most_labels: request.limits.labels.min(MOST_LABELS),
        most_checks: request.limits.checks,
        walks: false,
    };
    run.search();
    scratch.active.clear();
    reopen(&mut scratch.closed, request.closed_segments);
    nearest(&terms, stay_s, most, scratch)
}

/// What the labels of a search amount to.
fn nearest(
    terms: &Expander<'_>,
    stay_s: f64,
    most: usize,
    scratch: &ItineraryScratch,
) -> Vec<Nearby> {
    let world = terms.world;
    let mut labels: Vec<u32> = (0..scratch.labels.len() as u32).collect();
    labels.retain(|&label| {
        let label = &scratch.labels[label as usize];
        let is_start = matches!(label.how, How::Start(_));
        let (obstacles, at_s) = (world.obstacles, label.family.lo_s);
        !is_start || !obstacles.forbids_landing(world, terms.request.began_s, label.node, at_s)
    });
    labels.sort_by(|&one, &other| {
        let weight = |label: u32| scratch.labels[label as usize].family.weight;
        weight(one).total_cmp(&weight(other))
    });
    let mut near: Vec<Nearby> = Vec::with_capacity(most);
    let mut steps = Vec::new();
    for label in labels {
        let there = &scratch.labels[label as usize];
        let is_told = near.iter().any(|other| other.node == there.node);
        // The nearest of all is told though it may have no pads.
        let has_pads = world.topology.pads(there.node) > 0;
        if is_told || !(has_pads || near.is_empty()) {
            continue;
        }
        let to_it = FlightRequest {
            destination: there.node,
            ..terms.request.clone()
        };
        let terms_there = Expander::new(world, &to_it, terms.potentials);
        let value = terms_there.value(&there.family);
        ItineraryScratch::history(&scratch.labels, label, &mut steps);
        let lands_s = value.arrives_s;
        near.push(Nearby {
            node: there.node,
            flight: plan(&terms_there, &steps, value),
            has_free_pad: world.pads.stay_until_s(there.node, lands_s) >= lands_s + stay_s,
        });
        if near.len() >= most {
            break;
        }
    }
    near
}

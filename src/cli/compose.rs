//! `skyway compose`: a plan from a source to a destination, with its contingencies.
//!
//! The plan is the shortest open way. Every leg has two contingencies, so that a drone that loses its edge
//! knows what to do: the detour to take if that leg closes, and the nearest safe node.

use super::airspace_source::AirspaceArguments;
use super::answer_table::{node_text, outcome_name};
use super::names;
use super::network_source::NetworkArguments;
use super::output::{Align, Output, metres, titled_table};
use super::plan;
use super::stop::{Stop, Verdict};
use crate::flight::{FailureReport, FailureType, Location};
use crate::formats::{node_id_json, segment_id_json};
use crate::network::{NodeIx, SegmentIx, Topology};
use crate::recompose::{Outcome, Recomposition, Request, Scratch, World, recompose};
use clap::Args;
use serde_json::{Value, json};

const EXAMPLES: &str = "\
Examples:
  skyway compose --source 1 --destination 450
  skyway compose --source 1 --destination 450 --airspeed 12 --json
  skyway compose --source 1 --destination 450 --close 353

Times are nominal: the airspeed, or a segment's limit where that is slower, without wind, climb or \
stops. Energy is not checked.";

/// Airspeed where none is given, in metres per second.
const DEFAULT_AIRSPEED_MPS: f64 = 16.0;

/// Arguments of `skyway compose`.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct Compose {
    #[command(flatten)]
    network: NetworkArguments,
    /// Where the delivery starts
    #[arg(help_heading = "Plan", long, value_name = "NODE")]
    source: String,
    /// Where the delivery goes
    #[arg(help_heading = "Plan", long, value_name = "NODE")]
    destination: String,
    /// Airspeed, in metres per second
    #[arg(help_heading = "Plan", long, value_name = "MPS", default_value_t = DEFAULT_AIRSPEED_MPS, value_parser = airspeed)]
    airspeed: f64,
    #[command(flatten)]
    airspace: AirspaceArguments,
    /// Write JSON
    #[arg(help_heading = "Output", long)]
    json: bool,
}

fn airspeed(text: &str) -> Result<f64, String> {
    let speed_mps = text.parse::<f64>().ok();
    let positive = speed_mps.filter(|speed_mps| speed_mps.is_finite() && *speed_mps > 0.0);
    positive.ok_or_else(|| "give metres per second above 0".to_owned())
}

/// A leg of the plan, with what to do on it.
struct Leg {
    from: NodeIx,
    to: NodeIx,
    segment: SegmentIx,
    length_m: f64,
    departure_s: f64,
    arrival_s: f64,
    /// What to do if the leg closes while the drone is at its start.
    detour: Recomposition,
    /// Metres that the detour is longer than the plan, where it reaches the destination.
    extra_m: Option<f64>,
    /// The way from the leg's start to the nearest safe node.
    safe: Recomposition,
}

struct Plan {
    nodes: Vec<NodeIx>,
    legs: Vec<Leg>,
    length_m: f64,
    flight_time_s: f64,
}

impl Compose {
    pub(super) fn run(&self, output: &Output) -> Result<Verdict, Stop> {
        let network = self.network.load(output)?;
        let topology = &network.topology;
        let source = names::node(topology, &self.source)?;
        let destination = names::node(topology, &self.destination)?;
        let airspace = self.airspace.open(topology)?;
        let tables = plan::tables();
        let world = World {
            airspace: &airspace,
            trees: Some(&tables),
        };
        let plan = self.plan(&world, source, destination);
        match (self.json, &plan) {
            (true, _) => output.json(&json(topology, source, destination, self.airspeed, &plan))?,
            (false, Some(plan)) => print(topology, plan, self.airspeed, output)?,
            (false, None) => {
                let [source, destination] =
                    [source, destination].map(|node| node_text(topology, node));
                output.line(&format!(
                    "no route: no open way leads from {source} to {destination}"
                ))?;
            }
        }
        Ok(Verdict::Done)
    }

    fn plan(&self, world: &World<'_>, source: NodeIx, destination: NodeIx) -> Option<Plan> {
        let topology = world.airspace.topology();
        let way = plan::shortest_way(world.airspace, source, destination)?;
        let mut scratch = Scratch::new(topology);
        plan::prepare_table(world, destination, scratch.searcher());
        let length_m = way.length_m(topology);
        let (mut flown_m, mut time_s) = (0.0, 0.0);
        let mut legs = Vec::new();
        for (place, &segment) in way.segments.iter().enumerate() {
            let leg = (way.nodes[place], way.nodes[place + 1]);
            let leg_length_m = topology.segment(segment).length_m;
            let limit_mps = topology.speed_limit_mps(segment).unwrap_or(f64::INFINITY);
            let departure_s = time_s;
            time_s += leg_length_m / self.airspeed.min(limit_mps);
            let mut contingency = |failure| {
                let request = Request::exact(FailureReport {
                    failure,
                    leg,
                    location: Location::LegStart,
                    cause_location: None,
                    destination,
                    remaining_path: Some(way.nodes[place..].to_vec()),
                });
                recompose(world, &request, &mut scratch)
            };
            let detour = contingency(FailureType::Navigational);
            let rest_m = length_m - flown_m;
            let extra_m = detour.remaining_length_m.map(|length_m| length_m - rest_m);
            legs.push(Leg {
                from: leg.0,
                to: leg.1,
                segment,
                length_m: leg_length_m,
                departure_s,
                arrival_s: time_s,
                extra_m: extra_m.filter(|_| detour.outcome == Outcome::Rerouted),
                detour,
                safe: contingency(FailureType::Operational),
            });
            flown_m += leg_length_m;
        }
        Some(Plan {
            nodes: way.nodes,
            legs,
            length_m,
            flight_time_s: time_s,
        })
    }
}

fn print(topology: &Topology, plan: &Plan, airspeed_mps: f64, output: &Output) -> Result<(), Stop> {
    let columns = [
        ("leg", Align::Right),
        ("from", Align::Left),
        ("to", Align::Left),
        ("length", Align::Right),
        ("arrival", Align::Right),
        ("if it closes", Align::Left),
        ("nearest safe node", Align::Left),
    ];
    let mut table = titled_table(&columns);
    for (number, leg) in (1..).zip(&plan.legs) {
        table.add_row([
            number.to_string(),
            node_text(topology, leg.from),
            node_text(topology, leg.to),
            metres(leg.length_m),
            format!("{:.0} s", leg.arrival_s),
            detour_text(topology, leg),
            safe_text(topology, &leg.safe),
        ]);
    }
    if !plan.legs.is_empty() {
        output.table(&table)?;
        output.line("")?;
    }
    output.line(&format!(
        "{} in {} legs, {:.0} s at {airspeed_mps} m/s; times: nominal, energy: unchecked",
        metres(plan.length_m),
        plan.legs.len(),
        plan.flight_time_s
    ))
}

fn detour_text(topology: &Topology, leg: &Leg) -> String {
    if let Some(extra_m) = leg.extra_m {
        let via = leg.detour.path.nodes.get(1);
        let via = via.map_or("", |&node| topology.node_id(node));
        return format!("{extra_m:+.1} m by {via}");
    }
    match (leg.detour.outcome, leg.detour.path.nodes.last()) {
        (Outcome::Diverted, Some(&node)) => format!("divert to {}", node_text(topology, node)),
        (outcome, _) => outcome_name(outcome).to_owned(),
    }
}

fn safe_text(topology: &Topology, safe: &Recomposition) -> String {
    match (safe.path.nodes.last(), safe.remaining_length_m) {
        (Some(&node), Some(length_m)) => {
            format!("{}, {}", node_text(topology, node), metres(length_m))
        }
        _ => "none".to_owned(),
    }
}

fn json(
    topology: &Topology,
    source: NodeIx,
    destination: NodeIx,
    airspeed_mps: f64,
    plan: &Option<Plan>,
) -> Value {
    let id = |node| node_id_json(topology, node);
    let Some(plan) = plan else {
        return json!({"outcome": "no_route", "source": id(source), "destination": id(destination)});
    };
    let nodes: Vec<Value> = plan.nodes.iter().map(|&node| id(node)).collect();
    let segments = plan.legs.iter();
    let segments: Vec<Value> = segments
        .map(|leg| segment_id_json(topology, leg.segment))
        .collect();
    let legs: Vec<Value> = plan
        .legs
        .iter()
        .map(|leg| leg_json(topology, leg))
        .collect();
    json!({
        "outcome": "composed",
        "source": id(source),
        "destination": id(destination),
        "path": {"nodes": nodes, "segments": segments},
        "length_m": plan.length_m,
        "flight_time_s": plan.flight_time_s,
        "airspeed_mps": airspeed_mps,
        "times": "nominal",
        "energy": "unchecked",
        "legs": legs,
    })
}

fn leg_json(topology: &Topology, leg: &Leg) -> Value {
    let id = |node| node_id_json(topology, node);
    let way = |answer: &Recomposition| {
        let nodes = answer.path.nodes.iter();
        json!({
            "outcome": answer.outcome,
            "nodes": nodes.map(|&node| id(node)).collect::<Vec<Value>>(),
            "length_m": answer.remaining_length_m,
        })
    };
    let mut detour = way(&leg.detour);
    if let Some(extra_m) = leg.extra_m {
        detour["extra_m"] = json!(extra_m);
    }
    let mut safe = way(&leg.safe);
    safe["node"] = json!(leg.safe.path.nodes.last().map(|&node| id(node)));
    json!({
        "from": id(leg.from),
        "to": id(leg.to),
        "segment": segment_id_json(topology, leg.segment),
        "length_m": leg.length_m,
        "departure_s": leg.departure_s,
        "arrival_s": leg.arrival_s,
        "if_closed": detour,
        "nearest_safe_node": safe,
    })
}

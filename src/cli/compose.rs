//! `skyway compose`: a plan from a source to a destination, with its contingencies.
//!
//! The plan is the shortest open way. Every leg has two contingencies, so that a drone that loses its edge
//! knows what to do: the detour to take if that leg closes, and the nearest alternate.

use super::airspace_source::AirspaceArguments;
use super::answer_table::node_text;
use super::flight::{self, FlightArguments, Wanted};
use super::names;
use super::network_source::NetworkArguments;
use super::output::{Align, Output, metres, titled_table};
use super::plan;
use super::stop::{Stop, Verdict};
use crate::airspace::Airspace;
use crate::compose::{Alternate, Composition, Leg, compose};
use crate::flight::ServiceStop;
use crate::formats::{Route, RouteFormat, composition_json, write_route};
use crate::network::{NodeIx, Topology};
use crate::recompose::{Outcome, Scratch, World};
use clap::{Args, ValueEnum};
use std::path::PathBuf;
use std::sync::Arc;

const EXAMPLES: &str = "\
Examples:
  skyway compose --source 1 --destination 450
  skyway compose --source 1 --destination 450 --airspeed 12 --json
  skyway compose --source 1 --destination 450 --close 353
  skyway compose --source 1 --destination 450 --format plan > mission.plan
  skyway compose --source 1 --stop 9=90 --stop 14=60 --destination 1 --payload-kg 0.5
  skyway compose --network corridor --source 1 --destination 280 --payload-kg 0.25 --wind 225/7 --deadline 14h

Without a drone times are nominal: the airspeed, or a segment's limit where that is slower, without wind, \
climb or stops, and energy is not checked. Any option of a flight computes times, battery and recharging stops.";

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
    /// Where it is served on its way, and for how many seconds; repeat for more, in order. Takes a drone
    #[arg(help_heading = "Plan", long, value_name = "NODE[=SECONDS]")]
    stop: Vec<String>,
    /// Airspeed without a drone, in metres per second [default: 16]
    #[arg(help_heading = "Plan", long, value_name = "MPS", value_parser = airspeed)]
    airspeed: Option<f64>,
    #[command(flatten)]
    airspace: AirspaceArguments,
    #[command(flatten)]
    flight: FlightArguments,
    /// Write the plan with all that it was made for, for skyway verify
    #[arg(help_heading = "Output", long, value_name = "FILE")]
    certificate: Option<PathBuf>,
    /// Draw the plan with its battery, its stops and the wind
    #[arg(help_heading = "Output", long, value_name = "FILE")]
    svg: Option<PathBuf>,
    /// Write JSON
    #[arg(help_heading = "Output", long)]
    json: bool,
    /// Write the route in a format of ground stations and maps
    #[arg(
        help_heading = "Output",
        long,
        value_enum,
        value_name = "FORMAT",
        conflicts_with = "json"
    )]
    format: Option<Format>,
}

/// A format of routes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(super) enum Format {
    /// A plan of QGroundControl: mission, fence, rally points
    Plan,
    /// A list of waypoints, QGC WPL 110
    Wpl,
    /// GPX 1.1
    Gpx,
    /// KML 2.2
    Kml,
    /// GeoJSON
    Geojson,
}

impl Format {
    fn of_route(self) -> RouteFormat {
        match self {
            Self::Plan => RouteFormat::QgcPlan,
            Self::Wpl => RouteFormat::QgcWaypoints,
            Self::Gpx => RouteFormat::Gpx,
            Self::Kml => RouteFormat::Kml,
            Self::Geojson => RouteFormat::GeoJson,
        }
    }

    /// Writes a route to standard output.
    pub(super) fn write(
        self,
        route: &Route,
        airspace: &Airspace,
        output: &Output,
    ) -> Result<(), Stop> {
        let written = write_route(route, airspace, self.of_route()).map_err(Stop::failed)?;
        for note in &written.notes {
            output.warn(note);
        }
        output.raw(written.text.as_bytes())
    }
}

/// What a route is called.
pub(super) fn route_name(topology: &Topology, source: NodeIx, destination: NodeIx) -> String {
    let [source, destination] = [source, destination].map(|node| topology.node_id(node));
    format!("{source} to {destination}")
}

fn airspeed(text: &str) -> Result<f64, String> {
    let speed_mps = text.parse::<f64>().ok();
    let positive = speed_mps.filter(|speed_mps| speed_mps.is_finite() && *speed_mps > 0.0);
    positive.ok_or_else(|| "give metres per second above 0".to_owned())
}

impl Compose {
    pub(super) fn run(&self, output: &Output) -> Result<Verdict, Stop> {
        let network = self.network.load(output)?;
        let topology = &network.topology;
        let source = names::node(topology, &self.source)?;
        let destination = names::node(topology, &self.destination)?;
        if self.flight.is_given() {
            if self.airspeed.is_some() {
                let problem = "--airspeed takes a plan without a drone; the airspeed of a drone is that of its airframe";
                return Err(Stop::Usage(problem.to_owned()));
            }
            return self.fly(topology, (source, destination), output);
        }
        if !self.stop.is_empty() {
            let problem =
                "--stop takes a plan that is flown; name a drone, such as --airframe phantom3";
            return Err(Stop::Usage(problem.to_owned()));
        }
        if self.certificate.is_some() || self.svg.is_some() {
            let problem = "--certificate and --svg take a plan that is flown; name a drone, such as --airframe phantom3";
            return Err(Stop::Usage(problem.to_owned()));
        }
        let airspace = self.airspace.open(topology, output)?;
        let tables = plan::tables();
        let world = World {
            airspace: &airspace,
            trees: Some(&tables),
        };
        let mut scratch = Scratch::new(topology);
        let airspeed_mps = self.airspeed.unwrap_or(DEFAULT_AIRSPEED_MPS);
        let plan = compose(&world, source, destination, airspeed_mps, &mut scratch);
        if let (Some(format), Some(plan)) = (self.format, &plan) {
            let name = route_name(topology, source, destination);
            let route = Route::of_composition(name, plan, airspace.as_of(), &[]);
            format.write(&route, &airspace, output)?;
            return Ok(Verdict::Done);
        }
        if self.format.is_some() {
            let ends = [source, destination].map(|node| node_text(topology, node));
            return Err(no_route_to_write(&ends));
        }
        match (self.json, &plan) {
            (true, _) => output.json(&composition_json(
                topology,
                (source, destination),
                airspeed_mps,
                plan.as_ref(),
            ))?,
            (false, Some(plan)) => print(topology, plan, airspeed_mps, output)?,
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

    /// The same with a drone.
    fn fly(
        &self,
        topology: &Arc<Topology>,
        ends: (NodeIx, NodeIx),
        output: &Output,
    ) -> Result<Verdict, Stop> {
        let airspace = self.flight.airspace(&self.airspace, topology, output)?;
        let flight = self.flight.flight(&airspace, output)?;
        let stops = self.stop.iter().map(|text| service_stop(topology, text));
        let stops = stops.collect::<Result<Vec<_>, _>>()?;
        let wanted = Wanted {
            json: self.json,
            format: self.format,
            certificate: self.certificate.as_deref(),
            svg: self.svg.as_deref(),
        };
        flight::compose(&flight, (ends, &stops), &wanted, output)?;
        Ok(Verdict::Done)
    }
}

/// A stop with its service time, none where it states none. An id may have an equals sign itself.
fn service_stop(topology: &Topology, text: &str) -> Result<ServiceStop, Stop> {
    let timed = text.rsplit_once('=').and_then(|(id, seconds)| {
        let seconds = seconds.parse::<f64>().ok();
        let possible = seconds.filter(|seconds| seconds.is_finite() && *seconds >= 0.0);
        Some((id, possible?))
    });
    let (id, service_s) = timed.unwrap_or((text, 0.0));
    let node = names::node(topology, id)?;
    if topology.pads(node) == 0 {
        return Err(Stop::failed(format!("node {id} has no pad to stop on")));
    }
    Ok(ServiceStop { node, service_s })
}

/// Nothing is to be written where no way leads.
pub(super) fn no_route_to_write([source, destination]: &[String; 2]) -> Stop {
    Stop::failed(format!(
        "no route: no open way leads from {source} to {destination}"
    ))
}

fn print(
    topology: &Topology,
    plan: &Composition,
    airspeed_mps: f64,
    output: &Output,
) -> Result<(), Stop> {
    let columns = [
        ("leg", Align::Right),
        ("from", Align::Left),
        ("to", Align::Left),
        ("length", Align::Right),
        ("arrival", Align::Right),
        ("if it closes", Align::Left),
        ("alternate", Align::Left),
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
            safe_text(topology, leg.safe.as_ref()),
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
    let Some(detour) = &leg.if_closed else {
        return "not worked out".to_owned();
    };
    if let Some(extra_m) = detour.extra_m {
        let via = detour.nodes.get(1);
        let via = via.map_or("", |&node| topology.node_id(node));
        return format!("{extra_m:+.1} m by {via}");
    }
    match (detour.outcome, detour.nodes.last()) {
        (Outcome::Diverted, Some(&node)) => format!("divert to {}", node_text(topology, node)),
        (outcome, _) => outcome.name().to_owned(),
    }
}

fn safe_text(topology: &Topology, safe: Option<&Alternate>) -> String {
    safe.map_or_else(
        || "none".to_owned(),
        |safe| {
            let node = node_text(topology, safe.node);
            format!("{node}, {}", metres(safe.length_m))
        },
    )
}

//! `skyway network criticality`: what each segment, node and pad costs the deliveries if it fails.

use crate::cli::files;
use crate::cli::network_source::NetworkArguments;
use crate::cli::output::{Align, Output, titled_table};
use crate::cli::picture::PictureArguments;
use crate::cli::stop::{Stop, Verdict};
use crate::draw::{Picture, PictureOptions, svg};
use crate::formats::{read_demand, write_criticality};
use crate::network::{NodeIx, SegmentIx, Topology};
use crate::routing::{Cost, Criticality, Demand, Fleet, criticality, uniform_demand};
use clap::Args;
use std::path::PathBuf;

const EXAMPLES: &str = "\
Examples:
  skyway network criticality
  skyway network criticality --network corridor --range 8000 -o corridor.geojson --map corridor.svg
  skyway network criticality --network town.geojson --demand deliveries.csv

Segments and nodes are measured on shortest routes; pads on the quickest routes whose stretches between pads \
are within range. Each failure is taken alone, with all others intact.";

/// Between more nodes than this, deliveries have to be named.
const MAX_NODES_WITHOUT_DEMAND: usize = 1_000;

/// Arguments of `skyway network criticality`.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(in crate::cli) struct Criticalities {
    #[command(flatten)]
    network: NetworkArguments,
    /// The deliveries: CSV with the columns from, to, deliveries [default: one from every node to every other]
    #[arg(help_heading = "Fleet", long, value_name = "FILE")]
    demand: Option<PathBuf>,
    /// The longest stretch between two pads, in metres
    #[arg(
        help_heading = "Fleet",
        long,
        value_name = "METRES",
        default_value_t = 10_000.0
    )]
    range: f64,
    /// Speed over ground, in metres per second
    #[arg(
        help_heading = "Fleet",
        long,
        value_name = "SPEED",
        default_value_t = 16.0
    )]
    speed: f64,
    /// What a stop at a pad takes, in minutes
    #[arg(
        help_heading = "Fleet",
        long,
        value_name = "MINUTES",
        default_value_t = 30.0
    )]
    stop: f64,
    #[command(flatten)]
    picture: PictureArguments,
    /// How many segments, nodes and pads are listed
    #[arg(
        help_heading = "Output",
        long,
        value_name = "COUNT",
        default_value_t = 10
    )]
    top: usize,
    /// Write the cost of every failure as GeoJSON (.gz compresses)
    #[arg(help_heading = "Output", long, short, value_name = "FILE")]
    output: Option<PathBuf>,
    /// Draw a map (SVG)
    #[arg(help_heading = "Output", long, value_name = "FILE")]
    map: Option<PathBuf>,
}

/// What fails, what each costs, and how each is called.
type Kind<'a> = (&'a str, &'a [Cost], &'a dyn Fn(usize) -> String);

impl Criticalities {
    pub(super) fn run(&self, output: &Output) -> Result<Verdict, Stop> {
        let fleet = self.fleet()?;
        let network = self.network.load(output)?;
        let topology = &network.topology;
        let demand = self.demand(topology)?;
        let found = criticality(topology, &demand, &fleet);
        if let Some(path) = &self.output {
            files::write_text(path, &write_criticality(topology, &found), output)?;
        }
        if let Some(path) = &self.map {
            let buildings = self.picture.ground_plans(topology)?;
            let picture = Picture {
                buildings: &buildings,
                criticality: Some(&found),
                options: PictureOptions {
                    title: Some(format!("{}: what fails at what cost", topology.name())),
                    ..self.picture.options()
                },
                ..Picture::of(topology)
            };
            files::write_text(path, &svg(&picture), output)?;
        }
        output.note(&format!(
            "{} deliveries, {} without a route and {} more out of range with everything intact",
            count_text(found.deliveries),
            count_text(found.without_route),
            count_text(found.out_of_range)
        ));
        self.print(topology, &found, output)
    }

    fn fleet(&self) -> Result<Fleet, Stop> {
        let above_0 = [("--range", self.range), ("--speed", self.speed)];
        for (name, value) in above_0 {
            if !(value.is_finite() && value > 0.0) {
                return Err(Stop::Usage(format!(
                    "{name} is {value}; give a number above 0"
                )));
            }
        }
        if !(self.stop.is_finite() && self.stop >= 0.0) {
            let problem = format!("--stop is {}; give minutes, 0 or more", self.stop);
            return Err(Stop::Usage(problem));
        }
        Ok(Fleet {
            range_m: self.range,
            speed_mps: self.speed,
            stop_minutes: self.stop,
        })
    }

    fn demand(&self, topology: &Topology) -> Result<Vec<Demand>, Stop> {
        let nodes = topology.node_count();
        match &self.demand {
            Some(path) => read_demand(topology, &files::read_text(path)?)
                .map_err(|problems| Stop::all_of(&path.display().to_string(), &problems)),
            None if nodes > MAX_NODES_WITHOUT_DEMAND => Err(Stop::Usage(format!(
                "name the deliveries with --demand: from each of {nodes} nodes to every other they are too many"
            ))),
            None => Ok(uniform_demand(topology)),
        }
    }

    /// The costliest failures of each kind: first those that lose deliveries.
    fn print(
        &self,
        topology: &Topology,
        found: &Criticality,
        output: &Output,
    ) -> Result<Verdict, Stop> {
        let columns = [
            ("fails", Align::Left),
            ("id", Align::Left),
            ("lost", Align::Right),
            ("diverted", Align::Right),
            ("grounded", Align::Right),
            ("rerouted", Align::Right),
            ("extra km", Align::Right),
            ("extra min", Align::Right),
            ("min each", Align::Right),
        ];
        let mut table = titled_table(&columns);
        let node = |place: usize| topology.node_id(NodeIx(place as u32)).to_owned();
        let segment = |place: usize| topology.segment_id(SegmentIx(place as u32)).into_owned();
        let kinds: [Kind<'_>; 3] = [
            ("segment", &found.segments, &segment),
            ("node", &found.nodes, &node),
            ("pads", &found.pads, &node),
        ];
        for (kind, costs, id) in kinds {
            for place in costliest(costs).into_iter().take(self.top) {
                let cost = costs[place];
                let is_rerouted = cost.rerouted > 0.0;
                let each = if is_rerouted {
                    cost.extra_minutes / cost.rerouted
                } else {
                    0.0
                };
                table.add_row([
                    kind.to_owned(),
                    id(place),
                    count_text(cost.lost),
                    count_text(cost.diverted),
                    count_text(cost.grounded),
                    count_text(cost.rerouted),
                    format!("{:.1}", cost.extra_m / 1e3),
                    format!("{:.1}", cost.extra_minutes),
                    format!("{each:.2}"),
                ]);
            }
        }
        output.table(&table)?;
        Ok(Verdict::Done)
    }
}

/// A count of deliveries, which may have a fraction; sums of fractions differ in their last digits.
fn count_text(deliveries: f64) -> String {
    ((deliveries * 1e6).round() / 1e6).to_string()
}

/// The places of the costs that are any, the greatest loss first, then the longest delay.
fn costliest(costs: &[Cost]) -> Vec<usize> {
    let mut places: Vec<usize> = (0..costs.len())
        .filter(|&place| costs[place].lost > 0.0 || costs[place].extra_minutes > 0.0)
        .collect();
    places.sort_by(|&one, &other| {
        let (one, other) = (&costs[one], &costs[other]);
        let by_loss = other.lost.total_cmp(&one.lost);
        by_loss.then_with(|| other.extra_minutes.total_cmp(&one.extra_minutes))
    });
    places
}

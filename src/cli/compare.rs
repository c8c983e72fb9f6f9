//! `skyway compare`: every strategy on the same failure, in one table.

use super::airspace_source::AirspaceArguments;
use super::answer_table::answer_fields;
use super::clock;
use super::failure::FailureArguments;
use super::method::{ParameterArguments, scope_name};
use super::network_source::NetworkArguments;
use super::output::{
    Align, Output, metres, metres_or_dash, overhead, percent_or_dash, time, titled_table,
};
use super::plan;
use super::reroute::draw;
use super::stop::{Stop, Verdict};
use crate::compose::prepare_table;
use crate::formats::{node_id_json, warning_text};
use crate::network::Topology;
use crate::recompose::{
    Outcome, Recomposition, Request, Scope, Scratch, Strategy, World, recompose,
};
use clap::{ArgGroup, Args};
use serde_json::{Map, Value, json};
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::time::Duration;

const EXAMPLES: &str = "\
Examples:
  skyway compare --service 379,406 --destination 450
  skyway compare --service 379,406 --destination 450 --close 408 --json
  skyway compare --service 379,406 --destination 450 --svg exact.svg

`recomposed` is the new part: from A to B for a local strategy, the whole path otherwise. `remaining` \
is the whole route to the destination, and `overhead` what it is longer than the optimum. `time` is \
the median of many repetitions, the construction of search areas included. The table of distances to \
the destination, which `exact, with table` finds ready, is measured apart.";

/// A method is repeated at least this often, however long it takes.
const FEWEST_REPETITIONS: usize = 5;
/// And after that no longer than this.
const TIME_FOR_REPETITIONS: Duration = Duration::from_millis(50);
/// But one that takes this long is not repeated at all.
const TOO_LONG_TO_REPEAT: Duration = Duration::from_secs(1);

/// Arguments of `skyway compare`.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES, group(ArgGroup::new("what").required(true).args(["service"])))]
pub(super) struct Compare {
    #[command(flatten)]
    network: NetworkArguments,
    #[command(flatten)]
    failure: FailureArguments,
    #[command(flatten)]
    parameters: ParameterArguments,
    #[command(flatten)]
    airspace: AirspaceArguments,
    /// How often each strategy is repeated at most, to measure it; within 50 ms each, but at least 5 times
    #[arg(help_heading = "Output", long, value_name = "COUNT", default_value_t = 200, value_parser = clap::value_parser!(u32).range(1..))]
    repetitions: u32,
    /// Draw the exact answer
    #[arg(help_heading = "Output", long, value_name = "FILE")]
    svg: Option<PathBuf>,
    /// Write JSON under the names of the API
    #[arg(help_heading = "Output", long)]
    json: bool,
}

/// A strategy with its scope, with a table of distances to the destination or without.
struct Method {
    strategy: Strategy,
    scope: Scope,
    has_table: bool,
}

impl Method {
    fn name(&self) -> String {
        let strategy = self.strategy.name();
        match (self.strategy, self.has_table) {
            (Strategy::Exact, true) => format!("{strategy}, with table"),
            (Strategy::Exact, false) => format!("{strategy}, without"),
            (Strategy::TwoPhased | Strategy::CellDensity | Strategy::Radius, _) => {
                strategy.to_owned()
            }
            _ => format!("{strategy}, {}", scope_name(self.scope)),
        }
    }
}

/// What a method answered.
struct Compared {
    method: Method,
    answer: Recomposition,
    median_us: f64,
    repetitions: usize,
}

fn methods() -> Vec<Method> {
    let method = |strategy, scope, has_table| Method {
        strategy,
        scope,
        has_table,
    };
    let mut methods = vec![method(Strategy::Exact, Scope::Global, true)];
    let others = Strategy::ALL.into_iter();
    for strategy in others {
        let scopes: &[Scope] = match strategy {
            Strategy::Dijkstra | Strategy::Astar | Strategy::BellmanFord => {
                &[Scope::Local, Scope::Global]
            }
            _ => &[Scope::Global],
        };
        methods.extend(scopes.iter().map(|&scope| method(strategy, scope, false)));
    }
    methods
}

impl Compare {
    pub(super) fn run(&self, output: &Output) -> Result<Verdict, Stop> {
        let network = self.network.load(output)?;
        let topology = &network.topology;
        let airspace = self.airspace.open(topology, output)?;
        let failure = Request {
            parameters: self.parameters.checked()?,
            optimum: true,
            ..Request::exact(self.failure.report(topology)?)
        };
        let tables = plan::tables();
        let with_table = World {
            airspace: &airspace,
            trees: Some(&tables),
        };
        let mut scratch = Scratch::new(topology);
        let destination = failure.report.destination;
        let ((), table) = clock::timed(|| {
            prepare_table(&with_table, destination, scratch.searcher());
        });
        let compared: Vec<Compared> = methods()
            .into_iter()
            .map(|method| self.measure(method, &failure, &with_table, &mut scratch))
            .collect();
        let table_us = clock::microseconds(table);
        if self.json {
            output.json(&json(&with_table, &failure, &compared, table_us)?)?;
        } else {
            print(&with_table, &failure, &compared, table_us, output)?;
        }
        if cfg!(debug_assertions) {
            output.note("this build checks its assertions; for figures build with --profile dist");
        }
        if let Some(file) = &self.svg {
            let request = Request {
                explain: true,
                ..failure
            };
            let exact = recompose(&with_table, &request, &mut scratch);
            draw(file, &airspace, &request, &exact, output)?;
        }
        Ok(Verdict::Done)
    }

    fn measure(
        &self,
        method: Method,
        failure: &Request,
        with_table: &World<'_>,
        scratch: &mut Scratch,
    ) -> Compared {
        let request = Request {
            strategy: method.strategy,
            scope: method.scope,
            ..failure.clone()
        };
        let world = World {
            trees: with_table.trees.filter(|_| method.has_table),
            ..*with_table
        };
        let answer = recompose(&world, &request, scratch);
        let bare = Request {
            optimum: false,
            ..request
        };
        let mut times: Vec<Duration> = Vec::new();
        let mut total = Duration::ZERO;
        let most = self.repetitions as usize;
        let fewest = FEWEST_REPETITIONS.min(most);
        loop {
            let allowed = match times.len() {
                0 => Duration::MAX,
                few if few < fewest => TOO_LONG_TO_REPEAT,
                _ => TIME_FOR_REPETITIONS,
            };
            if times.len() >= most || total >= allowed {
                break;
            }
            let (_, elapsed) = clock::timed(|| recompose(&world, &bare, scratch));
            times.push(elapsed);
            total += elapsed;
        }
        times.sort_unstable();
        Compared {
            method,
            answer,
            median_us: clock::microseconds(times[times.len() / 2]),
            repetitions: times.len(),
        }
    }
}

fn print(
    world: &World<'_>,
    failure: &Request,
    compared: &[Compared],
    table_us: f64,
    output: &Output,
) -> Result<(), Stop> {
    let topology = world.airspace.topology();
    let columns = [
        ("strategy", Align::Left),
        ("recomposed", Align::Right),
        ("remaining", Align::Right),
        ("overhead", Align::Right),
        ("area nodes", Align::Right),
        ("settled", Align::Right),
        ("searches", Align::Right),
        ("stage", Align::Left),
        ("outcome", Align::Left),
        ("time", Align::Right),
    ];
    let mut table = titled_table(&columns);
    let mut remarks: BTreeMap<String, Vec<String>> = BTreeMap::new();
    for row in compared {
        let answer = &row.answer;
        let reaches = matches!(answer.outcome, Outcome::Rerouted | Outcome::Unaffected);
        let percent = overhead(answer.remaining_length_m, answer.remaining_optimum_m);
        table.add_row([
            row.method.name(),
            metres_or_dash(answer.recomposed_length_m),
            metres_or_dash(answer.remaining_length_m),
            percent_or_dash(percent.filter(|_| reaches)),
            answer.area_nodes.to_string(),
            answer.settled_nodes.to_string(),
            answer.searches.to_string(),
            answer.stage.name().to_owned(),
            answer.outcome.name().to_owned(),
            time(row.median_us),
        ]);
        let fallback = answer.fallback.as_ref().map(|reason| {
            let used = answer.strategy_used.name();
            format!("{used} answered instead, as {reason}")
        });
        let warnings = answer.warnings.iter();
        let warnings = warnings.map(|warning| warning_text(topology, warning).1);
        for remark in fallback.into_iter().chain(warnings) {
            remarks.entry(remark).or_default().push(row.method.name());
        }
    }
    output.line(&title(topology, failure))?;
    output.line("")?;
    output.table(&table)?;
    output.line("")?;
    for line in closing_lines(topology, failure, compared, table_us) {
        output.line(&line)?;
    }
    for (remark, methods) in remarks {
        let everyone = methods.len() == compared.len();
        let whose = if everyone {
            "all".to_owned()
        } else {
            methods.join("; ")
        };
        output.warn(&format!("{whose}: {remark}"));
    }
    Ok(())
}

fn title(topology: &Topology, failure: &Request) -> String {
    let (from, to) = failure.report.leg;
    let [from, to, destination] =
        [from, to, failure.report.destination].map(|node| topology.node_id(node));
    let kind = failure.report.failure.name();
    format!("{kind} failure on {from} - {to}, destination {destination}")
}

fn closing_lines(
    topology: &Topology,
    failure: &Request,
    compared: &[Compared],
    table_us: f64,
) -> Vec<String> {
    let mut lines = Vec::new();
    if let Some(first) = compared.first() {
        let (from, to) = failure.report.leg;
        let [from, to] = [from, to].map(|node| topology.node_id(node));
        lines.push(format!(
            "optimum {} from the drone to the destination, {} from {from} to {to}",
            metres_or_dash(first.answer.remaining_optimum_m),
            metres_or_dash(first.answer.local_optimum_m),
        ));
    }
    let size = metres(topology.size_m());
    let table = time(table_us);
    lines.push(format!(
        "table of the destination: {table}, made once, before anything fails; network size {size}"
    ));
    lines
}

fn json(
    world: &World<'_>,
    failure: &Request,
    compared: &[Compared],
    table_us: f64,
) -> Result<Value, Stop> {
    let topology = world.airspace.topology();
    let id = |node| node_id_json(topology, node);
    let answers: Result<Vec<Value>, Stop> = compared
        .iter()
        .map(|row| {
            let mut fields = Map::new();
            fields.insert("name".to_owned(), json!(row.method.name()));
            fields.insert("scope".to_owned(), json!(row.method.scope));
            fields.insert("table".to_owned(), json!(row.method.has_table));
            fields.extend(answer_fields(world.airspace, &row.answer, &[])?);
            fields.insert("elapsed_us".to_owned(), json!(row.median_us));
            fields.insert("repetitions".to_owned(), json!(row.repetitions));
            Ok(Value::Object(fields))
        })
        .collect();
    let (from, to) = failure.report.leg;
    Ok(json!({
        "network": topology.name(),
        "type": failure.report.failure,
        "service": {"from": id(from), "to": id(to)},
        "destination": id(failure.report.destination),
        "table_us": table_us,
        "answers": answers?,
    }))
}

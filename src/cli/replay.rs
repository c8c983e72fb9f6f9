//! `skyway replay`: tells what was asked and why it was answered so, by computing the answer again from what its edge kept.
//!
//! The recorded world and the settled report are all that goes in: no tables, no plans, no telemetry. The same
//! outcome and the same length, to 1e-9 of it, have to come out; the path may differ only where lengths tie.

use super::answer_table::{causes_text, strategy_text};
use super::edge::runtime;
use super::output::Output;
use super::remote::{Remote, START_OR_NAME};
use super::stop::{Stop, Verdict};
use crate::checked::{self, Alternatives, Known};
use crate::edge::{SqliteFile, StoreFile, read_decision, read_network};
use crate::formats::{flight_cause_text, load_network, read_flight_question, recorded_question};
use crate::network::{NodeIx, Topology};
use crate::recompose::{Outcome, Scratch, Stage, World, recompose};
use crate::wire::Record;
use clap::Args;
use serde_json::json;
use std::path::{Path, PathBuf};
use std::sync::Arc;

const EXAMPLES: &str = "\
Examples:
  skyway replay 1795269600000-17
  skyway replay 1795269600000-17 --edge http://127.0.0.1:8080 --json
  skyway replay 1795269600000-17 --store edge.db    without an edge, or beside it

Exit codes: 0 when the same answer comes out, 1 when another does, 4 when the edge cannot be reached.";

/// Two lengths are the same when they differ by less than this share.
const TOLERANCE: f64 = 1e-9;

/// Arguments of `skyway replay`.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct Replay {
    /// Id of the recomposition
    #[arg(value_name = "ID")]
    id: String,
    /// The edge that gave the answer
    #[arg(long, value_name = "URL", default_value = "http://127.0.0.1:8080")]
    edge: String,
    /// The file of an edge, in place of an edge
    #[arg(long, value_name = "FILE", conflicts_with_all = ["edge", "token_file"])]
    store: Option<PathBuf>,
    /// A file with the token to show to the edge
    #[arg(long, value_name = "FILE")]
    token_file: Option<PathBuf>,
    /// Write JSON
    #[arg(long)]
    json: bool,
}

/// The answer computed again.
struct Again {
    outcome: Outcome,
    length_m: Option<f64>,
    nodes: Vec<NodeIx>,
    strategy: String,
    stage: Stage,
    /// What cuts the drone off; empty where nothing does.
    causes: String,
}

/// How the answer computed again compares with the recorded one.
struct Comparison {
    recorded_outcome: String,
    outcome: String,
    recorded_length_m: Option<f64>,
    length_m: Option<f64>,
    same_path: bool,
    same_network: bool,
}

impl Comparison {
    fn is_same(&self) -> bool {
        let same_length = match (self.recorded_length_m, self.length_m) {
            (Some(recorded_m), Some(length_m)) => {
                (recorded_m - length_m).abs() <= TOLERANCE * recorded_m.abs().max(1.0)
            }
            (None, None) => true,
            _ => false,
        };
        self.same_network && self.recorded_outcome == self.outcome && same_length
    }
}

impl Replay {
    pub(super) fn run(&self, output: &Output) -> Result<Verdict, Stop> {
        let (record, network) = match &self.store {
            Some(store) => runtime()?.block_on(self.look_up(store))?,
            None => self.ask()?,
        };
        let loaded = load_network(&network)
            .map_err(|error| Stop::all_of("the edge's network", &error.lines()))?;
        let topology = Arc::new(loaded.topology);
        let again = compute(&record, &topology)?;
        let comparison = compare(&record, &again, &topology);
        match self.json {
            true => output.json(&json!({
                "same": comparison.is_same(),
                "same_path": comparison.same_path,
                "same_network": comparison.same_network,
                "recorded": {"outcome": comparison.recorded_outcome, "remaining_length_m": comparison.recorded_length_m},
                "computed": {"outcome": comparison.outcome, "remaining_length_m": comparison.length_m},
                "record": record,
            }))?,
            false => {
                tell_asked(&record, output)?;
                tell_answers(&record, &again, &comparison, output)?;
            }
        }
        Ok(match comparison.is_same() {
            true => Verdict::Done,
            false => Verdict::Negative,
        })
    }

    /// The record and the network from the edge.
    fn ask(&self) -> Result<(Record<'static>, String), Stop> {
        let remedy =
            format!("{START_OR_NAME}, or read the file that one keeps with --store edge.db");
        let remote = Remote::of(&self.edge, self.token_file.as_deref(), remedy)?;
        let (record, network) = runtime()?.block_on(async {
            let record = remote
                .get(&format!("/v1/recompositions/{}", self.id))
                .await?;
            Ok::<_, Stop>((record, remote.get("/v1/network").await?))
        })?;
        let record: Record<'static> = serde_json::from_slice(&record)
            .map_err(|error| Stop::failed(format!("the edge's record cannot be read: {error}")))?;
        let network = String::from_utf8(network).map_err(Stop::failed)?;
        Ok((record, network))
    }

    /// The same from the file of an edge, which may have it open.
    async fn look_up(&self, store: &Path) -> Result<(Record<'static>, String), Stop> {
        let mut file: Box<dyn StoreFile> = Box::new(
            SqliteFile::open_to_read(store)
                .await
                .map_err(Stop::failed)?,
        );
        let found = read_decision(&mut *file, &self.id).await;
        let found = found.map_err(Stop::failed)?.ok_or_else(|| {
            Stop::failed(format!(
                "{} keeps no recomposition '{}'",
                store.display(),
                self.id
            ))
        })?;
        let network = read_network(&mut *file).await.map_err(Stop::failed)?;
        file.close().await;
        Ok((found.into_record(), network.unwrap_or_default()))
    }
}

/// When it was asked, on what world, and what, with all that was looked up or assumed.
fn tell_asked(record: &Record<'_>, output: &Output) -> Result<(), Stop> {
    let closures = record.world.closures.len();
    output.line(&format!(
        "answered: {}, at revision {}, with {closures} {} in force",
        record.answered_at,
        record.world.revision,
        if closures == 1 { "closure" } else { "closures" },
    ))?;
    let asked = serde_json::to_string(&record.settled_report).map_err(Stop::failed)?;
    output.line(&format!("asked: {asked}"))
}

/// What was answered and what comes out now, and why.
fn tell_answers(
    record: &Record<'_>,
    again: &Again,
    comparison: &Comparison,
    output: &Output,
) -> Result<(), Stop> {
    for warning in &record.answer.answer.warnings {
        output.line(&format!("noted: {}: {}", warning.code, warning.message))?;
    }
    if !comparison.same_network {
        output.line("not the same: the edge's network is another one than recorded")?;
    }
    let length = |length_m: Option<f64>| {
        length_m.map_or("no path".to_owned(), |length_m| format!("{length_m:.3} m"))
    };
    output.line(&format!(
        "recorded: {}, {}",
        comparison.recorded_outcome,
        length(comparison.recorded_length_m)
    ))?;
    output.line(&format!(
        "computed: {}, {}; by {}, searched: {}",
        comparison.outcome,
        length(comparison.length_m),
        again.strategy,
        again.stage.name(),
    ))?;
    if !again.causes.is_empty() {
        output.line(&format!("cut off by: {}", again.causes))?;
    }
    output.line(match (comparison.is_same(), comparison.same_path) {
        (true, true) => "the same answer",
        (true, false) => "the same answer, by another path of the same length",
        (false, _) => "not the same answer",
    })
}

/// Computes the answer to the settled report on the recorded world.
fn compute(record: &Record<'_>, topology: &Arc<Topology>) -> Result<Again, Stop> {
    let (airspace, read) = recorded_question(record, topology).map_err(Stop::failed)?;
    if let Some(question) = &record.world.flight {
        let question = read_flight_question(question, &airspace).map_err(Stop::failed)?;
        let answer = question.answer(&read.request);
        let causes = answer.causes.iter();
        let causes = causes.map(|cause| flight_cause_text(question.skies(), cause).1);
        let plan = answer.composition.as_ref();
        return Ok(Again {
            outcome: answer.outcome,
            length_m: plan.map(|plan| plan.plan.distance_m),
            nodes: plan.map_or_else(Vec::new, |plan| plan.nodes()),
            strategy: format!("{}, in flight", answer.strategy_used.name()),
            stage: answer.stage,
            causes: causes.collect::<Vec<String>>().join(", "),
        });
    }
    let world = World {
        airspace: &airspace,
        trees: None,
    };
    let mut scratch = Scratch::new(topology);
    let found = recompose(&world, &read.request, &mut scratch);
    let alternatives = Alternatives {
        reported: read.request.report.remaining_path.as_deref(),
        ..Alternatives::default()
    };
    let (request, known) = (&read.request, Known::default());
    let answer = checked::pass(
        &airspace,
        request,
        &known,
        alternatives,
        found,
        &mut scratch,
    )
    .answer;
    Ok(Again {
        outcome: answer.outcome,
        length_m: answer.remaining_length_m,
        strategy: strategy_text(&answer),
        stage: answer.stage,
        causes: match answer.severed_by.is_empty() {
            true => String::new(),
            false => causes_text(&answer),
        },
        nodes: answer.path.nodes,
    })
}

fn compare(record: &Record<'_>, again: &Again, topology: &Topology) -> Comparison {
    let recorded = &record.answer.answer;
    let nodes = again.nodes.iter().map(|&node| topology.node_id(node));
    let fingerprint = topology.fingerprint_text();
    let recorded_outcome = serde_json::to_value(recorded.outcome).unwrap_or_default();
    Comparison {
        recorded_outcome: recorded_outcome.as_str().unwrap_or_default().to_owned(),
        outcome: again.outcome.name().to_owned(),
        recorded_length_m: recorded.remaining_length_m,
        length_m: again.length_m,
        same_path: recorded.path.nodes.iter().map(|id| id.text()).eq(nodes),
        same_network: record.world.network_sha256 == fingerprint,
    }
}

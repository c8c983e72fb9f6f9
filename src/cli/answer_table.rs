//! A recomposition, measured, and as a table for people.

use super::clock;
use super::output::{
    Align, Output, facts_table, metres, metres_or_dash, overhead, percent_or_dash, time,
    titled_table,
};
use super::stop::Stop;
use crate::airspace::Airspace;
use crate::checked::{self, Alternatives, Known};
use crate::formats::{self, ReadWarning, warning_text};
use crate::network::{NodeIx, Topology};
use crate::recompose::{Outcome, Recomposition, Request, Scratch, Severance, World, recompose};
use serde_json::{Map, Value, json};

/// An answer and how long it took.
#[derive(Debug)]
pub(super) struct TimedAnswer {
    pub(super) recomposition: Recomposition,
    /// The construction of search areas included, optima and explanations not.
    pub(super) elapsed_us: f64,
    /// What was wrong with the answer that this one stands in for.
    pub(super) refused: Option<String>,
}

/// Answers a request, and measures the answer alone: what is asked for beside it is computed afterwards.
pub(super) fn answer(world: &World<'_>, request: &Request, scratch: &mut Scratch) -> TimedAnswer {
    let bare = Request {
        optimum: false,
        explain: false,
        ..request.clone()
    };
    let (recomposition, elapsed) = clock::timed(|| recompose(world, &bare, scratch));
    let asks_for_more = request.optimum || request.explain;
    let found = match asks_for_more {
        true => recompose(world, request, scratch),
        false => recomposition,
    };
    let alternatives = Alternatives {
        reported: request.report.remaining_path.as_deref(),
        ..Alternatives::default()
    };
    let airspace = world.airspace;
    let checked = checked::pass(
        airspace,
        request,
        &Known::default(),
        alternatives,
        found,
        scratch,
    );
    let topology = airspace.topology();
    TimedAnswer {
        recomposition: checked.answer,
        elapsed_us: clock::microseconds(elapsed),
        refused: checked.case.map(|case| case.fault.text(topology)),
    }
}

impl TimedAnswer {
    /// The answer under the names of the wire.
    pub(super) fn json(
        &self,
        world: &World<'_>,
        warnings: &[ReadWarning],
    ) -> Result<Map<String, Value>, Stop> {
        let mut fields = answer_fields(world.airspace, &self.recomposition, warnings)?;
        fields.insert("elapsed_us".to_owned(), json!(self.elapsed_us));
        if let Some(refused) = &self.refused {
            fields.insert("checker_case".to_owned(), json!(refused));
        }
        Ok(fields)
    }
}

/// An answer under the names of the wire, with the revisions it was computed on.
pub(super) fn answer_fields(
    airspace: &Airspace,
    recomposition: &Recomposition,
    warnings: &[ReadWarning],
) -> Result<Map<String, Value>, Stop> {
    let answer = formats::answer(airspace, recomposition, warnings);
    let written = serde_json::to_value(answer)
        .and_then(serde_json::from_value::<Map<String, Value>>)
        .map_err(|error| Stop::failed(format!("cannot write the answer as JSON: {error}")));
    let mut fields = written?;
    let revisions = [
        ("topology_revision", airspace.topology_revision()),
        ("revision", airspace.revision()),
    ];
    for (name, revision) in revisions {
        fields.insert(name.to_owned(), json!(revision));
    }
    Ok(fields)
}

/// Prints an answer for people.
pub(super) fn print(
    topology: &Topology,
    answered: &TimedAnswer,
    explain: bool,
    output: &Output,
) -> Result<(), Stop> {
    let answer = &answered.recomposition;
    output.table(&facts_table(facts(topology, answered)))?;
    if !answer.path.segments.is_empty() {
        output.line("")?;
        print_path(topology, answer, output)?;
    }
    if !answer.repairs.is_empty() {
        output.line("")?;
        print_repairs(topology, answer, output)?;
    }
    if explain && !answer.stages.is_empty() {
        output.line("")?;
        print_stages(answer, output)?;
    }
    for warning in &answer.warnings {
        let (_, message) = warning_text(topology, warning);
        output.warn(&message);
    }
    if let Some(refused) = &answered.refused {
        let message = format!("the checker did not let another answer pass: {refused}");
        output.warn(&message);
    }
    Ok(())
}

fn facts(topology: &Topology, answered: &TimedAnswer) -> Vec<(&'static str, String)> {
    let answer = &answered.recomposition;
    let best_m = answer.remaining_optimum_m;
    let percent = overhead(answer.remaining_length_m, best_m);
    let overhead = match answer.outcome {
        Outcome::Rerouted | Outcome::Unaffected | Outcome::Hold => percent_or_dash(percent),
        Outcome::Diverted | Outcome::NoRoute => "-".to_owned(),
    };
    let area = format!(
        "{} nodes, {} segments",
        answer.area_nodes, answer.area_segments
    );
    let mut facts = vec![("outcome", outcome_text(topology, answer))];
    if !answer.severed_by.is_empty() {
        facts.push(("cut off by", causes_text(answer)));
    }
    facts.extend([
        ("strategy", strategy_text(answer)),
        ("recomposed", metres_or_dash(answer.recomposed_length_m)),
        ("remaining", metres_or_dash(answer.remaining_length_m)),
        ("first stretch", metres(answer.first_stretch_m)),
        (
            "overhead",
            format!("{overhead} of {}", metres_or_dash(best_m)),
        ),
        ("stage", answer.stage.name().to_owned()),
        ("searches", answer.searches.to_string()),
        ("area", area),
        ("settled", format!("{} nodes", answer.settled_nodes)),
        ("time", time(answered.elapsed_us)),
    ]);
    facts
}

fn outcome_text(topology: &Topology, answer: &Recomposition) -> String {
    let last = answer.path.nodes.last();
    let last = last.map_or_else(String::new, |&node| node_text(topology, node));
    match answer.outcome {
        Outcome::Rerouted => "rerouted".to_owned(),
        Outcome::Unaffected => "unaffected: the plan stands".to_owned(),
        Outcome::Hold => "hold, then rerouted".to_owned(),
        Outcome::Diverted => format!("diverted to {last}"),
        Outcome::NoRoute => "no route".to_owned(),
    }
}

pub(super) fn causes_text(answer: &Recomposition) -> String {
    let causes: Vec<String> = answer
        .severed_by
        .iter()
        .map(|cause| match cause {
            Severance::Report => "the failure itself".to_owned(),
            Severance::Closure(id) => format!("closure '{id}'"),
            Severance::Network => "the network, which ends there".to_owned(),
        })
        .collect();
    causes.join(", ")
}

/// The strategy that answered, and why, where it is not the one that was asked for.
pub(super) fn strategy_text(answer: &Recomposition) -> String {
    let (asked, used) = (answer.strategy.name(), answer.strategy_used.name());
    match &answer.fallback {
        Some(reason) => format!("{used} instead of {asked}: {reason}"),
        None => used.to_owned(),
    }
}

/// A node as people call it: its id, and its name where it has one.
pub(super) fn node_text(topology: &Topology, node: NodeIx) -> String {
    let id = topology.node_id(node);
    match topology.node_name(node) {
        Some(name) => format!("{id} ({name})"),
        None => id.to_owned(),
    }
}

fn print_path(topology: &Topology, answer: &Recomposition, output: &Output) -> Result<(), Stop> {
    let columns = [
        ("leg", Align::Right),
        ("from", Align::Left),
        ("to", Align::Left),
        ("length", Align::Right),
        ("flown", Align::Right),
    ];
    let mut table = titled_table(&columns);
    let mut flown_m = answer.first_stretch_m;
    let ends = answer.path.nodes.windows(2);
    for (leg, (ends, &segment)) in (1..).zip(ends.zip(&answer.path.segments)) {
        let length_m = topology.segment(segment).length_m;
        flown_m += length_m;
        table.add_row([
            leg.to_string(),
            node_text(topology, ends[0]),
            node_text(topology, ends[1]),
            metres(length_m),
            metres(flown_m),
        ]);
    }
    output.table(&table)
}

fn print_repairs(topology: &Topology, answer: &Recomposition, output: &Output) -> Result<(), Stop> {
    let columns = [
        ("repair", Align::Left),
        ("length", Align::Right),
        ("stage", Align::Left),
        ("searches", Align::Right),
        ("area nodes", Align::Right),
        ("settled", Align::Right),
    ];
    let mut table = titled_table(&columns);
    for repair in &answer.repairs {
        let [from, to] = [repair.from, repair.to].map(|node| topology.node_id(node));
        table.add_row([
            format!("{from} to {to}"),
            metres_or_dash(repair.length_m),
            repair.stage.name().to_owned(),
            repair.searches.to_string(),
            repair.area_nodes.to_string(),
            repair.settled_nodes.to_string(),
        ]);
    }
    output.table(&table)
}

fn print_stages(answer: &Recomposition, output: &Output) -> Result<(), Stop> {
    let columns = [
        ("stage", Align::Left),
        ("nodes", Align::Right),
        ("what happened", Align::Left),
    ];
    let mut table = titled_table(&columns);
    for stage in &answer.stages {
        let what_happened = match (stage.skipped, stage.searched, stage.path_found) {
            (true, ..) => "skipped: few nodes",
            (_, _, true) => "searched, path found",
            (_, true, false) => "searched, no path",
            (_, false, false) => "not searched",
        };
        table.add_row([
            stage.stage.name().to_owned(),
            stage.nodes.len().to_string(),
            what_happened.to_owned(),
        ]);
    }
    output.table(&table)
}

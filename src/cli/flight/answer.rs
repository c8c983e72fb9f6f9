//! `skyway reroute` with a drone: what it is told in flight, with the battery that it has.

use super::composition::Wanted;
use super::{Flight, table};
use crate::cli::answer_table::node_text;
use crate::cli::output::{Output, facts_table, metres};
use crate::cli::stop::Stop;
use crate::delivery::{
    BatteryNow, DeliveryScratch, FlightComposition, FlightFailure, FlightRecomposition, Landing,
    Trouble, answer_failure,
};
use crate::formats::warning_text;
use crate::recompose::{Outcome, Request, UnsafeWay};
use serde_json::Value;

/// Answers a report and tells the answer.
pub(in crate::cli) fn answer(
    flight: &Flight,
    request: &Request,
    wanted: &Wanted<'_>,
    output: &Output,
) -> Result<(), Stop> {
    let failure = FlightFailure {
        request,
        at_s: flight.start_s,
        battery: BatteryNow::Given(flight.battery),
        objective: flight.objective,
        deadline_s: Some(flight.deadline_s),
        planned_stops: None,
        landing: Landing::of(
            request.report.failure,
            Trouble::of(request.circumstances.detail),
            flight.reported,
        ),
    };
    let mut scratch = DeliveryScratch::new(flight.skies.topology());
    let answer = answer_failure(&flight.world(), &failure, &mut scratch);
    match wanted.json {
        true => output.json(&Value::Object(flight.writer().recomposition(&answer)))?,
        false => print(flight, &answer, output)?,
    }
    let Some(composition) = &answer.composition else {
        return wanted.without_plan();
    };
    if let Some(file) = wanted.certificate {
        flight.write_certificate(file, composition, output)?;
    }
    let told = (&request.report, answer.outcome.name());
    match wanted.svg {
        Some(file) => flight.draw(file, composition, Some(told), output),
        None => Ok(()),
    }
}

fn print(flight: &Flight, answer: &FlightRecomposition, output: &Output) -> Result<(), Stop> {
    if let Some(composition) = &answer.composition {
        table::print_plan(flight, composition, output)?;
        output.line("")?;
        table::print_contingencies(flight, composition, output)?;
        output.line("")?;
    }
    let mut facts = vec![("outcome", outcome_text(flight, answer))];
    if !answer.causes.is_empty() {
        let causes = table::causes_text(flight, &answer.causes, answer.opens);
        facts.push(("cut off by", causes));
    }
    if let Some(way) = &answer.unsafe_way {
        facts.push(("near", near_text(flight, answer)));
        facts.push(("least bad", unsafe_text(flight, way)));
    }
    facts.push(("strategy", strategy_text(answer)));
    facts.push(("battery now", table::battery_text(answer.battery)));
    facts.push(("first stretch", metres(answer.first_stretch_m)));
    if let Some(composition) = &answer.composition {
        facts.extend(table::facts(flight, composition));
    }
    if !answer.flags.is_empty() {
        let flags: Vec<&str> = answer.flags.iter().map(|flag| flag.name()).collect();
        facts.push(("flags", flags.join(", ")));
    }
    output.table(&facts_table(facts))?;
    for warning in &answer.warnings {
        let (_, message) = warning_text(flight.skies.topology(), warning);
        output.warn(&message);
    }
    Ok(())
}

/// What is near a drone that has no way, a line for each node.
fn near_text(flight: &Flight, answer: &FlightRecomposition) -> String {
    let topology = flight.skies.topology();
    let lines = answer.near.iter().map(|near| {
        let battery = near.battery.unwrap_or_default();
        format!(
            "{}: {}, {} pads, {:.1} % left, {}",
            node_text(topology, near.node),
            metres(near.length_m),
            near.pads,
            100.0 * battery,
            near.why_not.name()
        )
    });
    lines.collect::<Vec<_>>().join("\n")
}

/// The least bad way of a drone that has no safe one.
fn unsafe_text(flight: &Flight, way: &UnsafeWay) -> String {
    let topology = flight.skies.topology();
    let nodes = way.nodes.iter().map(|&node| node_text(topology, node));
    format!(
        "{} by {}: {}",
        metres(way.length_m),
        nodes.collect::<Vec<_>>().join(", "),
        way.code.reason()
    )
}

fn outcome_text(flight: &Flight, answer: &FlightRecomposition) -> String {
    let topology = flight.skies.topology();
    let nodes = answer.composition.as_ref().map(FlightComposition::nodes);
    let last = nodes.and_then(|nodes| nodes.last().copied());
    let last = last.map_or_else(String::new, |node| node_text(topology, node));
    match (answer.outcome, answer.hold) {
        (Outcome::Hold, Some(hold)) => format!(
            "hold at {}, pad {}, until {}",
            node_text(topology, hold.node),
            hold.pad,
            table::instant_text(&flight.skies, hold.until_s)
        ),
        (Outcome::Hold, None) => "hold".to_owned(),
        (Outcome::Rerouted, _) => "rerouted".to_owned(),
        (Outcome::Unaffected, _) => "unaffected: the plan stands".to_owned(),
        (Outcome::Diverted, _) => match answer.reserve_used {
            true => format!("diverted to {last}, on the reserve"),
            false => format!("diverted to {last}"),
        },
        (Outcome::NoRoute, _) => "no route".to_owned(),
    }
}

fn strategy_text(answer: &FlightRecomposition) -> String {
    let (asked, used) = (answer.strategy.name(), answer.strategy_used.name());
    let mut text = match &answer.fallback {
        Some(reason) => format!("{used} instead of {asked}: {reason}"),
        None => used.to_owned(),
    };
    if !answer.unflyable_stages.is_empty() {
        let stages = answer.unflyable_stages.iter().map(|stage| stage.name());
        let stages: Vec<&str> = stages.collect();
        text.push_str(&format!("; cannot be flown by: {}", stages.join(", ")));
    }
    text
}

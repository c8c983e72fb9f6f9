//! `skyway verify`: checks the certificate of an exact answer, or a plan with times and battery, in code that shares nothing with
//! the search.

use super::files;
use super::network_source::NetworkArguments;
use super::output::Output;
use super::stop::{Stop, Verdict};
use crate::formats::{
    DifferingPremise, FlightDocument, differing_premises, is_flight_document, premises_lines,
    read_flight_document,
};
use crate::network::Topology;
use crate::verify::{self, FlightFault, NetworkFacts, verify_flight};
use clap::Args;
use serde_json::{Map, Value, json};
use std::path::PathBuf;

const EXAMPLES: &str = "\
Examples:
  skyway reroute --service 379,406 --destination 450 --certificate proof.json
  skyway verify proof.json
  skyway verify proof.json --network city.geojson --json
  skyway compose --network corridor --source 1 --destination 280 --deadline 10h --certificate plan.json
  skyway verify plan.json --network corridor

What is checked of a plan is that it can be flown as it says: battery, pads, closures, other plans, times.
The network is to be the very file that the answer was computed on: the certificate names its SHA-256.

Exit codes: 0 when it holds, 1 when it does not or cannot be read, 2 for arguments that make no sense.";

/// Arguments of `skyway verify`.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct Verify {
    /// The certificate or plan, as --certificate of reroute or compose writes it, or - for standard input
    #[arg(value_name = "FILE")]
    certificate: PathBuf,
    #[command(flatten)]
    network: NetworkArguments,
    /// Write JSON
    #[arg(help_heading = "Output", long)]
    json: bool,
}

impl Verify {
    pub(super) fn run(&self, output: &Output) -> Result<Verdict, Stop> {
        let text = files::read_text(&self.certificate)?;
        let network = self.network.load(output)?;
        if is_flight_document(&text) {
            return self.check_flight(&text, &network.topology, output);
        }
        let facts = NetworkFacts::of(&network.topology);
        let checked = verify::verify(&text, &facts);
        if self.json {
            output.json(&json(&checked))?;
        } else {
            match &checked {
                Ok(verdict) => output.line(&verdict.to_string())?,
                Err(fault) => output.line(&format!("not proved: {fault}"))?,
            }
        }
        match checked {
            Ok(_) => Ok(Verdict::Done),
            Err(_) => Ok(Verdict::Negative),
        }
    }
}

impl Verify {
    /// Flies a plan again and says whether it holds.
    fn check_flight(
        &self,
        text: &str,
        topology: &Topology,
        output: &Output,
    ) -> Result<Verdict, Stop> {
        let document = read_flight_document(text, topology)
            .map_err(|fault| Stop::failed(format!("{}: {fault}", self.certificate.display())))?;
        let checked = verify_flight(&document.plan, &document.premises(topology));
        let differing = differing_premises(&document).map_err(Stop::failed)?;
        if self.json {
            output.json(&flight_json(
                &document, topology, &checked, &differing, text,
            ))?;
        } else {
            output.line(&flight_text(&document, topology, &checked, &differing))?;
        }
        Ok(match checked {
            Ok(()) => Verdict::Done,
            Err(_) => Verdict::Negative,
        })
    }
}

/// The verdict with the premises that it rests on.
fn flight_text(
    document: &FlightDocument,
    topology: &Topology,
    checked: &Result<(), FlightFault>,
    differing: &[DifferingPremise],
) -> String {
    if let Err(fault) = checked {
        return format!("cannot be flown as it says: {fault}");
    }
    let plan = &document.plan;
    let [from, to] = [document.start.node, document.destination].map(|node| topology.node_id(node));
    let mut text = format!(
        "can be flown: {} and {} from node '{from}' to node '{to}', {:.1} m, {:.0} % of the battery left",
        counted(plan.legs.len(), "leg"),
        counted(plan.stops.len(), "stay"),
        plan.distance_m,
        100.0 * plan.battery_at_arrival,
    );
    text.push_str("\nif these premises, which the plan states itself, are those of the world:");
    for line in premises_lines(document, topology) {
        text.push_str(&format!("\n  {line}"));
    }
    match differing {
        [] => text.push_str("\nairframe and rules are the bundled ones"),
        _ => text.push_str("\nairframe and rules differ from the bundled ones:"),
    }
    for premise in differing {
        let DifferingPremise {
            name,
            value,
            default,
        } = premise;
        text.push_str(&format!("\n  {name} is {value}, by default {default}"));
    }
    text
}

fn counted(count: usize, noun: &str) -> String {
    let plural = if count == 1 { "" } else { "s" };
    format!("{count} {noun}{plural}")
}

fn flight_json(
    document: &FlightDocument,
    topology: &Topology,
    checked: &Result<(), FlightFault>,
    differing: &[DifferingPremise],
    text: &str,
) -> Value {
    let fault = checked.as_ref().err().map(ToString::to_string);
    let differing = differing.iter().map(
        |premise| json!({"name": premise.name, "value": premise.value, "default": premise.default}),
    );
    // The document again, but for the plan that is checked.
    let mut premises: Value = serde_json::from_str(text).unwrap_or_default();
    if let Some(members) = premises.as_object_mut() {
        members.remove("plan");
        members.remove("format");
    }
    json!({
        "flyable": checked.is_ok(),
        "fault": fault,
        "airframe": document.airframe.name,
        "payload_kg": document.payload_kg,
        "battery_fraction": document.start.battery,
        "reserve_fraction": document.reserve,
        "source": topology.node_id(document.start.node),
        "destination": topology.node_id(document.destination),
        "closures": document.closure_ids,
        "length_m": document.plan.distance_m,
        "differing_premises": differing.collect::<Vec<Value>>(),
        "premises": premises,
    })
}

fn json(checked: &Result<verify::Verdict, verify::CertificateFault>) -> Value {
    let verdict = match checked {
        Ok(verdict) => verdict,
        Err(fault) => return json!({"proved": false, "fault": fault.to_string()}),
    };
    let premises = verdict.premises();
    let starts = premises.starts.iter();
    let starts: Vec<Value> = starts
        .map(|(node, offset_m)| json!({"node": node, "offset_m": offset_m}))
        .collect();
    let mut fields = Map::new();
    fields.insert("proved".to_owned(), json!(true));
    let length_m = match verdict {
        verify::Verdict::Proved { length_m, .. } => Some(*length_m),
        verify::Verdict::ProvedNoWay { .. } => None,
    };
    fields.insert("length_m".to_owned(), json!(length_m));
    fields.insert("starts".to_owned(), json!(starts));
    fields.insert("destination".to_owned(), json!(premises.destination));
    fields.insert("closed_nodes".to_owned(), json!(premises.closed_nodes));
    fields.insert(
        "closed_segments".to_owned(),
        json!(premises.closed_segments),
    );
    Value::Object(fields)
}

//! `skyway verify`: checks the certificate of an exact answer, in code that shares nothing with the search.

use super::files;
use super::network_source::NetworkArguments;
use super::output::Output;
use super::stop::{Stop, Verdict};
use crate::verify::{self, NetworkFacts};
use clap::Args;
use serde_json::{Map, Value, json};
use std::path::PathBuf;

const EXAMPLES: &str = "\
Examples:
  skyway reroute --service 379,406 --destination 450 --certificate proof.json
  skyway verify proof.json
  skyway verify proof.json --network city.geojson --json

The network is to be the very file that the answer was computed on: the certificate names its SHA-256.";

/// Arguments of `skyway verify`.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct Verify {
    /// The certificate, as reroute --certificate writes it, or - for standard input
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

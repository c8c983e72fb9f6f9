//! `skyway reroute`: the answer to a failure report, or to a file of them.

use super::airspace_source::AirspaceArguments;
use super::answer_table::{self, answer};
use super::failure::FailureArguments;
use super::files;
use super::flight::{self, FlightArguments, Wanted};
use super::method::{ParameterArguments, StrategyArguments};
use super::network_source::NetworkArguments;
use super::output::Output;
use super::picture;
use super::requests;
use super::stop::{Stop, Verdict};
use crate::airspace::Airspace;
use crate::flight::FailureType;
use crate::formats::write_certificate;
use crate::recompose::{Recomposition, Request, Scratch, Strategy, World, certify};
use clap::{ArgGroup, Args};
use serde_json::Value;
use std::path::{Path, PathBuf};

const EXAMPLES: &str = "\
Examples:
  skyway reroute --service 379,406 --destination 450
  skyway reroute --service 379,406 --destination 450 --strategy two_phased --explain
  skyway reroute --service 379,406 --destination 450 --close 408 --close 353,404 --json
  skyway reroute --service 379,406 --destination 450 --zones zones.geojson
  skyway reroute --service 379,406 --destination 450 --certificate proof.json
  skyway reroute --service 379,406 --destination 450 --battery 0.4 --payload-kg 0.5 --wind 270/5
  skyway reroute --requests reports.ndjson > answers.ndjson

Any outcome exits with 0, no_route too, unless there is no plan to write to a file that is asked for. With --requests each line is the body of POST /v1/failures, \
and may have `close`: a list of node ids, and of [A, B] for segments, closed before the failure. \
Answers come in the same order, one to a line; a line that is no failure report gives its id and a \
problem in its place, and the exit code is 1 at the end.";

/// Arguments of `skyway reroute`.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES, group(ArgGroup::new("what").required(true).args(["service", "requests"])))]
pub(super) struct Reroute {
    #[command(flatten)]
    network: NetworkArguments,
    #[command(flatten)]
    failure: FailureArguments,
    #[command(flatten)]
    strategy: StrategyArguments,
    #[command(flatten)]
    parameters: ParameterArguments,
    #[command(flatten)]
    airspace: AirspaceArguments,
    #[command(flatten)]
    flight: FlightArguments,
    /// Answer many reports: NDJSON, a file or - for standard input
    #[arg(
        help_heading = "Failure",
        long,
        value_name = "FILE",
        conflicts_with_all = [
            "destination", "failure", "location", "cause_location", "strategy", "scope", "cell_size",
            "val_ratio", "no_stage_skipping", "full_tree", "explain", "optimum", "certificate", "svg",
            "airframe", "payload_kg", "battery", "wind", "objective", "start_time", "deadline", "reserve",
            "swap_station",
        ]
    )]
    requests: Option<PathBuf>,
    /// Also tell the search areas, stage by stage
    #[arg(help_heading = "Output", long)]
    explain: bool,
    /// Also tell the optima that the answer is measured against (always told without --json)
    #[arg(help_heading = "Output", long)]
    optimum: bool,
    /// Write the proof that an exact answer is the optimum, for skyway verify
    #[arg(help_heading = "Output", long, value_name = "FILE")]
    certificate: Option<PathBuf>,
    /// Draw the answer
    #[arg(help_heading = "Output", long, value_name = "FILE")]
    svg: Option<PathBuf>,
    /// Write JSON under the names of the API; with --requests that is the only way
    #[arg(help_heading = "Output", long)]
    json: bool,
}

impl Reroute {
    pub(super) fn run(&self, output: &Output) -> Result<Verdict, Stop> {
        let network = self.network.load(output)?;
        let airspace = self
            .flight
            .airspace(&self.airspace, &network.topology, output)?;
        if let Some(file) = &self.requests {
            return requests::answer_all(file, &airspace, output);
        }
        let report = self.failure.report(&network.topology)?;
        let request = Request {
            optimum: self.optimum || !self.json,
            explain: self.explain || self.svg.is_some(),
            ..self.strategy.request(report, &self.parameters)?
        };
        if self.flight.is_given() {
            if self.explain || self.optimum {
                let problem = "--explain and --optimum take an answer without a drone: what is flown has neither search areas nor optima of lengths";
                return Err(Stop::Usage(problem.to_owned()));
            }
            return self.fly(&airspace, &request, output);
        }
        if self.certificate.is_some() {
            check_that_a_proof_exists(&request)?;
        }
        let world = World {
            airspace: &airspace,
            trees: None,
        };
        let mut scratch = Scratch::new(&network.topology);
        let answered = answer(&world, &request, &mut scratch);
        if self.json {
            let mut fields = answered.json(&world, &[])?;
            if !self.explain {
                fields.remove("stages");
            }
            output.json(&Value::Object(fields))?;
        } else {
            answer_table::print(&network.topology, &answered, self.explain, output)?;
        }
        if let Some(file) = &self.certificate {
            let certificate = certify(&world, &request, &mut scratch);
            let text = write_certificate(&network.topology, &certificate);
            files::write_text(file, &text, output)?;
            output.note(&format!("wrote the certificate to {}", file.display()));
        }
        if let Some(file) = &self.svg {
            draw(file, &airspace, &request, &answered.recomposition, output)?;
        }
        Ok(Verdict::Done)
    }
}

impl Reroute {
    /// The answer for a drone with the battery that it has.
    fn fly(
        &self,
        airspace: &Airspace,
        request: &Request,
        output: &Output,
    ) -> Result<Verdict, Stop> {
        let flight = self.flight.flight(airspace, output)?;
        let wanted = Wanted {
            format: None,
            json: self.json,
            certificate: self.certificate.as_deref(),
            svg: self.svg.as_deref(),
        };
        flight::answer(&flight, request, &wanted, output)?;
        Ok(Verdict::Done)
    }
}

/// Only what the exact search answers can be proved.
fn check_that_a_proof_exists(request: &Request) -> Result<(), Stop> {
    if request.strategy != Strategy::Exact {
        let problem = format!(
            "--certificate proves exact answers; that of {} is no optimum to prove",
            request.strategy.name()
        );
        return Err(Stop::Usage(problem));
    }
    if request.report.failure == FailureType::Operational {
        let problem = "--certificate proves the way to the destination; an operational failure leads to the nearest alternate";
        return Err(Stop::Usage(problem.to_owned()));
    }
    Ok(())
}

/// Draws an answer into a file.
pub(super) fn draw(
    file: &Path,
    airspace: &Airspace,
    request: &Request,
    answer: &Recomposition,
    output: &Output,
) -> Result<(), Stop> {
    let scene = picture::Scene::of(airspace).with_answer(&request.report, answer);
    files::write_text(file, &scene.svg(), output)?;
    output.note(&format!("drew the answer in {}", file.display()));
    Ok(())
}

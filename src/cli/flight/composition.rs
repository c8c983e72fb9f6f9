//! `skyway compose` with a drone: a plan with times, battery and recharging stops.

use super::{Flight, table};
use crate::cli::answer_table::node_text;
use crate::cli::compose::{Format, no_route_to_write, route_name};
use crate::cli::output::{Output, facts_table};
use crate::cli::stop::Stop;
use crate::delivery::{
    DeliveryRequest, DeliveryScratch, FlightComposition, Lands, compose_with_stops,
};
use crate::flight::ServiceStop;
use crate::formats::{Route, node_id_json};
use crate::network::NodeIx;
use serde_json::{Value, json};
use std::path::Path;

/// What is written of a composition beside the table.
pub(in crate::cli) struct Wanted<'a> {
    pub(in crate::cli) json: bool,
    pub(in crate::cli) format: Option<Format>,
    pub(in crate::cli) certificate: Option<&'a Path>,
    pub(in crate::cli) svg: Option<&'a Path>,
}

impl Wanted<'_> {
    /// Without a plan no file is written: those that are asked for are named, as older ones may be there.
    pub(super) fn without_plan(&self) -> Result<(), Stop> {
        let files = [self.certificate, self.svg].into_iter().flatten();
        let files: Vec<String> = files.map(|file| file.display().to_string()).collect();
        match files.is_empty() {
            true => Ok(()),
            false => Err(Stop::failed(format!(
                "there is no plan to write to {}",
                files.join(" and ")
            ))),
        }
    }
}

/// Composes a delivery and tells the plan.
pub(in crate::cli) fn compose(
    flight: &Flight,
    ((source, destination), stops): ((NodeIx, NodeIx), &[ServiceStop]),
    wanted: &Wanted<'_>,
    output: &Output,
) -> Result<(), Stop> {
    let request = DeliveryRequest {
        pad: None,
        source,
        destination,
        start_s: flight.start_s,
        began_s: flight.start_s,
        battery: flight.battery,
        objective: flight.objective,
        deadline_s: Some(flight.deadline_s),
    };
    let topology = flight.skies.topology();
    let mut scratch = DeliveryScratch::new(topology);
    let stops = (stops, Lands::AtDestination);
    let composed = compose_with_stops(&flight.world(), &request, stops, &mut scratch);
    let writer = flight.writer();
    if let Some(format) = wanted.format {
        let Ok(composition) = &composed else {
            let ends = [source, destination].map(|node| node_text(topology, node));
            return Err(no_route_to_write(&ends));
        };
        let name = route_name(topology, source, destination);
        let route = Route::of_flight(name, &flight.skies, composition);
        format.write(&route, flight.skies.airspace(), output)?;
    } else if wanted.json {
        let mut fields = match &composed {
            Ok(composition) => {
                let mut fields = writer.composition(composition);
                fields.insert("outcome".to_owned(), json!("composed"));
                fields
            }
            Err(refused) => writer.no_delivery(refused),
        };
        for (name, node) in [("source", source), ("destination", destination)] {
            fields.insert(name.to_owned(), node_id_json(topology, node));
        }
        output.json(&Value::Object(fields))?;
    } else {
        match &composed {
            Ok(composition) => print(flight, composition, output)?,
            Err(refused) => {
                let [from, to] = [source, destination].map(|node| node_text(topology, node));
                let deadline = table::instant_text(&flight.skies, refused.deadline_s);
                output.line(&format!(
                    "no route: no plan leads from {from} to {to} by {deadline}"
                ))?;
                let causes = table::causes_text(flight, &refused.causes, refused.opens);
                output.line(&format!("cut off by: {causes}"))?;
            }
        }
    }
    let Ok(composition) = composed else {
        return wanted.without_plan();
    };
    if let Some(file) = wanted.certificate {
        flight.write_certificate(file, &composition, output)?;
    }
    match wanted.svg {
        Some(file) => flight.draw(file, &composition, None, output),
        None => Ok(()),
    }
}

fn print(flight: &Flight, composition: &FlightComposition, output: &Output) -> Result<(), Stop> {
    table::print_plan(flight, composition, output)?;
    output.line("")?;
    table::print_contingencies(flight, composition, output)?;
    output.line("")?;
    output.table(&facts_table(table::facts(flight, composition)))
}

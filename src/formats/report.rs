//! A failure report from the wire: the body of `POST /v1/failures`, and a line of a requests file.
//!
//! A drone always gets an outcome: what is unknown, doubtful or out of place becomes a warning and a
//! safe assumption. Only a body that names no place at all is a problem.

use super::identifier::{find_node, id_text};
use super::report_place::{read_leg, read_location, read_place};
use super::report_problem::{ReadWarning, ReportProblem, Warnings};
use super::zones::{ZoneId, zone_from_feature};
use crate::airspace::{Airspace, Hits};
use crate::flight::{FailureReport, FailureType};
use crate::network::{NodeIx, SegmentIx, Topology};
use crate::recompose::{BroughtZone, Parameters, Request, Scope, Strategy};
use serde::de::DeserializeOwned;
use serde_json::{Map, Value};
use std::sync::Arc;

/// Fields of a report; any other is ignored with a warning.
const FIELDS: [&str; 20] = [
    "id",
    "type",
    "service",
    "location",
    "cause_location",
    "timestamp",
    "zone",
    "drone",
    "remaining_path",
    "destination",
    "strategy",
    "scope",
    "parameters",
    "objective",
    "optimum",
    "deadline",
    "explain",
    "dry_run",
    "close",
    "certificate",
];
const PARAMETERS: [&str; 4] = ["cell_size_m", "val_ratio", "stage_skipping", "full_tree"];

/// A thing that a line of a requests file closes beforehand, as an operator would.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CloseTarget {
    /// A node.
    Node(NodeIx),
    /// A segment.
    Segment(SegmentIx),
}

/// A failure report as read.
#[derive(Clone, Debug, PartialEq)]
pub struct ReadReport {
    /// The report's id, whatever it is.
    pub id: Option<Value>,
    /// What is asked.
    pub request: Request,
    /// What is closed beforehand; only in files of requests.
    pub close: Vec<CloseTarget>,
    /// What was passed over or assumed.
    pub warnings: Vec<ReadWarning>,
}

/// Reads a failure report.
///
/// # Errors
/// When the body is not an object or names nothing that locates the drone.
pub fn read_report(body: &Value, airspace: &Airspace) -> Result<ReadReport, ReportProblem> {
    let fields = body.as_object().ok_or(ReportProblem::NotAnObject)?;
    let topology = airspace.topology();
    let mut warnings = Warnings::default();
    for name in fields
        .keys()
        .filter(|name| !FIELDS.contains(&name.as_str()))
    {
        warnings.add(
            "unknown_field",
            format!("the field '{name}' is not known and ignored"),
        );
    }
    let leg = read_leg(topology, fields, &mut warnings)?;
    let failure = read_failure_type(fields.get("type"), &mut warnings);
    let location = read_location(topology, fields, leg.nodes, &mut warnings);
    let cause = fields
        .get("cause_location")
        .filter(|value| !value.is_null());
    let cause_location =
        cause.and_then(|value| read_place(topology, value, "cause_location", &mut warnings));
    if let Some(objective) = fields.get("objective").filter(|value| !value.is_null())
        && objective != "distance"
    {
        warnings.add(
            "objective_unsupported",
            format!(
                "the objective {objective} is not computed; the answer is the shortest by distance"
            ),
        );
    }
    let request = Request {
        report: FailureReport {
            failure,
            leg: leg.nodes,
            location,
            cause_location,
            destination: leg.destination,
            remaining_path: leg.remaining_path,
        },
        zone: read_brought_zone(airspace, fields.get("zone"), &mut warnings),
        strategy: read_choice::<Strategy>(fields, "strategy", &mut warnings),
        scope: read_choice::<Scope>(fields, "scope", &mut warnings),
        parameters: read_parameters(fields.get("parameters"), &mut warnings),
        optimum: read_flag(fields, "optimum", &mut warnings),
        explain: read_flag(fields, "explain", &mut warnings),
    };
    Ok(ReadReport {
        id: fields.get("id").cloned(),
        request,
        close: read_close(topology, fields.get("close"))?,
        warnings: warnings.0,
    })
}

fn read_failure_type(value: Option<&Value>, warnings: &mut Warnings) -> FailureType {
    let Some(value) = value.filter(|value| !value.is_null()) else {
        warnings.add(
            "missing_failure_type",
            "no failure type is given; it counts as navigational",
        );
        return FailureType::Navigational;
    };
    serde_json::from_value(value.clone()).unwrap_or_else(|_| {
        warnings.add(
            "unknown_failure_type",
            format!("the failure type {value} is not known and counts as navigational"),
        );
        FailureType::Navigational
    })
}

/// A value of an enumeration; its default where it is absent or unknown.
fn read_choice<T: DeserializeOwned + Default>(
    fields: &Map<String, Value>,
    name: &str,
    warnings: &mut Warnings,
) -> T {
    let Some(value) = fields.get(name).filter(|value| !value.is_null()) else {
        return T::default();
    };
    serde_json::from_value(value.clone()).unwrap_or_else(|_| {
        warnings.add(
            "unknown_value",
            format!("'{name}' does not know {value}; the default is taken"),
        );
        T::default()
    })
}

fn read_flag(fields: &Map<String, Value>, name: &str, warnings: &mut Warnings) -> bool {
    match fields.get(name) {
        None | Some(Value::Null) => false,
        Some(Value::Bool(flag)) => *flag,
        Some(other) => {
            warnings.add(
                "wrong_type",
                format!("'{name}' is {other}, not true or false; false is taken"),
            );
            false
        }
    }
}

fn read_parameters(value: Option<&Value>, warnings: &mut Warnings) -> Parameters {
    let mut parameters = Parameters::default();
    let fields = match value {
        None | Some(Value::Null) => return parameters,
        Some(Value::Object(fields)) => fields,
        Some(_) => {
            warnings.add("wrong_type", "'parameters' is not an object and ignored");
            return parameters;
        }
    };
    for (name, value) in fields {
        let number = value.as_f64();
        match (name.as_str(), number, value.as_bool()) {
            _ if value.is_null() => {}
            ("cell_size_m", Some(size_m), _) => parameters.cell_size_m = Some(size_m),
            ("val_ratio", Some(ratio), _) => parameters.val_ratio = ratio,
            ("stage_skipping", _, Some(flag)) => parameters.stage_skipping = flag,
            ("full_tree", _, Some(flag)) => parameters.full_tree = flag,
            (known, _, _) if PARAMETERS.contains(&known) => warnings.add(
                "wrong_type",
                format!("the parameter '{name}' is {value}; its default is taken"),
            ),
            _ => warnings.add(
                "unknown_field",
                format!("the parameter '{name}' is not known and ignored"),
            ),
        }
    }
    parameters
}

/// A zone that the report brings; one that cannot be read, or does not count now, binds nothing.
fn read_brought_zone(
    airspace: &Airspace,
    value: Option<&Value>,
    warnings: &mut Warnings,
) -> Option<BroughtZone> {
    let value = value.filter(|value| !value.is_null())?;
    let topology = airspace.topology();
    let zone = match zone_from_feature(value, ZoneId::StatedOr("brought"), topology.frame()) {
        Ok(zone) => zone,
        Err(problems) => {
            for problem in problems {
                let (code, message) = (problem.code, &problem.message);
                let pointer = &problem.pointer;
                warnings.add(
                    "zone_ignored",
                    format!("/zone{pointer}: {message} ({code})"),
                );
            }
            return None;
        }
    };
    if !zone.counts_at(airspace.as_of(), airspace.horizon()) {
        warnings.add(
            "zone_not_active",
            "the zone brought is not active within the planning horizon",
        );
        return None;
    }
    let hits = Hits::of(topology, &zone);
    Some(BroughtZone {
        zone: Arc::new(zone),
        hits,
    })
}

fn read_close(
    topology: &Topology,
    value: Option<&Value>,
) -> Result<Vec<CloseTarget>, ReportProblem> {
    let entries = match value {
        None | Some(Value::Null) => return Ok(Vec::new()),
        Some(Value::Array(entries)) => entries.as_slice(),
        Some(_) => {
            let pointer = "/close".to_owned();
            return Err(ReportProblem::CannotClose { pointer });
        }
    };
    let target = |(index, entry): (usize, &Value)| {
        let found = match entry {
            Value::Array(ends) => match ends.as_slice() {
                [from, to] => find_node(topology, from)
                    .zip(find_node(topology, to))
                    .and_then(|(from, to)| topology.segment_between(from, to))
                    .map(CloseTarget::Segment),
                _ => None,
            },
            id => find_node(topology, id).map(CloseTarget::Node).or_else(|| {
                let segment = topology.find_segment(&id_text(id)?)?;
                Some(CloseTarget::Segment(segment))
            }),
        };
        let pointer = format!("/close/{index}");
        found.ok_or(ReportProblem::CannotClose { pointer })
    };
    entries.iter().enumerate().map(target).collect()
}

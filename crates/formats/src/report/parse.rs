//! From the bytes of a failure report to its fields: at once where every field is as it should be, else field by field.
//!
//! A field that cannot be read is left out with a warning, and never spoils the others: a drone gets an outcome
//! unless nothing is left that says where it is. Nothing is looked up here; that is `resolve`.

use super::problem::{ReadWarning, ReportProblem, cut, shown};
use crate::mark::without_mark;
use crate::suggestion::nearest;
use crate::twice::members_twice;
use crate::wire::{DroneFacts, FailureReport, Id, Parameters, Place, Service, with_ids_as_text};
use serde::de::DeserializeOwned;
use serde_json::{Map, Value};

/// Fields of a report. `certificate` is known and does nothing: reports written for files may have it.
const FIELDS: [&str; 33] = [
    "id",
    "type",
    "detail",
    "node",
    "pads",
    "wind_mps",
    "gust_mps",
    "visibility_m",
    "airborne",
    "location_age_s",
    "leg",
    "fraction",
    "altitude_m",
    "altitude_reference",
    "service",
    "location",
    "location_unknown",
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
const SERVICE: [&str; 4] = ["plan_id", "leg", "from", "to"];
const DRONE: [&str; 5] = [
    "id",
    "battery_fraction",
    "payload_kg",
    "airframe",
    "airspeed_mps",
];
const PARAMETERS: [&str; 4] = ["cell_size_m", "val_ratio", "stage_skipping", "full_tree"];

/// Unknown fields of one object that have a warning each; the rest are counted.
const MAX_UNKNOWN_FIELDS: usize = 8;

/// A failure report as its fields say it, before anything is looked up.
#[derive(Clone, Debug, PartialEq)]
pub struct ParsedReport {
    /// The fields that could be read.
    pub report: FailureReport,
    /// What was passed over.
    pub warnings: Vec<ReadWarning>,
}

/// Reads the body of a failure report.
///
/// # Errors
/// [`ReportProblem::NotJson`] or [`ReportProblem::NotAnObject`].
pub fn parse_report(body: &[u8]) -> Result<ParsedReport, ReportProblem> {
    let body = without_mark(body);
    // A list in the order of the fields is no object, though the derived reader would take it for one.
    let opens_object = body.trim_ascii_start().starts_with(b"{");
    if opens_object && let Ok(report) = serde_json::from_slice::<FailureReport>(body) {
        // Of the fields themselves the reader takes none twice.
        let warnings = match &report.zone {
            None => Vec::new(),
            Some(_) => members_twice(body).iter().map(|at| twice(at)).collect(),
        };
        return Ok(ParsedReport { report, warnings });
    }
    let value = serde_json::from_slice(body).map_err(|error| ReportProblem::not_json(&error))?;
    let mut parsed = lenient_report(value)?;
    let all_twice = members_twice(body);
    parsed.warnings.extend(all_twice.iter().map(|at| twice(at)));
    Ok(parsed)
}

/// The warning that a member is there twice.
pub fn twice(pointer: &str) -> ReadWarning {
    let message = format!(
        "'{}' is there more than once; the last one counts, and nothing is published on its word",
        cut(pointer)
    );
    ReadWarning::new("member_twice", message)
}

/// Reads a failure report field by field: each that cannot be read is left out with a warning.
///
/// # Errors
/// [`ReportProblem::NotAnObject`].
pub fn lenient_report(body: Value) -> Result<ParsedReport, ReportProblem> {
    let Value::Object(fields) = body else {
        return Err(ReportProblem::NotAnObject);
    };
    let mut reader = Reader::default();
    let report = reader.report(fields);
    Ok(ParsedReport {
        report,
        warnings: reader.warnings,
    })
}

/// Reads values, and keeps the warnings as they arise.
#[derive(Debug, Default)]
struct Reader {
    warnings: Vec<ReadWarning>,
}

impl Reader {
    fn report(&mut self, fields: Map<String, Value>) -> FailureReport {
        self.unknown_fields("", &fields, &FIELDS);
        let mut report = FailureReport::default();
        for (name, value) in fields {
            if value.is_null() {
                continue;
            }
            let name = name.as_str();
            match name {
                "id" => report.id = self.id(name, &value),
                "type" => report.failure = self.failure_type(&value),
                "detail" => report.detail = self.choice(name, &value),
                "node" => report.node = self.id(name, &value),
                "pads" => report.pads = self.count(name, &value),
                "leg" => report.leg = self.count(name, &value),
                "wind_mps" => report.wind_mps = self.number(name, &value),
                "gust_mps" => report.gust_mps = self.number(name, &value),
                "visibility_m" => report.visibility_m = self.number(name, &value),
                "airborne" => report.airborne = self.flag(name, &value),
                "location_age_s" => report.location_age_s = self.number(name, &value),
                "fraction" => report.fraction = self.number(name, &value),
                "altitude_m" => report.altitude_m = self.number(name, &value),
                "altitude_reference" => report.altitude_reference = self.text(name, &value),
                "service" => report.service = self.service(&value),
                "location" => {
                    report.location = self.place(name, &value);
                    if report.location.is_none() {
                        report.location_unknown = Some(true);
                    }
                }
                "location_unknown" => {
                    let stated = self.flag(name, &value);
                    report.location_unknown = report.location_unknown.or(stated);
                }
                "cause_location" => report.cause_location = self.place(name, &value),
                "timestamp" => report.timestamp = self.time(name, "timestamp_ignored", &value),
                "zone" => report.zone = Some(value),
                "drone" => report.drone = self.drone(&value),
                "remaining_path" => report.remaining_path = self.path(&value),
                "destination" => report.destination = self.destination(&value),
                "strategy" => report.strategy = self.choice(name, &value),
                "scope" => report.scope = self.choice(name, &value),
                "parameters" => report.parameters = self.parameters(&value),
                "objective" => report.objective = self.objective(&value),
                "optimum" => report.optimum = self.flag(name, &value),
                "deadline" => report.deadline = self.time(name, "deadline_ignored", &value),
                "explain" => report.explain = self.flag(name, &value),
                "dry_run" => report.dry_run = self.flag(name, &value),
                "close" => report.close = self.close(value),
                _ => {}
            }
        }
        report
    }

    fn service(&mut self, value: &Value) -> Option<Service> {
        let fields = self.object("service", value, &SERVICE)?;
        let mut service = Service::default();
        for (name, value) in present(fields) {
            let path = format!("service.{name}");
            match name {
                "plan_id" => service.plan_id = self.text(&path, value),
                "leg" => service.leg = self.count(&path, value),
                "from" => service.from = self.id(&path, value),
                "to" => service.to = self.id(&path, value),
                _ => {}
            }
        }
        Some(service)
    }

    fn drone(&mut self, value: &Value) -> Option<DroneFacts> {
        let fields = self.object("drone", value, &DRONE)?;
        let mut drone = DroneFacts::default();
        for (name, value) in present(fields) {
            let path = format!("drone.{name}");
            match name {
                "id" => drone.id = self.text(&path, value),
                "battery_fraction" => drone.battery_fraction = self.number(&path, value),
                "payload_kg" => drone.payload_kg = self.number(&path, value),
                "airframe" => drone.airframe = self.text(&path, value),
                "airspeed_mps" => drone.airspeed_mps = self.number(&path, value),
                _ => {}
            }
        }
        Some(drone)
    }

    fn parameters(&mut self, value: &Value) -> Option<Parameters> {
        let fields = self.object("parameters", value, &PARAMETERS)?;
        let mut parameters = Parameters::default();
        for (name, value) in present(fields) {
            let path = format!("parameters.{name}");
            match name {
                "cell_size_m" => parameters.cell_size_m = self.number(&path, value),
                "val_ratio" => parameters.val_ratio = self.number(&path, value),
                "stage_skipping" => parameters.stage_skipping = self.flag(&path, value),
                "full_tree" => parameters.full_tree = self.flag(&path, value),
                _ => {}
            }
        }
        Some(parameters)
    }

    fn object<'v>(
        &mut self,
        name: &str,
        value: &'v Value,
        known: &[&str],
    ) -> Option<&'v Map<String, Value>> {
        let fields = value.as_object();
        if let Some(fields) = fields {
            self.unknown_fields(name, fields, known);
        }
        self.or_wrong_type(fields, name, value, "an object")
    }

    fn unknown_fields(&mut self, object: &str, fields: &Map<String, Value>, known: &[&str]) {
        let place = match object {
            "" => String::new(),
            named => format!(" of '{named}'"),
        };
        let is_unknown = |name: &&String| !known.contains(&name.as_str());
        for name in fields.keys().filter(is_unknown).take(MAX_UNKNOWN_FIELDS) {
            let meant = nearest(name, known.iter().copied(), 1);
            let hint = meant
                .first()
                .map_or_else(String::new, |meant| format!("; was '{meant}' meant?"));
            let name = cut(name);
            let message = format!("the field '{name}'{place} is not known and ignored{hint}");
            self.warn("unknown_field", message);
        }
        let unknown = fields.keys().filter(is_unknown).count();
        if unknown > MAX_UNKNOWN_FIELDS {
            let more = unknown - MAX_UNKNOWN_FIELDS;
            let message = format!("{more} more fields{place} are not known and ignored");
            self.warn("unknown_field", message);
        }
    }

    fn failure_type<T: DeserializeOwned>(&mut self, value: &Value) -> Option<T> {
        let message = |value| format!("the failure type {value} is not known");
        self.value("unknown_failure_type", value, message)
    }

    fn place(&mut self, name: &str, value: &Value) -> Option<Place> {
        self.value("location_ignored", value, |value| {
            format!("'{name}' is {value}, which is no place, and is ignored; a place is [longitude, latitude], {{x, y}} on a planar network, or {{node}}")
        })
    }

    fn time(&mut self, name: &str, code: &'static str, value: &Value) -> Option<String> {
        self.value(code, value, |value| {
            format!("'{name}' is {value}, not an RFC 3339 time, and is ignored")
        })
    }

    fn choice<T: DeserializeOwned>(&mut self, name: &str, value: &Value) -> Option<T> {
        self.value("unknown_value", value, |value| {
            format!("'{name}' does not know {value}; the default is taken")
        })
    }

    fn objective(&mut self, value: &Value) -> Option<String> {
        self.value("objective_unsupported", value, |value| {
            format!("the objective {value} is not known; the answer is the shortest by distance")
        })
    }

    fn destination(&mut self, value: &Value) -> Option<Id<'static>> {
        self.value("unknown_destination", value, |value| {
            format!("the destination {value} is not the id of a node and is ignored")
        })
    }

    fn path(&mut self, value: &Value) -> Option<Vec<Id<'static>>> {
        let Value::Array(entries) = value else {
            let value = shown(value);
            self.warn(
                "remaining_path_ignored",
                format!("'remaining_path' is {value}, not a list of node ids, and is ignored"),
            );
            return None;
        };
        // What is no id becomes the name of no node: the nodes about it can still tell where the drone is.
        let id = |entry: &Value| read(entry).unwrap_or_else(|| Id::new(shown(entry)));
        Some(entries.iter().map(id).collect())
    }

    fn close(&mut self, value: Value) -> Option<Vec<Value>> {
        match value {
            Value::Array(entries) => Some(with_ids_as_text(entries)),
            other => self.or_wrong_type(None, "close", &other, "a list"),
        }
    }

    fn id(&mut self, name: &str, value: &Value) -> Option<Id<'static>> {
        self.or_wrong_type(read(value), name, value, "an id, as text or an integer")
    }

    /// Text; a number where a name is expected can only mean the name that it spells.
    fn text(&mut self, name: &str, value: &Value) -> Option<String> {
        let text = read::<Id<'static>>(value).map(|id| id.into_text());
        self.or_wrong_type(text, name, value, "text")
    }

    fn number(&mut self, name: &str, value: &Value) -> Option<f64> {
        self.or_wrong_type(value.as_f64(), name, value, "a number")
    }

    fn count(&mut self, name: &str, value: &Value) -> Option<u32> {
        self.or_wrong_type(whole_number(value), name, value, "a count from 0")
    }

    fn flag(&mut self, name: &str, value: &Value) -> Option<bool> {
        self.or_wrong_type(value.as_bool(), name, value, "true or false")
    }

    fn or_wrong_type<T>(
        &mut self,
        found: Option<T>,
        name: &str,
        value: &Value,
        expected: &str,
    ) -> Option<T> {
        if found.is_none() {
            let value = shown(value);
            let message = format!("'{name}' is {value}, not {expected}, and is ignored");
            self.warn("wrong_type", message);
        }
        found
    }

    fn value<T: DeserializeOwned>(
        &mut self,
        code: &'static str,
        value: &Value,
        message: impl FnOnce(String) -> String,
    ) -> Option<T> {
        let found = read(value);
        if found.is_none() {
            self.warn(code, message(shown(value)));
        }
        found
    }

    fn warn(&mut self, code: &'static str, message: String) {
        self.warnings.push(ReadWarning::new(code, message));
    }
}

fn read<T: DeserializeOwned>(value: &Value) -> Option<T> {
    T::deserialize(value).ok()
}

fn present(fields: &Map<String, Value>) -> impl Iterator<Item = (&str, &Value)> {
    let present = fields.iter().filter(|(_, value)| !value.is_null());
    present.map(|(name, value)| (name.as_str(), value))
}

/// A count; some clients write every number with a point.
fn whole_number(value: &Value) -> Option<u32> {
    let number = value.as_f64().filter(|number| number.fract() == 0.0)?;
    let fits = (0.0..=f64::from(u32::MAX)).contains(&number);
    fits.then_some(number as u32)
}

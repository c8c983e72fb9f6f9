//! A failure report as a JSON value, read and settled at once: a line of a requests file.

mod circumstances;
mod close;
pub(crate) mod known;
mod leg;
mod names;
mod nearest;
pub(crate) mod parse;
mod place;
pub(crate) mod problem;
pub(crate) mod resolve;
pub(crate) mod resolved;

use crate::airspace::Airspace;
use crate::recompose::Request;
use close::check_close;
use known::{CloseTarget, Known};
use parse::lenient_report;
use problem::{ReadWarning, ReportProblem};
use resolve::resolve_report;
use serde_json::Value;

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

/// Reads a failure report of which nothing is known beside what it says.
///
/// # Errors
/// When the body is not an object, names nothing that locates the drone, or closes what there is not.
pub fn read_report(body: &Value, airspace: &Airspace) -> Result<ReadReport, ReportProblem> {
    let mut fields = body.clone();
    // In a file an id may be anything: the answer repeats it.
    let id = fields
        .as_object_mut()
        .and_then(|fields| fields.shift_remove("id"));
    let mut parsed = lenient_report(fields)?;
    let known = Known::nothing();
    let settled = resolve_report(&parsed.report, &known, airspace, &mut parsed.warnings)?;
    check_close(airspace.topology(), body.get("close"))?;
    Ok(ReadReport {
        id,
        request: settled.request,
        close: settled.close,
        warnings: parsed.warnings,
    })
}

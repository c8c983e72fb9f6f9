//! `skyway reroute --requests`: many failure reports, one to a line, answered in order.
//!
//! Each line is answered and written before the next is read, so that it can stand in a pipe. What is
//! costly is kept between lines: scratch, the airspaces of `close`, and the table of a destination from
//! the second time on that it is asked for.

use super::airspace_source::closing;
use super::answer_table::answer;
use super::files;
use super::output::Output;
use super::plan;
use super::stop::{Stop, Verdict};
use crate::airspace::Airspace;
use crate::compose::prepare_table;
use crate::formats::{CloseTarget, ReadReport, ReportProblem, read_report};
use crate::network::NodeIx;
use crate::recompose::{Scratch, World};
use crate::routing::TreeCache;
use rustc_hash::{FxHashMap, FxHashSet};
use serde_json::{Map, Value, json};
use std::io::{self, BufRead, Read};
use std::path::Path;

/// A longer line is not a failure report.
const MAX_LINE_BYTES: usize = 1 << 20;
/// At most this many airspaces of `close` are kept.
const MAX_AIRSPACES: usize = 64;

/// Answers every line of a file.
pub(super) fn answer_all(
    file: &Path,
    airspace: &Airspace,
    output: &Output,
) -> Result<Verdict, Stop> {
    let mut lines = files::open(file)?;
    let mut desk = LineRunner::new(airspace);
    let mut verdict = Verdict::Done;
    for number in 1.. {
        let line = read_line(&mut lines)
            .map_err(|error| Stop::failed(format!("cannot read {}: {error}", file.display())))?;
        let answered = match line {
            Line::End => break,
            Line::Text(text) if text.trim_ascii().is_empty() => continue,
            Line::Text(text) => desk.answer_line(&text)?,
            Line::TooLong => Err(Refused::too_long()),
        };
        let fields = answered.unwrap_or_else(|refused| {
            verdict = Verdict::Negative;
            output.warn(&format!("line {number}: {}", refused.message));
            refused.fields
        });
        output.line(&Value::Object(fields).to_string())?;
    }
    Ok(verdict)
}

/// A line, without the end of it.
enum Line {
    Text(Vec<u8>),
    /// It was passed over.
    TooLong,
    End,
}

fn read_line(lines: &mut dyn BufRead) -> io::Result<Line> {
    let mut text = Vec::new();
    let bound = MAX_LINE_BYTES as u64 + 1;
    (&mut *lines).take(bound).read_until(b'\n', &mut text)?;
    if text.is_empty() {
        return Ok(Line::End);
    }
    let is_whole = text.ends_with(b"\n");
    if is_whole || text.len() <= MAX_LINE_BYTES {
        return Ok(Line::Text(text));
    }
    lines.skip_until(b'\n')?;
    Ok(Line::TooLong)
}

/// A line that is not answered, and why.
struct Refused {
    message: String,
    /// What is written in the place of an answer.
    fields: Map<String, Value>,
}

impl Refused {
    fn new(id: Option<&Value>, code: &str, message: String, pointer: &str) -> Self {
        let problem = json!({"code": code, "message": message, "pointer": pointer});
        let id = id.cloned().unwrap_or(Value::Null);
        Self {
            message,
            fields: Map::from_iter([("id".to_owned(), id), ("problem".to_owned(), problem)]),
        }
    }

    fn too_long() -> Self {
        let message = format!("the line is longer than {MAX_LINE_BYTES} bytes");
        Self::new(None, "report_too_long", message, "")
    }

    /// The body is null where the line is no JSON.
    fn of_report(problem: &ReportProblem, body: &Value) -> Self {
        let (code, pointer) = (problem.code(), problem.pointer());
        Self::new(body.get("id"), code, problem.to_string(), pointer)
    }
}

/// What is kept between lines.
struct LineRunner<'a> {
    standing: &'a Airspace,
    scratch: Scratch,
    tables: TreeCache,
    /// Destinations asked for once.
    asked: FxHashSet<NodeIx>,
    airspaces: FxHashMap<Vec<TargetKey>, Airspace>,
}

/// What is closed, in a form with an order.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
enum TargetKey {
    Node(u32),
    Segment(u32),
}

impl<'a> LineRunner<'a> {
    fn new(standing: &'a Airspace) -> Self {
        Self {
            standing,
            scratch: Scratch::new(standing.topology()),
            tables: plan::tables(),
            asked: FxHashSet::default(),
            airspaces: FxHashMap::default(),
        }
    }

    /// The answer to a line, or why it has none.
    fn answer_line(&mut self, line: &[u8]) -> Result<Result<Map<String, Value>, Refused>, Stop> {
        let body: Value = match serde_json::from_slice(line) {
            Ok(body) => body,
            Err(error) => {
                let problem = ReportProblem::not_json(&error);
                return Ok(Err(Refused::of_report(&problem, &Value::Null)));
            }
        };
        match read_report(&body, self.standing) {
            Ok(read) => self.answer_report(read).map(Ok),
            Err(problem) => Ok(Err(Refused::of_report(&problem, &body))),
        }
    }

    fn answer_report(&mut self, read: ReadReport) -> Result<Map<String, Value>, Stop> {
        let ReadReport {
            id,
            request,
            close,
            warnings,
        } = read;
        self.prepare_table_if_asked_again(request.report.destination);
        let airspace = match close.is_empty() {
            true => self.standing,
            false => closed_as_well(&mut self.airspaces, self.standing, &close),
        };
        let world = World {
            airspace,
            trees: Some(&self.tables),
        };
        let answered = answer(&world, &request, &mut self.scratch);
        let id = id.map(|id| ("id".to_owned(), id));
        let mut fields = Map::from_iter(id);
        fields.extend(answered.json(&world, &warnings)?);
        Ok(fields)
    }

    fn prepare_table_if_asked_again(&mut self, destination: NodeIx) {
        if self.asked.insert(destination) {
            return;
        }
        let world = World {
            airspace: self.standing,
            trees: Some(&self.tables),
        };
        let topology_revision = self.standing.topology_revision();
        if !self.tables.holds(destination, topology_revision) {
            prepare_table(&world, destination, self.scratch.searcher());
        }
    }
}

/// The airspace with more closed than stands, made once for the same set.
fn closed_as_well<'m>(
    airspaces: &'m mut FxHashMap<Vec<TargetKey>, Airspace>,
    standing: &Airspace,
    targets: &[CloseTarget],
) -> &'m Airspace {
    let keys = targets.iter().map(|target| match target {
        CloseTarget::Node(node) => TargetKey::Node(node.0),
        CloseTarget::Segment(segment) => TargetKey::Segment(segment.0),
    });
    let mut key: Vec<TargetKey> = keys.collect();
    key.sort_unstable();
    key.dedup();
    if airspaces.len() >= MAX_AIRSPACES && !airspaces.contains_key(&key) {
        airspaces.clear();
    }
    airspaces
        .entry(key)
        .or_insert_with(|| closing(standing, targets))
}

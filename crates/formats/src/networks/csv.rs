//! A network as two CSV tables: nodes (`id` and `lon`,`lat` or `x`,`y`) and edges (`u`,`v`,`length_m`).
//!
//! Columns are found by name; `source`/`target` and `from`/`to` are understood for the ends, `weight` for
//! the length; other columns are passed over, and told by name.

use super::attributes::{ReadNetwork, Unread};
use crate::error::{FormatError, FormatErrors};
use crate::mark::without_mark;
use crate::network::{Coordinates, NetworkDraft, NodeDraft, SegmentDraft};
use csv::{ReaderBuilder, StringRecord};

/// Reads the two tables. Repairs are for the caller: see [`NetworkDraft::repair`].
///
/// # Errors
/// Each with the table and line it is about, up to a bound.
pub fn read_csv_network(nodes: &str, edges: &str) -> Result<ReadNetwork, Vec<FormatError>> {
    let mut errors = FormatErrors::default();
    let mut unread = Unread::default();
    let mut draft = NetworkDraft {
        name: "CSV network".to_owned(),
        integer_ids: true,
        ..NetworkDraft::default()
    };
    let others = read_table(
        nodes,
        "nodes",
        &mut errors,
        &NODE_COLUMNS,
        |columns, row| {
            let node = read_node(columns, row)?;
            if !draft.nodes.is_empty() && draft.coordinates != node.1 {
                return Err("has other coordinates than the nodes before it".to_owned());
            }
            let number = node.0.id.parse::<i64>();
            draft.integer_ids &= number.is_ok_and(|number| number.to_string() == node.0.id);
            draft.coordinates = node.1;
            draft.nodes.push(node.0);
            Ok(())
        },
    );
    unread.columns_of_nodes(others);
    let others = read_table(
        edges,
        "edges",
        &mut errors,
        &EDGE_COLUMNS,
        |columns, row| {
            draft.segments.push(read_edge(columns, row)?);
            Ok(())
        },
    );
    unread.columns_of_segments(others);
    if errors.is_empty() && draft.segments.is_empty() {
        let error = FormatError::new("edges", "has no rows, so that nothing could be flown");
        let columns =
            "give a header with the columns u, v and length_m, and a row for each segment";
        errors.push(error.hint(columns));
    }
    errors.or(ReadNetwork { draft, unread })
}

/// Names that a column may bear; the first that the header has is taken.
type ColumnNames = [&'static [&'static str]];

const NODE_COLUMNS: [&[&str]; 6] = [&["id"], &["lon"], &["lat"], &["x"], &["y"], &["pads"]];
const EDGE_COLUMNS: [&[&str]; 3] = [
    &["u", "source", "from"],
    &["v", "target", "to"],
    &["length_m", "weight"],
];

/// Reads the rows of a table; gives the names of the columns that are not read.
fn read_table(
    text: &str,
    table: &str,
    errors: &mut FormatErrors,
    names: &ColumnNames,
    mut take: impl FnMut(&[Option<usize>], &StringRecord) -> Result<(), String>,
) -> Vec<String> {
    let text = without_mark(text.as_bytes());
    let mut reader = ReaderBuilder::new()
        .delimiter(delimiter(text))
        .from_reader(text);
    let header = match reader.headers() {
        Ok(header) => header.clone(),
        Err(error) => {
            errors.push(FormatError::new(table, error.to_string()));
            return Vec::new();
        }
    };
    let column = |wanted: &&[&str]| {
        let place = |name: &&str| header.iter().position(|found| found.trim() == *name);
        wanted.iter().find_map(place)
    };
    let columns: Vec<Option<usize>> = names.iter().map(column).collect();
    let others = header.iter().enumerate();
    let others = others.filter(|(place, _)| !columns.contains(&Some(*place)));
    let others = others.map(|(_, name)| name.trim().to_owned()).collect();
    for row in reader.records() {
        if errors.is_full() {
            break;
        }
        let outcome = match &row {
            Ok(row) => take(&columns, row),
            Err(error) => Err(error.to_string()),
        };
        if let Err(message) = outcome {
            let line = row
                .ok()
                .and_then(|row| row.position().map(csv::Position::line));
            let place = line.map_or(table.to_owned(), |line| format!("{table}, line {line}"));
            errors.push(FormatError::new(place, message));
        }
    }
    others
}

/// What stands between the cells, by the first line: spreadsheets write semicolons where the comma is the decimal mark.
fn delimiter(text: &[u8]) -> u8 {
    let mut header = text.split(|&byte| byte == b'\n');
    let header = header.next().unwrap_or_default();
    let count = |delimiter: u8| header.iter().filter(|&&byte| byte == delimiter).count();
    let delimiters = [b',', b';', b'\t'].into_iter();
    // Of equally many the last would be taken, and the comma is the usual one.
    delimiters
        .rev()
        .max_by_key(|&delimiter| count(delimiter))
        .unwrap_or(b',')
}

fn cell<'r>(columns: &[Option<usize>], row: &'r StringRecord, wanted: usize) -> Option<&'r str> {
    let text = row.get(columns[wanted]?)?.trim();
    (!text.is_empty()).then_some(text)
}

fn number(text: &str, name: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(number) if number.is_finite() => Ok(number),
        _ if text.contains(',') => Err(format!(
            "'{name}' is '{text}', not a finite number; write a point for the decimals, not a comma"
        )),
        _ => Err(format!("'{name}' is '{text}', not a finite number")),
    }
}

fn read_node(
    columns: &[Option<usize>],
    row: &StringRecord,
) -> Result<(NodeDraft, Coordinates), String> {
    let id = cell(columns, row, 0).ok_or("has no 'id'")?;
    let pair = |first: usize, second: usize, names: [&str; 2]| {
        let (first, second) = (cell(columns, row, first), cell(columns, row, second));
        let (first, second) = first.zip(second)?;
        Some((|| {
            Ok([number(first, names[0])?, number(second, names[1])?])
        })())
    };
    let degrees = pair(1, 2, ["lon", "lat"]).map(|pair| (pair, Coordinates::Geographic));
    let metres = || pair(3, 4, ["x", "y"]).map(|pair| (pair, Coordinates::Planar));
    let (position, coordinates): (Result<[f64; 2], String>, Coordinates) = degrees
        .or_else(metres)
        .ok_or("has neither 'lon' and 'lat' nor 'x' and 'y'")?;
    let pads = match cell(columns, row, 5) {
        None => 0,
        Some(text) => text
            .parse()
            .map_err(|_| format!("'pads' is '{text}', not a count"))?,
    };
    let node = NodeDraft {
        id: id.to_owned(),
        position: position?,
        pads,
        ..NodeDraft::default()
    };
    Ok((node, coordinates))
}

fn read_edge(columns: &[Option<usize>], row: &StringRecord) -> Result<SegmentDraft, String> {
    let from = cell(columns, row, 0).ok_or("has no 'u' (or 'source', 'from')")?;
    let to = cell(columns, row, 1).ok_or("has no 'v' (or 'target', 'to')")?;
    let length_m = cell(columns, row, 2)
        .map(|text| number(text, "length_m"))
        .transpose()?;
    Ok(SegmentDraft {
        from: from.to_owned(),
        to: to.to_owned(),
        length_m,
        ..SegmentDraft::default()
    })
}

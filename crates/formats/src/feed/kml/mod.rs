//! KML 2.2 (OGC 07-147r2): what people draw in Google Earth, and what geographic information
//! systems write. Each Placemark is a zone, closed for everyone, as KML has no kinds.
//!
//! A place is a JSON Pointer as if elements were members: what may be there several times is counted
//! from 0 among its like, and so are the rings of a polygon and the positions of a ring.

mod element;
mod shape;
mod tags;
#[cfg(test)]
mod tests;

use super::collected::{Collected, MAX_FEED_ZONES, Reader};
use super::layer::FeedDraft;
use super::record::{Record, plain_identifier};
use super::sheet::Sheet;
use super::times::{Applicability, instant, window};
use crate::airspace::{Window, ZoneKind};
use crate::networks::foreign::ForeignFormat;
use crate::place::Place;
use crate::zones::{ZoneCode, ZoneProblem};
use element::{elements, named, only, text_of, text_under};
use roxmltree::{Document, Error, Node, ParsingOptions};
use rustc_hash::FxHashMap;
use serde_json::{Map, Value, json};
use shape::{is_shape, read_shapes};
use tags::check_tags;

/// At most this many elements and pieces of text in a file.
const MAX_NODES: u32 = 2_000_000;
/// How deep folders may lie in one another.
const MAX_DEPTH: usize = 32;
/// What is drawn and found by: it says nothing of what is closed.
const DRAWN: [&str; 20] = [
    "name",
    "visibility",
    "open",
    "author",
    "link",
    "address",
    "AddressDetails",
    "phoneNumber",
    "Snippet",
    "snippet",
    "description",
    "Camera",
    "LookAt",
    "styleUrl",
    "Style",
    "StyleMap",
    "Region",
    "Schema",
    "Metadata",
    "ExtendedData",
];
const TIMES: [&str; 2] = ["TimeSpan", "TimeStamp"];

pub(super) fn read(
    text: &str,
    reader: &Reader<'_>,
    collected: &mut Collected,
) -> Result<(), ZoneProblem> {
    check_tags(text)?;
    let options = ParsingOptions {
        nodes_limit: MAX_NODES,
        ..ParsingOptions::default()
    };
    let document = Document::parse_with_options(text, options).map_err(|error| told(&error))?;
    let root = document.root_element();
    if root.tag_name().name() != "kml" {
        let message = ForeignFormat::Xml.instead_of_zones();
        return Err(ZoneProblem::new(
            ZoneCode::FormatForeign,
            String::new(),
            message,
        ));
    }
    let place = Place::ROOT;
    let mut walk = Walk { reader, collected };
    walk.container(root, &place.member("kml"), Around::default())
}

/// Why a text cannot be read as XML.
fn told(error: &Error) -> ZoneProblem {
    let (code, message, remedy) = match error {
        Error::NodesLimitReached => (
            ZoneCode::TextTooLong,
            format!("the feed has more than {MAX_NODES} elements and texts"),
            "divide it into feeds by region",
        ),
        Error::DtdDetected => (
            ZoneCode::NotXml,
            "the feed defines its own document type, which is not read".to_owned(),
            "leave <!DOCTYPE ...> out",
        ),
        error => (
            ZoneCode::NotXml,
            error.to_string(),
            "mend it at that line and column, or export it again",
        ),
    };
    ZoneProblem::new(code, String::new(), message).hint(remedy)
}

/// What the folders around a Placemark say of it.
#[derive(Clone, Copy, Default)]
struct Around {
    depth: usize,
    has_time: bool,
}

/// A walk through the folders of a file.
struct Walk<'a, 'r> {
    reader: &'a Reader<'r>,
    collected: &'a mut Collected,
}

impl Walk<'_, '_> {
    fn container(
        &mut self,
        container: Node<'_, '_>,
        place: &Place<'_>,
        around: Around,
    ) -> Result<(), ZoneProblem> {
        let has_time = TIMES
            .iter()
            .any(|name| named(container, name).next().is_some());
        let within = Around {
            depth: around.depth + 1,
            has_time: around.has_time || has_time,
        };
        if within.depth > MAX_DEPTH {
            let message = format!("folders lie more than {MAX_DEPTH} deep in one another");
            let problem = ZoneProblem::new(ZoneCode::TextTooLong, place.pointer(), message);
            return Err(problem.hint("lay them beside each other"));
        }
        let mut counts: FxHashMap<&str, usize> = FxHashMap::default();
        for element in elements(container) {
            let name = element.tag_name().name();
            let count = counts.entry(name).or_default();
            let listed = place.member(name);
            let place = listed.element(*count);
            *count += 1;
            match name {
                "Document" | "Folder" => self.container(element, &place, within)?,
                "Placemark" | "NetworkLink" => self.feature(element, &place, within)?,
                "GroundOverlay" | "ScreenOverlay" | "PhotoOverlay" => {
                    let message = "not imported: a picture is no zone";
                    self.collected.note(&place.pointer(), message);
                }
                known if DRAWN.contains(&known) || TIMES.contains(&known) => {}
                _ => {
                    let message = "not imported: it is no Placemark";
                    self.collected.note(&place.pointer(), message);
                }
            }
        }
        Ok(())
    }

    fn feature(
        &mut self,
        feature: Node<'_, '_>,
        place: &Place<'_>,
        around: Around,
    ) -> Result<(), ZoneProblem> {
        if self.collected.zones.len() >= MAX_FEED_ZONES {
            let message = format!("the feed has more than the {MAX_FEED_ZONES} zones allowed");
            let problem = ZoneProblem::new(ZoneCode::TextTooLong, place.pointer(), message);
            return Err(problem.hint("divide it into feeds by region"));
        }
        let mut sheet = Sheet::default();
        let name = text_under(feature, "name", place, &mut sheet);
        let identifier = read_identifier(feature, name.as_deref(), place, &mut sheet);
        let draft = match feature.tag_name().name() {
            "Placemark" => {
                let applies = read_time(feature, place, around, &mut sheet);
                let layers = read_shapes(feature, place, &mut sheet);
                let record = read_record(feature, name, place, &mut sheet);
                identifier.clone().map(|identifier| FeedDraft {
                    identifier,
                    kind: ZoneKind::Prohibited,
                    applies,
                    layers,
                    record,
                })
            }
            _ => {
                let message = "links to zones that lie elsewhere, which are not fetched";
                let remedy = "save what it links to into one file";
                sheet.refuse(ZoneCode::GeometryUnsupported, place, message, remedy);
                None
            }
        };
        let pointer = place.pointer();
        self.reader
            .take(identifier, pointer, draft, sheet, self.collected);
        Ok(())
    }
}

/// The id, or the name of what has none: programs in which people draw write no ids.
fn read_identifier(
    feature: Node<'_, '_>,
    name: Option<&str>,
    place: &Place<'_>,
    sheet: &mut Sheet,
) -> Option<String> {
    let id = feature.attribute("id").filter(|id| !id.trim().is_empty());
    if let Some(id) = id {
        return plain_identifier(id, &place.member("id"), sheet);
    }
    let Some(name) = name else {
        sheet.missing(place, "id");
        return None;
    };
    sheet.note(place, "has no id, and is known by its name");
    plain_identifier(name, &place.member("name"), sheet)
}

/// When a Placemark counts: always, or in its span.
fn read_time(
    placemark: Node<'_, '_>,
    place: &Place<'_>,
    around: Around,
    sheet: &mut Sheet,
) -> Applicability {
    let remedy = "write a TimeSpan with begin and end into the Placemark";
    if only(placemark, "TimeStamp", place, sheet).is_some() {
        let place = place.member("TimeStamp");
        let message = "is a single instant, and a zone counts for a while";
        sheet.refuse(ZoneCode::TimeInvalid, &place, message, remedy);
        return Applicability::default();
    }
    let Some(span) = only(placemark, "TimeSpan", place, sheet) else {
        if around.has_time {
            let message =
                "has no time of its own, and it is unclear whether that of its folder holds";
            sheet.refuse(ZoneCode::TimeInvalid, place, message, remedy);
        }
        return Applicability::default();
    };
    let place = place.member("TimeSpan");
    let [from, until] = ["begin", "end"].map(|name| {
        let written = text_under(span, name, &place, sheet)?;
        instant(&written, &place.member(name), sheet)
    });
    let within = window(from, until, &place.member("end"), sheet);
    if within == Some(Window::ALWAYS) && sheet.problems.count() == 0 {
        sheet.note(&place, "without begin and end it counts always");
    }
    Applicability {
        windows: within.into_iter().collect(),
        schedules: Vec::new(),
    }
}

/// What people are told of it, and what nothing acts on.
fn read_record(
    placemark: Node<'_, '_>,
    name: Option<String>,
    place: &Place<'_>,
    sheet: &mut Sheet,
) -> Record {
    let mut record = Record::empty();
    if let Some(name) = name {
        record.put("name", json!([{"text": name}]));
    }
    let mut extended = Map::new();
    if let Some(description) = text_under(placemark, "description", place, sheet) {
        extended.insert("description".to_owned(), json!(description));
    }
    if let Some(data) = only(placemark, "ExtendedData", place, sheet) {
        let data = read_data(data);
        if !data.is_empty() {
            let names: Vec<&str> = data.keys().map(String::as_str).collect();
            let message = format!("kept, and nothing acts on: {}", names.join(", "));
            sheet.note(&place.member("ExtendedData"), message);
            extended.insert("ExtendedData".to_owned(), Value::Object(data));
        }
    }
    if !extended.is_empty() {
        record.put("extendedProperties", Value::Object(extended));
    }
    for element in elements(placemark) {
        let name = element.tag_name().name();
        if !DRAWN.contains(&name) && !TIMES.contains(&name) && !is_shape(name) {
            sheet.note(&place.member(name), "left out: nothing is known of it");
        }
    }
    record
}

/// The values of `ExtendedData` by their names: of `Data`, of `SchemaData`, of elements of others.
fn read_data(data: Node<'_, '_>) -> Map<String, Value> {
    let mut values = Map::new();
    let mut put = |name: Option<&str>, text: String| {
        let Some(name) = name.filter(|_| !text.is_empty()) else {
            return;
        };
        match values.get_mut(name) {
            None => {
                values.insert(name.to_owned(), json!(text));
            }
            Some(Value::Array(texts)) => texts.push(json!(text)),
            Some(only) => *only = json!([only.take(), text]),
        }
    };
    for element in elements(data) {
        match element.tag_name().name() {
            "Data" => {
                let value = named(element, "value").next();
                put(
                    element.attribute("name"),
                    value.map(text_of).unwrap_or_default(),
                );
            }
            "SchemaData" => {
                for field in named(element, "SimpleData") {
                    put(field.attribute("name"), text_of(field));
                }
            }
            name => put(Some(name), text_of(element)),
        }
    }
    values
}

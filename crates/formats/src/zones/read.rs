//! Text or JSON to zones.

use super::geometry::{geometry_problem, read_geometry};
use super::member::{Members, known_only, text, wrong_type};
use super::problem::{Problems, ZoneCode, ZoneProblem};
use super::terms::read_terms;
use super::windows::read_windows;
use crate::airspace::{DEFAULT_MARGIN_M, Zone, ZoneDraft, ZoneFault, ZoneGeometry, ZoneText};
use crate::geo::{Altitude, AltitudeBand, AltitudeReference, Frame};
use crate::mark::without_mark;
use crate::networks::foreign::ForeignFormat;
use crate::place::Place;
use crate::suggestion::nearest;
use rustc_hash::FxHashMap;
use serde_json::{Map, Value};

const COLLECTION_MEMBERS: [&str; 4] = ["type", "features", "name", "bbox"];
const FEATURE_MEMBERS: [&str; 5] = ["type", "id", "geometry", "properties", "bbox"];
const PROPERTIES: [&str; 14] = [
    "name",
    "reason",
    "authority",
    "kind",
    "authorized",
    "source",
    "record",
    "lower_m",
    "lower_reference",
    "upper_m",
    "upper_reference",
    "windows",
    "radius_m",
    "margin_m",
];
const REFERENCES: [&str; 3] = ["agl", "amsl", "wgs84"];

/// Where the id of a zone comes from.
#[derive(Clone, Copy, Debug)]
pub enum ZoneId<'a> {
    /// The feature has to have one.
    Stated,
    /// The feature's, or this one where it has none.
    StatedOr(&'a str),
    /// This one; a feature may repeat it and must not have another.
    Fixed(&'a str),
}

/// Reads a zone from a GeoJSON feature, in the coordinates that `frame` says.
///
/// # Errors
/// Up to [`MAX_ZONE_PROBLEMS`](super::MAX_ZONE_PROBLEMS) problems, each with its code and its place,
/// relative to the feature.
pub fn zone_from_feature(
    feature: &Value,
    id: ZoneId<'_>,
    frame: &Frame,
) -> Result<Zone, Vec<ZoneProblem>> {
    if let Some(foreign) = ForeignFormat::of_json(feature) {
        return Err(vec![foreign_format(foreign)]);
    }
    let mut problems = Problems::default();
    let zone = read_feature(feature, id, frame, &Place::ROOT, &mut problems);
    problems.or(zone)
}

/// Reads the zones of the text of a GeoJSON feature collection, each with its own id; a single feature is one zone.
///
/// # Errors
/// As [`zone_from_feature`], of all zones together, places relative to the document; text that is not JSON; two
/// zones of one id.
pub fn read_zones(json: &str, frame: &Frame) -> Result<Vec<Zone>, Vec<ZoneProblem>> {
    let document = parse(json)?;
    if let Some(foreign) = ForeignFormat::of_json(&document) {
        return Err(vec![foreign_format(foreign)]);
    }
    let mut problems = Problems::default();
    let root = Place::ROOT;
    if document.get("type").and_then(Value::as_str) == Some("Feature") {
        let zone = read_feature(&document, ZoneId::Stated, frame, &root, &mut problems);
        return problems.or(zone.map(|zone| vec![zone]));
    }
    let zones = read_collection(&document, frame, &root, &mut problems);
    problems.or(zones)
}

fn parse(json: &str) -> Result<Value, Vec<ZoneProblem>> {
    serde_json::from_slice(without_mark(json.as_bytes())).map_err(|error| {
        if let Some(foreign) = ForeignFormat::of_text(json) {
            return vec![foreign_format(foreign)];
        }
        let message = error.to_string();
        let code = match message.starts_with("number out of range") {
            true => ZoneCode::NumberOutOfRange,
            false => ZoneCode::NotJson,
        };
        vec![ZoneProblem::new(code, String::new(), message)]
    })
}

fn foreign_format(foreign: ForeignFormat) -> ZoneProblem {
    let message = foreign.instead_of_zones();
    ZoneProblem::new(ZoneCode::FormatForeign, String::new(), message)
}

fn read_collection(
    document: &Value,
    frame: &Frame,
    place: &Place<'_>,
    problems: &mut Problems,
) -> Option<Vec<Zone>> {
    let Value::Object(members) = document else {
        problems.push(wrong_type(document, "an object", place));
        return None;
    };
    known_only(members, &COLLECTION_MEMBERS, place, problems);
    let members = Members { members, place };
    members.expect_type("FeatureCollection", problems);
    let features = members.required("features", problems)?;
    let place = place.member("features");
    let Value::Array(features) = features else {
        problems.push(wrong_type(features, "an array", &place));
        return None;
    };
    let mut zones: Vec<Zone> = Vec::with_capacity(features.len());
    let mut index_of: FxHashMap<String, usize> = FxHashMap::default();
    for (index, feature) in features.iter().enumerate() {
        let place = place.element(index);
        let Some(zone) = read_feature(feature, ZoneId::Stated, frame, &place, problems) else {
            if problems.is_full() {
                break;
            }
            continue;
        };
        if let Some(earlier) = index_of.insert(zone.id().to_owned(), index) {
            let message = format!("the id '{}' is that of feature {earlier}, too", zone.id());
            let pointer = place.member("id").pointer();
            problems.push(ZoneProblem::new(ZoneCode::IdDuplicate, pointer, message));
        }
        zones.push(zone);
    }
    Some(zones)
}

fn read_feature(
    feature: &Value,
    id: ZoneId<'_>,
    frame: &Frame,
    place: &Place<'_>,
    problems: &mut Problems,
) -> Option<Zone> {
    let problems_before = problems.count();
    let Value::Object(members) = feature else {
        problems.push(wrong_type(feature, "an object", place));
        return None;
    };
    known_only(members, &FEATURE_MEMBERS, place, problems);
    let members = Members { members, place };
    members.expect_type("Feature", problems);
    let id = read_id(&members, id, problems);
    let empty = Map::new();
    let properties_place = place.member("properties");
    let properties = match members.optional("properties") {
        None => &empty,
        Some(Value::Object(properties)) => properties,
        Some(other) => {
            problems.push(wrong_type(other, "an object", &properties_place));
            &empty
        }
    };
    known_only(properties, &PROPERTIES, &properties_place, problems);
    let properties = Members {
        members: properties,
        place: &properties_place,
    };
    let geometry = members.required("geometry", problems).and_then(|geometry| {
        let radius_m = read_radius(&properties, geometry, problems);
        read_geometry(geometry, radius_m, &place.member("geometry"), problems)
    });
    let windows = read_windows(&properties, problems);
    let draft = ZoneDraft {
        name: properties.text("name", problems),
        reason: properties.text("reason", problems),
        authority: properties.text("authority", problems),
        band: AltitudeBand {
            lower: read_limit(&properties, "lower_m", "lower_reference", problems),
            upper: read_limit(&properties, "upper_m", "upper_reference", problems),
        },
        windows: windows.plain,
        margin_m: properties
            .number("margin_m", problems)
            .unwrap_or(DEFAULT_MARGIN_M),
        terms: read_terms(&properties, windows.schedules, problems),
        id: id?,
        geometry: geometry?,
    };
    let geometry = draft.geometry.clone();
    match Zone::new(draft, frame) {
        // A zone of which a part could not be read is no zone.
        Ok(zone) => (problems.count() == problems_before).then_some(zone),
        Err(faults) => {
            for fault in &faults {
                problems.push(zone_problem(fault, &geometry, place));
            }
            None
        }
    }
}

fn read_id(members: &Members<'_>, id: ZoneId<'_>, problems: &mut Problems) -> Option<String> {
    let place = members.place.member("id");
    let stated = match members.optional("id") {
        Some(value) => Some(text(value, &place, problems)?),
        None => None,
    };
    match (id, stated) {
        (ZoneId::Stated, None) => {
            members.missing("id", problems);
            None
        }
        (ZoneId::Fixed(fixed), Some(stated)) if fixed != stated => {
            let message =
                format!("the id '{stated}' is not '{fixed}', under which the zone is written");
            let problem = ZoneProblem::new(ZoneCode::IdMismatch, place.pointer(), message);
            problems.push(problem.hint("leave the id out, or write it the same"));
            None
        }
        (ZoneId::StatedOr(id) | ZoneId::Fixed(id), None) => Some(id.to_owned()),
        (_, Some(stated)) => Some(stated.to_owned()),
    }
}

/// Whether an id is a step of a path: addresses are made without such steps, and lead to another thing.
pub fn is_path_step(id: &str) -> bool {
    matches!(id, "." | "..")
}

/// The property `radius_m`, which a point has to have and nothing else may.
fn read_radius(properties: &Members<'_>, geometry: &Value, problems: &mut Problems) -> Option<f64> {
    let is_point = geometry.get("type").and_then(Value::as_str) == Some("Point");
    match properties.optional("radius_m") {
        None if is_point => {
            let pointer = properties.place.member("radius_m").pointer();
            let message = "a Point is a circle and needs its radius_m";
            let problem = ZoneProblem::new(ZoneCode::MissingField, pointer, message);
            problems.push(problem.hint("give radius_m in metres"));
            None
        }
        Some(_) if !is_point => {
            let pointer = properties.place.member("radius_m").pointer();
            let message = "only a Point has a radius";
            let problem = ZoneProblem::new(ZoneCode::RadiusInvalid, pointer, message);
            problems.push(problem.hint("margin_m widens a polygon"));
            None
        }
        _ => properties.number("radius_m", problems),
    }
}

fn read_limit(
    properties: &Members<'_>,
    value_name: &str,
    reference_name: &str,
    problems: &mut Problems,
) -> Option<Altitude> {
    let value_m = properties.number(value_name, problems);
    let reference = match properties.text(reference_name, problems).as_deref() {
        None | Some("agl") => AltitudeReference::Agl,
        Some("amsl") => AltitudeReference::Amsl,
        Some("wgs84") => AltitudeReference::Wgs84,
        Some(other) => {
            let pointer = properties.place.member(reference_name).pointer();
            let hint = match nearest(other, REFERENCES, 1).first() {
                Some(meant) => format!("did you mean '{meant}'?"),
                None => format!("use one of {}", REFERENCES.join(", ")),
            };
            let message = format!("nothing is known of the reference '{other}'");
            problems.push(ZoneProblem::new(ZoneCode::UnknownValue, pointer, message).hint(hint));
            return None;
        }
    };
    let reference_is_alone =
        properties.optional(reference_name).is_some() && properties.optional(value_name).is_none();
    if reference_is_alone {
        let pointer = properties.place.member(value_name).pointer();
        let message = format!("{reference_name} is given without {value_name}");
        let problem = ZoneProblem::new(ZoneCode::MissingField, pointer, message);
        problems.push(problem.hint("leave out both for no limit"));
    }
    let value_m = value_m?;
    Some(Altitude { value_m, reference })
}

/// The problem for a fault that [`Zone::new`] found.
fn zone_problem(fault: &ZoneFault, geometry: &ZoneGeometry, feature: &Place<'_>) -> ZoneProblem {
    let property = |name: &str| feature.member("properties").member(name).pointer();
    let (code, pointer) = match fault {
        ZoneFault::Geometry(error) => return geometry_problem(error, geometry, feature),
        ZoneFault::EmptyId => (ZoneCode::IdEmpty, feature.member("id").pointer()),
        ZoneFault::TextTooLong {
            text: ZoneText::Id, ..
        } => (ZoneCode::TextTooLong, feature.member("id").pointer()),
        ZoneFault::TextTooLong { text, .. } => (ZoneCode::TextTooLong, property(text.field())),
        ZoneFault::RecordTooDeep(_) => (ZoneCode::TextTooLong, property("record")),
        ZoneFault::AltitudeNotFinite => (ZoneCode::AltitudeInvalid, property("upper_m")),
        ZoneFault::BandReversed { .. } => (ZoneCode::BandReversed, property("lower_m")),
        ZoneFault::TooManyWindows { .. } => (ZoneCode::TooManyWindows, property("windows")),
        ZoneFault::TooManyPeriods { .. } => (ZoneCode::TooManyPeriods, property("windows")),
        ZoneFault::ScheduleEmpty | ZoneFault::NoSun => {
            (ZoneCode::ScheduleInvalid, property("windows"))
        }
        ZoneFault::Margin { .. } => (ZoneCode::MarginInvalid, property("margin_m")),
        ZoneFault::NotAuthorizable { .. } => {
            let pointer = property("authorized");
            return ZoneProblem::new(ZoneCode::NotAuthorizable, pointer, fault.to_string())
                .hint("leave it out, or give the kind 'req_authorization' or 'conditional'");
        }
    };
    ZoneProblem::new(code, pointer, fault.to_string())
}

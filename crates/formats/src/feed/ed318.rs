//! ED-318: GeoJSON features whose geometries carry their layer, and what national feeds make of it.

use super::collected::{Collected, Reader, bounded};
use super::extended::{EXTENDED, MARGIN, is_plain, stands_for};
use super::layer::{FeedDraft, Layer, UNITS, read_limit, read_position, read_rings};
use super::record::{Record, read_identifier, read_kind};
use super::sheet::{Members, Sheet};
use super::times::Applicability;
use crate::airspace::{MAX_MARGIN_M, ZoneGeometry};
use crate::geo::AltitudeBand;
use crate::place::Place;
use crate::zones::{ZoneCode, ZoneProblem};
use serde_json::{Map, Value};

const ACTED_ON: [&str; 20] = [
    "identifier",
    "type",
    "restriction",
    "limitedApplicability",
    "applicability",
    "layer",
    "verticalLayer",
    "UASZone",
    "upper",
    "upperReference",
    "lower",
    "lowerReference",
    "uom",
    "upperLimit",
    "upperVerticalReference",
    "lowerLimit",
    "lowerVerticalReference",
    "uomDimensions",
    "permanent",
    "radius",
];
/// The limits of a volume: in the standard, and as ED-269 and Spanish feeds name them.
const LIMITS: [[&str; 2]; 5] = [
    ["lower", "lowerLimit"],
    ["lowerReference", "lowerVerticalReference"],
    ["upper", "upperLimit"],
    ["upperReference", "upperVerticalReference"],
    ["uom", "uomDimensions"],
];
const PERIODS: [&str; 2] = ["limitedApplicability", "applicability"];
const METADATA: [&str; 2] = ["metadata", "datasetMetadata"];

pub(super) fn read(
    document: &Value,
    reader: &Reader<'_>,
    collected: &mut Collected,
) -> Result<(), ZoneProblem> {
    let root = Place::ROOT;
    let Some(features) = document.get("features").and_then(Value::as_array) else {
        // A zone by itself.
        read_feature(document, &root, reader, collected);
        return Ok(());
    };
    for name in METADATA {
        let has = |end: &str| {
            document
                .get(name)
                .is_some_and(|told| told.get(end).is_some())
        };
        if has("validFrom") || has("validTo") {
            let pointer = format!("/{name}");
            collected.note(
                &pointer,
                "the validity of the collection does not end its zones",
            );
        }
    }
    let place = root.member("features");
    for (index, feature) in bounded(features, &place)?.iter().enumerate() {
        read_feature(feature, &place.element(index), reader, collected);
    }
    Ok(())
}

fn read_feature(value: &Value, place: &Place<'_>, reader: &Reader<'_>, collected: &mut Collected) {
    let mut sheet = Sheet::default();
    let mut identifier = None;
    let draft = sheet
        .object(value, place)
        .and_then(|members| read_draft(Members { members, place }, &mut identifier, &mut sheet));
    reader.take(identifier, place.pointer(), draft, sheet, collected);
}

fn read_draft(
    feature: Members<'_>,
    identifier: &mut Option<String>,
    sheet: &mut Sheet,
) -> Option<FeedDraft> {
    let place = feature.place.member("properties");
    let Some(properties) = feature.get("properties") else {
        sheet.missing(feature.place, "properties");
        return None;
    };
    let outer = Members {
        members: sheet.object(properties, &place)?,
        place: &place,
    };
    let nested_place = place.member("UASZone");
    let zone = match outer.get("UASZone") {
        None => outer,
        Some(nested) => {
            sheet.note(&nested_place, "was read as the properties of the zone");
            Members {
                members: sheet.object(nested, &nested_place)?,
                place: &nested_place,
            }
        }
    };
    *identifier = read_identifier(zone, sheet);
    read_extended(zone, identifier, sheet);
    let kind = read_kind(zone, ["type", "restriction"], sheet);
    let applies = read_applicability(zone, sheet);
    let mut layers = Vec::new();
    let geometry_place = feature.place.member("geometry");
    match feature.get("geometry") {
        None => sheet.missing(feature.place, "geometry"),
        Some(geometry) => {
            let outer_layers = [outer, zone];
            read_geometry(geometry, &geometry_place, &outer_layers, &mut layers, sheet);
            if layers.is_empty() && sheet.problems.count() == 0 {
                let remedy = "give it a shape";
                let (code, what) = (ZoneCode::GeometryEmpty, "has no shape");
                sheet.refuse(code, &geometry_place, what, remedy);
            }
        }
    }
    let record = Record::read(zone, &ACTED_ON, sheet);
    Some(FeedDraft {
        identifier: identifier.clone()?,
        kind: kind?,
        applies,
        layers,
        record,
    })
}

/// What the export here writes where the standard has no word for it: the margin, and the identifier whose place digits take.
fn read_extended(zone: Members<'_>, identifier: &mut Option<String>, sheet: &mut Sheet) {
    let place = zone.place.member(EXTENDED);
    let Some(members) = zone.get(EXTENDED).and_then(Value::as_object) else {
        return;
    };
    let extended = Members {
        members,
        place: &place,
    };
    if let Some(margin) = extended.get(MARGIN) {
        let sane = margin
            .as_f64()
            .filter(|margin_m| (0.0..=MAX_MARGIN_M).contains(margin_m));
        if sane.is_none() {
            let message = format!("not used, as it is no margin from 0 to {MAX_MARGIN_M} m");
            sheet.note(&place.member(MARGIN), message);
        }
        sheet.margin_m = sane;
    }
    let full = extended.get("identifier").and_then(Value::as_str);
    if let (Some(full), Some(short)) = (full, identifier)
        && is_plain(full)
        && stands_for(short, full)
    {
        sheet.note(&place.member("identifier"), "was read as the identifier");
        full.clone_into(short);
    }
}

/// Without limits in time a zone is permanent.
fn read_applicability(zone: Members<'_>, sheet: &mut Sheet) -> Applicability {
    let mut applies = Applicability::default();
    let Some((name, periods)) = zone.first(&PERIODS) else {
        return applies;
    };
    let place = zone.place.member(name);
    let periods = sheet.list(periods, &place);
    sheet.each(periods, &place, |period, sheet| {
        let permanent = period.get("permanent").and_then(Value::as_str);
        applies.read(period, permanent == Some("YES"), sheet);
    });
    applies
}

/// A shape, or a collection of them; what has no layer of its own has that of its surroundings.
fn read_geometry(
    value: &Value,
    place: &Place<'_>,
    around: &[Members<'_>],
    layers: &mut Vec<Layer>,
    sheet: &mut Sheet,
) {
    let Some(members) = sheet.object(value, place) else {
        return;
    };
    let geometry = Members { members, place };
    if geometry.get("type").and_then(Value::as_str) != Some("GeometryCollection") {
        layers.extend(read_shape(geometry, around, sheet));
        return;
    }
    let place = place.member("geometries");
    let shapes = geometry.get("geometries");
    let Some(shapes) = shapes.and_then(Value::as_array) else {
        sheet.missing(geometry.place, "geometries");
        return;
    };
    let around: Vec<Members<'_>> = std::iter::once(geometry)
        .chain(around.iter().copied())
        .collect();
    sheet.each(shapes, &place, |shape, sheet| {
        layers.extend(read_shape(shape, &around, sheet))
    });
}

fn read_shape(shape: Members<'_>, around: &[Members<'_>], sheet: &mut Sheet) -> Option<Layer> {
    let kinds = [("POLYGON", 'p'), ("MULTIPOLYGON", 'm'), ("POINT", 'c')];
    let Some(kind) = shape.get("type") else {
        sheet.missing(shape.place, "type");
        return None;
    };
    let kind = sheet.word(kind, &shape.place.member("type"), &kinds)?;
    let Some(coordinates) = shape.get("coordinates") else {
        sheet.missing(shape.place, "coordinates");
        return None;
    };
    let place = shape.place.member("coordinates");
    let geometry = match kind {
        'p' => ZoneGeometry::Polygon(read_rings(coordinates, &place, sheet)?),
        'm' => {
            sheet.note(
                &place,
                "the standard has no MultiPolygon; it was read as one",
            );
            ZoneGeometry::MultiPolygon(read_polygons(coordinates, &place, sheet)?)
        }
        _ => {
            let centre = read_position(coordinates, &place, sheet);
            let radius_m = read_radius(shape, around, sheet);
            ZoneGeometry::Circle {
                centre: centre?,
                radius_m: radius_m?,
            }
        }
    };
    sheet.shapes.push(geometry.clone());
    Some(Layer {
        geometry,
        band: read_band(shape, around, sheet)?,
        pointer: place.pointer(),
    })
}

fn read_polygons(
    value: &Value,
    place: &Place<'_>,
    sheet: &mut Sheet,
) -> Option<Vec<Vec<crate::airspace::WrittenRing>>> {
    let polygons = sheet.list(value, place).iter().enumerate();
    polygons
        .map(|(index, rings)| read_rings(rings, &place.element(index), sheet))
        .collect()
}

/// The radius of a circle, in metres: the standard states no unit, and feeds mean metres.
fn read_radius(shape: Members<'_>, around: &[Members<'_>], sheet: &mut Sheet) -> Option<f64> {
    let place = shape.place.member("extent");
    let Some(extent) = shape.get("extent") else {
        let found = around
            .iter()
            .find_map(|members| Some((*members, members.get("radius")?)));
        let Some((members, radius)) = found else {
            sheet.missing(shape.place, "extent");
            return None;
        };
        let place = members.place.member("radius");
        sheet.note(&place, "was read as the radius of the extent, in metres");
        return sheet.number(radius, &place);
    };
    let extent = Members {
        members: sheet.object(extent, &place)?,
        place: &place,
    };
    if let Some(kind) = extent.get("subType") {
        sheet.word(kind, &place.member("subType"), &[("CIRCLE", ())])?;
    }
    let Some(radius) = extent.get("radius") else {
        sheet.missing(&place, "radius");
        return None;
    };
    sheet.number(radius, &place.member("radius"))
}

/// The limits: of the layer of the shape, else of its surroundings, or flat among their members.
fn read_band(
    shape: Members<'_>,
    around: &[Members<'_>],
    sheet: &mut Sheet,
) -> Option<AltitudeBand> {
    for members in std::iter::once(&shape).chain(around) {
        if let Some((name, layer)) = members.first(&["layer", "verticalLayer"]) {
            let place = members.place.member(name);
            let layer: &Map<String, Value> = sheet.object(layer, &place)?;
            let layer = Members {
                members: layer,
                place: &place,
            };
            if members.place.pointer() != shape.place.pointer() {
                sheet.note(&place, "was read as the layer of the shape");
            }
            return read_limits(layer, sheet);
        }
    }
    let has_limits = |members: &&Members<'_>| {
        let names = LIMITS.iter().flatten();
        names.copied().any(|name| members.get(name).is_some())
    };
    match std::iter::once(&shape).chain(around).find(has_limits) {
        Some(members) => {
            sheet.note(
                members.place,
                "its limits were read as the layer of the shape",
            );
            read_limits(*members, sheet)
        }
        None => {
            sheet.note(shape.place, "without a layer it reaches over all altitudes");
            Some(AltitudeBand::UNLIMITED)
        }
    }
}

fn read_limits(layer: Members<'_>, sheet: &mut Sheet) -> Option<AltitudeBand> {
    let names = LIMITS.map(|names| spelling(layer, names, sheet));
    let [lower, lower_reference, upper, upper_reference, unit] = names;
    let unit = unit?;
    let unit_m = match layer.get(unit) {
        Some(value) => sheet.word(value, &layer.place.member(unit), &UNITS)?,
        // The default of the standard.
        None => 1.0,
    };
    let lower = read_limit(layer, [lower?, lower_reference?], unit_m, sheet);
    let upper = read_limit(layer, [upper?, upper_reference?], unit_m, sheet);
    Some(AltitudeBand {
        lower: lower?,
        upper: upper?,
    })
}

/// The name that a member of a layer has there, that of the standard where it has none; it is refused where both are there
/// and say different things.
fn spelling(
    layer: Members<'_>,
    [usual, other]: [&'static str; 2],
    sheet: &mut Sheet,
) -> Option<&'static str> {
    let Some(value) = layer.get(other) else {
        return Some(usual);
    };
    let place = layer.place.member(other);
    match layer.get(usual) {
        None => {
            sheet.note(&place, format!("was read as the {usual}"));
            Some(other)
        }
        Some(stated) if means_same(stated, value) => Some(usual),
        Some(_) => {
            let message = format!("says something else than '{usual}' beside it");
            sheet.refuse(ZoneCode::UnknownField, &place, message, "leave one of them");
            None
        }
    }
}

/// Whether two values mean the same: how a number is written, and the case of words, do not matter.
fn means_same(one: &Value, other: &Value) -> bool {
    match (one.as_f64(), other.as_f64()) {
        (Some(one), Some(other)) => one == other,
        _ => one.to_string().eq_ignore_ascii_case(&other.to_string()),
    }
}

//! The geometry of a zone's feature: read as written, and the places its faults are at.

use super::member::{Members, known_only, number, text, wrong_type};
use super::problem::{Problems, ZoneCode, ZoneProblem};
use crate::airspace::{GeometryError, GeometryFault, WrittenRing, ZoneGeometry};
use crate::geo::{ShapeFault, VertexPlace};
use crate::place::Place;
use crate::suggestion::nearest;
use serde_json::Value;

const GEOMETRY_MEMBERS: [&str; 3] = ["type", "coordinates", "bbox"];
const GEOMETRY_TYPES: [&str; 3] = ["Polygon", "MultiPolygon", "Point"];

/// Reads a geometry; `radius_m` is the property of that name, which makes a point a circle.
pub(super) fn read_geometry(
    value: &Value,
    radius_m: Option<f64>,
    place: &Place<'_>,
    problems: &mut Problems,
) -> Option<ZoneGeometry> {
    let Value::Object(members) = value else {
        problems.push(wrong_type(value, "an object", place));
        return None;
    };
    known_only(members, &GEOMETRY_MEMBERS, place, problems);
    let members = Members { members, place };
    let kind = text(
        members.required("type", problems)?,
        &place.member("type"),
        problems,
    )?;
    if !GEOMETRY_TYPES.contains(&kind) {
        problems.push(unsupported(kind, place.member("type").pointer()));
        return None;
    }
    let coordinates = members.required("coordinates", problems)?;
    let place = place.member("coordinates");
    match kind {
        "Polygon" => read_rings(coordinates, &place, problems).map(ZoneGeometry::Polygon),
        "MultiPolygon" => {
            let polygons = each(coordinates, &place, problems, read_rings)?;
            Some(ZoneGeometry::MultiPolygon(polygons))
        }
        _ => {
            let centre = read_position(coordinates, &place, problems);
            Some(ZoneGeometry::Circle {
                centre: centre?,
                radius_m: radius_m?,
            })
        }
    }
}

fn unsupported(kind: &str, pointer: String) -> ZoneProblem {
    let hint = match nearest(kind, GEOMETRY_TYPES, 1).first() {
        Some(meant) => format!("did you mean '{meant}'?"),
        None => "use Polygon, MultiPolygon, or Point with radius_m".to_owned(),
    };
    let code = ZoneCode::GeometryUnsupported;
    ZoneProblem::new(code, pointer, format!("a zone cannot be a '{kind}'")).hint(hint)
}

fn read_rings(
    value: &Value,
    place: &Place<'_>,
    problems: &mut Problems,
) -> Option<Vec<WrittenRing>> {
    each(value, place, problems, |ring, place, problems| {
        each(ring, place, problems, read_position)
    })
}

/// Reads every element of an array; `None` when the value is none, or an element could not be read.
fn each<T>(
    value: &Value,
    place: &Place<'_>,
    problems: &mut Problems,
    mut read: impl FnMut(&Value, &Place<'_>, &mut Problems) -> Option<T>,
) -> Option<Vec<T>> {
    let Value::Array(elements) = value else {
        problems.push(wrong_type(value, "an array", place));
        return None;
    };
    let mut found = Vec::with_capacity(elements.len());
    for (index, element) in elements.iter().enumerate() {
        found.extend(read(element, &place.element(index), problems));
        if problems.is_full() {
            return None;
        }
    }
    (found.len() == elements.len()).then_some(found)
}

fn read_position(value: &Value, place: &Place<'_>, problems: &mut Problems) -> Option<[f64; 2]> {
    let Value::Array(numbers) = value else {
        problems.push(wrong_type(value, "a position", place));
        return None;
    };
    let [first, second] = numbers.as_slice() else {
        let message = format!("a position has 2 numbers, this one {}", numbers.len());
        let problem = ZoneProblem::new(ZoneCode::PositionNotPair, place.pointer(), message);
        problems.push(match numbers.len() {
            3 => problem.hint("give altitudes as lower_m and upper_m, with their references"),
            _ => problem,
        });
        return None;
    };
    let first = number(first, &place.element(0), problems);
    let second = number(second, &place.element(1), problems);
    Some([first?, second?])
}

/// The problem for a fault of a geometry that could be read; `feature` is the place of the zone.
pub(super) fn geometry_problem(
    error: &GeometryError,
    geometry: &ZoneGeometry,
    feature: &Place<'_>,
) -> ZoneProblem {
    let (code, hint) = code_and_hint(&error.fault);
    let is_circle = matches!(geometry, ZoneGeometry::Circle { .. });
    let is_about_radius = is_circle
        && matches!(
            error.fault,
            GeometryFault::Pole
                | GeometryFault::Antimeridian
                | GeometryFault::Shape(ShapeFault::Radius { .. })
        );
    let pointer = match is_about_radius {
        true => feature.member("properties").member("radius_m").pointer(),
        false => vertex_pointer(error.place, geometry, feature),
    };
    let problem = ZoneProblem::new(code, pointer, error.fault.to_string());
    match hint {
        Some(hint) => problem.hint(hint),
        None => problem,
    }
}

fn vertex_pointer(place: VertexPlace, geometry: &ZoneGeometry, feature: &Place<'_>) -> String {
    let geometry_place = feature.member("geometry");
    let mut pointer = geometry_place.member("coordinates").pointer();
    let polygon = match geometry {
        ZoneGeometry::MultiPolygon(_) => place.polygon,
        ZoneGeometry::Polygon(_) | ZoneGeometry::Circle { .. } => None,
    };
    for index in [polygon, place.ring, place.vertex].into_iter().flatten() {
        pointer.push('/');
        pointer.push_str(&index.to_string());
    }
    pointer
}

pub(crate) fn code_and_hint(fault: &GeometryFault) -> (ZoneCode, Option<&'static str>) {
    let swapped_hint = "longitude comes first; were longitude and latitude swapped?";
    match fault {
        GeometryFault::Latitude { swapped, .. } => (
            ZoneCode::LatitudeOutOfRange,
            swapped.then_some(swapped_hint),
        ),
        GeometryFault::Longitude { .. } => (
            ZoneCode::LongitudeOutOfRange,
            Some("cut the zone at the antimeridian into a MultiPolygon (RFC 7946, 3.1.9)"),
        ),
        GeometryFault::Antimeridian => (
            ZoneCode::CrossesAntimeridian,
            Some("cut the zone at the antimeridian into a MultiPolygon (RFC 7946, 3.1.9)"),
        ),
        GeometryFault::Pole => (ZoneCode::CrossesPole, None),
        GeometryFault::Shape(fault) => shape_code_and_hint(fault),
    }
}

fn shape_code_and_hint(fault: &ShapeFault) -> (ZoneCode, Option<&'static str>) {
    match fault {
        ShapeFault::Empty => (ZoneCode::GeometryEmpty, None),
        ShapeFault::TooManyVertices { .. } => (
            ZoneCode::TooManyVertices,
            Some("simplify the outline, or divide the zone"),
        ),
        ShapeFault::NotFinite => (ZoneCode::CoordinateNotFinite, None),
        ShapeFault::TooFar { .. } => (ZoneCode::CoordinateOutOfRange, None),
        ShapeFault::TooFewPoints { .. } => (ZoneCode::TooFewPoints, None),
        ShapeFault::Unclosed => (
            ZoneCode::RingUnclosed,
            Some("repeat the first position at the end"),
        ),
        ShapeFault::ZeroArea => (ZoneCode::ZeroArea, None),
        ShapeFault::SelfIntersection { .. } => (
            ZoneCode::SelfIntersection,
            Some("give the positions in order around the area; two areas make a MultiPolygon"),
        ),
        ShapeFault::Spike { .. } => (ZoneCode::Spike, Some("remove the position at its tip")),
        ShapeFault::RingsMeet { .. } => (
            ZoneCode::RingsMeet,
            Some("draw the outer ring around the gap instead, or move the hole inside"),
        ),
        ShapeFault::HoleOutside { .. } => (
            ZoneCode::HoleOutside,
            Some("the first ring is the outer one; several areas make a MultiPolygon"),
        ),
        ShapeFault::HoleInHole { .. } => (
            ZoneCode::HoleInHole,
            Some("an area inside a hole is a polygon of its own, in a MultiPolygon"),
        ),
        ShapeFault::Radius { .. } => (ZoneCode::RadiusInvalid, None),
    }
}

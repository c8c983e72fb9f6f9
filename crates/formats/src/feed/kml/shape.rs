//! Shapes of KML: polygons, alone or in a `MultiGeometry`, and the heights that they close.
//!
//! A polygon is a surface. Which heights it closes follows from its `altitudeMode`: clamped to the
//! ground it closes all of them, extruded those from the ground up to it. A surface in the air that
//! is not extruded could be a floor or a ceiling, and is refused.

use super::element::{elements, named, only, text_of, text_under};
use crate::airspace::{WrittenRing, ZoneGeometry};
use crate::feed::layer::Layer;
use crate::feed::sheet::Sheet;
use crate::geo::{Altitude, AltitudeBand, AltitudeReference};
use crate::place::Place;
use crate::zones::ZoneCode;
use roxmltree::Node;
use rustc_hash::FxHashMap;

/// Shapes that a Placemark may have.
const SHAPES: [&str; 8] = [
    "Polygon",
    "MultiGeometry",
    "Point",
    "LineString",
    "LinearRing",
    "Model",
    "Track",
    "MultiTrack",
];
/// What a polygon has.
const OF_POLYGON: [&str; 6] = [
    "extrude",
    "tessellate",
    "altitudeMode",
    "drawOrder",
    "outerBoundaryIs",
    "innerBoundaryIs",
];
/// How deep `MultiGeometry` may lie in one another.
const MAX_DEPTH: usize = 8;
/// Heights this near to each other are one: programs write them with errors of rounding, in metres.
const ONE_HEIGHT_M: f64 = 0.01;
/// The most characters of a position that are quoted.
const QUOTED_MAX: usize = 60;

/// Whether an element of a Placemark is a shape.
pub(super) fn is_shape(name: &str) -> bool {
    SHAPES.contains(&name)
}

/// The volumes of a Placemark, one for each polygon.
pub(super) fn read_shapes(
    placemark: Node<'_, '_>,
    place: &Place<'_>,
    sheet: &mut Sheet,
) -> Vec<Layer> {
    let mut layers = Vec::new();
    let mut shapes = elements(placemark).filter(|element| is_shape(element.tag_name().name()));
    let first = shapes.next();
    if shapes.next().is_some() {
        let message = "has several shapes beside each other";
        let remedy = "put them into a MultiGeometry";
        sheet.refuse(ZoneCode::GeometryUnsupported, place, message, remedy);
    } else if let Some(shape) = first {
        let place = place.member(shape.tag_name().name());
        read_shape(shape, &place, 0, sheet, &mut layers);
    }
    if layers.is_empty() && sheet.problems.count() == 0 {
        sheet.refuse(
            ZoneCode::GeometryEmpty,
            place,
            "has no polygon",
            "draw a Polygon",
        );
    }
    layers
}

fn read_shape(
    shape: Node<'_, '_>,
    place: &Place<'_>,
    depth: usize,
    sheet: &mut Sheet,
    layers: &mut Vec<Layer>,
) {
    let message = match shape.tag_name().name() {
        "Polygon" => {
            layers.extend(read_polygon(shape, place, sheet));
            return;
        }
        "MultiGeometry" if depth < MAX_DEPTH => {
            let mut counts: FxHashMap<&str, usize> = FxHashMap::default();
            for part in elements(shape) {
                let name = part.tag_name().name();
                let count = counts.entry(name).or_default();
                let place = place.member(name);
                read_shape(part, &place.element(*count), depth + 1, sheet, layers);
                *count += 1;
            }
            return;
        }
        "MultiGeometry" => format!("lies more than {MAX_DEPTH} deep in others of its kind"),
        // Where drawing programs put the name.
        "Point" if depth > 0 => {
            sheet.note(place, "not imported: a point covers nothing");
            return;
        }
        "Point" => "is a point, which covers nothing".to_owned(),
        "LineString" | "LinearRing" => "is a line, which covers nothing".to_owned(),
        name => format!("a '{name}' is no polygon"),
    };
    let remedy = "draw a Polygon of what is closed";
    sheet.refuse(ZoneCode::GeometryUnsupported, place, message, remedy);
}

fn read_polygon(polygon: Node<'_, '_>, place: &Place<'_>, sheet: &mut Sheet) -> Option<Layer> {
    let mut is_known = true;
    for element in elements(polygon) {
        let name = element.tag_name().name();
        if !OF_POLYGON.contains(&name) {
            let message = "nothing is known of it, and it may move the polygon";
            let remedy = "leave it out";
            sheet.refuse(ZoneCode::UnknownField, &place.member(name), message, remedy);
            is_known = false;
        }
    }
    let boundaries = rings_of(polygon, place, sheet);
    let mut heights = Heights::default();
    let rings: Option<Vec<WrittenRing>> = boundaries
        .into_iter()
        .enumerate()
        .map(|(number, ring)| read_ring(ring, &place.element(number), &mut heights, sheet))
        .collect();
    let rings = rings.filter(|rings| !rings.is_empty())?;
    let geometry = ZoneGeometry::Polygon(rings);
    if is_known {
        sheet.shapes.push(geometry.clone());
    }
    Some(Layer {
        geometry,
        band: read_band(polygon, &heights, place, sheet)?,
        pointer: place.pointer(),
    })
}

/// The outer ring of a polygon, then its holes.
fn rings_of<'a, 'i>(
    polygon: Node<'a, 'i>,
    place: &Place<'_>,
    sheet: &mut Sheet,
) -> Vec<Node<'a, 'i>> {
    let mut boundaries = Vec::new();
    match only(polygon, "outerBoundaryIs", place, sheet) {
        Some(outer) => {
            let place = place.member("outerBoundaryIs");
            match only(outer, "LinearRing", &place, sheet) {
                Some(ring) => boundaries.push(ring),
                None => sheet.missing(&place, "LinearRing"),
            }
        }
        None => sheet.missing(place, "outerBoundaryIs"),
    }
    for hole in named(polygon, "innerBoundaryIs") {
        // Google Earth writes all holes into one of them.
        let before = boundaries.len();
        boundaries.extend(named(hole, "LinearRing"));
        if boundaries.len() == before {
            sheet.missing(&place.member("innerBoundaryIs"), "LinearRing");
        }
    }
    boundaries
}

fn read_ring(
    ring: Node<'_, '_>,
    place: &Place<'_>,
    heights: &mut Heights,
    sheet: &mut Sheet,
) -> Option<WrittenRing> {
    let Some(coordinates) = only(ring, "coordinates", place, sheet) else {
        sheet.missing(place, "coordinates");
        return None;
    };
    let mut positions = WrittenRing::new();
    for written in text_of(coordinates).split_whitespace() {
        let Some((position, height_m)) = position_of(written) else {
            let quoted: String = written.chars().take(QUOTED_MAX).collect();
            let message = format!("'{quoted}' is no position");
            let remedy =
                "write longitude,latitude,height without blanks in them, and blanks between";
            let place = place.element(positions.len());
            sheet.refuse(ZoneCode::PositionNotPair, &place, message, remedy);
            return None;
        };
        heights.add(height_m);
        positions.push(position);
    }
    if let (Some(first), Some(last)) = (positions.first().copied(), positions.last())
        && first != *last
    {
        sheet.note(place, "the ring was closed");
        positions.push(first);
    }
    Some(positions)
}

/// Longitude and latitude, and the height where there is one.
fn position_of(written: &str) -> Option<([f64; 2], Option<f64>)> {
    let mut numbers = written.split(',').map(|number| {
        let number = number.parse::<f64>().ok();
        number.filter(|number| number.is_finite())
    });
    let position = [numbers.next()??, numbers.next()??];
    let height_m = match numbers.next() {
        Some(height_m) => Some(height_m?),
        None => None,
    };
    numbers.next().is_none().then_some((position, height_m))
}

/// The heights of the positions of a polygon; one that is not stated is 0, by KML 2.2.
#[derive(Default)]
struct Heights {
    range_m: Option<(f64, f64)>,
    any_stated: bool,
}

impl Heights {
    fn add(&mut self, height_m: Option<f64>) {
        self.any_stated |= height_m.is_some();
        let height_m = height_m.unwrap_or(0.0);
        let (lowest, highest) = self.range_m.unwrap_or((height_m, height_m));
        self.range_m = Some((lowest.min(height_m), highest.max(height_m)));
    }
}

/// The heights that a polygon closes.
fn read_band(
    polygon: Node<'_, '_>,
    heights: &Heights,
    place: &Place<'_>,
    sheet: &mut Sheet,
) -> Option<AltitudeBand> {
    let mode = text_under(polygon, "altitudeMode", place, sheet);
    let is_on_ground = heights.range_m.is_none_or(|range_m| range_m == (0.0, 0.0));
    let reference = match mode.as_deref() {
        None | Some("clampToGround") => {
            if !is_on_ground {
                let message = "the heights of positions were left out: it is clamped to the ground";
                sheet.note(place, message);
            }
            return Some(AltitudeBand::UNLIMITED);
        }
        Some("relativeToGround") if is_on_ground => {
            let message = "at height 0 it was read as clamped to the ground: it closes all heights";
            sheet.note(place, message);
            return Some(AltitudeBand::UNLIMITED);
        }
        Some("relativeToGround") => AltitudeReference::Agl,
        Some("absolute") => AltitudeReference::Amsl,
        Some(other) => {
            let place = place.member("altitudeMode");
            let message = format!("nothing is known of '{other}'");
            let remedy = "use one of clampToGround, relativeToGround, absolute";
            sheet.refuse(ZoneCode::UnknownValue, &place, message, remedy);
            return None;
        }
    };
    let is_extruded = read_extrude(polygon, place, sheet)?;
    match ceiling(heights, reference, is_extruded) {
        Ok(ceiling) => Some(AltitudeBand {
            lower: None,
            upper: Some(ceiling),
        }),
        Err((message, remedy)) => {
            sheet.refuse(ZoneCode::AltitudeInvalid, place, message, remedy);
            None
        }
    }
}

/// The height up to which a polygon in the air closes; else why that is unclear, and the remedy.
fn ceiling(
    heights: &Heights,
    reference: AltitudeReference,
    is_extruded: bool,
) -> Result<Altitude, (String, &'static str)> {
    let range_m = heights.range_m.filter(|_| heights.any_stated);
    let Some((lowest_m, highest_m)) = range_m else {
        let message = "its positions have no heights".to_owned();
        return Err((message, "write one into each of them"));
    };
    if highest_m - lowest_m > ONE_HEIGHT_M {
        let message =
            format!("its heights go from {lowest_m} to {highest_m} m, and a zone is flat");
        return Err((message, "give all positions one height"));
    }
    if !is_extruded {
        let message = format!("it is a surface at {highest_m} m, a floor or a ceiling");
        let remedy =
            "set extrude to 1 to close what is below it, or clampToGround to close all heights";
        return Err((message, remedy));
    }
    if reference == AltitudeReference::Agl && highest_m < 0.0 {
        let message = format!("its height of {highest_m} m is below the ground");
        return Err((message, "write heights above the ground"));
    }
    Ok(Altitude {
        value_m: highest_m,
        reference,
    })
}

fn read_extrude(polygon: Node<'_, '_>, place: &Place<'_>, sheet: &mut Sheet) -> Option<bool> {
    match text_under(polygon, "extrude", place, sheet).as_deref() {
        None | Some("0" | "false") => Some(false),
        Some("1" | "true") => Some(true),
        Some(other) => {
            let place = place.member("extrude");
            let message = format!("nothing is known of '{other}'");
            sheet.refuse(ZoneCode::UnknownValue, &place, message, "write 0 or 1");
            None
        }
    }
}

//! ED-269: a list of zones under one of several names, each with volumes and periods of
//! applicability.

use super::collected::{Collected, Reader, bounded};
use super::layer::{FeedDraft, Layer, UNITS, read_limit, read_position, read_rings};
use super::record::{Record, read_identifier, read_kind};
use super::sheet::{Members, Sheet};
use super::times::Applicability;
use crate::airspace::ZoneGeometry;
use crate::geo::AltitudeBand;
use crate::place::Place;
use crate::zones::{ZoneCode, ZoneProblem};
use serde_json::Value;

/// Where zones are listed: in the standard, in Swiss files, in those of EUROCONTROL.
const LISTS: [&str; 3] = ["features", "UASZoneList", "uas_zones"];
const ACTED_ON: [&str; 5] = [
    "identifier",
    "type",
    "restriction",
    "applicability",
    "geometry",
];

pub(super) fn read(
    document: &Value,
    reader: &Reader<'_>,
    collected: &mut Collected,
) -> Result<(), ZoneProblem> {
    let root = Place::ROOT;
    let named = LISTS.iter().find_map(|name| {
        let list = document.get(name)?.as_array()?;
        Some((*name, list.as_slice()))
    });
    let Some((name, list)) = named else {
        // A zone by itself.
        read_zone(document, &root, reader, collected);
        return Ok(());
    };
    let place = root.member(name);
    for (index, zone) in bounded(list, &place)?.iter().enumerate() {
        read_zone(zone, &place.element(index), reader, collected);
    }
    Ok(())
}

fn read_zone(value: &Value, place: &Place<'_>, reader: &Reader<'_>, collected: &mut Collected) {
    let mut sheet = Sheet::default();
    let mut identifier = None;
    let draft = sheet.object(value, place).and_then(|members| {
        let zone = Members { members, place };
        identifier = read_identifier(zone, &mut sheet);
        let kind = read_kind(zone, ["restriction", "type"], &mut sheet);
        let applies = read_applicability(zone, &mut sheet);
        let layers = read_layers(zone, &mut sheet);
        let mut record = Record::read(zone, &ACTED_ON, &mut sheet);
        if let Some(variant) = zone.get("type").filter(|_| kind.is_some()) {
            record.put("variant", variant.clone());
        }
        Some(FeedDraft {
            identifier: identifier.clone()?,
            kind: kind?,
            applies,
            layers,
            record,
        })
    });
    reader.take(identifier, place.pointer(), draft, sheet, collected);
}

/// A zone without a period of applicability is permanent.
fn read_applicability(zone: Members<'_>, sheet: &mut Sheet) -> Applicability {
    let mut applies = Applicability::default();
    let place = zone.place.member("applicability");
    let stated = zone.get("applicability");
    let periods = stated.map_or(&[][..], |periods| sheet.list(periods, &place));
    if periods.is_empty() {
        sheet.note(&place, "without applicability it counts always");
    }
    sheet.each(periods, &place, |period, sheet| {
        let is_permanent = period.get("permanent").map_or(Some(false), |value| {
            let words = [("YES", true), ("NO", false)];
            sheet.word(value, &period.place.member("permanent"), &words)
        });
        if let Some(is_permanent) = is_permanent {
            applies.read(period, is_permanent, sheet);
        }
    });
    applies
}

fn read_layers(zone: Members<'_>, sheet: &mut Sheet) -> Vec<Layer> {
    let place = zone.place.member("geometry");
    let Some(volumes) = zone.get("geometry") else {
        sheet.missing(zone.place, "geometry");
        return Vec::new();
    };
    let mut layers = Vec::new();
    let volumes = sheet.list(volumes, &place);
    sheet.each(volumes, &place, |volume, sheet| {
        layers.extend(read_volume(volume, sheet))
    });
    if layers.is_empty() && sheet.problems.count() == 0 {
        let remedy = "give it at least one volume";
        sheet.refuse(ZoneCode::GeometryEmpty, &place, "has no volume", remedy);
    }
    layers
}

fn read_volume(volume: Members<'_>, sheet: &mut Sheet) -> Option<Layer> {
    let place = volume.place.member("uomDimensions");
    let unit_m = match volume.get("uomDimensions") {
        Some(unit) => sheet.word(unit, &place, &UNITS)?,
        None => {
            sheet.missing(volume.place, "uomDimensions");
            return None;
        }
    };
    let lower = ["lowerLimit", "lowerVerticalReference"];
    let upper = ["upperLimit", "upperVerticalReference"];
    let lower = read_limit(volume, lower, unit_m, sheet);
    let upper = read_limit(volume, upper, unit_m, sheet);
    let place = volume.place.member("horizontalProjection");
    let Some(projection) = volume.get("horizontalProjection") else {
        sheet.missing(volume.place, "horizontalProjection");
        return None;
    };
    let projection = Members {
        members: sheet.object(projection, &place)?,
        place: &place,
    };
    let (geometry, pointer) = read_projection(projection, unit_m, sheet)?;
    sheet.shapes.push(geometry.clone());
    Some(Layer {
        geometry,
        band: AltitudeBand {
            lower: lower?,
            upper: upper?,
        },
        pointer,
    })
}

fn read_projection(
    projection: Members<'_>,
    unit_m: f64,
    sheet: &mut Sheet,
) -> Option<(ZoneGeometry, String)> {
    let kinds = [("CIRCLE", true), ("POLYGON", false)];
    let Some(kind) = projection.get("type") else {
        sheet.missing(projection.place, "type");
        return None;
    };
    let is_circle = sheet.word(kind, &projection.place.member("type"), &kinds)?;
    let needed: &[&str] = match is_circle {
        true => &["center", "radius"],
        false => &["coordinates"],
    };
    for name in needed {
        if projection.get(name).is_none() {
            sheet.missing(projection.place, name);
            return None;
        }
    }
    if is_circle {
        let (center, radius) = (projection.get("center")?, projection.get("radius")?);
        let center = read_position(center, &projection.place.member("center"), sheet);
        let radius = sheet.number(radius, &projection.place.member("radius"));
        let geometry = ZoneGeometry::Circle {
            centre: center?,
            radius_m: radius? * unit_m,
        };
        return Some((geometry, projection.place.pointer()));
    }
    let place = projection.place.member("coordinates");
    let rings = read_rings(projection.get("coordinates")?, &place, sheet)?;
    Some((ZoneGeometry::Polygon(rings), place.pointer()))
}

//! The fence of a plan of QGroundControl: what drones have to stay out of. It has neither ids nor
//! altitudes nor times, and latitude comes first.

use super::collected::{Collected, Reader, bounded};
use super::layer::{FeedDraft, Layer, read_position};
use super::record::Record;
use super::sheet::{Members, Sheet};
use super::times::Applicability;
use crate::airspace::{WrittenRing, ZoneGeometry, ZoneKind};
use crate::geo::AltitudeBand;
use crate::place::Place;
use crate::zones::{ZoneCode, ZoneProblem};
use serde_json::Value;

/// The version of fences that ground stations read; they pass over others.
const VERSION: u64 = 2;

pub(super) fn read(
    document: &Value,
    reader: &Reader<'_>,
    collected: &mut Collected,
) -> Result<(), ZoneProblem> {
    let root = Place::ROOT;
    let place = root.member("geoFence");
    let Some(fence) = document.get("geoFence").and_then(Value::as_object) else {
        let message = "the plan has no fence";
        return Err(ZoneProblem::new(
            ZoneCode::MissingField,
            place.pointer(),
            message,
        ));
    };
    let version = fence.get("version").and_then(Value::as_u64);
    if version != Some(VERSION) {
        let message = "the fence is not of version 2, and ground stations pass over others";
        let pointer = place.member("version").pointer();
        let problem = ZoneProblem::new(ZoneCode::UnknownValue, pointer, message);
        return Err(problem.hint("save the plan with a current QGroundControl"));
    }
    for (name, why) in [
        ("mission", "a mission has no zones"),
        ("rallyPoints", "they are no zones"),
    ] {
        if document.get(name).is_some() {
            collected.note(&format!("/{name}"), &format!("not imported: {why}"));
        }
    }
    if fence
        .get("breachReturn")
        .is_some_and(|place| !place.is_null())
    {
        let pointer = place.member("breachReturn").pointer();
        collected.note(&pointer, "not imported: a place to return to is no zone");
    }
    for (list, shape) in [("polygons", "polygon"), ("circles", "circle")] {
        let place = place.member(list);
        let entries = fence.get(list).and_then(Value::as_array);
        let entries = bounded(entries.map_or(&[], Vec::as_slice), &place)?;
        for (index, entry) in entries.iter().enumerate() {
            let place = place.element(index);
            let identifier = format!("{shape}-{}", index + 1);
            let mut sheet = Sheet::default();
            let draft = sheet.object(entry, &place).and_then(|members| {
                let entry = Members {
                    members,
                    place: &place,
                };
                read_fence(entry, shape, &identifier, &mut sheet)
            });
            reader.take(Some(identifier), place.pointer(), draft, sheet, collected);
        }
    }
    Ok(())
}

fn read_fence(
    entry: Members<'_>,
    shape: &str,
    identifier: &str,
    sheet: &mut Sheet,
) -> Option<FeedDraft> {
    let place = entry.place.member("inclusion");
    match entry.get("inclusion").and_then(Value::as_bool) {
        Some(false) => {}
        Some(true) => {
            let remedy = "make a zone of what lies outside of it";
            let message = "a fence that keeps drones in is no zone";
            sheet.refuse(ZoneCode::FenceKeepsIn, &place, message, remedy);
            return None;
        }
        None => {
            let remedy = "state inclusion, false to keep drones out";
            let message = "it is unclear whether it keeps drones in or out: readers differ";
            sheet.refuse(ZoneCode::MissingField, &place, message, remedy);
            return None;
        }
    }
    let Some(value) = entry.get(shape) else {
        sheet.missing(entry.place, shape);
        return None;
    };
    let place = entry.place.member(shape);
    let geometry = match shape {
        "polygon" => ZoneGeometry::Polygon(vec![read_ring(value, &place, sheet)?]),
        _ => read_circle(value, &place, sheet)?,
    };
    Some(FeedDraft {
        identifier: identifier.to_owned(),
        kind: ZoneKind::Prohibited,
        applies: Applicability::default(),
        layers: vec![Layer {
            geometry,
            band: AltitudeBand::UNLIMITED,
            pointer: place.pointer(),
        }],
        record: Record::empty(),
    })
}

/// An open ring with latitude first.
fn read_ring(value: &Value, place: &Place<'_>, sheet: &mut Sheet) -> Option<WrittenRing> {
    let positions = sheet.list(value, place).iter().enumerate();
    let ring: Option<WrittenRing> = positions
        .map(|(index, position)| {
            let [lat, lon] = read_position(position, &place.element(index), sheet)?;
            Some([lon, lat])
        })
        .collect();
    let mut ring = ring?;
    if ring.first() != ring.last() {
        ring.extend(ring.first().copied());
    }
    Some(ring)
}

fn read_circle(value: &Value, place: &Place<'_>, sheet: &mut Sheet) -> Option<ZoneGeometry> {
    let circle = Members {
        members: sheet.object(value, place)?,
        place,
    };
    for name in ["center", "radius"] {
        if circle.get(name).is_none() {
            sheet.missing(place, name);
            return None;
        }
    }
    let [lat, lon] = read_position(circle.get("center")?, &place.member("center"), sheet)?;
    let radius_m = sheet.number(circle.get("radius")?, &place.member("radius"))?;
    Some(ZoneGeometry::Circle {
        centre: [lon, lat],
        radius_m,
    })
}

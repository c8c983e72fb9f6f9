//! GeoJSON with the properties of zones here, read as strictly as single zones are.

use super::collected::{Collected, FeedZone, Reader, bounded};
use crate::airspace::{Zone, ZoneKind};
use crate::place::Place;
use crate::zones::{ZoneCode, ZoneId, ZoneProblem, zone_from_feature};
use serde_json::{Map, Value, json};

pub(super) fn read(
    document: &Value,
    reader: &Reader<'_>,
    collected: &mut Collected,
) -> Result<(), ZoneProblem> {
    let root = Place::ROOT;
    match document.get("type").and_then(Value::as_str) {
        Some("Feature") => collected.zones.push(read_feature(document, &root, reader)),
        Some("FeatureCollection") => {
            let place = root.member("features");
            let Some(features) = document.get("features").and_then(Value::as_array) else {
                let message = "'features' is missing";
                let code = ZoneCode::MissingField;
                return Err(ZoneProblem::new(code, place.pointer(), message));
            };
            for (index, feature) in bounded(features, &place)?.iter().enumerate() {
                let zone = read_feature(feature, &place.element(index), reader);
                collected.zones.push(zone);
            }
        }
        _ => {
            let message = "it is none of the formats that zones are imported from";
            let problem = ZoneProblem::new(ZoneCode::FormatForeign, String::new(), message);
            return Err(
                problem.hint("send ED-269, ED-318, KML, a plan of QGroundControl or GeoJSON")
            );
        }
    }
    Ok(())
}

fn read_feature(feature: &Value, place: &Place<'_>, reader: &Reader<'_>) -> FeedZone {
    let pointer = place.pointer();
    let stated = feature.get("id").and_then(Value::as_str);
    let identifier = stated.filter(|id| !id.is_empty()).map(str::to_owned);
    let feature = identifier
        .as_deref()
        .map_or_else(|| feature.clone(), |id| named(feature, id, reader));
    let read = zone_from_feature(&feature, ZoneId::Stated, reader.frame);
    let outcome = read.map(|zone| vec![zone]).map_err(|problems| {
        let within = problems.into_iter().map(|problem| ZoneProblem {
            pointer: format!("{pointer}{}", problem.pointer),
            ..problem
        });
        within.collect()
    });
    let outlines = match (&outcome, &identifier) {
        (Err(_), Some(_)) => Vec::from_iter(outline(&feature, reader)),
        _ => Vec::new(),
    };
    FeedZone {
        identifier,
        pointer,
        outcome,
        outlines,
    }
}

/// A feature as one of this feed.
fn named(feature: &Value, identifier: &str, reader: &Reader<'_>) -> Value {
    let terms = reader.terms;
    let mut feature = feature.clone();
    feature["id"] = json!(format!("{}{identifier}", terms.prefix));
    let properties = match feature.get_mut("properties") {
        Some(Value::Object(properties)) => Some(properties),
        Some(Value::Null) | None => {
            feature["properties"] = Value::Object(Map::new());
            feature["properties"].as_object_mut()
        }
        // It is refused.
        Some(_) => None,
    };
    if let Some(properties) = properties {
        let source = json!({"feed": terms.feed, "id": identifier});
        properties.insert("source".to_owned(), source);
        let margin = properties.entry("margin_m").or_insert(Value::Null);
        if margin.is_null() {
            *margin = json!(terms.margin_m);
        }
    }
    feature
}

/// The shape of a feature that is refused, closed at all heights and always; none where its kind, if that can be read,
/// closes nothing.
fn outline(feature: &Value, reader: &Reader<'_>) -> Option<Zone> {
    let stated = &feature["properties"];
    let kind = ZoneKind::ALL
        .into_iter()
        .find(|kind| stated["kind"] == kind.name());
    let kind = kind.unwrap_or(ZoneKind::Prohibited);
    let mut properties = json!({"kind": kind.name(), "source": stated["source"]});
    if let Some(radius) = stated.get("radius_m") {
        properties["radius_m"] = radius.clone();
    }
    let mut bare = json!({"type": "Feature", "id": feature["id"], "geometry": feature["geometry"]});
    // As wide as it says, where that can be read.
    let margins = [stated["margin_m"].clone(), json!(reader.terms.margin_m)];
    let outline = margins.into_iter().find_map(|margin| {
        properties["margin_m"] = margin;
        bare["properties"] = properties.clone();
        zone_from_feature(&bare, ZoneId::Stated, reader.frame).ok()
    });
    outline.filter(|_| kind.closes())
}

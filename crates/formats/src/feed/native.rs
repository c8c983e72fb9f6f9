//! GeoJSON with the properties of zones here, read as strictly as single zones are.

use super::collected::{Collected, FeedZone, Reader, bounded};
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
    let mut feature = feature.clone();
    if let Some(identifier) = &identifier {
        let terms = reader.terms;
        feature["id"] = json!(format!("{}{identifier}", terms.prefix));
        let properties = match feature.get_mut("properties") {
            Some(Value::Object(properties)) => Some(properties),
            Some(Value::Null) | None => {
                feature["properties"] = Value::Object(Map::new());
                feature["properties"].as_object_mut()
            }
            // It is refused below.
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
    }
    let read = zone_from_feature(&feature, ZoneId::Stated, reader.frame);
    let outcome = read.map(|zone| vec![zone]).map_err(|problems| {
        let within = problems.into_iter().map(|problem| ZoneProblem {
            pointer: format!("{pointer}{}", problem.pointer),
            ..problem
        });
        within.collect()
    });
    FeedZone {
        identifier,
        pointer,
        outcome,
    }
}

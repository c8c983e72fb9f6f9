//! Zones: typed in messages, GeoJSON features inside, so that one reader checks both with the same codes.

use super::convert::{instant_text, number_value, timestamp};
use super::proto;
use super::proto::zone::Geometry;
use serde_json::{Map, Value, json};

/// The GeoJSON feature of a zone, as `formats::zones` reads it. What is missing, or not finite, is left for that
/// reader to find.
pub(super) fn feature_of(zone: &proto::Zone) -> Value {
    let mut properties = Map::new();
    let texts = [
        ("name", &zone.name),
        ("reason", &zone.reason),
        ("authority", &zone.authority),
    ];
    for (name, text) in texts {
        if let Some(text) = text {
            properties.insert(name.to_owned(), Value::from(text.as_str()));
        }
    }
    put_limit(&mut properties, "lower", zone.lower.as_ref());
    put_limit(&mut properties, "upper", zone.upper.as_ref());
    if !zone.windows.is_empty() {
        let windows = zone.windows.iter().map(window_value).collect();
        properties.insert("windows".to_owned(), Value::Array(windows));
    }
    if let Some(Geometry::Circle(circle)) = &zone.geometry {
        properties.insert("radius_m".to_owned(), number_value(circle.radius_m));
    }
    if let Some(margin_m) = zone.margin_m {
        properties.insert("margin_m".to_owned(), number_value(margin_m));
    }
    let mut feature = Map::new();
    feature.insert("type".to_owned(), Value::from("Feature"));
    if !zone.id.is_empty() {
        feature.insert("id".to_owned(), Value::from(zone.id.as_str()));
    }
    if let Some(geometry) = &zone.geometry {
        feature.insert("geometry".to_owned(), geometry_value(geometry));
    }
    feature.insert("properties".to_owned(), Value::Object(properties));
    Value::Object(feature)
}

fn geometry_value(geometry: &Geometry) -> Value {
    match geometry {
        Geometry::Polygon(polygon) => {
            json!({"type": "Polygon", "coordinates": rings_value(polygon)})
        }
        Geometry::MultiPolygon(multi) => {
            let polygons: Vec<Value> = multi.polygons.iter().map(rings_value).collect();
            json!({"type": "MultiPolygon", "coordinates": polygons})
        }
        Geometry::Circle(circle) => match &circle.centre {
            Some(centre) => json!({"type": "Point", "coordinates": position_value(centre)}),
            None => json!({"type": "Point"}),
        },
    }
}

fn rings_value(polygon: &proto::Polygon) -> Value {
    let ring_value =
        |ring: &proto::Ring| Value::Array(ring.positions.iter().map(position_value).collect());
    Value::Array(polygon.rings.iter().map(ring_value).collect())
}

fn position_value(position: &proto::Coordinates) -> Value {
    Value::Array(vec![number_value(position.x), number_value(position.y)])
}

fn put_limit(properties: &mut Map<String, Value>, end: &str, limit: Option<&proto::Altitude>) {
    let Some(limit) = limit else {
        return;
    };
    properties.insert(format!("{end}_m"), number_value(limit.value_m));
    let reference = match proto::AltitudeReference::try_from(limit.reference) {
        Ok(proto::AltitudeReference::Unspecified) => return,
        Ok(proto::AltitudeReference::Agl) => "agl".to_owned(),
        Ok(proto::AltitudeReference::Amsl) => "amsl".to_owned(),
        Ok(proto::AltitudeReference::Wgs84) => "wgs84".to_owned(),
        // The reader refuses what it does not know, and says what there is.
        Err(_) => limit.reference.to_string(),
    };
    properties.insert(format!("{end}_reference"), Value::from(reference));
}

fn window_value(window: &proto::Window) -> Value {
    let ends = [("from", &window.from), ("until", &window.until)];
    let stated = ends.into_iter().filter_map(|(name, end)| {
        Some((name.to_owned(), Value::from(instant_text(end.as_ref()?))))
    });
    Value::Object(stated.collect())
}

/// The zone of a GeoJSON feature that this edge wrote. Of a feature that it merely keeps, such as a record's, what
/// no zone has is left out.
pub(super) fn zone_of(feature: &Value) -> proto::Zone {
    let properties = &feature["properties"];
    let text = |name: &str| properties[name].as_str().map(str::to_owned);
    let windows = properties["windows"].as_array();
    proto::Zone {
        id: feature["id"].as_str().unwrap_or_default().to_owned(),
        name: text("name"),
        reason: text("reason"),
        authority: text("authority"),
        geometry: geometry_of(&feature["geometry"], properties["radius_m"].as_f64()),
        lower: limit_of(&properties["lower_m"], &properties["lower_reference"]),
        upper: limit_of(&properties["upper_m"], &properties["upper_reference"]),
        windows: windows.into_iter().flatten().map(window_of).collect(),
        margin_m: properties["margin_m"].as_f64(),
    }
}

fn geometry_of(geometry: &Value, radius_m: Option<f64>) -> Option<Geometry> {
    let coordinates = &geometry["coordinates"];
    match geometry["type"].as_str()? {
        "Polygon" => Some(Geometry::Polygon(polygon_of(coordinates)?)),
        "MultiPolygon" => {
            let polygons = coordinates.as_array()?.iter().map(polygon_of);
            let polygons = polygons.collect::<Option<Vec<_>>>()?;
            Some(Geometry::MultiPolygon(proto::MultiPolygon { polygons }))
        }
        "Point" => Some(Geometry::Circle(proto::Circle {
            centre: Some(position_of(coordinates)?),
            radius_m: radius_m?,
        })),
        _ => None,
    }
}

fn polygon_of(rings: &Value) -> Option<proto::Polygon> {
    let ring_of = |ring: &Value| {
        let positions = ring.as_array()?.iter().map(position_of);
        let positions = positions.collect::<Option<Vec<_>>>()?;
        Some(proto::Ring { positions })
    };
    let rings = rings.as_array()?.iter().map(ring_of);
    let rings = rings.collect::<Option<Vec<_>>>()?;
    Some(proto::Polygon { rings })
}

fn position_of(position: &Value) -> Option<proto::Coordinates> {
    Some(proto::Coordinates {
        x: position[0].as_f64()?,
        y: position[1].as_f64()?,
    })
}

fn limit_of(value_m: &Value, reference: &Value) -> Option<proto::Altitude> {
    let reference = match reference.as_str() {
        Some("agl") => proto::AltitudeReference::Agl,
        Some("amsl") => proto::AltitudeReference::Amsl,
        Some("wgs84") => proto::AltitudeReference::Wgs84,
        _ => proto::AltitudeReference::Unspecified,
    };
    Some(proto::Altitude {
        value_m: value_m.as_f64()?,
        reference: reference as i32,
    })
}

fn window_of(window: &Value) -> proto::Window {
    let end = |name: &str| window[name].as_str().and_then(timestamp);
    proto::Window {
        from: end("from"),
        until: end("until"),
    }
}

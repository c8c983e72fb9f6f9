//! Zones to GeoJSON: what was read, with the defaults filled in.

use super::terms::put_terms;
use super::windows::windows_value;
use crate::airspace::{Zone, ZoneGeometry};
use crate::geo::{Altitude, AltitudeReference};
use serde_json::{Map, Value, json};

/// The zone as a GeoJSON feature: positions as they were written, defaults filled in, absent fields left out.
pub fn zone_to_feature(zone: &Zone) -> Value {
    let mut properties = Map::new();
    let texts = [
        ("name", zone.name()),
        ("reason", zone.reason()),
        ("authority", zone.authority()),
    ];
    for (name, value) in texts {
        if let Some(value) = value {
            properties.insert(name.to_owned(), json!(value));
        }
    }
    let band = zone.band();
    put_limit(&mut properties, "lower", band.lower);
    put_limit(&mut properties, "upper", band.upper);
    if let Some(windows) = windows_value(zone) {
        properties.insert("windows".to_owned(), windows);
    }
    if let ZoneGeometry::Circle { radius_m, .. } = zone.geometry() {
        properties.insert("radius_m".to_owned(), json!(radius_m));
    }
    properties.insert("margin_m".to_owned(), json!(zone.margin_m()));
    put_terms(zone.terms(), &mut properties);
    json!({
        "type": "Feature",
        "id": zone.id(),
        "geometry": geometry_value(zone.geometry()),
        "properties": properties,
    })
}

/// Zones as the text of a GeoJSON feature collection, one zone to a line.
pub fn write_zones<'z>(zones: impl IntoIterator<Item = &'z Zone>) -> String {
    let lines: Vec<String> = zones
        .into_iter()
        .map(|zone| zone_to_feature(zone).to_string())
        .collect();
    format!(
        "{{\"type\":\"FeatureCollection\",\"features\":[\n{}\n]}}\n",
        lines.join(",\n")
    )
}

fn geometry_value(geometry: &ZoneGeometry) -> Value {
    match geometry {
        ZoneGeometry::Polygon(rings) => json!({"type": "Polygon", "coordinates": rings}),
        ZoneGeometry::MultiPolygon(polygons) => {
            json!({"type": "MultiPolygon", "coordinates": polygons})
        }
        ZoneGeometry::Circle { centre, .. } => json!({"type": "Point", "coordinates": centre}),
    }
}

fn put_limit(properties: &mut Map<String, Value>, end: &str, limit: Option<Altitude>) {
    let Some(Altitude { value_m, reference }) = limit else {
        return;
    };
    let reference = match reference {
        AltitudeReference::Agl => "agl",
        AltitudeReference::Amsl => "amsl",
        AltitudeReference::Wgs84 => "wgs84",
    };
    properties.insert(format!("{end}_m"), json!(value_m));
    properties.insert(format!("{end}_reference"), json!(reference));
}

//! Routes for maps: GPX, KML, GeoJSON.

use super::{Corner, Told, WrittenRoute};
use crate::geo::AltitudeReference;
use crate::identifier::node_id_json;
use quick_xml::Writer;
use quick_xml::events::BytesText;
use serde_json::{Value, json};
use std::io;

/// GPX 1.1. Its elevation is above sea; other heights stand in the description.
pub(super) fn gpx(told: &Told<'_>) -> WrittenRoute {
    let mut notes = Vec::new();
    if told.reference != Some(AltitudeReference::Amsl) {
        notes.push("heights are not above sea, and stand in the descriptions".to_owned());
    }
    let text = document(|writer| {
        let root = writer.create_element("gpx").with_attributes([
            ("version", "1.1"),
            ("creator", "skyway"),
            ("xmlns", "http://www.topografix.com/GPX/1/1"),
        ]);
        root.write_inner_content(|writer| {
            for &node in &told.alternates {
                let ([lon, lat], _) = told.place(node);
                let name = format!("alternate {}", told.topology.node_id(node));
                point(writer, "wpt", [lon, lat], |writer| {
                    text_of(writer, "name", &name)
                })?;
            }
            let route = writer.create_element("rte");
            route.write_inner_content(|writer| {
                text_of(writer, "name", &told.route.name)?;
                for corner in &told.corners {
                    point(writer, "rtept", corner.lon_lat, |writer| {
                        corner_content(told, corner, writer)
                    })?;
                }
                Ok(())
            })?;
            Ok(())
        })?;
        Ok(())
    });
    WrittenRoute { text, notes }
}

fn corner_content(
    told: &Told<'_>,
    corner: &Corner,
    writer: &mut Writer<Vec<u8>>,
) -> io::Result<()> {
    let reference = told.reference;
    if let Some(height_m) = corner
        .height_m
        .filter(|_| reference == Some(AltitudeReference::Amsl))
    {
        text_of(writer, "ele", &height_m.to_string())?;
    }
    if let Some(time) = corner.time {
        text_of(writer, "time", &time.to_string())?;
    }
    if let Some(node) = corner.node {
        text_of(writer, "name", told.topology.node_id(node))?;
    }
    match (corner.height_m, reference) {
        (Some(height_m), Some(reference)) if reference != AltitudeReference::Amsl => text_of(
            writer,
            "desc",
            &format!("{height_m} m {}", reference.name()),
        ),
        _ => Ok(()),
    }
}

/// KML 2.2. It has no mode for heights above the ellipsoid, which are left out.
pub(super) fn kml(told: &Told<'_>) -> WrittenRoute {
    let (mode, has_heights) = match told.reference {
        Some(AltitudeReference::Agl) => ("relativeToGround", true),
        Some(AltitudeReference::Amsl) => ("absolute", true),
        Some(AltitudeReference::Wgs84) | None => ("clampToGround", false),
    };
    let mut notes = Vec::new();
    if !has_heights {
        notes.push("heights are unknown or above the ellipsoid, and left out".to_owned());
    }
    let position = |corner: &Corner| {
        let [lon, lat] = corner.lon_lat;
        match corner.height_m.filter(|_| has_heights) {
            Some(height_m) => format!("{lon},{lat},{height_m}"),
            None => format!("{lon},{lat}"),
        }
    };
    let line: Vec<String> = told.corners.iter().map(position).collect();
    let text = document(|writer| {
        let root = writer
            .create_element("kml")
            .with_attribute(("xmlns", "http://www.opengis.net/kml/2.2"));
        root.write_inner_content(|writer| {
            writer
                .create_element("Document")
                .write_inner_content(|writer| {
                    text_of(writer, "name", &told.route.name)?;
                    placemark(
                        writer,
                        &told.route.name,
                        "LineString",
                        mode,
                        &line.join(" "),
                    )?;
                    for &node in &told.alternates {
                        let ([lon, lat], _) = told.place(node);
                        let name = format!("alternate {}", told.topology.node_id(node));
                        placemark(
                            writer,
                            &name,
                            "Point",
                            "clampToGround",
                            &format!("{lon},{lat}"),
                        )?;
                    }
                    Ok(())
                })?;
            Ok(())
        })?;
        Ok(())
    });
    WrittenRoute { text, notes }
}

fn placemark(
    writer: &mut Writer<Vec<u8>>,
    name: &str,
    shape: &str,
    mode: &str,
    coordinates: &str,
) -> io::Result<()> {
    writer
        .create_element("Placemark")
        .write_inner_content(|writer| {
            text_of(writer, "name", name)?;
            writer.create_element(shape).write_inner_content(|writer| {
                text_of(writer, "altitudeMode", mode)?;
                text_of(writer, "coordinates", coordinates)
            })?;
            Ok(())
        })?;
    Ok(())
}

/// A line for the route and a point for each node and alternate.
pub(super) fn geojson(told: &Told<'_>) -> WrittenRoute {
    let position = |corner: &Corner| {
        let [lon, lat] = corner.lon_lat;
        match corner.height_m {
            Some(height_m) => json!([lon, lat, height_m]),
            None => json!([lon, lat]),
        }
    };
    let reference = told.reference.map(AltitudeReference::name);
    let line: Vec<Value> = told.corners.iter().map(position).collect();
    let mut features = vec![json!({
        "type": "Feature",
        "geometry": {"type": "LineString", "coordinates": line},
        "properties": {"kind": "route", "name": told.route.name, "height_reference": reference},
    })];
    let over_nodes = told
        .corners
        .iter()
        .filter_map(|corner| Some((corner, corner.node?)));
    for (corner, node) in over_nodes {
        let time = corner.time.map(|time| time.to_string());
        features.push(json!({
            "type": "Feature",
            "geometry": {"type": "Point", "coordinates": position(corner)},
            "properties": {
                "kind": if corner.lands { "landing" } else { "node" },
                "node": node_id_json(told.topology, node),
                "time": time,
            },
        }));
    }
    for &node in &told.alternates {
        let (lon_lat, _) = told.place(node);
        features.push(json!({
            "type": "Feature",
            "geometry": {"type": "Point", "coordinates": lon_lat},
            "properties": {"kind": "alternate", "node": node_id_json(told.topology, node)},
        }));
    }
    let collection = json!({"type": "FeatureCollection", "features": features});
    WrittenRoute {
        text: format!("{collection}\n"),
        notes: Vec::new(),
    }
}

/// A document of XML; writing to memory cannot fail.
fn document(write: impl FnOnce(&mut Writer<Vec<u8>>) -> io::Result<()>) -> String {
    let mut writer = Writer::new_with_indent(Vec::new(), b' ', 1);
    let written = write(&mut writer).map(|()| writer.into_inner());
    let body = written.unwrap_or_default();
    let body = String::from_utf8_lossy(&body);
    format!("<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n{body}\n")
}

fn text_of(writer: &mut Writer<Vec<u8>>, name: &str, text: &str) -> io::Result<()> {
    let element = writer.create_element(name);
    element.write_text_content(BytesText::new(text))?;
    Ok(())
}

fn point(
    writer: &mut Writer<Vec<u8>>,
    name: &str,
    [lon, lat]: [f64; 2],
    content: impl FnOnce(&mut Writer<Vec<u8>>) -> io::Result<()>,
) -> io::Result<()> {
    let (lat, lon) = (lat.to_string(), lon.to_string());
    let attributes = [("lat", lat.as_str()), ("lon", lon.as_str())];
    let element = writer.create_element(name).with_attributes(attributes);
    element.write_inner_content(content)?;
    Ok(())
}

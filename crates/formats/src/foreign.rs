//! Formats of the field, told by name: what a file is, what it has otherwise, and what to do.

use serde_json::Value;

/// Zones of a file looked at to find its format.
const LOOKED_AT: usize = 20;
/// Bytes of a text of XML looked at to find its format.
const LOOKED_AT_BYTES: usize = 2_000;

/// A format of the field.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ForeignFormat {
    /// EUROCAE ED-269: UAS geographical zones.
    Ed269,
    /// EUROCAE ED-318: the same as GeoJSON of a profile of its own.
    Ed318,
    /// A plan of QGroundControl: mission, fence and rally points.
    QgcPlan,
    /// A list of waypoints, `QGC WPL`.
    QgcWaypoints,
    /// Keyhole Markup Language.
    Kml,
    /// GPS exchange format.
    Gpx,
    /// Any other XML, such as AIXM.
    Xml,
}

/// Whether a file is a zip, as a KMZ is: by the signature that its first entry begins with (APPNOTE,
/// 4.3.7).
pub fn is_zip(bytes: &[u8]) -> bool {
    bytes.starts_with(b"PK\x03\x04")
}

impl ForeignFormat {
    /// Finds out which of them a text is; `None` for anything else.
    pub fn of_text(text: &str) -> Option<Self> {
        let head = text.trim_start_matches('\u{feff}').trim_start();
        if head.starts_with("QGC WPL") {
            return Some(Self::QgcWaypoints);
        }
        if let Some(markup) = Self::of_markup(head) {
            return Some(markup);
        }
        Self::of_json(&serde_json::from_str(head).ok()?)
    }

    /// The same of a text that begins as XML does; `None` for anything else.
    pub fn of_markup(text: &str) -> Option<Self> {
        let head = text.trim_start();
        if !head.starts_with('<') {
            return None;
        }
        let start = &head[..head.floor_char_boundary(LOOKED_AT_BYTES)];
        Some(match start {
            _ if start.contains("<kml") => Self::Kml,
            _ if start.contains("<gpx") => Self::Gpx,
            _ => Self::Xml,
        })
    }

    /// The same of a document that has been read: a whole file, or a single zone.
    pub fn of_json(document: &Value) -> Option<Self> {
        if document.get("fileType").is_some_and(|kind| kind == "Plan")
            || (document.get("geoFence").is_some() && document.get("mission").is_some())
        {
            return Some(Self::QgcPlan);
        }
        let zones = ["UASZoneList", "uas_zones"];
        if zones.iter().any(|name| document.get(name).is_some()) {
            return Some(Self::Ed269);
        }
        let features = document.get("features").and_then(Value::as_array);
        let zones = features.map_or(std::slice::from_ref(document), Vec::as_slice);
        // One that is broken does not hide what the others are.
        let zones = &zones[..zones.len().min(LOOKED_AT)];
        if zones.iter().any(is_ed269_zone) {
            return Some(Self::Ed269);
        }
        let mut properties = zones.iter().filter_map(|zone| zone.get("properties"));
        properties.any(is_ed318).then_some(Self::Ed318)
    }

    /// Its name.
    pub fn name(self) -> &'static str {
        match self {
            Self::Ed269 => "an ED-269 file of UAS zones",
            Self::Ed318 => "an ED-318 file of UAS zones",
            Self::QgcPlan => "a plan of QGroundControl",
            Self::QgcWaypoints => "a list of waypoints of QGroundControl",
            Self::Kml => "a KML file",
            Self::Gpx => "a GPX file",
            Self::Xml => "an XML file",
        }
    }

    /// Why it gives no zones here, and how to make some of it.
    pub fn instead_of_zones(self) -> String {
        let how = match self {
            Self::Ed269 | Self::Ed318 | Self::QgcPlan | Self::Kml => {
                "import it with skyway zone import, or POST /v1/zones:import"
            }
            Self::QgcWaypoints => "a mission has no zones",
            Self::Gpx | Self::Xml => {
                "it is no JSON: convert it to GeoJSON, as ogr2ogr does, and give every Feature an id"
            }
        };
        let what = match self.has_zones() {
            true => "which has many zones and is no GeoJSON feature",
            false => "which is not read here",
        };
        format!("it is {}, {what}; {how}", self.name())
    }

    /// Whether zones are imported from it.
    pub fn has_zones(self) -> bool {
        matches!(self, Self::Ed269 | Self::Ed318 | Self::QgcPlan | Self::Kml)
    }

    /// Why it gives no network here, and what would.
    pub fn instead_of_network(self) -> String {
        let how = match self {
            Self::Ed269 | Self::Ed318 => {
                "it has zones, and neither nodes nor segments: give a network with --network, and the zones with --zones"
            }
            Self::QgcPlan | Self::QgcWaypoints => {
                "it has one mission, and neither nodes with pads nor segments: give a network as GeoJSON, node-link JSON \
                 or CSV"
            }
            Self::Kml | Self::Gpx | Self::Xml => {
                "it says nothing of nodes, pads and segments: give a network as GeoJSON, node-link JSON or CSV"
            }
        };
        format!("is {}, which is not read here; {how}", self.name())
    }
}

/// The geometry of ED-269 is a list of volumes.
fn is_ed269_zone(zone: &Value) -> bool {
    let volumes = zone.get("geometry").and_then(Value::as_array);
    volumes.is_some_and(|volumes| {
        let is_volume = |volume: &Value| volume.get("horizontalProjection").is_some();
        volumes.iter().any(is_volume)
    })
}

/// Every zone of ED-318 has these; national feeds leave one or the other out.
fn is_ed318(properties: &Value) -> bool {
    const TELLING: [&str; 5] = [
        "identifier",
        "country",
        "variant",
        "zoneAuthority",
        "limitedApplicability",
    ];
    if properties.get("UASZone").is_some_and(Value::is_object) {
        return true;
    }
    let has = |name: &&&str| properties.get(**name).is_some();
    TELLING.iter().filter(has).count() >= 2
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn files_of_the_field_are_told_by_what_they_have() {
        let ed269 = json!({"identifier": "A", "country": "CHE", "geometry": [{"horizontalProjection": {}}]});
        let ed318 = json!({"type": "Feature", "properties": {"identifier": "A", "country": "FRA"}});
        for (document, format) in [
            (
                json!({"title": "x", "features": [ed269]}),
                ForeignFormat::Ed269,
            ),
            (json!({"UASZoneList": []}), ForeignFormat::Ed269),
            (json!({"uas_zones": []}), ForeignFormat::Ed269),
            (ed269.clone(), ForeignFormat::Ed269),
            (
                json!({"type": "FeatureCollection", "features": [ed318]}),
                ForeignFormat::Ed318,
            ),
            (ed318.clone(), ForeignFormat::Ed318),
            (json!({"fileType": "Plan"}), ForeignFormat::QgcPlan),
        ] {
            assert_eq!(
                ForeignFormat::of_text(&document.to_string()),
                Some(format),
                "{document}"
            );
        }
        for (text, format) in [
            ("QGC WPL 110\n0\t1", ForeignFormat::QgcWaypoints),
            (
                "<?xml version=\"1.0\"?>\n<kml xmlns=\"http://www.opengis.net/kml/2.2\">",
                ForeignFormat::Kml,
            ),
            ("<gpx>", ForeignFormat::Gpx),
            ("\u{feff}<aixm:AIXMBasicMessage>", ForeignFormat::Xml),
        ] {
            assert_eq!(ForeignFormat::of_text(text), Some(format), "{text}");
        }
        let own =
            json!({"type": "Feature", "id": "z", "properties": {"name": "a", "country": "b"}});
        for text in ["", "{}", "[1]", "id,lon,lat", &own.to_string()] {
            assert_eq!(ForeignFormat::of_text(text), None, "{text}");
        }
    }
}

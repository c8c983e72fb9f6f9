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
    /// A graph in GraphML.
    Graphml,
    /// A graph in the node-link JSON of NetworkX.
    NodeLink,
    /// OpenStreetMap as XML.
    OsmXml,
    /// Any other XML, such as AIXM.
    Xml,
    /// OpenStreetMap in protocol buffers.
    OsmPbf,
    /// OGC GeoPackage.
    Geopackage,
    /// Any other database of SQLite.
    Sqlite,
    /// A zip archive, such as KMZ or a zipped shapefile.
    Zip,
    /// The geometries of a shapefile.
    Shapefile,
    /// Apache Parquet, such as GeoParquet.
    Parquet,
    /// FlatGeobuf.
    FlatGeobuf,
}

/// What files that are no text begin with.
const BEGINNINGS: [(&[u8], ForeignFormat); 5] = [
    (b"SQLite format 3\0", ForeignFormat::Sqlite),
    (b"PK\x03\x04", ForeignFormat::Zip),
    (b"\0\0\x27\x0a", ForeignFormat::Shapefile),
    (b"PAR1", ForeignFormat::Parquet),
    (b"fgb\x03", ForeignFormat::FlatGeobuf),
];
/// Where a database of SQLite says whose it is, and what a GeoPackage says there (OGC 12-128, requirement 2).
const APPLICATION_ID: std::ops::Range<usize> = 68..72;
const GEOPACKAGE_IDS: [&[u8]; 3] = [b"GPKG", b"GP10", b"GP11"];
/// The kind of the first block of an OSM extract, after the lengths of its header and of its kind.
const OSM_HEADER: &[u8] = b"OSMHeader";
const OSM_HEADER_AT: usize = 6;

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
            _ if start.contains("<graphml") => Self::Graphml,
            _ if start.contains("<osm") => Self::OsmXml,
            _ => Self::Xml,
        })
    }

    /// The same of a file that is no text.
    pub fn of_bytes(bytes: &[u8]) -> Option<Self> {
        if bytes
            .get(OSM_HEADER_AT..)
            .is_some_and(|rest| rest.starts_with(OSM_HEADER))
        {
            return Some(Self::OsmPbf);
        }
        let mut beginnings = BEGINNINGS.iter();
        let (_, format) = beginnings.find(|(beginning, _)| bytes.starts_with(beginning))?;
        let application = bytes.get(APPLICATION_ID).unwrap_or_default();
        match format {
            Self::Sqlite if GEOPACKAGE_IDS.contains(&application) => Some(Self::Geopackage),
            format => Some(*format),
        }
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
        let has_list = |name: &str| document.get(name).is_some_and(Value::is_array);
        if has_list("nodes") && (has_list("links") || has_list("edges")) {
            return Some(Self::NodeLink);
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
            Self::Graphml => "a GraphML file",
            Self::NodeLink => "node-link JSON of NetworkX",
            Self::OsmXml => "an OSM file in XML",
            Self::Xml => "an XML file",
            Self::OsmPbf => "an OSM extract (.osm.pbf)",
            Self::Geopackage => "a GeoPackage",
            Self::Sqlite => "a database of SQLite",
            Self::Zip => "a zip archive",
            Self::Shapefile => "a shapefile",
            Self::Parquet => "a Parquet file",
            Self::FlatGeobuf => "a FlatGeobuf file",
        }
    }

    /// Why it gives no zones here, and how to make some of it.
    pub fn instead_of_zones(self) -> String {
        let how = match self {
            Self::Ed269 | Self::Ed318 | Self::QgcPlan | Self::Kml => {
                "import it with skyway zone import, or POST /v1/zones:import"
            }
            Self::QgcWaypoints => "a mission has no zones",
            Self::Graphml | Self::NodeLink => {
                "it has a network and no zones: give it with --network"
            }
            Self::OsmXml | Self::OsmPbf => "it has a map and no zones",
            _ => {
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
                "it has one mission, and neither nodes with pads nor segments: give a network as GeoJSON, GraphML, \
                 GeoPackage, node-link JSON or CSV"
            }
            Self::OsmPbf | Self::OsmXml => {
                return format!("is {}, {}", self.name(), self.instead_of_text());
            }
            _ => {
                "it says nothing of nodes, pads and segments: give a network as GeoJSON, GraphML, GeoPackage, node-link \
                 JSON or CSV"
            }
        };
        format!("is {}, which is not read here; {how}", self.name())
    }

    /// Why it is not the text that a command asks for, and what to do with it.
    pub fn instead_of_text(self) -> &'static str {
        match self {
            Self::OsmPbf => {
                "which has a map: skyway network build makes a network of the buildings in it"
            }
            Self::OsmXml => {
                "which has a map: make it a .osm.pbf, as osmium cat does, and skyway network build makes a network of \
                 the buildings in it"
            }
            Self::Geopackage => {
                "which is read as a network alone: convert other layers with ogr2ogr -f GeoJSON"
            }
            Self::Zip => {
                "which is not read here: unpack it, as a KMZ too, and name the file that is in it"
            }
            _ => "which is not read here: convert it with ogr2ogr -f GeoJSON",
        }
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
            (
                "<graphml xmlns='x'><graph/></graphml>",
                ForeignFormat::Graphml,
            ),
            (
                "<?xml version='1.0'?><osm version='0.6'>",
                ForeignFormat::OsmXml,
            ),
            (r#"{"nodes": [], "links": []}"#, ForeignFormat::NodeLink),
        ] {
            assert_eq!(ForeignFormat::of_text(text), Some(format), "{text}");
        }
        let own =
            json!({"type": "Feature", "id": "z", "properties": {"name": "a", "country": "b"}});
        for text in ["", "{}", "[1]", "id,lon,lat", &own.to_string()] {
            assert_eq!(ForeignFormat::of_text(text), None, "{text}");
        }
    }
    #[test]
    fn files_that_are_no_text_are_told_by_their_beginning() {
        let database = |application: &[u8]| {
            let mut bytes = b"SQLite format 3\0".to_vec();
            bytes.resize(68, 0);
            [&bytes, application, &[0; 28]].concat()
        };
        for (bytes, format) in [
            (database(b"GPKG"), ForeignFormat::Geopackage),
            (database(b"GP10"), ForeignFormat::Geopackage),
            (database(&[0; 4]), ForeignFormat::Sqlite),
            (b"SQLite format 3\0".to_vec(), ForeignFormat::Sqlite),
            (
                b"\0\0\0\x0d\x0a\x09OSMHeader\x18".to_vec(),
                ForeignFormat::OsmPbf,
            ),
            (b"PK\x03\x04\x14".to_vec(), ForeignFormat::Zip),
            (b"\0\0\x27\x0a\0\0".to_vec(), ForeignFormat::Shapefile),
            (b"PAR1".to_vec(), ForeignFormat::Parquet),
            (b"fgb\x03fgb\x00".to_vec(), ForeignFormat::FlatGeobuf),
        ] {
            assert_eq!(ForeignFormat::of_bytes(&bytes), Some(format), "{bytes:?}");
        }
        for bytes in [&b""[..], b"{}", b"SQLite", b"\0\0\0\x0d\x0a\x09OSMData"] {
            assert_eq!(ForeignFormat::of_bytes(bytes), None, "{bytes:?}");
        }
    }
}

//! Writing a GeoPackage: the statements of SQL that make one, with the rows they are run for.

use super::{Cell, NETWORK_TABLE, NODES_LAYER, SEGMENTS_LAYER, geometry};
use crate::network::{Coordinates, NetworkDraft};
use crate::networks::attributes::{
    AttributeKind, OF_NODES, OF_SEGMENTS, node_members, segment_members, written_position,
};
use rustc_hash::FxHashMap;
use serde_json::{Map, Value};

/// Undefined cartesian, and WGS 84 in degrees (OGC 12-128, 1.1.2).
const CARTESIAN: i32 = -1;
const WGS_84: i32 = 4326;
const WGS_84_DEFINITION: &str = r#"GEOGCS["WGS 84",DATUM["WGS_1984",SPHEROID["WGS 84",6378137,298.257223563,AUTHORITY["EPSG","7030"]],AUTHORITY["EPSG","6326"]],PRIMEM["Greenwich",0,AUTHORITY["EPSG","8901"]],UNIT["degree",0.0174532925199433,AUTHORITY["EPSG","9122"]],AUTHORITY["EPSG","4326"]]"#;
/// The type of whole numbers, of 64 bits with a sign.
const INTEGER: &str = "INTEGER";
/// The same network gives the same bytes: the time at which it was written is left to the file system.
const LAST_CHANGE: &str = "1970-01-01T00:00:00.000Z";

/// What every GeoPackage has; its application id and version 1.3 first.
const STANDARD: [&str; 5] = [
    "PRAGMA application_id = 1196444487",
    "PRAGMA user_version = 10300",
    "CREATE TABLE gpkg_spatial_ref_sys (srs_name TEXT NOT NULL, srs_id INTEGER PRIMARY KEY, \
     organization TEXT NOT NULL, organization_coordsys_id INTEGER NOT NULL, definition TEXT NOT NULL, \
     description TEXT)",
    "CREATE TABLE gpkg_contents (table_name TEXT NOT NULL PRIMARY KEY, data_type TEXT NOT NULL, \
     identifier TEXT UNIQUE, description TEXT DEFAULT '', last_change DATETIME NOT NULL DEFAULT \
     (strftime('%Y-%m-%dT%H:%M:%fZ','now')), min_x DOUBLE, min_y DOUBLE, max_x DOUBLE, max_y DOUBLE, \
     srs_id INTEGER, CONSTRAINT fk_gc_r_srs_id FOREIGN KEY (srs_id) REFERENCES gpkg_spatial_ref_sys (srs_id))",
    "CREATE TABLE gpkg_geometry_columns (table_name TEXT NOT NULL, column_name TEXT NOT NULL, \
     geometry_type_name TEXT NOT NULL, srs_id INTEGER NOT NULL, z TINYINT NOT NULL, m TINYINT NOT NULL, \
     CONSTRAINT pk_geom_cols PRIMARY KEY (table_name, column_name), \
     CONSTRAINT uk_gc_table_name UNIQUE (table_name), \
     CONSTRAINT fk_gc_tn FOREIGN KEY (table_name) REFERENCES gpkg_contents (table_name), \
     CONSTRAINT fk_gc_srs FOREIGN KEY (srs_id) REFERENCES gpkg_spatial_ref_sys (srs_id))",
];

/// A statement and the rows of values it is run for, once for each.
#[derive(Clone, Debug)]
pub struct GeopackageStatement {
    /// The statement, with a `?` for each value.
    pub sql: String,
    /// The values.
    pub rows: Vec<Vec<Cell>>,
}

/// A layer as it is declared.
struct Layer {
    name: &'static str,
    shape: &'static str,
    /// Its columns after the geometry, with their types.
    columns: Vec<(&'static str, &'static str)>,
    rows: Vec<Vec<Cell>>,
}

/// A network as a GeoPackage.
#[derive(Clone, Debug)]
pub struct WrittenGeopackage {
    /// The statements that make it in an empty database, in their order.
    pub statements: Vec<GeopackageStatement>,
    /// What the format has no place for, a line each.
    pub losses: Vec<String>,
}

/// Writes a network as the statements that make a GeoPackage of it.
pub fn write_geopackage(draft: &NetworkDraft) -> WrittenGeopackage {
    let mut statements: Vec<GeopackageStatement> = STANDARD.map(once).into_iter().collect();
    let srs_id = match draft.coordinates {
        Coordinates::Planar => CARTESIAN,
        Coordinates::Geographic => WGS_84,
    };
    statements.push(reference_systems());
    let bounds = bounds_of(draft);
    for layer in [nodes_layer(draft, srs_id), segments_layer(draft, srs_id)] {
        let contents = [
            text(layer.name),
            text("features"),
            text(layer.name),
            text(&draft.attribution),
            text(LAST_CHANGE),
        ];
        let place = bounds.iter().cloned().chain([Cell::Whole(srs_id.into())]);
        statements.push(contents_of(contents.into_iter().chain(place).collect()));
        statements.push(GeopackageStatement {
            sql: insert("gpkg_geometry_columns", 6),
            rows: vec![vec![
                text(layer.name),
                text("geom"),
                text(layer.shape),
                Cell::Whole(srs_id.into()),
                Cell::Whole(0),
                Cell::Whole(0),
            ]],
        });
        statements.extend(layer.statements());
    }
    statements.extend(network_table(draft));
    let losses = match draft.integer_ids && id_type(draft) != INTEGER {
        true => vec![format!(
            "an id is above {}; all ids are written as text",
            i64::MAX
        )],
        false => Vec::new(),
    };
    WrittenGeopackage { statements, losses }
}

impl Layer {
    fn statements(self) -> [GeopackageStatement; 2] {
        let columns = self.columns.iter();
        let declared: String = columns
            .map(|(name, kind)| format!(", \"{name}\" {kind}"))
            .collect();
        let (name, shape) = (self.name, self.shape);
        let create = format!(
            "CREATE TABLE {name} (fid INTEGER PRIMARY KEY AUTOINCREMENT NOT NULL, geom {shape}{declared})"
        );
        let fill = GeopackageStatement {
            sql: insert(name, 2 + self.columns.len()),
            rows: self.rows,
        };
        [once(&create), fill]
    }
}

fn once(sql: &str) -> GeopackageStatement {
    GeopackageStatement {
        sql: sql.to_owned(),
        rows: vec![Vec::new()],
    }
}

fn insert(table: &str, columns: usize) -> String {
    let places = vec!["?"; columns].join(", ");
    format!("INSERT INTO {table} VALUES ({places})")
}

fn text(words: &str) -> Cell {
    Cell::Text(words.to_owned())
}

fn reference_systems() -> GeopackageStatement {
    let system = |name: &str, id: i32, organization: &str, definition: &str| {
        vec![
            text(name),
            Cell::Whole(id.into()),
            text(organization),
            Cell::Whole(id.into()),
            text(definition),
            Cell::Null,
        ]
    };
    GeopackageStatement {
        sql: insert("gpkg_spatial_ref_sys", 6),
        rows: vec![
            system("Undefined cartesian SRS", CARTESIAN, "NONE", "undefined"),
            system("Undefined geographic SRS", 0, "NONE", "undefined"),
            system("WGS 84 geodetic", WGS_84, "EPSG", WGS_84_DEFINITION),
        ],
    }
}

fn contents_of(row: Vec<Cell>) -> GeopackageStatement {
    GeopackageStatement {
        sql: insert("gpkg_contents", 10),
        rows: vec![row],
    }
}

/// The least and the largest coordinates: x and y, then x and y.
fn bounds_of(draft: &NetworkDraft) -> [Cell; 4] {
    let positions = || draft.nodes.iter().map(|node| node.position);
    let extreme = |axis: usize, better: fn(f64, f64) -> f64| {
        let extreme = positions().map(|position| position[axis]).reduce(better);
        extreme.map_or(Cell::Null, Cell::Real)
    };
    [
        extreme(0, f64::min),
        extreme(1, f64::min),
        extreme(0, f64::max),
        extreme(1, f64::max),
    ]
}

/// The type of the columns that have ids: integers where all of them are, as a file of integers has them.
fn id_type(draft: &NetworkDraft) -> &'static str {
    let is_integer = |id: &str| id.parse().is_ok_and(|number: i64| number.to_string() == id);
    match draft.integer_ids && draft.nodes.iter().all(|node| is_integer(&node.id)) {
        true => INTEGER,
        false => "TEXT",
    }
}

fn id_cell(id: &str, id_type: &str) -> Cell {
    let number = id.parse().ok().filter(|_| id_type == INTEGER);
    number.map_or_else(|| text(id), Cell::Whole)
}

fn nodes_layer(draft: &NetworkDraft, srs_id: i32) -> Layer {
    let id_type = id_type(draft);
    let numbered = (1..).zip(&draft.nodes);
    let rows = numbered.map(|(fid, node)| {
        let position = written_position(draft.coordinates, node.position);
        let mut row = vec![
            Cell::Whole(fid),
            Cell::Blob(geometry::point(position, srs_id)),
            id_cell(&node.id, id_type),
        ];
        row.extend(cells(&OF_NODES, &node_members(node)));
        row
    });
    Layer {
        name: NODES_LAYER,
        shape: "POINT",
        columns: [("id", id_type)]
            .into_iter()
            .chain(OF_NODES.map(declared))
            .collect(),
        rows: rows.collect(),
    }
}

fn segments_layer(draft: &NetworkDraft, srs_id: i32) -> Layer {
    let id_type = id_type(draft);
    let positions: FxHashMap<&str, [f64; 2]> = draft
        .nodes
        .iter()
        .map(|node| {
            (
                node.id.as_str(),
                written_position(draft.coordinates, node.position),
            )
        })
        .collect();
    let numbered = (1..).zip(&draft.segments);
    let rows = numbered.map(|(fid, segment)| {
        let ends = [&segment.from, &segment.to];
        let line = ends.map(|id| positions.get(id.as_str()).copied());
        let line = match line {
            [Some(from), Some(to)] => Cell::Blob(geometry::line([from, to], srs_id)),
            _ => Cell::Null,
        };
        let id = segment.id.as_deref().map_or(Cell::Null, text);
        let mut row = vec![Cell::Whole(fid), line, id];
        row.extend(ends.map(|end| id_cell(end, id_type)));
        row.extend(cells(&OF_SEGMENTS, &segment_members(segment)));
        row
    });
    let ends = [("id", "TEXT"), ("from", id_type), ("to", id_type)];
    Layer {
        name: SEGMENTS_LAYER,
        shape: "LINESTRING",
        columns: ends.into_iter().chain(OF_SEGMENTS.map(declared)).collect(),
        rows: rows.collect(),
    }
}

fn declared((name, kind): (&'static str, AttributeKind)) -> (&'static str, &'static str) {
    let declared = match kind {
        AttributeKind::Whole => INTEGER,
        AttributeKind::Real => "DOUBLE",
        AttributeKind::Text => "TEXT",
    };
    (name, declared)
}

fn cells(columns: &[(&str, AttributeKind)], members: &Map<String, Value>) -> Vec<Cell> {
    let cell = |(name, _): &(&str, AttributeKind)| match members.get(*name) {
        None | Some(Value::Null) => Cell::Null,
        Some(Value::String(words)) => text(words),
        Some(value) => match value.as_i64() {
            Some(number) => Cell::Whole(number),
            None => value.as_f64().map_or(Cell::Null, Cell::Real),
        },
    };
    columns.iter().map(cell).collect()
}

/// What the network says of itself.
fn network_table(draft: &NetworkDraft) -> [GeopackageStatement; 3] {
    let mut contents = vec![
        text(NETWORK_TABLE),
        text("attributes"),
        text(NETWORK_TABLE),
        text(""),
        text(LAST_CHANGE),
    ];
    contents.resize(10, Cell::Null);
    let create = format!(
        "CREATE TABLE {NETWORK_TABLE} (id INTEGER PRIMARY KEY AUTOINCREMENT NOT NULL, name TEXT, attribution TEXT)"
    );
    let row = vec![Cell::Whole(1), text(&draft.name), text(&draft.attribution)];
    let fill = GeopackageStatement {
        sql: insert(NETWORK_TABLE, 3),
        rows: vec![row],
    };
    [contents_of(contents), once(&create), fill]
}

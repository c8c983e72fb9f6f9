//! Search areas as GeoJSON geometries, in the coordinates of the network's file.

use crate::geo::{Bounds, Point};
use crate::network::Topology;
use crate::recompose::AreaShape;
use geo::{Coord, LineString, MultiPolygon, Polygon, unary_union};
use serde_json::{Value, json};
use std::f64::consts::TAU;

/// A circle is written as a polygon of this many sides.
const CIRCLE_SIDES: usize = 96;

/// A search area as a GeoJSON geometry: degrees for a geographic network, metres for a planar one.
pub fn area_geometry(topology: &Topology, shape: &AreaShape) -> Value {
    match shape {
        AreaShape::Everything => polygon(topology, &corners_of(topology.bounds())),
        AreaShape::Circle { centre, radius_m } => {
            let corners: Vec<Point> = (0..CIRCLE_SIDES)
                .map(|side| {
                    let angle = TAU * side as f64 / CIRCLE_SIDES as f64;
                    Point::new(
                        centre.x + radius_m * angle.cos(),
                        centre.y + radius_m * angle.sin(),
                    )
                })
                .collect();
            polygon(topology, &corners)
        }
        AreaShape::Squares { squares } => multi_polygon(topology, &union_of(squares)),
        AreaShape::Polygon { corners } => polygon(topology, corners),
        AreaShape::Grown { corners, added } => {
            let points: Vec<[f64; 2]> = added
                .iter()
                .map(|&node| topology.frame().from_plane(topology.position(node)))
                .collect();
            json!({
                "type": "GeometryCollection",
                "geometries": [
                    polygon(topology, corners),
                    {"type": "MultiPoint", "coordinates": points},
                ],
            })
        }
    }
}

fn corners_of(bounds: Bounds) -> [Point; 4] {
    [
        bounds.min,
        Point::new(bounds.max.x, bounds.min.y),
        bounds.max,
        Point::new(bounds.min.x, bounds.max.y),
    ]
}

/// The outline of overlapping squares: RFC 7946 readers want polygons that do not overlap.
fn union_of(squares: &[(Point, f64)]) -> MultiPolygon {
    let squares: Vec<Polygon> = squares
        .iter()
        .map(|&(centre, half_side_m)| {
            let around = Bounds {
                min: centre,
                max: centre,
            };
            let corners = corners_of(around.grown(half_side_m));
            let outline = corners.map(|corner| Coord {
                x: corner.x,
                y: corner.y,
            });
            Polygon::new(LineString::from_iter(outline), Vec::new())
        })
        .collect();
    unary_union(&squares)
}

fn polygon(topology: &Topology, corners: &[Point]) -> Value {
    let closed = corners.iter().chain(corners.first());
    let ring: Vec<[f64; 2]> = closed
        .map(|&corner| topology.frame().from_plane(corner))
        .collect();
    json!({"type": "Polygon", "coordinates": [ring]})
}

fn multi_polygon(topology: &Topology, polygons: &MultiPolygon) -> Value {
    let ring = |line: &LineString| -> Vec<[f64; 2]> {
        let corners = line.coords();
        corners
            .map(|corner| topology.frame().from_plane(Point::new(corner.x, corner.y)))
            .collect()
    };
    let coordinates: Vec<Vec<Vec<[f64; 2]>>> = polygons
        .iter()
        .map(|polygon| {
            let rings = std::iter::once(polygon.exterior()).chain(polygon.interiors());
            rings.map(ring).collect()
        })
        .collect();
    json!({"type": "MultiPolygon", "coordinates": coordinates})
}

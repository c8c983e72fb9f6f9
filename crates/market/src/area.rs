//! Where a service picks up and drops: a GeoJSON area on the plane of its network.

use serde_json::Value;
use skyway_engine::geo::{Frame, Point, PreparedShape, Shape, ShapeError};
use thiserror::Error;

/// Why an area is none.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum AreaError {
    /// It is no polygon by its `type`.
    #[error("an area is a GeoJSON Polygon or MultiPolygon (RFC 7946, 3.1.6 and 3.1.7)")]
    NotPolygonal,
    /// Its coordinates are not nested as those of a polygon.
    #[error("{place} is no {expected} (RFC 7946, 3.1)")]
    Coordinates {
        /// Where, as a JSON pointer below the geometry.
        place: String,
        /// What has to be there.
        expected: &'static str,
    },
    /// Its rings are those of no area.
    #[error(transparent)]
    Shape(#[from] ShapeError),
}

/// Where a service picks up and drops.
#[derive(Clone, Debug)]
pub struct Area(PreparedShape);

impl Area {
    /// Reads an area, in the coordinates of a network's file.
    ///
    /// # Errors
    /// When it is no polygon, or one without an area.
    pub fn read(geometry: &Value, frame: &Frame) -> Result<Self, AreaError> {
        let coordinates = &geometry["coordinates"];
        let polygons = match geometry["type"].as_str() {
            Some("Polygon") => vec![read_rings(coordinates, "/coordinates", frame)?],
            Some("MultiPolygon") => each(
                coordinates,
                "/coordinates",
                "list of polygons",
                |rings, place| read_rings(rings, place, frame),
            )?,
            _ => return Err(AreaError::NotPolygonal),
        };
        Ok(Self(PreparedShape::new(Shape::multi_polygon(&polygons)?)))
    }

    /// Whether a point of the plane is in it, its boundary included.
    pub fn contains(&self, point: Point) -> bool {
        self.0.covers_point(point, 0.0)
    }
}

fn read_rings(value: &Value, place: &str, frame: &Frame) -> Result<Vec<Vec<Point>>, AreaError> {
    each(value, place, "list of rings", |ring, place| {
        each(ring, place, "list of positions", |position, place| {
            read_position(position, place, frame)
        })
    })
}

fn each<T>(
    value: &Value,
    place: &str,
    expected: &'static str,
    read: impl Fn(&Value, &str) -> Result<T, AreaError>,
) -> Result<Vec<T>, AreaError> {
    let list = value.as_array().ok_or_else(|| AreaError::Coordinates {
        place: place.to_owned(),
        expected,
    })?;
    let entries = list.iter().enumerate();
    entries
        .map(|(index, entry)| read(entry, &format!("{place}/{index}")))
        .collect()
}

fn read_position(value: &Value, place: &str, frame: &Frame) -> Result<Point, AreaError> {
    let wrong = || AreaError::Coordinates {
        place: place.to_owned(),
        expected: "position",
    };
    let numbers = value.as_array().ok_or_else(wrong)?;
    let number = |index: usize| numbers.get(index).and_then(Value::as_f64);
    let (Some(first), Some(second)) = (number(0), number(1)) else {
        return Err(wrong());
    };
    Ok(frame.to_plane([first, second]))
}

#[cfg(test)]
mod tests {
    use super::{Area, AreaError};
    use serde_json::{Value, json};
    use skyway_engine::geo::{Frame, LocalPlane, Point};

    fn square(from: f64, to: f64) -> Value {
        json!([[from, from], [to, from], [to, to], [from, to], [from, from]])
    }

    #[test]
    fn inside_means_its_boundary_too_and_not_its_holes() {
        let geometry =
            json!({"type": "Polygon", "coordinates": [square(0.0, 10.0), square(4.0, 6.0)]});
        let area = Area::read(&geometry, &Frame::Planar).unwrap();
        assert!(area.contains(Point::new(1.0, 1.0)));
        assert!(area.contains(Point::new(10.0, 5.0)));
        assert!(!area.contains(Point::new(5.0, 5.0)));
        assert!(!area.contains(Point::new(10.1, 5.0)));
    }

    #[test]
    fn several_polygons_are_one_area_in_degrees() {
        let frame = Frame::Geographic(LocalPlane::about(151.2, -33.87));
        let at = |lon: f64, lat: f64| frame.to_plane([lon, lat]);
        let around = |lon: f64| {
            json!([[
                [lon, -33.9],
                [lon + 0.01, -33.9],
                [lon + 0.01, -33.8],
                [lon, -33.8],
                [lon, -33.9]
            ]])
        };
        let geometry =
            json!({"type": "MultiPolygon", "coordinates": [around(151.2), around(151.3)]});
        let area = Area::read(&geometry, &frame).unwrap();
        assert!(area.contains(at(151.205, -33.85)));
        assert!(area.contains(at(151.305, -33.85)));
        assert!(!area.contains(at(151.25, -33.85)));
    }

    #[test]
    fn what_is_no_area_says_where() {
        let refused = |geometry: Value| Area::read(&geometry, &Frame::Planar).unwrap_err();
        assert_eq!(
            refused(json!({"type": "Point", "coordinates": [1, 2]})),
            AreaError::NotPolygonal
        );
        assert_eq!(refused(json!(7)), AreaError::NotPolygonal);
        let text = refused(json!({"type": "Polygon", "coordinates": [[[0, 0], "x"]]})).to_string();
        assert_eq!(text, "/coordinates/0/1 is no position (RFC 7946, 3.1)");
        let open = refused(json!({"type": "Polygon", "coordinates": [[[0, 0], [1, 0], [1, 1]]]}));
        assert!(matches!(open, AreaError::Shape(_)));
    }
}

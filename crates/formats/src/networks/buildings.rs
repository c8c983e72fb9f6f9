//! Buildings from GeoJSON: a `FeatureCollection` of polygons with heights, as made from
//! OpenStreetMap.
//!
//! Of the properties, `height_m`, `min_height_m`, `name` and `extract` are read, each optional and
//! null where unknown; any others are left alone. The id is the feature's `id`, or its `osm_id`.

use crate::error::{FormatError, FormatErrors};
use crate::place::{Place, array, number, object, optional, position, required, text};
use serde_json::{Map, Value};
use skyway_maps::buildings::{Building, Outline};

/// Reads buildings, in file order.
///
/// # Errors
/// Up to [`MAX_FORMAT_ERRORS`](crate::MAX_FORMAT_ERRORS) errors, one for each feature at fault. A
/// building that cannot be read is never left out in silence: it would be an obstacle that no one
/// sees.
pub fn read_buildings(text: &str) -> Result<Vec<Building>, Vec<FormatError>> {
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    let document: Value = serde_json::from_str(text)
        .map_err(|error| vec![FormatError::new("", format!("is not JSON: {error}"))])?;
    let features = features(&document).map_err(|error| vec![error])?;
    let list = Place::ROOT.member("features");
    let mut errors = FormatErrors::default();
    let mut buildings = Vec::with_capacity(features.len());
    for (index, feature) in features.iter().enumerate() {
        match building(feature, index, &list.element(index)) {
            Ok(building) => buildings.push(building),
            Err(error) => errors.push(error),
        }
    }
    errors.or(buildings)
}

fn features(document: &Value) -> Result<&[Value], FormatError> {
    let members = object(document, &Place::ROOT)?;
    let kind = members.get("type").and_then(Value::as_str);
    if kind != Some("FeatureCollection") {
        return Err(Place::ROOT.error("is not a GeoJSON FeatureCollection"));
    }
    let features = required(members, "features", &Place::ROOT)?;
    array(features, &Place::ROOT.member("features"))
}

fn building(feature: &Value, index: usize, place: &Place<'_>) -> Result<Building, FormatError> {
    let members = object(feature, place)?;
    let nothing = Map::new();
    let properties = match optional(members, "properties") {
        Some(properties) => object(properties, &place.member("properties"))?,
        None => &nothing,
    };
    let id = id_of(members, properties).unwrap_or_else(|| format!("feature {index}"));
    facts(members, properties, &id, place).map_err(|error| error.of(format!("building '{id}'")))
}

fn id_of(members: &Map<String, Value>, properties: &Map<String, Value>) -> Option<String> {
    let stated = optional(members, "id").or_else(|| optional(properties, "osm_id"))?;
    match stated {
        Value::String(id) => Some(id.clone()),
        Value::Number(id) => Some(id.to_string()),
        _ => None,
    }
}

fn facts(
    members: &Map<String, Value>,
    properties: &Map<String, Value>,
    id: &str,
    place: &Place<'_>,
) -> Result<Building, FormatError> {
    let geometry = required(members, "geometry", place)?;
    let outline = outline(geometry, &place.member("geometry"))?;
    let place = place.member("properties");
    let words = |name: &str| {
        let stated = optional(properties, name).map(|value| text(value, &place.member(name)));
        stated.transpose().map(|stated| stated.map(str::to_owned))
    };
    let height_m = height_m(properties, "height_m", &place)?;
    if height_m == Some(0.0) {
        let error = place.member("height_m").error("is 0");
        return Err(error.hint("leave it out where the height is unknown"));
    }
    Ok(Building {
        id: id.to_owned(),
        name: words("name")?,
        outline,
        height_m,
        min_height_m: self::height_m(properties, "min_height_m", &place)?,
        extract: words("extract")?,
    })
}

fn height_m(
    properties: &Map<String, Value>,
    name: &str,
    place: &Place<'_>,
) -> Result<Option<f64>, FormatError> {
    let Some(stated) = optional(properties, name) else {
        return Ok(None);
    };
    let place = place.member(name);
    let height_m = number(stated, &place)?;
    if height_m < 0.0 {
        return Err(place.error(format!("is {height_m} m, below ground")));
    }
    Ok(Some(height_m))
}

fn outline(geometry: &Value, place: &Place<'_>) -> Result<Outline, FormatError> {
    let members = object(geometry, place)?;
    let kind_place = place.member("type");
    let kind = text(required(members, "type", place)?, &kind_place)?;
    let place = place.member("coordinates");
    let coordinates = required(members, "coordinates", &place)?;
    let polygons = match kind {
        "Polygon" => vec![rings(coordinates, &place)?],
        "MultiPolygon" => array(coordinates, &place)?
            .iter()
            .enumerate()
            .map(|(index, polygon)| rings(polygon, &place.element(index)))
            .collect::<Result<_, _>>()?,
        other => {
            let error = kind_place.error(format!("is '{other}', not 'Polygon' or 'MultiPolygon'"));
            return Err(error.hint("a building without an outline cannot be avoided"));
        }
    };
    Outline::new(&polygons).map_err(|fault| place.error(fault.to_string()))
}

fn rings(polygon: &Value, place: &Place<'_>) -> Result<Vec<Vec<[f64; 2]>>, FormatError> {
    let ring = |(index, ring): (usize, &Value)| {
        let place = place.element(index);
        array(ring, &place)?
            .iter()
            .enumerate()
            .map(|(index, corner)| position(corner, &place.element(index)))
            .collect()
    };
    array(polygon, place)?
        .iter()
        .enumerate()
        .map(ring)
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    fn collection(properties: Value, rings: Value) -> String {
        let geometry = json!({"type": "Polygon", "coordinates": rings});
        let feature = json!({"type": "Feature", "id": "way/1", "properties": properties, "geometry": geometry});
        json!({"type": "FeatureCollection", "features": [feature]}).to_string()
    }

    fn square() -> Value {
        json!([[
            [0.0, 0.0],
            [0.001, 0.0],
            [0.001, 0.001],
            [0.0, 0.001],
            [0.0, 0.0]
        ]])
    }

    fn refused(properties: Value, rings: Value) -> String {
        let errors = read_buildings(&collection(properties, rings)).expect_err("at fault");
        assert_eq!(errors.len(), 1);
        errors[0].to_string()
    }

    #[test]
    fn a_building_is_read_with_what_is_known_of_it() {
        let properties =
            json!({"height_m": 20.5, "min_height_m": null, "name": "Hall", "levels": 5});
        let buildings = read_buildings(&collection(properties, square())).expect("valid");
        let hall = &buildings[0];
        assert_eq!(
            (hall.id.as_str(), hall.name.as_deref()),
            ("way/1", Some("Hall"))
        );
        assert_eq!(
            (hall.height_m, hall.min_height_m, &hall.extract),
            (Some(20.5), None, &None)
        );
    }

    #[test]
    fn every_fault_names_the_feature_and_the_place() {
        assert_eq!(
            refused(json!({"height_m": "12"}), square()),
            "features/0/properties/height_m (building 'way/1'): is text, not a number; remove the quotes"
        );
        assert_eq!(
            refused(json!({"height_m": -3}), square()),
            "features/0/properties/height_m (building 'way/1'): is -3 m, below ground"
        );
        assert_eq!(
            refused(json!({}), json!([[[0, 0], [1, 1], [0, 1]]])),
            "features/0/geometry/coordinates (building 'way/1'): ring 0 of polygon 0 is not closed; repeat its first position at its end"
        );
        let bow_tie = json!([[[0, 0], [1, 1], [1, 0], [0, 1], [0, 0]]]);
        assert_eq!(
            refused(json!({}), bow_tie),
            "features/0/geometry/coordinates (building 'way/1'): ring 0 of polygon 0 crosses itself"
        );
        let line = json!([[[0, 0], [1, 1], [0, 0], [0, 0]]]);
        assert_eq!(
            refused(json!({}), line),
            "features/0/geometry/coordinates (building 'way/1'): ring 0 of polygon 0 has fewer than three corners"
        );
        let hole_outside = json!([square()[0], [[2, 2], [3, 2], [3, 3], [2, 2]]]);
        assert_eq!(
            refused(json!({}), hole_outside),
            "features/0/geometry/coordinates (building 'way/1'): the holes of polygon 0 are not inside it and apart"
        );
        let swapped = json!([[[0, 151], [0, 151.1], [0.1, 151.1], [0, 151]]]);
        assert_eq!(
            refused(json!({}), swapped),
            "features/0/geometry/coordinates (building 'way/1'): ring 0 of polygon 0 has the position [0, 151], which is not a longitude and latitude"
        );
        assert_eq!(
            refused(json!({}), json!([])),
            "features/0/geometry/coordinates (building 'way/1'): has no outer ring"
        );
    }

    #[test]
    fn what_is_no_collection_is_refused_as_a_whole() {
        let message = |text: &str| read_buildings(text).expect_err("at fault")[0].to_string();
        assert!(message("{").starts_with("document: is not JSON: "));
        assert_eq!(message("[]"), "document: is an array, not an object");
        assert_eq!(
            message("{}"),
            "document: is not a GeoJSON FeatureCollection"
        );
    }
}

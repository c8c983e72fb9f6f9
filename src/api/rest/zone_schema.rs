//! The shape of a zone as GeoJSON, for the description of the API; `formats` reads and checks zones.
#![expect(
    dead_code,
    reason = "these types describe what `formats` reads, and are never made"
)]

use crate::geo::MAX_VERTICES;
use crate::wire::Stamp;
use serde::Deserialize;
use serde_json::{Value, json};
use std::borrow::Cow;
use utoipa::openapi::schema::{ArrayBuilder, ObjectBuilder, Type};
use utoipa::openapi::{Ref, RefOr, Schema};
use utoipa::{PartialSchema, ToSchema};

/// A zone: a GeoJSON feature (RFC 7946), longitude first, or metres on a planar network.
#[derive(Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub(in crate::api) struct ZoneFeature {
    r#type: FeatureType,
    /// Id of the zone; one is made where none is given. With `PUT` it is that of the path.
    #[schema(min_length = 1, max_length = 200)]
    id: Option<String>,
    geometry: ZoneGeometry,
    properties: Option<ZoneProperties>,
    /// Read and not kept: the geometry says it better.
    bbox: Option<Value>,
}

/// Always `Feature`.
#[derive(Deserialize, ToSchema)]
enum FeatureType {
    Feature,
}

/// A polygon, several, or a circle: a point whose feature has the property `radius_m`.
#[derive(Deserialize, ToSchema)]
#[serde(untagged)]
enum ZoneGeometry {
    Polygon(Polygon),
    MultiPolygon(MultiPolygon),
    Point(Point),
}

/// A polygon: its outer ring, then its holes. Rings are closed; together they have at most 1,000 vertices.
#[derive(Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
struct Polygon {
    r#type: PolygonType,
    #[schema(min_items = 1, max_items = 333)]
    coordinates: Vec<Ring>,
    bbox: Option<Value>,
}

/// Several polygons, with at most 1,000 vertices together.
#[derive(Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
struct MultiPolygon {
    r#type: MultiPolygonType,
    #[schema(min_items = 1, max_items = 333)]
    coordinates: Vec<Vec<Ring>>,
    bbox: Option<Value>,
}

/// The centre of a circle.
#[derive(Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
struct Point {
    r#type: PointType,
    coordinates: Position,
    bbox: Option<Value>,
}

/// Always `Polygon`.
#[derive(Deserialize, ToSchema)]
enum PolygonType {
    Polygon,
}

/// Always `MultiPolygon`.
#[derive(Deserialize, ToSchema)]
enum MultiPolygonType {
    MultiPolygon,
}

/// Always `Point`.
#[derive(Deserialize, ToSchema)]
enum PointType {
    Point,
}

/// Positions of which the last is the first again.
#[derive(Deserialize)]
struct Ring(Vec<Position>);

impl PartialSchema for Ring {
    fn schema() -> RefOr<Schema> {
        let ring = ArrayBuilder::new()
            .items(Ref::from_schema_name(Position::name()))
            .min_items(Some(4))
            .max_items(Some(MAX_VERTICES + 1))
            .description(Some(
                "Positions of which the last is the first again; all rings of a zone have at most 1,000 of them, the last ones not counted.",
            ));
        ring.into()
    }
}

impl ToSchema for Ring {
    fn schemas(schemas: &mut Vec<(String, RefOr<Schema>)>) {
        schemas.push((Position::name().into_owned(), Position::schema()));
    }
}

/// Longitude and latitude in degrees; metres on a planar network.
#[derive(Deserialize)]
struct Position(Vec<f64>);

impl PartialSchema for Position {
    fn schema() -> RefOr<Schema> {
        let position = ArrayBuilder::new()
            .items(ObjectBuilder::new().schema_type(Type::Number))
            .min_items(Some(2))
            .max_items(Some(2))
            .description(Some(
                "Longitude and latitude in degrees; metres on a planar network.",
            ));
        position.into()
    }
}

impl ToSchema for Position {
    // Telemetry has a `Position` of another shape, and names of schemas are one space.
    fn name() -> Cow<'static, str> {
        Cow::Borrowed("ZonePosition")
    }
}

/// What a zone is, how high and when. What is null counts as absent.
#[derive(Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
struct ZoneProperties {
    /// A name for people.
    #[schema(max_length = 10000)]
    name: Option<String>,
    /// Why it is closed.
    #[schema(max_length = 10000)]
    reason: Option<String>,
    /// Who closed it.
    #[schema(max_length = 10000)]
    authority: Option<String>,
    /// `prohibited` where none is given.
    kind: Option<ZoneKind>,
    /// Whether the drones of the network are authorized for it, or meet its conditions, so that it closes nothing; only
    /// `req_authorization` and `conditional` can be.
    authorized: Option<bool>,
    source: Option<ZoneSource>,
    /// What its feed says of it and nothing acts on, in the words of ED-318; at most 64 KiB.
    record: Option<Value>,
    /// Its lower limit in metres; without one it reaches down without end.
    lower_m: Option<f64>,
    lower_reference: Option<AltitudeReference>,
    /// Its upper limit in metres; without one it reaches up without end.
    upper_m: Option<f64>,
    upper_reference: Option<AltitudeReference>,
    /// When it counts; always where none is given.
    #[schema(max_items = 1000)]
    windows: Option<Vec<ZoneWindow>>,
    /// Radius of a circle in metres: of a `Point`, which has to have one, and of nothing else.
    #[schema(exclusive_minimum = 0, maximum = 100000)]
    radius_m: Option<f64>,
    /// How far around it segments are closed, in metres; 10 where none is given.
    #[schema(minimum = 0, maximum = 10000)]
    margin_m: Option<f64>,
}

/// From where altitudes count; above ground where none is given.
#[derive(Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
enum AltitudeReference {
    /// Above ground.
    Agl,
    /// Above mean sea level.
    Amsl,
    /// Above the ellipsoid of WGS 84.
    Wgs84,
}

/// A time in which a zone counts.
#[derive(Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
struct ZoneWindow {
    /// Its beginning, RFC 3339.
    #[schema(format = DateTime)]
    from: Option<String>,
    /// Its end, RFC 3339.
    #[schema(format = DateTime)]
    until: Option<String>,
    /// Within it the zone counts at these times alone.
    #[schema(max_items = 100)]
    schedule: Option<Vec<ZonePeriod>>,
}

/// A time of some days of the week, both ends included; what ends no later than it begins ends on the day after.
#[derive(Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
struct ZonePeriod {
    /// The days it begins on; every day where none is given.
    days: Option<Vec<ZoneDay>>,
    /// A time with its offset, such as `06:30Z` or `22:00+02:00`, or `morning_twilight`, `sunrise`, `sunset`, `evening_twilight`.
    from: String,
    /// The same.
    until: String,
}

/// A day of the week.
#[derive(Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
enum ZoneDay {
    Mon,
    Tue,
    Wed,
    Thu,
    Fri,
    Sat,
    Sun,
}

/// What a zone means for drones: the last two close nothing.
#[derive(Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
enum ZoneKind {
    /// Closed.
    Prohibited,
    /// Closed, unless `authorized`.
    ReqAuthorization,
    /// Closed, unless `authorized`.
    Conditional,
    /// U-space airspace.
    Uspace,
    /// Information.
    NoRestriction,
}

/// Where a zone was imported from.
#[derive(Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
struct ZoneSource {
    /// The name of the feed.
    #[schema(max_length = 200)]
    feed: String,
    /// Its identifier there.
    #[schema(max_length = 200)]
    id: String,
}

/// A page of zones: a GeoJSON feature collection.
#[derive(Deserialize, ToSchema)]
pub(in crate::api) struct ZoneCollection {
    r#type: CollectionType,
    /// The zones, by id.
    features: Vec<ZoneFeature>,
    /// The version of each zone, in their order, for `If-Match`.
    etags: Vec<String>,
    /// Where the next page begins; absent on the last.
    next_page_token: Option<String>,
    /// The world of this answer.
    #[serde(flatten)]
    stamp: Stamp<'static>,
}

/// Always `FeatureCollection`.
#[derive(Deserialize, ToSchema)]
enum CollectionType {
    FeatureCollection,
}

/// A zone around Customs House in Sydney.
pub(in crate::api) fn example() -> Value {
    let mut feature = example_without_id();
    feature["id"] = json!("harbour-concert");
    feature
}

/// The same for an id that the path has.
pub(in crate::api) fn example_without_id() -> Value {
    json!({
        "type": "Feature",
        "geometry": {"type": "Point", "coordinates": [151.2108551, -33.862204]},
        "properties": {
            "name": "Concert",
            "reason": "crowd",
            "radius_m": 60,
            "lower_m": 0,
            "upper_m": 120,
            "upper_reference": "agl",
            "margin_m": 10,
        },
    })
}

//! Zones as ED-318: one feature for each identifier, with its volumes as layers.
//!
//! Written strictly after the published schemas. What they have no word for is kept below
//! `extendedProperties`: the identifier where it is longer than one may be, the margin, and a class
//! of U-space. Identifier and margin are read back.

use super::extended::{EXTENDED, Identifier, MARGIN, identifiers};
use super::{FeedFormat, check_frame};
use crate::airspace::{DailyPeriod, DayTime, Recurrence, Window, Zone, ZoneGeometry, ZoneKind};
use crate::geo::{Altitude, AltitudeReference, Frame};
use crate::zones::{DAYS, ZoneProblem, clock_text, record_of};
use rustc_hash::FxHashMap;
use serde_json::{Map, Value, json};

/// The longest text, in characters.
const TEXT_MAX: usize = 200;
/// The code of a country that is not stated: ISO 3166-1 leaves it to its users.
const NO_COUNTRY: &str = "ZZZ";
const REASONS: [&str; 9] = [
    "AIR_TRAFFIC",
    "SENSITIVE",
    "PRIVACY",
    "POPULATION",
    "NATURE",
    "NOISE",
    "EMERGENCY",
    "DAR",
    "OTHER",
];

/// Zones as the text of an ED-318 collection; those of one identifier of one feed are the volumes
/// of one zone.
///
/// # Errors
/// When their coordinates, as `frame` says, are no longitudes and latitudes.
pub fn write_ed318<'z>(
    zones: impl IntoIterator<Item = &'z Zone>,
    frame: &Frame,
) -> Result<String, ZoneProblem> {
    check_frame(FeedFormat::Ed318, frame)?;
    let mut order: Vec<Vec<&Zone>> = Vec::new();
    let mut places: FxHashMap<(String, String), usize> = FxHashMap::default();
    for zone in zones {
        let Some(source) = &zone.terms().source else {
            order.push(vec![zone]);
            continue;
        };
        let key = (source.feed.clone(), source.id.clone());
        let same = places.get(&key).copied();
        match same.filter(|place| is_one_zone(order[*place][0], zone)) {
            Some(place) => order[place].push(zone),
            None => {
                places.insert(key, order.len());
                order.push(vec![zone]);
            }
        }
    }
    let firsts: Vec<&Zone> = order.iter().map(|volumes| volumes[0]).collect();
    let features: Vec<String> = order
        .iter()
        .zip(identifiers(&firsts))
        .map(|(volumes, identifier)| feature(volumes, identifier).to_string())
        .collect();
    Ok(format!(
        "{{\"type\":\"FeatureCollection\",\"name\":\"zones\",\"features\":[\n{}\n]}}\n",
        features.join(",\n")
    ))
}

/// Whether two volumes of one identifier mean the same, so that one feature can say both.
fn is_one_zone(one: &Zone, other: &Zone) -> bool {
    one.terms() == other.terms()
        && one.plain_windows() == other.plain_windows()
        && one.margin_m() == other.margin_m()
}

fn feature(volumes: &[&Zone], identifier: Identifier<'_>) -> Value {
    let mut shapes: Vec<Value> = volumes.iter().flat_map(|zone| shapes_of(zone)).collect();
    let geometry = match shapes.len() {
        1 => shapes.remove(0),
        _ => json!({"type": "GeometryCollection", "geometries": shapes}),
    };
    json!({"type": "Feature", "geometry": geometry, "properties": properties(volumes[0], identifier)})
}

fn properties(zone: &Zone, identifier: Identifier<'_>) -> Map<String, Value> {
    let mut record = record_of(zone.terms()).unwrap_or_default();
    let mut extended = match record.remove(EXTENDED) {
        Some(Value::Object(extended)) => extended,
        _ => Map::new(),
    };
    let Identifier { full, short } = identifier;
    if full != short {
        extended.insert("identifier".to_owned(), json!(full));
    }
    extended.insert(MARGIN.to_owned(), json!(zone.margin_m()));
    for name in ["uSpaceClass", "dataSource"] {
        if let Some(value) = record.remove(name) {
            extended.insert(name.to_owned(), value);
        }
    }
    let country = record.get("country").and_then(Value::as_str);
    let country = country
        .filter(|code| code.chars().count() == 3)
        .unwrap_or(NO_COUNTRY);
    let variant = record.get("variant").and_then(Value::as_str);
    let mut told = Map::new();
    told.insert("identifier".to_owned(), json!(short));
    told.insert("country".to_owned(), json!(country));
    told.insert("type".to_owned(), json!(kind_code(zone.terms().kind)));
    let variant = variant
        .filter(|variant| *variant == "CUSTOMIZED")
        .unwrap_or("COMMON");
    told.insert("variant".to_owned(), json!(variant));
    put_texts(&record, zone, &mut told, &mut extended);
    put_reasons(&record, zone, &mut told, &mut extended);
    for name in ["restrictionConditions", "region", "regulationExemption"] {
        if let Some(value) = record.get(name) {
            told.insert(name.to_owned(), value.clone());
        }
    }
    told.insert("zoneAuthority".to_owned(), authorities(&record, zone));
    if let Some(periods) = limited_applicability(zone) {
        told.insert("limitedApplicability".to_owned(), periods);
    }
    told.insert(EXTENDED.to_owned(), Value::Object(extended));
    told
}

fn kind_code(kind: ZoneKind) -> &'static str {
    match kind {
        ZoneKind::Prohibited => "PROHIBITED",
        ZoneKind::ReqAuthorization => "REQ_AUTHORIZATION",
        ZoneKind::Conditional => "CONDITIONAL",
        ZoneKind::Uspace => "USPACE",
        ZoneKind::NoRestriction => "NO_RESTRICTION",
    }
}

/// Names and messages; one that is longer than the standard allows is cut, and whole below
/// `extendedProperties`.
fn put_texts(
    record: &Map<String, Value>,
    zone: &Zone,
    told: &mut Map<String, Value>,
    extended: &mut Map<String, Value>,
) {
    for name in ["name", "message", "otherReasonInfo"] {
        let own = zone.name().filter(|_| name == "name");
        let Some(texts) = record
            .get(name)
            .cloned()
            .or_else(|| own.map(|own| json!([{"text": own}])))
        else {
            continue;
        };
        let is_long = |text: &Value| {
            let text = text.get("text").and_then(Value::as_str).unwrap_or_default();
            text.chars().count() > TEXT_MAX
        };
        let listed = texts.as_array().cloned().unwrap_or_default();
        if listed.iter().any(is_long) {
            extended.insert(name.to_owned(), texts);
        }
        let cut = listed.into_iter().map(|mut text| {
            if let Some(Value::String(words)) = text.get_mut("text") {
                *words = words.chars().take(TEXT_MAX).collect();
            }
            text
        });
        told.insert(name.to_owned(), Value::Array(cut.collect()));
    }
}

/// The reasons of the feed; words that people wrote here are no codes, and stand in
/// `otherReasonInfo`.
fn put_reasons(
    record: &Map<String, Value>,
    zone: &Zone,
    told: &mut Map<String, Value>,
    extended: &mut Map<String, Value>,
) {
    if let Some(Value::Array(reasons)) = record.get("reason") {
        let words = reasons.iter().filter_map(Value::as_str);
        let (mut known, others): (Vec<&str>, Vec<&str>) =
            words.partition(|word| REASONS.contains(word));
        if !others.is_empty() {
            extended.insert("reason".to_owned(), json!(reasons));
            known.push("OTHER");
        }
        known.sort_unstable();
        known.dedup();
        told.insert("reason".to_owned(), json!(known));
        return;
    }
    let Some(reason) = zone.reason() else {
        return;
    };
    let cut: String = reason.chars().take(TEXT_MAX).collect();
    told.insert("reason".to_owned(), json!(["OTHER"]));
    told.entry("otherReasonInfo".to_owned())
        .or_insert(json!([{"text": cut}]));
}

/// Each authority with its purpose, which the standard asks for.
fn authorities(record: &Map<String, Value>, zone: &Zone) -> Value {
    let purpose = match zone.terms().kind {
        ZoneKind::ReqAuthorization => "AUTHORIZATION",
        _ => "INFORMATION",
    };
    let stated = record.get("zoneAuthority").and_then(Value::as_array);
    let stated = stated.cloned().unwrap_or_default();
    if stated.is_empty() {
        let name: String = zone
            .authority()
            .unwrap_or("unknown")
            .chars()
            .take(TEXT_MAX)
            .collect();
        return json!([{"name": [{"text": name}], "purpose": purpose}]);
    }
    let with_purpose = stated.into_iter().map(|mut authority| {
        if let Some(members) = authority.as_object_mut() {
            members.entry("purpose").or_insert(json!(purpose));
        }
        authority
    });
    Value::Array(with_purpose.collect())
}

fn limited_applicability(zone: &Zone) -> Option<Value> {
    let plain = zone
        .plain_windows()
        .iter()
        .map(|window| period(window, None));
    let schedules = zone.terms().schedules.iter();
    let recurring = schedules.map(|schedule| period(&schedule.within, Some(schedule)));
    let periods: Vec<Value> = plain.chain(recurring).collect();
    (!periods.is_empty()).then_some(Value::Array(periods))
}

fn period(within: &Window, schedule: Option<&Recurrence>) -> Value {
    let mut members = Map::new();
    let ends = [
        ("startDateTime", within.from()),
        ("endDateTime", within.until()),
    ];
    for (name, instant) in ends {
        if let Some(instant) = instant {
            members.insert(name.to_owned(), json!(instant.to_string()));
        }
    }
    if let Some(schedule) = schedule {
        let periods = schedule.periods.iter().map(daily).collect();
        members.insert("schedule".to_owned(), Value::Array(periods));
    }
    Value::Object(members)
}

fn daily(period: &DailyPeriod) -> Value {
    let days: Vec<String> = DAYS
        .iter()
        .filter(|(_, day)| period.days.contains(*day))
        .map(|(name, _)| name.to_ascii_uppercase())
        .collect();
    let days = match days.len() {
        7 => vec!["ANY".to_owned()],
        _ => days,
    };
    let mut members = Map::from_iter([("day".to_owned(), json!(days))]);
    for (end, time) in [("start", period.from), ("end", period.until)] {
        let (name, text) = match time {
            DayTime::Clock { time, offset } => (format!("{end}Time"), clock_text(time, offset)),
            DayTime::Sun(event) => (format!("{end}Event"), event.code().to_owned()),
        };
        members.insert(name, json!(text));
    }
    Value::Object(members)
}

/// The shapes of a zone; the standard has no MultiPolygon.
fn shapes_of(zone: &Zone) -> Vec<Value> {
    let layer = layer(zone);
    let polygon = |rings: &Vec<Vec<[f64; 2]>>| json!({"type": "Polygon", "coordinates": rings, "layer": layer});
    match zone.geometry() {
        ZoneGeometry::Polygon(rings) => vec![polygon(rings)],
        ZoneGeometry::MultiPolygon(polygons) => polygons.iter().map(polygon).collect(),
        ZoneGeometry::Circle { centre, radius_m } => vec![json!({
            "type": "Point",
            "coordinates": centre,
            "extent": {"subType": "Circle", "radius": radius_m},
            "layer": layer,
        })],
    }
}

fn layer(zone: &Zone) -> Value {
    let mut layer = Map::new();
    let band = zone.band();
    for (end, limit) in [("upper", band.upper), ("lower", band.lower)] {
        if let Some(Altitude { value_m, reference }) = limit {
            let reference = match reference {
                AltitudeReference::Agl => "AGL",
                AltitudeReference::Amsl => "AMSL",
                AltitudeReference::Wgs84 => "WGS84",
            };
            layer.insert(end.to_owned(), json!(value_m));
            layer.insert(format!("{end}Reference"), json!(reference));
        }
    }
    layer.insert("uom".to_owned(), json!("m"));
    Value::Object(layer)
}

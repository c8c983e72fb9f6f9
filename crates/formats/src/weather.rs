//! The weather as it is stated, as the wind that drones fly in.

use crate::flight::{Wind, WindField, WindPatch};
use crate::geo::{Frame, PreparedShape};
use crate::wire;
use crate::zones::{ZoneId, zone_from_feature};
use jiff::Timestamp;
use serde_json::{Value, json};
use std::sync::Arc;

/// The wind over a network: as the weather states it, and `base` where and when it states nothing.
///
/// `zero` is second 0 of the flights. Weather has been checked before it was kept; what of it cannot be read all the same, as a
/// network that has changed may make of an area, is passed over.
pub fn wind_field(weather: Option<&str>, base: Wind, frame: &Frame, zero: Timestamp) -> WindField {
    let stated = weather.and_then(|text| serde_json::from_str::<wire::Weather>(text).ok());
    let stated = stated.unwrap_or_default();
    let patches = stated.wind.iter();
    WindField {
        base,
        patches: patches
            .filter_map(|wind| patch(wind, frame, zero))
            .collect(),
    }
}

fn patch(wind: &wire::Wind, frame: &Frame, zero: Timestamp) -> Option<WindPatch> {
    let seconds = |text: &str| {
        let instant: Timestamp = text.parse().ok()?;
        Some(instant.duration_since(zero).as_secs_f64())
    };
    let area = match &wind.area {
        Some(area) => Some(Arc::new(shape(area, frame)?)),
        None => None,
    };
    Some(WindPatch {
        area,
        from_s: seconds(&wind.from)?,
        until_s: seconds(&wind.until)?,
        wind: Wind::coming_from(wind.from_deg, wind.speed_mps),
    })
}

/// An area is the geometry of a zone without a circle.
fn shape(area: &Value, frame: &Frame) -> Option<PreparedShape> {
    let feature = json!({"type": "Feature", "geometry": area, "properties": {"margin_m": 0}});
    let zone = zone_from_feature(&feature, ZoneId::Fixed("area"), frame).ok()?;
    Some(zone.shape().clone())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geo::Point;

    #[test]
    fn wind_blows_where_and_when_it_is_stated() {
        let frame = Frame::Planar;
        let zero: Timestamp = "2026-11-27T12:00:00Z".parse().expect("a time");
        let weather = json!({"wind": [
            {"from": "2026-11-27T12:10:00Z", "until": "2026-11-27T12:20:00Z", "speed_mps": 5, "from_deg": 90},
            {"area": {"type": "Polygon", "coordinates": [[[0, 0], [100, 0], [100, 100], [0, 100], [0, 0]]]},
                "from": "2026-11-27T11:00:00Z", "until": "2026-11-27T12:20:00Z", "speed_mps": 8, "from_deg": 180},
        ]});
        let base = Wind::coming_from(0.0, 1.0);
        let field = wind_field(Some(&weather.to_string()), base, &frame, zero);
        let speeds = |from: [f64; 2], to: [f64; 2], entered_s: f64| {
            let [from, to] = [from, to].map(|[x, y]| Point::new(x, y));
            let winds = field.on_leg(from, to, entered_s);
            let speeds = winds.iter().map(|wind| wind.speed_mps().round());
            speeds.collect::<Vec<_>>()
        };
        assert_eq!(speeds([500.0, 0.0], [900.0, 0.0], 0.0), [1.0]);
        assert_eq!(speeds([500.0, 0.0], [900.0, 0.0], 600.0), [5.0]);
        assert_eq!(speeds([50.0, 50.0], [900.0, 0.0], 600.0), [8.0]);
        assert_eq!(speeds([50.0, 50.0], [900.0, 0.0], 1200.0), [1.0]);
        let local = field.on_leg(Point::new(9.0, 9.0), Point::new(8.0, 8.0), 0.0);
        // From the south means towards the north.
        assert!(local[0].north_mps > 7.9 && local[0].east_mps.abs() < 1e-9);
    }

    #[test]
    fn without_a_word_the_base_blows() {
        let zero = Timestamp::UNIX_EPOCH;
        let base = Wind::coming_from(225.0, 7.0);
        let field = wind_field(None, base, &Frame::Planar, zero);
        assert!(field.patches.is_empty() && field.base == base);
    }
}

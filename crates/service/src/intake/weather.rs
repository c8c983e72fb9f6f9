//! Weather as operators send it: wind, for the whole network or by area and time.

use super::fields::Faults;
use crate::formats::{ZoneId, zone_from_feature};
use crate::geo::Frame;
use crate::refusal::{Code, Refusal};
use crate::wire::{Weather, Wind};
use serde_json::json;

/// At most this many statements about wind.
const WINDS_MAX: usize = 1_000;
/// More than any wind that was ever measured near the ground, in metres per second.
const SPEED_MAX_MPS: f64 = 120.0;

/// Checks weather for a network whose coordinates `frame` says.
///
/// # Errors
/// Everything wrong with it.
pub fn read_weather(weather: &Weather, frame: &Frame) -> Result<(), Refusal> {
    let mut faults = Faults::default();
    if weather.wind.len() > WINDS_MAX {
        let count = weather.wind.len();
        let message = format!("{count} statements about wind, more than {WINDS_MAX}");
        faults.add("too_many_winds", "/wind", message, None);
        return Err(faults.refusal(Code::WeatherInvalid, "weather"));
    }
    for (place, wind) in weather.wind.iter().enumerate() {
        check_wind(&format!("/wind/{place}"), wind, frame, &mut faults);
    }
    faults.check(Code::WeatherInvalid, "weather")
}

fn check_wind(place: &str, wind: &Wind, frame: &Frame, faults: &mut Faults) {
    let speed = Some(wind.speed_mps);
    faults.number(&format!("{place}/speed_mps"), speed, 0.0, SPEED_MAX_MPS);
    let from_deg = Some(wind.from_deg);
    faults.number(&format!("{place}/from_deg"), from_deg, 0.0, 360.0);
    let from = faults.instant(&format!("{place}/from"), Some(&wind.from));
    let until_place = format!("{place}/until");
    let until = faults.instant(&until_place, Some(&wind.until));
    if let (Some(from), Some(until)) = (from, until)
        && until <= from
    {
        let message = format!("the wind ends at {until}, not after it begins at {from}");
        faults.add("window_reversed", &until_place, message, None);
    }
    check_area(place, wind, frame, faults);
}

/// An area is the geometry of a zone without a circle, and is judged as one.
fn check_area(place: &str, wind: &Wind, frame: &Frame, faults: &mut Faults) {
    let Some(area) = &wind.area else {
        return;
    };
    let feature = json!({"type": "Feature", "geometry": area, "properties": {"margin_m": 0}});
    let Err(problems) = zone_from_feature(&feature, ZoneId::Fixed("area"), frame) else {
        return;
    };
    for problem in problems {
        let within = problem.pointer.strip_prefix("/geometry");
        let pointer = format!("{place}/area{}", within.unwrap_or_default());
        faults.add(problem.code, &pointer, problem.message, problem.hint);
    }
}

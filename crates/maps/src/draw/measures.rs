//! Measures: coordinates along the frame, the scale bar, and the round numbers of both.

use super::style::{FRAME, INK, QUIET_INK, SMALL_LETTER_PX};
use super::svg::{Document, PathData, Px, Spot};
use super::view::View;
use crate::geo::{Bounds, Frame};

/// The scale bar is at most this share of the map's width, and at most this wide.
const SCALE_SHARE: f64 = 0.2;
const MAX_SCALE_PX: f64 = 130.0;
/// About how many coordinates are written along a side of the map.
const COORDINATES_PER_SIDE: f64 = 5.0;

/// Writes coordinates as the network's file has them, along the foot and the left side of the frame.
pub(super) fn draw_coordinates(frame: &Frame, view: &View, map: Spot, document: &mut Document) {
    let mut ticks = PathData::default();
    document.open(
        "g",
        format_args!("font-size=\"{SMALL_LETTER_PX}\" fill=\"{QUIET_INK}\" text-anchor=\"middle\""),
    );
    let foot = map.y + view.height_px;
    for (words, along) in coordinates(frame, view, 0) {
        let at = Spot::new(map.x + along.x, foot);
        ticks.add([at, at.moved(0.0, 4.0)], false);
        let (x, y) = (Px(at.x), Px(at.y + 13.0));
        document.words("text", format_args!("x=\"{x}\" y=\"{y}\""), &words);
    }
    for (words, along) in coordinates(frame, view, 1) {
        let at = Spot::new(map.x, map.y + along.y);
        ticks.add([at, at.moved(-4.0, 0.0)], false);
        let (x, y) = (Px(at.x - 7.0), Px(at.y));
        document.words(
            "text",
            format_args!("transform=\"translate({x} {y}) rotate(-90)\""),
            &words,
        );
    }
    document.close();
    document.path(
        &ticks,
        format_args!("fill=\"none\" stroke=\"{FRAME}\" stroke-width=\"0.8\""),
    );
}

/// Round coordinates along an axis, each with where it lies on the map.
fn coordinates(frame: &Frame, view: &View, axis: usize) -> Vec<(String, Spot)> {
    let Bounds { min, max } = view.bounds;
    let (low, high) = (frame.from_plane(min), frame.from_plane(max));
    let Some((step, decimals)) = round_step((high[axis] - low[axis]) / COORDINATES_PER_SIDE) else {
        return Vec::new();
    };
    let first = (low[axis] / step).ceil();
    let count = ((high[axis] / step).floor() - first).clamp(-1.0, 20.0) as i32 + 1;
    let tick = |index: i32| {
        // Adding 0 takes the sign off a negative 0.
        let value = (first + f64::from(index)) * step + 0.0;
        let mut coordinates = low;
        coordinates[axis] = value;
        let place = view.place(frame.to_plane(coordinates));
        let words = match frame.is_geographic() {
            true => degrees(value, decimals, axis),
            false => format!("{} m", grouped_with_decimals(value, decimals)),
        };
        (words, place)
    };
    // A coordinate in a corner would be cut off.
    let has_room = |place: &Spot| match axis {
        0 => place.x > 25.0 && place.x < view.width_px - 25.0,
        _ => place.y > 25.0 && place.y < view.height_px - 25.0,
    };
    let ticks = (0..count).map(tick);
    ticks.filter(|(_, place)| has_room(place)).collect()
}

/// Draws a scale bar that ends at a spot.
pub(super) fn draw_scale(right: Spot, view: &View, document: &mut Document) {
    let longest_px = (view.width_px * SCALE_SHARE).min(MAX_SCALE_PX);
    let Some((length_m, decimals)) = round_length(longest_px / view.px_per_m) else {
        return;
    };
    let width_px = view.pixels(length_m);
    let left = right.moved(-width_px, 0.0);
    let ends = [left.moved(0.0, -4.0), left, right, right.moved(0.0, -4.0)];
    document.path(
        &PathData::through(ends, false),
        format_args!("fill=\"none\" stroke=\"{INK}\" stroke-width=\"1.4\""),
    );
    let words = match length_m >= 1_000.0 {
        true => format!("{} km", grouped(length_m / 1_000.0)),
        false => format!("{length_m:.decimals$} m"),
    };
    let (x, y) = (Px(left.x + width_px / 2.0), Px(right.y - 6.0));
    document.words(
        "text",
        format_args!("x=\"{x}\" y=\"{y}\" text-anchor=\"middle\""),
        &words,
    );
}

/// The largest of 1, 2 and 5 times a power of ten that is not above a length, with the decimals it needs.
fn round_length(longest: f64) -> Option<(f64, usize)> {
    let (power, exponent) = power_of_ten(longest)?;
    let fits = |factor: &f64| factor * power <= longest;
    let factor = [5.0, 2.0].into_iter().find(fits).unwrap_or(1.0);
    Some((factor * power, decimals(exponent)))
}

/// The smallest such number that is not below a length.
fn round_step(shortest: f64) -> Option<(f64, usize)> {
    let (power, exponent) = power_of_ten(shortest)?;
    let reaches = |factor: &f64| factor * power >= shortest;
    match [1.0, 2.0, 5.0].into_iter().find(reaches) {
        Some(factor) => Some((factor * power, decimals(exponent))),
        None => Some((10.0 * power, decimals(exponent + 1))),
    }
}

/// The largest power of ten that is not above a length, and its exponent.
fn power_of_ten(length: f64) -> Option<(f64, i32)> {
    if !(length.is_finite() && length > 1e-6) {
        return None;
    }
    let mut exponent = length.log10().floor() as i32;
    // The logarithm may be off by a hair at a power of ten.
    if 10_f64.powi(exponent) > length {
        exponent -= 1;
    }
    Some((10_f64.powi(exponent), exponent))
}

fn decimals(exponent: i32) -> usize {
    usize::try_from(-exponent).unwrap_or(0)
}

fn degrees(value: f64, decimals: usize, axis: usize) -> String {
    let side = match (axis, value < 0.0) {
        _ if value == 0.0 => "",
        (0, false) => " E",
        (0, true) => " W",
        (_, false) => " N",
        (_, true) => " S",
    };
    format!("{:.decimals$}°{side}", value.abs())
}

fn grouped_with_decimals(value: f64, decimals: usize) -> String {
    match decimals {
        0 => grouped(value),
        _ => format!("{value:.decimals$}"),
    }
}

/// A number without decimals, its thousands apart.
pub(super) fn grouped(number: f64) -> String {
    let digits = format!("{:.0}", number.abs());
    let sign = if number < 0.0 && digits != "0" {
        "-"
    } else {
        ""
    };
    let mut text = sign.to_owned();
    for (index, digit) in digits.chars().enumerate() {
        if index > 0 && (digits.len() - index).is_multiple_of(3) {
            text.push(',');
        }
        text.push(digit);
    }
    text
}

#[cfg(test)]
mod tests {
    use super::grouped;

    #[test]
    fn thousands_stand_apart() {
        let numbers = [-0.4, 999.6, -1234.0, 1_234_567.0];
        assert_eq!(numbers.map(grouped), ["0", "1,000", "-1,234", "1,234,567"]);
    }
}

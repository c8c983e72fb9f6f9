//! What charts are drawn with: sizes and colours, marks with their words, and what a figure holds.

use super::length::px;
use super::look::Look;
use crate::evaluate::record::{Figure, PaperMark, Point, Series};
use crate::evaluate::report::numbers;
use maud::{Markup, Render, html};

/// Width of a picture, in its own units.
pub(super) const WIDTH: f64 = 580.0;
/// Free space at the borders.
pub(super) const BORDER: f64 = 14.0;
/// Height of letters.
pub(super) const LETTER: f64 = 12.5;
pub(super) const INK: &str = "#1f2328";
pub(super) const QUIET: &str = "#57606a";
pub(super) const GRID: &str = "#dfe3e8";

/// What is drawn below the legend, and how far down it reaches.
pub(super) struct Chart {
    pub(super) markup: Markup,
    pub(super) bottom: f64,
}

pub(super) fn points(figure: &Figure) -> impl Iterator<Item = (&Series, &Point)> {
    let series = figure.series.iter();
    series.flat_map(|series| series.points.iter().map(move |point| (series, point)))
}

/// All values the vertical axis has to reach: intervals, spreads, what the paper says and the line to compare with.
pub(super) fn values(figure: &Figure) -> impl Iterator<Item = f64> {
    let reference = figure.reference.iter().map(|reference| reference.y);
    points(figure)
        .flat_map(|(_, point)| {
            [
                point.low,
                point.y,
                point.high,
                point.spread[0],
                point.spread[1],
            ]
        })
        .chain(figure.marks.iter().map(|mark| mark.y))
        .chain(reference)
}

/// What the paper says of a series, as a cross in its colour.
pub(super) fn paper_mark(look: Option<&Look>, mark: &PaperMark, (x, y): (f64, f64)) -> Markup {
    let (class, colour) = look.map_or(("plot-ink", INK), |look| (look.class, look.colour));
    let tip = format!("{}, the paper: {}", mark.series, numbers::plain(mark.y));
    html! {
        g class=(class) color=(colour) {
            path d={ "M" (px(x - 4.5)) " " (px(y - 4.5)) "l9 9m0 -9l-9 9" } fill="none" stroke="currentColor"
                stroke-width="2.4" { desc { (Words(&tip)) } }
        }
    }
}

/// The look of the series that a mark is said of.
pub(super) fn look_of<'a>(
    figure: &Figure,
    looks: &'a [Look],
    mark: &PaperMark,
) -> Option<&'a Look> {
    let place = figure
        .series
        .iter()
        .position(|series| series.name == mark.series);
    place.and_then(|place| looks.get(place))
}

/// A mark, with what it stands for as a tooltip.
pub(super) fn mark(look: &Look, (x, y): (f64, f64), tip: &str) -> Markup {
    let fill = if look.is_hollow {
        "#ffffff"
    } else {
        "currentColor"
    };
    html! {
        path class=[look.is_hollow.then_some("plot-hollow")] d=(look.outline(x, y)) fill=(fill) stroke="currentColor" stroke-width="1.4"
            stroke-linejoin="round" {
            @if !tip.is_empty() { title { (Words(tip)) } }
        }
    }
}

/// What a point says in words.
pub(super) fn tip(series: &Series, point: &Point, place: &str) -> String {
    let value = numbers::plain(point.y);
    let interval = numbers::interval(point.low, point.high);
    let cases = numbers::count(point.cases);
    format!(
        "{}, {place}: {value} {interval}, {cases} cases",
        series.name
    )
}

/// Words that may come from a file: what XML 1.0 cannot hold becomes U+FFFD.
pub(super) struct Words<'a>(pub(super) &'a str);

impl Render for Words<'_> {
    fn render_to(&self, out: &mut String) {
        let clean = |letter: char| match letter {
            '\t' | '\n' | '\r' => ' ',
            '\u{0}'..='\u{1f}' | '\u{fffe}' | '\u{ffff}' => '\u{fffd}',
            _ => letter,
        };
        let words: String = self.0.chars().map(clean).collect();
        words.render_to(out);
    }
}

/// About how wide words are, on the safe side.
pub(super) fn width(words: &str, letter: f64) -> f64 {
    let ems: f64 = words
        .chars()
        .map(|letter| match letter {
            'i' | 'j' | 'l' | 'I' | '.' | ',' | ':' | ';' | '\'' | '|' | '!' => 0.29,
            ' ' | 'f' | 'r' | 't' | '-' | '(' | ')' | '[' | ']' | '/' => 0.4,
            'm' | 'w' | 'M' | 'W' | '%' | '\u{2192}' => 0.9,
            'A'..='Z' => 0.72,
            _ => 0.64,
        })
        .sum();
    ems * letter
}

/// Words in lines no wider than `most`, broken at spaces.
pub(super) fn wrapped(words: &str, letter: f64, most: f64) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for word in words.split_whitespace() {
        match lines.last_mut() {
            Some(line)
                if width(line, letter) + width(" ", letter) + width(word, letter) <= most =>
            {
                line.push(' ');
                line.push_str(word);
            }
            _ => lines.push(word.to_owned()),
        }
    }
    lines
}

//! A figure as a chart in SVG: lines over a measured variable, or rows of dots over categories.
//!
//! Each picture has its title, its legend above the data and the names of its axes, so that it can stand alone. Text is
//! text. Colours are attributes with classes beside them: programs that know no style sheets show the picture as
//! it is, and a page can give it other colours in the dark.

mod axis;
mod dots;
mod lines;
mod look;
mod top;

use crate::evaluate::record::{Figure, PaperMark, Point, Scale, Series};
use look::{Look, looks};
use maud::{Markup, Render, html};
use std::fmt::{Display, Formatter};
use thiserror::Error;
use top::Top;

#[cfg(test)]
pub(super) use look::classes;

/// Width of a picture, in its own units.
const WIDTH: f64 = 580.0;
/// Free space at the borders.
const BORDER: f64 = 14.0;
/// Height of letters.
const LETTER: f64 = 12.5;
const FONTS: &str =
    "system-ui, 'Segoe UI', Roboto, Helvetica, Arial, 'Liberation Sans', sans-serif";
const INK: &str = "#1f2328";
const QUIET: &str = "#57606a";
const GRID: &str = "#dfe3e8";

/// Why a figure cannot be drawn.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum PlotError {
    /// It has no point.
    #[error("figure {slug} has no points; measure at least one case that it shows")]
    Empty {
        /// The figure.
        slug: String,
    },
    /// A coordinate is not a number, or has no place on its axis.
    #[error("figure {slug}, series {series}: the point ({x}, {y}) has no place on {axis}")]
    NoPlace {
        /// The figure.
        slug: String,
        /// The series.
        series: String,
        /// The horizontal coordinate.
        x: f64,
        /// The vertical coordinate.
        y: f64,
        /// The axis, with its kind.
        axis: &'static str,
    },
    /// Values are asked to be categories.
    #[error(
        "figure {slug}: values on the vertical axis cannot be categories; make it linear or log"
    )]
    CategoriesUpright {
        /// The figure.
        slug: String,
    },
}

/// Draws a figure as an SVG document of its own.
///
/// # Errors
/// [`PlotError`] where the figure has no points, or points without a place on its axes.
pub fn plot(figure: &Figure) -> Result<String, PlotError> {
    check(figure)?;
    let looks = looks(&figure.series);
    let top = Top::new(figure, &looks);
    let chart = match &figure.x.scale {
        Scale::Categories(names) => dots::chart(figure, names, &looks, top.bottom),
        Scale::Linear | Scale::Log => lines::chart(figure, &looks, top.bottom),
    };
    let view = format!("0 0 {} {}", px(WIDTH), px(chart.bottom));
    let document = html! {
        svg xmlns="http://www.w3.org/2000/svg" class="plot" role="img" viewBox=(view) width=(px(WIDTH))
            height=(px(chart.bottom)) font-family=(FONTS) font-size=(px(LETTER)) {
            title { (Words(&figure.title)) }
            desc { (Words(&figure.caption)) }
            g class="plot-card" color="#ffffff" {
                rect width="100%" height="100%" fill="currentColor" {}
            }
            (top.markup)
            (chart.markup)
        }
    };
    Ok(document.into_string() + "\n")
}

/// What is drawn below the legend, and how far down it reaches.
struct Chart {
    markup: Markup,
    bottom: f64,
}

fn check(figure: &Figure) -> Result<(), PlotError> {
    let slug = || figure.slug.clone();
    if matches!(figure.y.scale, Scale::Categories(_)) {
        return Err(PlotError::CategoriesUpright { slug: slug() });
    }
    let mut is_empty = true;
    for (series, point) in points(figure) {
        let Point {
            x, y, low, high, ..
        } = *point;
        let missing = |axis| PlotError::NoPlace {
            slug: slug(),
            series: series.name.clone(),
            x,
            y,
            axis,
        };
        let [first, third] = point.spread;
        if ![x, y, low, high, first, third]
            .into_iter()
            .all(f64::is_finite)
        {
            return Err(missing("any axis, as its interval is not finite"));
        }
        let has_place = match &figure.x.scale {
            Scale::Linear => true,
            Scale::Log => x > 0.0,
            Scale::Categories(names) => x.fract() == 0.0 && (0.0..names.len() as f64).contains(&x),
        };
        if !has_place {
            return Err(missing(
                "its horizontal axis, which is logarithmic or of categories",
            ));
        }
        if figure.y.scale == Scale::Log && y <= 0.0 {
            return Err(missing("its vertical axis, which is logarithmic"));
        }
        is_empty = false;
    }
    match is_empty {
        true => Err(PlotError::Empty { slug: slug() }),
        false => Ok(()),
    }
}

fn points(figure: &Figure) -> impl Iterator<Item = (&Series, &Point)> {
    let series = figure.series.iter();
    series.flat_map(|series| series.points.iter().map(move |point| (series, point)))
}

/// All values the vertical axis has to reach: intervals, spreads, what the paper says and the line to compare with.
fn values(figure: &Figure) -> impl Iterator<Item = f64> {
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
fn paper_mark(look: Option<&Look>, mark: &PaperMark, (x, y): (f64, f64)) -> Markup {
    let (class, colour) = look.map_or(("plot-ink", INK), |look| (look.class, look.colour));
    let tip = format!(
        "{}, the paper: {}",
        mark.series,
        super::numbers::plain(mark.y)
    );
    html! {
        g class=(class) color=(colour) {
            path d={ "M" (px(x - 4.5)) " " (px(y - 4.5)) "l9 9m0 -9l-9 9" } fill="none" stroke="currentColor"
                stroke-width="2.4" { desc { (Words(&tip)) } }
        }
    }
}

/// The look of the series that a mark is said of.
fn look_of<'a>(figure: &Figure, looks: &'a [Look], mark: &PaperMark) -> Option<&'a Look> {
    let place = figure
        .series
        .iter()
        .position(|series| series.name == mark.series);
    place.and_then(|place| looks.get(place))
}

/// A mark, with what it stands for as a tooltip.
fn mark(look: &Look, (x, y): (f64, f64), tip: &str) -> Markup {
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
fn tip(series: &Series, point: &Point, place: &str) -> String {
    let value = super::numbers::plain(point.y);
    let interval = super::numbers::interval(point.low, point.high);
    let cases = super::numbers::count(point.cases);
    format!(
        "{}, {place}: {value} {interval}, {cases} cases",
        series.name
    )
}

/// A length or place in a picture: one decimal, none where it is 0.
fn px(pixels: f64) -> Px {
    Px(pixels)
}

#[derive(Clone, Copy, Debug)]
struct Px(f64);

impl Display for Px {
    fn fmt(&self, formatter: &mut Formatter<'_>) -> std::fmt::Result {
        let tenths = (self.0 * 10.0).round() / 10.0;
        // Adding 0 turns a negative zero into a plain one.
        write!(formatter, "{}", tenths + 0.0)
    }
}

/// Words that may come from a file: what XML 1.0 cannot hold becomes U+FFFD.
struct Words<'a>(&'a str);

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
fn width(words: &str, letter: f64) -> f64 {
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
fn wrapped(words: &str, letter: f64, most: f64) -> Vec<String> {
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

//! What stands above the data: title, legend and the name of the vertical axis.

use super::drawing::{BORDER, INK, LETTER, QUIET, WIDTH, Words, mark, width, wrapped};
use super::length::px;
use super::look::Look;
use crate::evaluate::record::{Figure, Point, Scale, Series};
use maud::{Markup, html};

const TITLE: f64 = 15.0;
const SAMPLE: f64 = 30.0;
const ROW: f64 = 21.0;
const BETWEEN: f64 = 18.0;

/// The upper part of a picture.
pub(super) struct Top {
    pub(super) markup: Markup,
    /// How far down it reaches.
    pub(super) bottom: f64,
}

/// What a row of the legend holds: a series, the cross of the paper, or the line to compare with.
enum Sample<'a> {
    Series(&'a Look),
    Paper,
    Reference,
}

impl Top {
    pub(super) fn new(figure: &Figure, looks: &[Look]) -> Self {
        let room = WIDTH - 2.0 * BORDER;
        let title = match &figure.paper {
            Some(paper) => format!("{paper}: {}", figure.title),
            None => figure.title.clone(),
        };
        let title = wrapped(&title, TITLE * 1.06, room);
        let legend_top = BORDER + 19.0 * title.len() as f64 + 6.0;
        let is_rows = matches!(figure.x.scale, Scale::Categories(_));
        let (legend, legend_bottom) = legend(figure, looks, legend_top, is_rows);
        // Rows of dots have their values at the foot, and their name with them.
        let upright = match is_rows {
            true => Vec::new(),
            false => wrapped(&figure.y.label, LETTER, room),
        };
        let upright_top = legend_bottom + if upright.is_empty() { 4.0 } else { 20.0 };
        let markup = html! {
            g class="plot-ink" color=(INK) fill="currentColor" font-size=(px(TITLE)) font-weight="600" {
                @for (index, line) in title.iter().enumerate() {
                    text x=(px(BORDER)) y=(px(BORDER + 13.0 + 19.0 * index as f64)) { (Words(line)) }
                }
            }
            (legend)
            g class="plot-quiet" color=(QUIET) fill="currentColor" {
                @for (index, line) in upright.iter().enumerate() {
                    text x=(px(BORDER)) y=(px(upright_top + 16.0 * index as f64)) { (Words(line)) }
                }
            }
        };
        Self {
            markup,
            bottom: upright_top + 16.0 * upright.len().saturating_sub(1) as f64 + 10.0,
        }
    }
}

/// The legend in as many rows as it needs, and how far down it reaches.
fn legend(figure: &Figure, looks: &[Look], top: f64, is_rows: bool) -> (Markup, f64) {
    let series = figure.series.iter().zip(looks);
    let series = series.filter(|(series, _)| needs_sample(series, &figure.x.scale));
    let mut samples: Vec<(&str, Sample<'_>)> = series
        .map(|(series, look)| (&*series.name, Sample::Series(look)))
        .collect();
    if !figure.marks.is_empty() {
        samples.push(("the paper", Sample::Paper));
    }
    if let Some(reference) = &figure.reference {
        samples.push((&*reference.label, Sample::Reference));
    }
    let (mut x, mut y) = (BORDER, top + ROW / 2.0);
    let mut placed = Vec::with_capacity(samples.len());
    for (name, sample) in samples {
        let takes = SAMPLE + 7.0 + width(name, LETTER);
        if x > BORDER && x + takes > WIDTH - BORDER {
            (x, y) = (BORDER, y + ROW);
        }
        placed.push((x, y, name, sample));
        x += takes + BETWEEN;
    }
    let markup = html! {
        @for (x, y, name, sample) in &placed {
            (drawn(sample, *x, *y, is_rows))
            g class="plot-ink" color=(INK) fill="currentColor" {
                text x=(px(x + SAMPLE + 7.0)) y=(px(y + 4.3)) { (Words(name)) }
            }
        }
    };
    (markup, y + ROW / 2.0)
}

/// A series without points is not seen, and one whose rows bear its name says itself what it is.
fn needs_sample(series: &Series, scale: &Scale) -> bool {
    let names_itself = |point: &Point| match scale {
        Scale::Categories(names) => names.get(point.x as usize) == Some(&series.name),
        Scale::Linear | Scale::Log => false,
    };
    !series.points.iter().all(names_itself)
}

fn drawn(sample: &Sample<'_>, x: f64, y: f64, is_rows: bool) -> Markup {
    let (end, middle) = (x + SAMPLE, x + SAMPLE / 2.0);
    match sample {
        Sample::Series(look) => html! {
            g class=(look.class) color=(look.colour) {
                @let (dash, line) = if is_rows { ("none", 1.6) } else { (look.dash, look.line_px) };
                path d={ "M" (px(x)) " " (px(y)) "H" (px(end)) } fill="none" stroke="currentColor"
                    stroke-width=(px(line)) stroke-dasharray=(dash) {}
                (mark(look, (middle, y), ""))
            }
        },
        Sample::Paper => html! {
            g class="plot-ink" color=(INK) {
                path d={ "M" (px(middle - 4.5)) " " (px(y - 4.5)) "l9 9m0 -9l-9 9" } fill="none"
                    stroke="currentColor" stroke-width="2.4" {}
            }
        },
        // A line to compare with lies as it does in the chart: upright between rows of dots.
        Sample::Reference => html! {
            g class="plot-ink" color=(INK) {
                @let line = match is_rows {
                    true => format!("M{} {}V{}", px(end - 4.0), px(y - 8.0), px(y + 8.0)),
                    false => format!("M{} {}H{}", px(x), px(y), px(end)),
                };
                path d=(line) fill="none" stroke="currentColor" stroke-width="1.3" stroke-dasharray="4 3" {}
            }
        },
    }
}

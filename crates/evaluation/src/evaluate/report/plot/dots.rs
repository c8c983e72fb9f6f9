//! Rows of dots over categories (Cleveland's dot plot): names are read level, values compared along one axis.

use super::axis::Range;
use super::drawing::{
    BORDER, Chart, GRID, INK, LETTER, QUIET, WIDTH, Words, look_of, mark, paper_mark, tip, values,
    width, wrapped,
};
use super::length::px;
use super::look::Look;
use crate::evaluate::record::{Figure, Point, Series};
use crate::evaluate::report::numbers::tick;
use maud::{Markup, html};

/// Names of categories are broken beyond this width.
const MOST_NAME: f64 = 190.0;
const LINE: f64 = 15.0;
/// Height that one dot of a category takes, and what is left between categories.
const DOT: f64 = 12.0;
const BETWEEN: f64 = 12.0;
/// Room for one number along the axis of values.
const NUMBER: f64 = 70.0;

/// One category: its name in lines, its dots, and where it lies.
struct Row<'a> {
    place: usize,
    name: Vec<String>,
    dots: Vec<(&'a Series, &'a Look, &'a Point)>,
    top: f64,
    bottom: f64,
}

/// Where values lie in the picture.
struct Frame {
    values: Range,
    left: f64,
    right: f64,
    top: f64,
    bottom: f64,
}

pub(super) fn chart(figure: &Figure, names: &[String], looks: &[Look], top: f64) -> Chart {
    let mut bottom = top;
    let rows: Vec<Row<'_>> = names
        .iter()
        .enumerate()
        .map(|(index, name)| {
            let row = row(figure, looks, index, name, bottom);
            bottom = row.bottom;
            row
        })
        .filter(|row| row.bottom > row.top)
        .collect();
    let lines = rows.iter().flat_map(|row| &row.name);
    let widest = lines.map(|line| width(line, LETTER)).fold(0.0, f64::max);
    let frame = Frame {
        values: Range::around(values(figure), &figure.y.scale),
        left: BORDER + widest + 12.0,
        right: WIDTH - BORDER - 12.0,
        top,
        bottom,
    };
    let ticks = frame
        .values
        .ticks(((frame.right - frame.left) / NUMBER) as usize);
    let label = wrapped(&figure.y.label, LETTER, WIDTH - 2.0 * BORDER);
    let label_top = bottom + 41.0;
    // A label wider than the axis is set in the middle of the picture.
    let is_wide = label
        .iter()
        .any(|line| width(line, LETTER) > frame.right - frame.left);
    let middle = if is_wide {
        WIDTH / 2.0
    } else {
        (frame.left + frame.right) / 2.0
    };
    let markup = html! {
        (stripes(&rows))
        (axis(&frame, &ticks))
        @if let Some(reference) = &figure.reference {
            g class="plot-ink" color=(INK) {
                path d={ "M" (px(frame.x_of(reference.y))) " " (px(top)) "V" (px(bottom)) } fill="none"
                    stroke="currentColor" stroke-width="1.3" stroke-dasharray="4 3" {}
            }
        }
        @for row in &rows { (dots(&frame, row)) }
        @for said in &figure.marks {
            @let row = said.x.and_then(|x| rows.iter().find(|row| row.place == x as usize));
            @if let Some(row) = row {
                @let y = (row.top + row.bottom) / 2.0;
                (paper_mark(look_of(figure, looks, said), said, (frame.x_of(said.y), y)))
            }
        }
        g class="plot-quiet" color=(QUIET) fill="currentColor" text-anchor="middle" {
            @for (index, line) in label.iter().enumerate() {
                text x=(px(middle)) y=(px(label_top + 16.0 * index as f64)) { (Words(line)) }
            }
        }
    };
    Chart {
        markup,
        bottom: label_top + 16.0 * label.len().saturating_sub(1) as f64 + BORDER,
    }
}

impl Frame {
    fn x_of(&self, value: f64) -> f64 {
        self.left + (self.right - self.left) * self.values.share(value)
    }
}

/// A category with its dots; one without any takes no room.
fn row<'a>(figure: &'a Figure, looks: &'a [Look], index: usize, name: &str, top: f64) -> Row<'a> {
    let in_row = |point: &&Point| point.x == index as f64;
    let dots: Vec<_> = figure
        .series
        .iter()
        .zip(looks)
        .flat_map(|(series, look)| {
            let points = series.points.iter().filter(in_row);
            points.map(move |point| (series, look, point))
        })
        .collect();
    let name = wrapped(name, LETTER, MOST_NAME);
    let height = match dots.len() {
        0 => 0.0,
        count => BETWEEN + (DOT * count as f64).max(LINE * name.len() as f64),
    };
    Row {
        place: index,
        name,
        dots,
        top,
        bottom: top + height,
    }
}

/// Every other row lies on a stripe, for the eye to follow.
fn stripes(rows: &[Row<'_>]) -> Markup {
    html! {
        g class="plot-grid" color=(GRID) {
            @for row in rows.iter().step_by(2) {
                rect x=(px(BORDER - 6.0)) y=(px(row.top)) width=(px(WIDTH - 2.0 * BORDER + 12.0))
                    height=(px(row.bottom - row.top)) fill="currentColor" fill-opacity="0.33" {}
            }
        }
    }
}

fn axis(frame: &Frame, ticks: &[f64]) -> Markup {
    html! {
        g class="plot-grid" color=(GRID) {
            @for &value in ticks {
                path d={ "M" (px(frame.x_of(value))) " " (px(frame.top)) "V" (px(frame.bottom)) }
                    stroke="currentColor" fill="none" {}
            }
        }
        g class="plot-quiet" color=(QUIET) fill="currentColor" text-anchor="middle" {
            path d={ "M" (px(frame.left)) " " (px(frame.bottom)) "H" (px(frame.right)) } stroke="currentColor"
                fill="none" {}
            @for &value in ticks {
                text x=(px(frame.x_of(value))) y=(px(frame.bottom + 18.0)) { (tick(value)) }
            }
        }
    }
}

fn dots(frame: &Frame, row: &Row<'_>) -> Markup {
    let middle = (row.top + row.bottom) / 2.0;
    let first_line = middle + 4.3 - LINE * (row.name.len() as f64 - 1.0) / 2.0;
    let first_dot = middle - DOT * (row.dots.len() as f64 - 1.0) / 2.0;
    let name = row.name.join(" ");
    html! {
        g class="plot-ink" color=(INK) fill="currentColor" text-anchor="end" {
            @for (index, line) in row.name.iter().enumerate() {
                text x=(px(frame.left - 10.0)) y=(px(first_line + LINE * index as f64)) { (Words(line)) }
            }
        }
        @for (index, (series, look, point)) in row.dots.iter().enumerate() {
            @let y = first_dot + DOT * index as f64;
            g class=(look.class) color=(look.colour) {
                path d={ "M" (px(frame.x_of(point.spread[0]))) " " (px(y)) "H" (px(frame.x_of(point.spread[1]))) }
                    fill="none" stroke="currentColor" stroke-width="1" stroke-opacity="0.6" {}
                path d={ "M" (px(frame.x_of(point.low))) " " (px(y)) "H" (px(frame.x_of(point.high))) }
                    fill="none" stroke="currentColor" stroke-width="2.2" stroke-linecap="round" {}
                (mark(look, (frame.x_of(point.y), y), &tip(series, point, &name)))
            }
        }
    }
}

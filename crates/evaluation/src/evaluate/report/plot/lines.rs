//! Lines over a measured variable, with bands for the spread of the values.

use super::axis::Range;
use super::drawing::{
    BORDER, Chart, GRID, INK, LETTER, QUIET, WIDTH, Words, look_of, mark, paper_mark, points, tip,
    values, width, wrapped,
};
use super::length::px;
use super::look::Look;
use crate::evaluate::record::{Figure, Point, Series};
use crate::evaluate::report::numbers::{plain, tick};
use maud::{Markup, html};

const HEIGHT: f64 = 300.0;
const MOST_TICKS: usize = 8;
/// Width of a mark.
const MARK: f64 = 8.5;
/// Marks nearer than this cover each other.
const COVERED: f64 = 5.0;
/// Values that were measured stand on the axis themselves, when there are no more than this.
const MOST_MEASURED: usize = 9;

/// Where values lie in the picture.
struct Frame {
    x: Range,
    y: Range,
    left: f64,
    right: f64,
    top: f64,
    bottom: f64,
}

pub(super) fn chart(figure: &Figure, looks: &[Look], top: f64) -> Chart {
    let x = Range::around(points(figure).map(|(_, point)| point.x), &figure.x.scale);
    let y = Range::around(values(figure), &figure.y.scale);
    let upright = y.ticks(MOST_TICKS);
    let widest = upright.iter().map(|&value| width(&tick(value), LETTER));
    let frame = Frame {
        x,
        y,
        left: BORDER + widest.fold(0.0, f64::max) + 8.0,
        // What the paper says stands beside the lines, of which it is no point.
        right: WIDTH - BORDER - if figure.marks.is_empty() { 6.0 } else { 22.0 },
        top,
        bottom: top + HEIGHT,
    };
    let label = wrapped(&figure.x.label, LETTER, frame.right - frame.left);
    let label_top = frame.bottom + 42.0;
    let markup = html! {
        (upright_axis(&frame, &upright))
        (lying_axis(&frame, &lying_ticks(figure, &frame)))
        @if let Some(reference) = &figure.reference {
            g class="plot-ink" color=(INK) {
                @let y = frame.y_of(reference.y);
                path d={ "M" (px(frame.left)) " " (px(y)) "H" (px(frame.right)) } fill="none"
                    stroke="currentColor" stroke-width="1.3" stroke-dasharray="4 3" {}
            }
        }
        (drawn(figure, looks, &frame))
        @for said in &figure.marks {
            (paper_mark(look_of(figure, looks, said), said, (frame.right + 13.0, frame.y_of(said.y))))
        }
        g class="plot-quiet" color=(QUIET) fill="currentColor" text-anchor="middle" {
            @for (index, line) in label.iter().enumerate() {
                text x=(px((frame.left + frame.right) / 2.0)) y=(px(label_top + 16.0 * index as f64)) { (Words(line)) }
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
        self.left + (self.right - self.left) * self.x.share(value)
    }

    fn y_of(&self, value: f64) -> f64 {
        self.bottom - (self.bottom - self.top) * self.y.share(value)
    }
}

fn upright_axis(frame: &Frame, ticks: &[f64]) -> Markup {
    html! {
        g class="plot-grid" color=(GRID) {
            @for &value in ticks {
                path d={ "M" (px(frame.left)) " " (px(frame.y_of(value))) "H" (px(frame.right)) }
                    stroke="currentColor" fill="none" {}
            }
        }
        g class="plot-quiet" color=(QUIET) fill="currentColor" text-anchor="end" {
            @for &value in ticks {
                text x=(px(frame.left - 8.0)) y=(px(frame.y_of(value) + 4.3)) { (tick(value)) }
            }
        }
    }
}

fn lying_axis(frame: &Frame, ticks: &[f64]) -> Markup {
    html! {
        g class="plot-quiet" color=(QUIET) {
            path d={ "M" (px(frame.left)) " " (px(frame.bottom)) "H" (px(frame.right)) } stroke="currentColor"
                fill="none" {}
            @for &value in ticks {
                path d={ "M" (px(frame.x_of(value))) " " (px(frame.bottom)) "v5" } stroke="currentColor"
                    fill="none" {}
            }
            g fill="currentColor" text-anchor="middle" {
                @for &value in ticks {
                    text x=(px(frame.x_of(value))) y=(px(frame.bottom + 19.0)) { (tick(value)) }
                }
            }
        }
    }
}

/// The measured values themselves while they are few, without those whose numbers would touch; else round ones.
fn lying_ticks(figure: &Figure, frame: &Frame) -> Vec<f64> {
    let mut measured: Vec<f64> = points(figure).map(|(_, point)| point.x).collect();
    measured.sort_by(f64::total_cmp);
    measured.dedup();
    if measured.len() > MOST_MEASURED {
        return frame.x.ticks(MOST_TICKS);
    }
    let mut free_from = f64::NEG_INFINITY;
    measured.retain(|&value| {
        let (middle, half) = (frame.x_of(value), width(&tick(value), LETTER) / 2.0);
        let fits = middle - half >= free_from;
        if fits {
            free_from = middle + half + 6.0;
        }
        fits
    });
    measured
}

/// Lines first and marks above them; the line of `exact` lies above the others.
fn drawn(figure: &Figure, looks: &[Look], frame: &Frame) -> Markup {
    let lines: Vec<(&Series, &Look)> = figure.series.iter().zip(looks).rev().collect();
    let marks = marks(figure, looks, frame);
    html! {
        @for (series, look) in lines.iter().filter(|(series, _)| series.points.len() > 1) {
            g class=(look.class) color=(look.colour) { (line(frame, series, look)) }
        }
        @for Placed { series, look, point, x, .. } in &marks {
            g class=(look.class) color=(look.colour) {
                path d={ "M" (px(*x)) " " (px(frame.y_of(point.low))) "V" (px(frame.y_of(point.high))) }
                    fill="none" stroke="currentColor" stroke-width="1.4" {}
                (mark(look, (*x, frame.y_of(point.y)), &tip(series, point, &plain(point.x))))
            }
        }
    }
}

fn line(frame: &Frame, series: &Series, look: &Look) -> Markup {
    let place = |x: f64, y: f64| format!("{} {}", px(frame.x_of(x)), px(frame.y_of(y)));
    let joined = |places: Vec<String>| format!("M{}", places.join("L"));
    let through: Vec<String> = series.points.iter().map(|at| place(at.x, at.y)).collect();
    let above = series.points.iter().map(|at| place(at.x, at.spread[1]));
    let below = series
        .points
        .iter()
        .rev()
        .map(|at| place(at.x, at.spread[0]));
    let band: Vec<String> = above.chain(below).collect();
    html! {
        path d={ (joined(band)) "z" } fill="currentColor" fill-opacity="0.1" {}
        path d=(joined(through)) fill="none" stroke="currentColor" stroke-width=(px(look.line_px))
            stroke-dasharray=(look.dash) stroke-linejoin="round" {}
    }
}

/// A mark and where it stands along the horizontal axis.
struct Placed<'a> {
    series: &'a Series,
    look: &'a Look,
    point: &'a Point,
    order: usize,
    x: f64,
}

/// All marks. Those that would cover each other stand side by side about their value, in the order of the legend.
fn marks<'a>(figure: &'a Figure, looks: &'a [Look], frame: &Frame) -> Vec<Placed<'a>> {
    let series = figure.series.iter().zip(looks).enumerate();
    let mut marks: Vec<Placed<'_>> = series
        .flat_map(|(order, (series, look))| {
            let points = series.points.iter();
            points.map(move |point| (order, series, look, point))
        })
        .map(|(order, series, look, point)| Placed {
            series,
            look,
            point,
            order,
            x: frame.x_of(point.x),
        })
        .collect();
    marks.sort_by(|one, other| {
        let by_value = one.point.y.total_cmp(&other.point.y);
        one.point.x.total_cmp(&other.point.x).then(by_value)
    });
    let touches = |one: &Placed<'_>, other: &Placed<'_>| {
        let apart = frame.y_of(one.point.y) - frame.y_of(other.point.y);
        one.point.x == other.point.x && apart.abs() < COVERED
    };
    for crowd in marks.chunk_by_mut(touches) {
        crowd.sort_by_key(|placed| placed.order);
        let half = (crowd.len() as f64 - 1.0) / 2.0;
        for (place, placed) in crowd.iter_mut().enumerate() {
            placed.x += (place as f64 - half) * MARK;
        }
    }
    marks
}

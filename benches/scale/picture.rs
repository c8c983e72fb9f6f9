//! The growth as a picture: times over nodes, both axes logarithmic.

use crate::measures::{Figures, Line, duration, grouped};
use std::fmt::Write as _;

const WIDTH: f64 = 760.0;
const HEIGHT: f64 = 460.0;
const LEFT: f64 = 80.0;
/// Room for the names of the lines.
const RIGHT: f64 = 250.0;
const TOP: f64 = 30.0;
const BOTTOM: f64 = 50.0;

/// Lines with their names and colours (Okabe and Ito's, which the colour-blind tell apart).
const LINES: [(Line, &str, &str); 6] = [
    (Line::Table, "building a table, once", "#999999"),
    (Line::Dijkstra, "compact Dijkstra", "#d55e00"),
    (Line::NoTable, "exact, no table", "#e69f00"),
    (Line::Zone, "exact around a zone, taken in", "#009e73"),
    (Line::Recomposition, "exact, whole recomposition", "#0072b2"),
    (Line::Search, "exact, search alone", "#56b4e9"),
];

/// The scales of both axes, in powers of ten.
struct Axes {
    nodes: (f64, f64),
    us: (f64, f64),
}

impl Axes {
    fn around(all: &[Figures]) -> Self {
        let range = |values: &mut dyn Iterator<Item = f64>| {
            values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| {
                (low.min(value.log10()), high.max(value.log10()))
            })
        };
        let (low, high) = range(
            &mut all
                .iter()
                .flat_map(|one| one.lines.iter().map(|line| line.1)),
        );
        Self {
            nodes: range(&mut all.iter().map(|one| one.nodes as f64)),
            us: (low.floor(), high.ceil()),
        }
    }

    fn x(&self, nodes: f64) -> f64 {
        let (low, high) = self.nodes;
        LEFT + (WIDTH - LEFT - RIGHT) * (nodes.log10() - low) / (high - low)
    }

    fn y(&self, us: f64) -> f64 {
        let (low, high) = self.us;
        HEIGHT - BOTTOM - (HEIGHT - TOP - BOTTOM) * (us.log10() - low) / (high - low)
    }
}

/// The picture, as SVG.
pub(crate) fn growth(all: &[Figures]) -> String {
    let axes = Axes::around(all);
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {WIDTH} {HEIGHT}\" font-family=\"sans-serif\" font-size=\"13\">\n\
         <title>Median times over the number of nodes</title>\n\
         <rect width=\"{WIDTH}\" height=\"{HEIGHT}\" fill=\"#ffffff\"/>\n"
    );
    draw_grid(&mut svg, &axes, all);
    let mut names: Vec<(f64, &str, &str)> = Vec::new();
    for (line, name, colour) in LINES {
        let points = all.iter().filter_map(|one| {
            let (_, us) = one.lines.iter().find(|(drawn, _)| *drawn == line)?;
            Some((axes.x(one.nodes as f64), axes.y(*us)))
        });
        let points: Vec<(f64, f64)> = points.collect();
        draw_line(&mut svg, &points, colour);
        if let Some(&(_, y)) = points.last() {
            names.push((y, name, colour));
        }
    }
    write_names(&mut svg, names);
    svg.push_str("</svg>\n");
    svg
}

fn draw_grid(svg: &mut String, axes: &Axes, all: &[Figures]) {
    let (left, right, bottom) = (LEFT, WIDTH - RIGHT, HEIGHT - BOTTOM);
    let (low, high) = axes.us;
    for power in low as i32..=high as i32 {
        let us = 10_f64.powi(power);
        let y = axes.y(us);
        let (words, baseline) = (short_duration(us), y + 4.0);
        let _ = writeln!(
            svg,
            "<path stroke=\"#dddddd\" d=\"M{left:.1} {y:.1}H{right:.1}\"/>\n\
             <text x=\"{:.1}\" y=\"{baseline:.1}\" text-anchor=\"end\" fill=\"#444444\">{words}</text>",
            left - 8.0
        );
    }
    for one in all {
        let x = axes.x(one.nodes as f64);
        let words = grouped(one.nodes);
        let _ = writeln!(
            svg,
            "<path stroke=\"#dddddd\" d=\"M{x:.1} {TOP:.1}V{bottom:.1}\"/>\n\
             <text x=\"{x:.1}\" y=\"{:.1}\" text-anchor=\"middle\" fill=\"#444444\">{words}</text>",
            bottom + 20.0
        );
    }
    let _ = writeln!(
        svg,
        "<text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"middle\" fill=\"#444444\">nodes</text>",
        (left + right) / 2.0,
        HEIGHT - 10.0
    );
}

fn draw_line(svg: &mut String, points: &[(f64, f64)], colour: &str) {
    let mut path = String::new();
    for (place, (x, y)) in points.iter().enumerate() {
        let _ = write!(path, "{}{x:.1} {y:.1}", if place == 0 { 'M' } else { 'L' });
        let _ = writeln!(
            svg,
            "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"3.5\" fill=\"{colour}\"/>"
        );
    }
    let _ = writeln!(
        svg,
        "<path fill=\"none\" stroke=\"{colour}\" stroke-width=\"2\" d=\"{path}\"/>"
    );
}

/// Names at the ends of their lines, moved apart where lines end close together.
fn write_names(svg: &mut String, mut names: Vec<(f64, &str, &str)>) {
    names.sort_by(|one, other| one.0.total_cmp(&other.0));
    let mut free_from = f64::NEG_INFINITY;
    for (y, name, colour) in names {
        let y = (y + 4.0).max(free_from);
        free_from = y + 16.0;
        let x = WIDTH - RIGHT + 10.0;
        let _ = writeln!(
            svg,
            "<text x=\"{x:.1}\" y=\"{y:.1}\" fill=\"{colour}\">{name}</text>"
        );
    }
}

/// A power of ten without decimals: `1 ms`.
fn short_duration(us: f64) -> String {
    let text = duration(us);
    let (number, unit) = text.split_once(' ').unwrap_or((text.as_str(), ""));
    let number: f64 = number.parse().unwrap_or(us);
    format!("{number} {unit}")
}

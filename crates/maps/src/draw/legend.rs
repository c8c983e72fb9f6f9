//! The legend: what is drawn, in the order it was drawn, each with a sample.

use super::lettering::{shortened, width_of};
use super::marks::{Mark, draw_cross, draw_mark, draw_rings};
use super::style::LETTER_PX;
use super::svg::{Document, PathData, Px, Spot};

/// Width of a sample in pixels.
pub(super) const SAMPLE_PX: f64 = 40.0;
/// From the foot of one line to that of the next, in pixels.
pub(super) const LINE_PX: f64 = 18.0;
/// Between a sample and its words, in pixels.
const GAP_PX: f64 = 8.0;
/// Between columns, in pixels.
const BETWEEN_COLUMNS_PX: f64 = 18.0;
/// There are at most this many columns.
const MAX_COLUMNS: usize = 4;

/// What a line of the legend shows before its words.
#[derive(Clone, Debug)]
pub(super) enum Sample {
    /// Lines over one another, by their attributes.
    Lines(Vec<String>),
    /// A line with a cross.
    CrossedLine(&'static str),
    /// Squares side by side, by their attributes.
    Squares(Vec<String>),
    /// Rings side by side, by their radii in pixels.
    Rings(Vec<f64>),
    /// A mark.
    Mark(Mark),
}

/// The lines of the legend.
#[derive(Clone, Debug, Default)]
pub(super) struct Legend {
    lines: Vec<(Sample, String)>,
}

impl Legend {
    pub(super) fn add(&mut self, sample: Sample, words: impl Into<String>) {
        self.lines.push((sample, words.into()));
    }

    /// How many lines stand in a column, and how wide each column is, in as many columns as there is room for.
    fn columns(&self, width_px: f64) -> (usize, Vec<f64>) {
        let line_px =
            |(_, words): &(Sample, String)| SAMPLE_PX + GAP_PX + width_of(words, LETTER_PX);
        let laid_out = |columns: usize| {
            let rows = self.lines.len().div_ceil(columns).max(1);
            let widths = self.lines.chunks(rows).map(|lines| {
                let lines = lines.iter().map(line_px);
                lines.fold(0.0, f64::max) + BETWEEN_COLUMNS_PX
            });
            (rows, widths.collect::<Vec<f64>>())
        };
        let fits = |(_, widths): &(usize, Vec<f64>)| {
            widths.iter().sum::<f64>() - BETWEEN_COLUMNS_PX <= width_px
        };
        let several = (2..=MAX_COLUMNS).rev().map(laid_out).find(fits);
        several.unwrap_or_else(|| laid_out(1))
    }

    /// How high the legend is in this width, in pixels.
    pub(super) fn height_px(&self, width_px: f64) -> f64 {
        let (rows, _) = self.columns(width_px);
        rows as f64 * LINE_PX
    }

    /// Draws the lines, column by column, into a box of this width.
    pub(super) fn draw(&self, at: Spot, width_px: f64, document: &mut Document) {
        let (rows, widths) = self.columns(width_px);
        let mut column_left = at;
        for (lines, column_px) in self.lines.chunks(rows).zip(widths) {
            for (row, (sample, words)) in lines.iter().enumerate() {
                let middle = column_left.moved(0.0, (row as f64 + 0.5) * LINE_PX);
                draw_sample(sample, middle, document);
                let foot = middle.moved(SAMPLE_PX + GAP_PX, LETTER_PX * 0.35);
                let words = shortened(words, LETTER_PX, width_px - (foot.x - at.x));
                let (x, y) = (Px(foot.x), Px(foot.y));
                document.words("text", format_args!("x=\"{x}\" y=\"{y}\""), &words);
            }
            column_left = column_left.moved(column_px, 0.0);
        }
    }
}

fn draw_sample(sample: &Sample, left: Spot, document: &mut Document) {
    let line = PathData::through([left, left.moved(SAMPLE_PX, 0.0)], false);
    let middle = left.moved(SAMPLE_PX / 2.0, 0.0);
    match sample {
        Sample::Lines(lines) => {
            for attributes in lines {
                document.path(&line, format_args!("{attributes}"));
            }
        }
        Sample::CrossedLine(attributes) => {
            document.path(&line, format_args!("{attributes}"));
            draw_cross(middle, document);
        }
        Sample::Squares(squares) => {
            let side_px = SAMPLE_PX / squares.len().max(2) as f64;
            let from = left.moved((SAMPLE_PX - side_px * squares.len() as f64) / 2.0, -6.0);
            for (index, attributes) in squares.iter().enumerate() {
                let (x, y) = (Px(from.x + index as f64 * side_px), Px(from.y));
                let width = Px(side_px);
                document.leaf(
                    "rect",
                    format_args!(
                        "x=\"{x}\" y=\"{y}\" width=\"{width}\" height=\"12\" {attributes}"
                    ),
                );
            }
        }
        Sample::Rings(radii) => {
            let step_px = SAMPLE_PX / radii.len().max(1) as f64;
            for (index, &radius) in radii.iter().enumerate() {
                let centre = left.moved((index as f64 + 0.5) * step_px, 0.0);
                draw_rings(&[centre], radius, document);
            }
        }
        Sample::Mark(mark) => draw_mark(*mark, middle, document),
    }
}

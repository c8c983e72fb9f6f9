//! A figure as a chart in SVG: lines over a measured variable, or rows of dots over categories.
//!
//! Each picture has its title, its legend above the data and the names of its axes, so that it can stand alone. Text is
//! text. Colours are attributes with classes beside them: programs that know no style sheets show the picture as
//! it is, and a page can give it other colours in the dark.

mod axis;
mod dots;
mod drawing;
mod length;
mod lines;
mod look;
mod top;

use crate::evaluate::record::{Figure, Point, Scale};
use drawing::{LETTER, WIDTH, Words, points};
use length::px;
use look::looks;
use maud::html;
use thiserror::Error;
use top::Top;

#[cfg(test)]
pub(super) use look::classes;

const FONTS: &str =
    "system-ui, 'Segoe UI', Roboto, Helvetica, Arial, 'Liberation Sans', sans-serif";

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

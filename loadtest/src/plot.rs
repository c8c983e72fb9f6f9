//! Lines over an axis, as SVG within a page: nothing is loaded from anywhere.

use maud::{Markup, html};

const WIDTH: f64 = 860.0;
const HEIGHT: f64 = 250.0;
const LEFT: f64 = 62.0;
const RIGHT: f64 = 14.0;
const TOP: f64 = 26.0;
const BOTTOM: f64 = 40.0;
/// Above the largest value.
const HEADROOM: f64 = 1.05;
/// Ticks on an axis, about.
const TICKS: f64 = 5.0;
/// Of a logarithmic axis of times, in milliseconds.
const LEAST_MS: f64 = 0.01;

/// How values become places.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Scale {
    Linear,
    Logarithmic,
    /// Parts of a whole, ever nearer to it: 90 %, 99 %, 99.9 %.
    Nines,
}

/// A line, or points where it is not whole.
pub(crate) struct Line {
    pub(crate) name: String,
    /// Which colour, of eight.
    pub(crate) colour: usize,
    pub(crate) is_dashed: bool,
    pub(crate) points: Vec<[f64; 2]>,
}

/// A stretch of the horizontal axis with a name.
pub(crate) struct Band {
    pub(crate) name: String,
    pub(crate) from: f64,
    pub(crate) until: f64,
}

/// A picture of lines.
pub(crate) struct Plot {
    pub(crate) title: String,
    pub(crate) across: String,
    pub(crate) x: Scale,
    pub(crate) y: Scale,
    pub(crate) bands: Vec<Band>,
    pub(crate) lines: Vec<Line>,
}

/// From values to places in the picture.
struct Axis {
    scale: Scale,
    from: f64,
    until: f64,
    begin: f64,
    end: f64,
}

impl Scale {
    fn of(self, value: f64) -> f64 {
        match self {
            Self::Linear => value,
            Self::Logarithmic => value.max(LEAST_MS).log10(),
            Self::Nines => -(1.0 - value).log10(),
        }
    }
}

impl Axis {
    fn over(scale: Scale, values: impl Iterator<Item = f64>, [begin, end]: [f64; 2]) -> Self {
        let mut least = f64::MAX;
        let mut most = f64::MIN;
        for value in values {
            least = least.min(scale.of(value));
            most = most.max(scale.of(value));
        }
        let (from, until) = match scale {
            _ if least > most => (0.0, 1.0),
            Scale::Linear => (0.0, most.max(1e-9)),
            Scale::Logarithmic => (least.floor(), most.ceil().max(least.floor() + 1.0)),
            Scale::Nines => (0.0, most.ceil().max(2.0)),
        };
        Self {
            scale,
            from,
            until,
            begin,
            end,
        }
    }

    fn place(&self, value: f64) -> f64 {
        let part = (self.scale.of(value) - self.from) / (self.until - self.from);
        self.begin + part * (self.end - self.begin)
    }

    /// Where ticks are, and what they say.
    fn ticks(&self) -> Vec<(f64, String)> {
        match self.scale {
            Scale::Linear => {
                let step = round_step(self.until / TICKS);
                let count = (self.until / step) as u32;
                let tick = |number: u32| {
                    let value = f64::from(number) * step;
                    (value, number_text(value))
                };
                (0..=count).map(tick).collect()
            }
            Scale::Logarithmic => {
                let powers = self.from as i32..=self.until as i32;
                let tick = |power: i32| (10_f64.powi(power), number_text(10_f64.powi(power)));
                powers.map(tick).collect()
            }
            Scale::Nines => {
                let tick = |nines: i32| {
                    let part = 1.0 - 10_f64.powi(-nines);
                    let digits = (nines - 2).max(0) as usize;
                    (part, format!("{:.digits$} %", part * 100.0))
                };
                (0..=self.until as i32).map(tick).collect()
            }
        }
    }
}

/// One, two or five times a power of ten.
fn round_step(step: f64) -> f64 {
    let power = 10_f64.powf(step.log10().floor());
    let steps = [1.0, 2.0, 5.0, 10.0];
    let fitting = steps.into_iter().find(|times| times * power >= step);
    fitting.unwrap_or(10.0) * power
}

fn number_text(value: f64) -> String {
    match value {
        value if value >= 1e6 => format!("{}M", value / 1e6),
        value if value >= 1e4 => format!("{}k", value / 1e3),
        value => format!("{}", (value * 1e6).round() / 1e6),
    }
}

impl Plot {
    /// The picture and its legend.
    pub(crate) fn draw(&self) -> Markup {
        let points = || self.lines.iter().flat_map(|line| &line.points);
        let ends = self.bands.iter().map(|band| band.until);
        let x = Axis::over(
            self.x,
            points().map(|point| point[0]).chain(ends),
            [LEFT, WIDTH - RIGHT],
        );
        let y = Axis::over(
            self.y,
            points().map(|point| point[1] * HEADROOM),
            [HEIGHT - BOTTOM, TOP],
        );
        html! {
            figure {
                figcaption { (self.title) }
                svg viewBox={ "0 0 " (WIDTH) " " (HEIGHT) } role="img" aria-label=(self.title) {
                    (self.draw_bands(&x))
                    (self.draw_grid(&x, &y))
                    @for line in &self.lines {
                        path class={ "line c" (line.colour) @if line.is_dashed { " dashed" } } d=(course(line, &x, &y)) {}
                    }
                }
                p class="legend" {
                    @for line in &self.lines {
                        span { i class={ "c" (line.colour) @if line.is_dashed { " dashed" } } {} (line.name) }
                    }
                }
            }
        }
    }

    fn draw_bands(&self, x: &Axis) -> Markup {
        html! {
            @for (number, band) in self.bands.iter().enumerate() {
                @let from = x.place(band.from);
                @let width = x.place(band.until) - from;
                rect class={ "band b" (number % 2) } x=(px(from)) y=(px(TOP)) width=(px(width)) height=(px(HEIGHT - BOTTOM - TOP)) {}
                text class="name" x=(px(from + 4.0)) y=(px(TOP - 8.0)) { (band.name) }
            }
        }
    }

    fn draw_grid(&self, x: &Axis, y: &Axis) -> Markup {
        html! {
            @for (value, text) in y.ticks() {
                @let at = y.place(value);
                line class="grid" x1=(px(LEFT)) x2=(px(WIDTH - RIGHT)) y1=(px(at)) y2=(px(at)) {}
                text class="tick end" x=(px(LEFT - 7.0)) y=(px(at + 4.0)) { (text) }
            }
            @for (value, text) in x.ticks() {
                @let at = x.place(value);
                line class="grid" x1=(px(at)) x2=(px(at)) y1=(px(HEIGHT - BOTTOM)) y2=(px(HEIGHT - BOTTOM + 4.0)) {}
                text class="tick middle" x=(px(at)) y=(px(HEIGHT - BOTTOM + 18.0)) { (text) }
            }
            text class="tick middle" x=(px(f64::midpoint(LEFT, WIDTH - RIGHT))) y=(px(HEIGHT - 5.0)) { (self.across) }
        }
    }
}

fn px(value: f64) -> String {
    format!("{value:.1}")
}

fn course(line: &Line, x: &Axis, y: &Axis) -> String {
    let mut course = String::new();
    for (number, point) in line.points.iter().enumerate() {
        let sign = if number == 0 { 'M' } else { 'L' };
        let (across, up) = (x.place(point[0]), y.place(point[1]));
        course.push_str(&format!("{sign}{across:.1} {up:.1}"));
    }
    course
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_are_round() {
        assert_eq!([0.3, 7.0, 12.0].map(round_step), [0.5, 10.0, 20.0]);
    }

    #[test]
    fn axes_of_nothing_have_a_length() {
        for scale in [Scale::Linear, Scale::Logarithmic, Scale::Nines] {
            let axis = Axis::over(scale, std::iter::empty(), [0.0, 1.0]);
            assert!(axis.place(0.5).is_finite() && !axis.ticks().is_empty());
        }
    }
}

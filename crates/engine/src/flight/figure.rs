//! What the figures of rules and airframes may be: one table that the configuration, the command line, documents and the
//! checker share.

use std::fmt::{Display, Formatter};

/// The values that a figure may have. What is no number is in no range.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FigureRange {
    /// The least value.
    pub least: f64,
    /// True where `least` itself is too little.
    pub above: bool,
    /// The largest value.
    pub most: f64,
}

impl FigureRange {
    /// From `least` to `most`, both allowed.
    pub const fn between(least: f64, most: f64) -> Self {
        Self {
            least,
            above: false,
            most,
        }
    }

    /// Above `least`, and up to `most`.
    pub const fn above(least: f64, most: f64) -> Self {
        Self {
            least,
            above: true,
            most,
        }
    }

    /// True for a value that the figure may have.
    pub fn contains(self, value: f64) -> bool {
        let is_enough = if self.above {
            value > self.least
        } else {
            value >= self.least
        };
        is_enough && value <= self.most
    }
}

impl Display for FigureRange {
    fn fmt(&self, formatter: &mut Formatter<'_>) -> std::fmt::Result {
        let (least, most) = (plain(self.least), plain(self.most));
        if self.above {
            write!(formatter, "a number above {least} and up to {most}")
        } else {
            write!(formatter, "a number from {least} to {most}")
        }
    }
}

/// A number without its many zeros.
fn plain(value: f64) -> String {
    if value.is_finite() && value.abs() >= 1e9 {
        format!("{value:e}")
    } else {
        value.to_string()
    }
}

/// A figure with what it may be.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Figure {
    /// Its name, as documents write it.
    pub name: &'static str,
    /// What it is.
    pub value: f64,
    /// What it may be.
    pub range: FigureRange,
}

impl Figure {
    /// A figure of a name.
    pub const fn new(name: &'static str, value: f64, range: FigureRange) -> Self {
        Self { name, value, range }
    }

    /// A name and a number as a sentence begins with them.
    pub fn said(name: &str, value: f64) -> String {
        format!("{name} is {}", plain(value))
    }

    /// True where it is what it may be.
    pub fn is_valid(&self) -> bool {
        self.range.contains(self.value)
    }
}

impl Display for Figure {
    fn fmt(&self, formatter: &mut Formatter<'_>) -> std::fmt::Result {
        let said = Self::said(self.name, self.value);
        write!(formatter, "{said}; give {}", self.range)
    }
}

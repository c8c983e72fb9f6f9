//! Lengths as a picture writes them.

use std::fmt::{Display, Formatter};

/// A length or place in a picture: one decimal, none where it is 0.
pub(super) fn px(pixels: f64) -> Px {
    Px(pixels)
}

#[derive(Clone, Copy, Debug)]
pub(super) struct Px(f64);

impl Display for Px {
    fn fmt(&self, formatter: &mut Formatter<'_>) -> std::fmt::Result {
        let tenths = (self.0 * 10.0).round() / 10.0;
        // Adding 0 turns a negative zero into a plain one.
        write!(formatter, "{}", tenths + 0.0)
    }
}

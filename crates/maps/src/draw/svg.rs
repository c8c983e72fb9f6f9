//! Writing SVG: elements that always close, text that is always escaped, compact paths.
//!
//! Attributes are written as given, so they hold nothing but numbers and words of this module's own; what
//! comes from files (ids, names) only ever goes in as the content of an element.

use std::fmt::{Arguments, Display, Formatter, Result};
use std::fmt::{Write, from_fn};

/// A place in the picture, in pixels: `x` to the right, `y` down.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Spot {
    pub(super) x: f64,
    pub(super) y: f64,
}

impl Spot {
    pub(super) const fn new(x: f64, y: f64) -> Self {
        Self { x, y }
    }

    /// The place this far to the right and down.
    pub(super) fn moved(self, right: f64, down: f64) -> Self {
        Self::new(self.x + right, self.y + down)
    }

    /// The place at `fraction` of the way to another.
    pub(super) fn towards(self, other: Self, fraction: f64) -> Self {
        let (dx, dy) = (other.x - self.x, other.y - self.y);
        self.moved(dx * fraction, dy * fraction)
    }

    /// The straight line to another place, in pixels.
    pub(super) fn distance(self, other: Self) -> f64 {
        let (dx, dy) = (other.x - self.x, other.y - self.y);
        (dx * dx + dy * dy).sqrt()
    }
}

/// A number of pixels as the text of an attribute: one decimal, none where it is 0.
#[derive(Clone, Copy, Debug)]
pub(super) struct Px(pub(super) f64);

impl Display for Px {
    fn fmt(&self, formatter: &mut Formatter<'_>) -> Result {
        write_tenths(formatter, tenths(self.0))
    }
}

/// Coordinates are whole tenths of a pixel, so that steps along a path add up without drift.
fn tenths(pixels: f64) -> i64 {
    (pixels * 10.0).round() as i64
}

fn write_tenths(out: &mut impl Write, tenths: i64) -> Result {
    let sign = if tenths < 0 { "-" } else { "" };
    let (whole, rest) = (tenths.unsigned_abs() / 10, tenths.unsigned_abs() % 10);
    match rest {
        0 => write!(out, "{sign}{whole}"),
        _ => write!(out, "{sign}{whole}.{rest}"),
    }
}

/// The `d` of a path, in steps relative to the place before.
#[derive(Clone, Debug, Default)]
pub(super) struct PathData {
    text: String,
    /// Where the pen is, in tenths of a pixel.
    pen: (i64, i64),
}

impl PathData {
    /// A path through places, closed or not.
    pub(super) fn through(places: impl IntoIterator<Item = Spot>, closed: bool) -> Self {
        let mut data = Self::default();
        data.add(places, closed);
        data
    }

    /// Adds a line through places, closed or not.
    pub(super) fn add(&mut self, places: impl IntoIterator<Item = Spot>, closed: bool) {
        for (index, place) in places.into_iter().enumerate() {
            match index {
                0 => self.move_to(place),
                _ => self.line_to(place),
            }
        }
        if closed {
            self.text.push('z');
        }
    }

    /// Adds a dot: a line of no length, seen where line ends are round, as wide as the stroke.
    pub(super) fn dot(&mut self, place: Spot) {
        self.move_to(place);
        self.text.push_str("h0");
    }

    /// Adds a full circle.
    pub(super) fn circle(&mut self, centre: Spot, radius: f64) {
        let radius = tenths(radius) as f64 / 10.0;
        self.move_to(centre.moved(-radius, 0.0));
        for diameter in [2.0 * radius, -2.0 * radius] {
            let radius = Px(radius);
            self.write(format_args!("a{radius} {radius} 0 1 0 {} 0", Px(diameter)));
        }
        self.text.push('z');
    }

    fn move_to(&mut self, place: Spot) {
        self.pen = (tenths(place.x), tenths(place.y));
        let (x, y) = self.pen;
        self.command('M', x, y);
    }

    fn line_to(&mut self, place: Spot) {
        let to = (tenths(place.x), tenths(place.y));
        let step = (
            to.0.saturating_sub(self.pen.0),
            to.1.saturating_sub(self.pen.1),
        );
        self.pen = to;
        self.command('l', step.0, step.1);
    }

    fn command(&mut self, letter: char, x: i64, y: i64) {
        let between = if y < 0 { "" } else { " " };
        let (x, y) = (
            from_fn(|out| write_tenths(out, x)),
            from_fn(|out| write_tenths(out, y)),
        );
        self.write(format_args!("{letter}{x}{between}{y}"));
    }

    fn write(&mut self, text: Arguments<'_>) {
        // Writing to a `String` cannot fail.
        let _ = self.text.write_fmt(text);
    }
}

/// A document under construction. What is opened gets closed, so that the text is always well-formed.
#[derive(Debug, Default)]
pub(super) struct Document {
    text: String,
    open: Vec<&'static str>,
}

impl Document {
    /// Begins an element that holds others.
    pub(super) fn open(&mut self, name: &'static str, attributes: Arguments<'_>) {
        self.begin(name, attributes);
        self.text.push('>');
        self.open.push(name);
    }

    /// Ends the element begun last.
    pub(super) fn close(&mut self) {
        if let Some(name) = self.open.pop() {
            self.new_line();
            self.write(format_args!("</{name}>"));
        }
    }

    /// An element that holds nothing.
    pub(super) fn leaf(&mut self, name: &'static str, attributes: Arguments<'_>) {
        self.begin(name, attributes);
        self.text.push_str("/>");
    }

    /// An element that holds words, which may come from anywhere.
    pub(super) fn words(&mut self, name: &'static str, attributes: Arguments<'_>, words: &str) {
        self.begin(name, attributes);
        self.text.push('>');
        push_escaped(&mut self.text, words);
        self.write(format_args!("</{name}>"));
    }

    /// A path; one without a line is left out.
    pub(super) fn path(&mut self, data: &PathData, attributes: Arguments<'_>) {
        if !data.text.is_empty() {
            let text = &data.text;
            self.leaf("path", format_args!("{attributes} d=\"{text}\""));
        }
    }

    /// Elements that were drawn into a document of their own.
    pub(super) fn nest(&mut self, elements: &str) {
        self.new_line();
        self.text.push_str(elements.trim_end());
    }

    /// The whole text, all elements closed.
    pub(super) fn finish(mut self) -> String {
        while !self.open.is_empty() {
            self.close();
        }
        self.text.push('\n');
        self.text
    }

    fn begin(&mut self, name: &str, attributes: Arguments<'_>) {
        self.new_line();
        let before = self.text.len();
        self.write(format_args!("<{name} {attributes}"));
        if self.text.len() == before + name.len() + 2 {
            self.text.pop();
        }
    }

    fn new_line(&mut self) {
        if !self.text.is_empty() {
            self.text.push('\n');
        }
        self.text.extend(self.open.iter().map(|_| ' '));
    }

    fn write(&mut self, text: Arguments<'_>) {
        // Writing to a `String` cannot fail.
        let _ = self.text.write_fmt(text);
    }
}

/// Escapes words for XML; characters that XML 1.0 cannot hold at all become U+FFFD.
fn push_escaped(out: &mut String, words: &str) {
    for letter in words.chars() {
        match letter {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            '\'' => out.push_str("&#39;"),
            '\t' | '\n' | '\r' => out.push(' '),
            '\u{0}'..='\u{1f}' | '\u{fffe}' | '\u{ffff}' => out.push('\u{fffd}'),
            _ => out.push(letter),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_along_a_path_add_up() {
        // Tenths: 0.14 -> 0.1, 0.28 -> 0.3, 0.42 -> 0.4; steps 0.2 and 0.1, not 0.1 and 0.1.
        let places = [0.14, 0.28, 0.42].map(|x| Spot::new(x, -x));
        let data = PathData::through(places, true);
        assert_eq!(data.text, "M0.1-0.1l0.2-0.2l0.1-0.1z");
    }

    #[test]
    fn numbers_that_are_none_do_not_break_the_text() {
        let far = [f64::NAN, f64::INFINITY, f64::NEG_INFINITY].map(|x| Spot::new(x, x));
        let data = PathData::through(far, false);
        assert!(data.text.starts_with("M0 0l"), "{}", data.text);
        assert_eq!(Px(-0.04).to_string(), "0");
        assert_eq!(Px(-1.25).to_string(), "-1.3");
    }

    #[test]
    fn words_are_escaped_and_elements_closed() {
        let mut document = Document::default();
        document.open("g", format_args!("id=\"a\""));
        document.words("text", format_args!(""), "<a href='x'>&\"\u{0}\n");
        let text =
            "<g id=\"a\">\n <text>&lt;a href=&#39;x&#39;&gt;&amp;&quot;\u{fffd} </text>\n</g>\n";
        assert_eq!(document.finish(), text);
    }
}

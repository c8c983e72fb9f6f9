//! The types that settings have: how each is written in text, in TOML and for people.

use crate::itinerary::Objective;
use jiff::{SignedDuration, Timestamp};
use std::fmt;
use std::net::SocketAddr;
use std::path::PathBuf;
use std::time::Duration;
use tracing_subscriber::filter::{LevelFilter, Targets};

/// How TOML writes a value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// In quotes.
    Text,
    /// A whole number.
    Integer,
    /// A number, whole or not.
    Number,
    /// `true` or `false`.
    Boolean,
}

impl Kind {
    /// The kind in a sentence.
    pub fn name(self) -> &'static str {
        match self {
            Self::Text => "text in quotes",
            Self::Integer => "a whole number",
            Self::Number => "a number",
            Self::Boolean => "true or false",
        }
    }
}

/// A type that a setting can have.
pub(super) trait Value: Sized {
    /// How TOML writes it.
    const KIND: Kind;
    /// What is expected, with an example, to follow "is not".
    const EXPECTED: &'static str;

    /// Reads it from text, without quotes; none when the text is something else.
    fn read(text: &str) -> Option<Self>;

    /// Writes it as text that `read` understands.
    fn write(&self) -> String;
}

impl Value for String {
    const KIND: Kind = Kind::Text;
    const EXPECTED: &'static str = "a name or path of at least one character";

    fn read(text: &str) -> Option<Self> {
        (!text.trim().is_empty()).then(|| text.to_owned())
    }

    fn write(&self) -> String {
        self.clone()
    }
}

/// Types that are read and written as Rust does.
macro_rules! as_in_rust {
    ($($type:ty: $kind:ident, $expected:literal;)+) => {$(
        impl Value for $type {
            const KIND: Kind = Kind::$kind;
            const EXPECTED: &'static str = $expected;

            fn read(text: &str) -> Option<Self> {
                text.parse().ok()
            }

            fn write(&self) -> String {
                self.to_string()
            }
        }
    )+};
}

as_in_rust! {
    bool: Boolean, "true or false";
    u8: Integer, "a whole number such as 50";
    usize: Integer, "a whole number such as 1000";
    SocketAddr: Text, "an address and port such as 127.0.0.1:8080 or [::1]:8080";
}

impl Value for f64 {
    const KIND: Kind = Kind::Number;
    const EXPECTED: &'static str = "a number such as 0.5";

    fn read(text: &str) -> Option<Self> {
        text.parse().ok().filter(|number: &f64| number.is_finite())
    }

    fn write(&self) -> String {
        self.to_string()
    }
}

/// Empty text is none, so that a flag can undo what a file says.
impl Value for Option<String> {
    const KIND: Kind = Kind::Text;
    const EXPECTED: &'static str = "a text, or empty for none";

    fn read(text: &str) -> Option<Self> {
        Some((!text.is_empty()).then(|| text.to_owned()))
    }

    fn write(&self) -> String {
        self.clone().unwrap_or_default()
    }
}

/// An address of plain HTTP on some machine.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct HttpUrl(String);

impl HttpUrl {
    /// As it was written.
    pub fn as_str(&self) -> &str {
        &self.0
    }
}

/// Empty text is none, so that a flag can undo what a file says.
impl Value for Option<HttpUrl> {
    const KIND: Kind = Kind::Text;
    const EXPECTED: &'static str =
        "an address such as http://127.0.0.1:4318/v1/traces, or empty for none";

    fn read(text: &str) -> Option<Self> {
        if text.is_empty() {
            return Some(None);
        }
        let uri: http::Uri = text.parse().ok()?;
        let is_http = uri.scheme() == Some(&http::uri::Scheme::HTTP);
        is_http.then(|| Some(HttpUrl(text.to_owned())))
    }

    fn write(&self) -> String {
        self.as_ref().map_or_else(String::new, |url| url.0.clone())
    }
}

/// Empty text is no path, so that a flag can undo what a file says.
impl Value for Option<PathBuf> {
    const KIND: Kind = Kind::Text;
    const EXPECTED: &'static str = "the path of a file, or empty for none";

    fn read(text: &str) -> Option<Self> {
        let path = (!text.is_empty()).then(|| PathBuf::from(text));
        Some(path)
    }

    fn write(&self) -> String {
        let path = self.as_deref();
        path.map_or_else(String::new, |path| path.display().to_string())
    }
}

/// Whether a text is scheme, host and port of HTTP, and nothing more.
pub(super) fn is_origin(text: &str) -> bool {
    let Ok(uri) = text.parse::<http::Uri>() else {
        return false;
    };
    let is_http = matches!(uri.scheme_str(), Some("http" | "https"));
    is_http && uri.path() == "/" && uri.query().is_none()
}

/// Several names, in one text with commas.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Names(Vec<String>);

impl Names {
    /// Them, in their order.
    pub fn iter(&self) -> impl Iterator<Item = &str> {
        self.0.iter().map(String::as_str)
    }
}

impl Value for Names {
    const KIND: Kind = Kind::Text;
    const EXPECTED: &'static str = "names with commas between them, or empty for none";

    fn read(text: &str) -> Option<Self> {
        if text.trim().is_empty() {
            return Some(Self::default());
        }
        let names = text.split(',').map(|name| name.trim().to_owned());
        let names: Vec<String> = names.collect();
        let is_each_named = names.iter().all(|name| !name.is_empty());
        is_each_named.then_some(Self(names))
    }

    fn write(&self) -> String {
        self.0.join(", ")
    }
}

impl Value for Objective {
    const KIND: Kind = Kind::Text;
    const EXPECTED: &'static str = "distance, time or energy";

    fn read(text: &str) -> Option<Self> {
        Self::ALL
            .into_iter()
            .find(|objective| objective.name() == text)
    }

    fn write(&self) -> String {
        self.name().to_owned()
    }
}

/// Empty text is no instant.
impl Value for Option<Timestamp> {
    const KIND: Kind = Kind::Text;
    const EXPECTED: &'static str =
        "an RFC 3339 time such as 2026-05-04T08:00:00Z, or empty for none";

    fn read(text: &str) -> Option<Self> {
        match text {
            "" => Some(None),
            text => text.parse().ok().map(Some),
        }
    }

    fn write(&self) -> String {
        self.map_or_else(String::new, |instant| instant.to_string())
    }
}

impl Value for Duration {
    const KIND: Kind = Kind::Text;
    const EXPECTED: &'static str = "a duration such as 500ms, 30s, 5min or 24h";

    fn read(text: &str) -> Option<Self> {
        let duration: SignedDuration = text.parse().ok()?;
        Self::try_from(duration).ok()
    }

    fn write(&self) -> String {
        const UNITS_NS: [(u128, &str); 5] = [
            (3_600_000_000_000, "h"),
            (60_000_000_000, "min"),
            (1_000_000_000, "s"),
            (1_000_000, "ms"),
            (1_000, "us"),
        ];
        let duration_ns = self.as_nanos();
        if duration_ns == 0 {
            return "0s".to_owned();
        }
        let largest = UNITS_NS
            .iter()
            .find(|(unit_ns, _)| duration_ns.is_multiple_of(*unit_ns));
        match largest {
            Some((unit_ns, unit)) => format!("{}{unit}", duration_ns / unit_ns),
            None => format!("{duration_ns}ns"),
        }
    }
}

/// How many bytes something may have.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Size(usize);

/// Binary units only: of decimal ones people do not know whether they are meant.
const SIZE_UNITS: [(&str, usize); 4] = [
    ("GiB", 1 << 30),
    ("MiB", 1 << 20),
    ("KiB", 1 << 10),
    ("B", 1),
];

impl Size {
    /// A size in bytes.
    pub const fn of_bytes(bytes: usize) -> Self {
        Self(bytes)
    }

    /// A size in KiB.
    pub const fn of_kib(kib: usize) -> Self {
        Self(kib << 10)
    }

    /// A size in MiB.
    pub const fn of_mib(mib: usize) -> Self {
        Self(mib << 20)
    }

    /// In bytes.
    pub const fn bytes(self) -> usize {
        self.0
    }
}

impl Value for Size {
    const KIND: Kind = Kind::Text;
    const EXPECTED: &'static str = "a size such as 512B, 16KiB, 1MiB or 1GiB";

    fn read(text: &str) -> Option<Self> {
        let (unit, unit_bytes) = SIZE_UNITS.iter().find(|(unit, _)| text.ends_with(unit))?;
        let number = text.strip_suffix(unit)?.trim_end();
        let is_plain = number.bytes().all(|byte| byte.is_ascii_digit());
        let number: usize = number.parse().ok().filter(|_| is_plain)?;
        number.checked_mul(*unit_bytes).map(Self)
    }

    fn write(&self) -> String {
        let largest = SIZE_UNITS
            .iter()
            .find(|(_, unit_bytes)| self.0 > 0 && self.0.is_multiple_of(*unit_bytes));
        let (unit, unit_bytes) = largest.unwrap_or(&("B", 1));
        format!("{}{unit}", self.0 / unit_bytes)
    }
}

/// What moves a daemon's clock.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ClockMover {
    /// The machine's clock, at a rate of its own or not.
    Machine,
    /// Clients, as far as they want.
    External,
}

impl Value for ClockMover {
    const KIND: Kind = Kind::Text;
    const EXPECTED: &'static str = "machine or external";

    fn read(text: &str) -> Option<Self> {
        match text {
            "machine" => Some(Self::Machine),
            "external" => Some(Self::External),
            _ => None,
        }
    }

    fn write(&self) -> String {
        match self {
            Self::Machine => "machine".to_owned(),
            Self::External => "external".to_owned(),
        }
    }
}

/// How a log line is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LogFormat {
    /// For people.
    Text,
    /// One JSON object to a line.
    Json,
}

impl Value for LogFormat {
    const KIND: Kind = Kind::Text;
    const EXPECTED: &'static str = "text or json";

    fn read(text: &str) -> Option<Self> {
        match text {
            "text" => Some(Self::Text),
            "json" => Some(Self::Json),
            _ => None,
        }
    }

    fn write(&self) -> String {
        match self {
            Self::Text => "text".to_owned(),
            Self::Json => "json".to_owned(),
        }
    }
}

/// Which log lines are written.
#[derive(Clone, Debug, PartialEq)]
pub struct LogFilter {
    text: String,
    targets: Targets,
}

/// The module whose lines are those of the database.
const DATABASE: &str = "sqlx";

impl LogFilter {
    /// Everything of this level and worse.
    pub fn level(level: LevelFilter) -> Self {
        Self {
            text: level.to_string(),
            targets: Targets::new().with_default(level),
        }
    }

    /// The filter as a layer of `tracing-subscriber` takes it.
    pub fn targets(&self) -> Targets {
        // What a database remarks on each statement is for who asks for it by name.
        match self.text.contains(DATABASE) {
            true => self.targets.clone(),
            false => self
                .targets
                .clone()
                .with_target(DATABASE, self.database_level()),
        }
    }

    /// The level of the database's lines: warnings, and no more than of all others.
    fn database_level(&self) -> LevelFilter {
        let most = self.targets.default_level().unwrap_or(LevelFilter::OFF);
        most.min(LevelFilter::WARN)
    }
}

impl fmt::Display for LogFilter {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(&self.text)
    }
}

impl Value for LogFilter {
    const KIND: Kind = Kind::Text;
    const EXPECTED: &'static str = "a log filter: off, error, warn, info, debug or trace, \
        and for a module MODULE=LEVEL, as in info,skyway::api=debug";

    fn read(text: &str) -> Option<Self> {
        // Left to itself the library takes a misspelt level for a module, of which it then traces everything.
        let is_directive = |directive: &str| {
            let level = match directive.split_once('=') {
                Some((module, level)) if !module.is_empty() => level,
                Some(_) => return false,
                None => directive,
            };
            level.parse::<LevelFilter>().is_ok() && !level.is_empty()
        };
        let is_filter = text.split(',').all(is_directive);
        let targets = text.parse().ok().filter(|_| is_filter)?;
        Some(Self {
            text: text.to_owned(),
            targets,
        })
    }

    fn write(&self) -> String {
        self.text.clone()
    }
}

#[cfg(test)]
mod tests {
    use super::LogFilter;
    use super::Value as _;
    use tracing::Level;

    #[test]
    fn what_a_database_remarks_is_for_those_who_ask_for_it() {
        let tells = |filter: &str, level: Level| {
            let filter = LogFilter::read(filter).expect("a filter");
            filter.targets().would_enable("sqlx::query", &level)
        };
        assert!(!tells("info", Level::INFO) && tells("info", Level::WARN));
        assert!(!tells("debug", Level::INFO) && !tells("error", Level::WARN));
        assert!(tells("info,sqlx=debug", Level::DEBUG));
    }
}

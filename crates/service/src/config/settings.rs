//! What a table of settings is made of: name, meaning, default and bounds of each.
//!
//! The struct that a daemon reads, the keys of the file, the names in the environment, `config show` and the
//! sample file all come from its table: [`edge`](super::edge) has that of an edge, [`registry`](super::registry)
//! that of a registry.

use super::fault::ConfigFault;
use super::resolve::EffectiveConfig;
use super::value::{Kind, Value};
use crate::clock::Clock;
use jiff::Timestamp;
use std::net::{Ipv4Addr, SocketAddr};
use std::ops::RangeInclusive;
use std::path::Path;
use std::time::Duration;

/// One row of the table.
#[derive(Debug)]
pub struct Setting<C: 'static> {
    /// The table of the file it stands in; empty for the top of the file.
    pub section: &'static str,
    /// Its key there.
    pub key: &'static str,
    /// What it means, line by line.
    pub doc: &'static [&'static str],
    /// How TOML writes it.
    pub kind: Kind,
    /// What is expected, with an example.
    pub(super) expected: &'static str,
    /// The least and the most it may be, as text.
    pub(super) bounds: fn() -> Option<(String, String)>,
    /// Reads a value from text into the configuration.
    pub(super) assign: fn(&mut C, &str) -> Result<(), Misfit>,
    /// The value in the configuration, as text that `assign` understands.
    pub(super) text: fn(&C) -> String,
}

/// The configuration of a daemon: its table, and what all daemons have in common.
pub trait Configuration: Clone + Default + PartialEq + std::fmt::Debug + 'static {
    /// What the names of all its variables begin with.
    const ENVIRONMENT_PREFIX: &'static str;
    /// The head of its sample file, as comments.
    const INTRODUCTION: &'static str;
    /// All its settings, in the order of the file.
    const SETTINGS: &'static [Setting<Self>];
    /// What each section of the file is about, in the order of the file.
    const SECTIONS: &'static [(&'static str, &'static [&'static str])];

    /// Who can reach it, and in whose time it lives.
    fn exposure(&self) -> Exposure<'_>;

    /// What is wrong with it beyond single settings and who can reach it.
    fn own_faults(effective: &EffectiveConfig<Self>) -> Vec<ConfigFault>;
}

/// Who can reach a daemon, and in whose time it lives.
#[derive(Clone, Copy, Debug)]
pub struct Exposure<'a> {
    /// Where it is served.
    pub listen: SocketAddr,
    /// Where metrics and status are read.
    pub admin_listen: SocketAddr,
    /// The file with the digests of the tokens.
    pub tokens_file: Option<&'a Path>,
    /// Whether other machines may be served without encryption.
    pub allow_plaintext: bool,
    /// Whether clients move its clock.
    pub is_clock_external: bool,
    /// What a clock of its own shows at the start.
    pub clock_start: Option<Timestamp>,
    /// How many times faster than the machine's it runs.
    pub clock_rate: f64,
}

impl Exposure<'_> {
    /// The setting by which the daemon has a time of its own; none where it has the machine's.
    pub fn own_clock(&self) -> Option<&'static str> {
        match (self.is_clock_external, self.clock_start) {
            (true, _) => Some("clock.kind"),
            (false, Some(_)) => Some("clock.start"),
            (false, None) => (self.clock_rate != 1.0).then_some("clock.rate"),
        }
    }

    /// Starts the clock that is configured.
    pub fn start_clock(&self) -> Clock {
        if self.own_clock().is_none() {
            return Clock::real();
        }
        let start = self.clock_start.unwrap_or_else(|| Clock::real().now());
        match self.is_clock_external {
            true => Clock::external(start),
            false => Clock::simulated(start, self.clock_rate),
        }
    }
}

/// Why a text is no value of a setting.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Misfit {
    /// It is something else.
    Unreadable,
    /// It is outside the bounds.
    OutOfBounds,
}

impl<C: Configuration> Setting<C> {
    /// The full name: `limits.connections`.
    pub fn name(&self) -> String {
        match self.section {
            "" => self.key.to_owned(),
            section => format!("{section}.{}", self.key),
        }
    }

    /// The name in the environment: of the edge's, `SKYWAY_EDGE_LIMITS_CONNECTIONS`.
    pub fn variable(&self) -> String {
        let name = self.name().replace('.', "_").to_uppercase();
        format!("{}{name}", C::ENVIRONMENT_PREFIX)
    }
}

/// Takes a value unless it is outside its bounds.
pub(super) fn checked<T: Value>(
    text: &str,
    bounds: Option<RangeInclusive<T>>,
    is_within: impl Fn(&RangeInclusive<T>, &T) -> bool,
) -> Result<T, Misfit> {
    let value = T::read(text).ok_or(Misfit::Unreadable)?;
    match bounds {
        Some(bounds) if !is_within(&bounds, &value) => Err(Misfit::OutOfBounds),
        _ => Ok(value),
    }
}

/// Makes the structs and the table from one list. A row is `key: type = default, least..=most;`.
macro_rules! settings {
    (
        $(#[doc = $config_doc:literal])+ $config:ident;
        { $( $(#[doc = $doc:literal])+ $key:ident : $type:ty = $default:expr $(, $bounds:expr)? ; )* }
        $(
            $(#[doc = $section_doc:literal])+
            $section:ident : $struct:ident {
                $( $(#[doc = $inner_doc:literal])+ $inner:ident : $inner_type:ty = $inner_default:expr $(, $inner_bounds:expr)? ; )*
            }
        )*
    ) => {
        $(#[doc = $config_doc])+
        #[derive(Clone, Debug, PartialEq)]
        pub struct $config {
            $( $(#[doc = $doc])+ pub $key: $type, )*
            $( $(#[doc = $section_doc])+ pub $section: $struct, )*
        }

        impl Default for $config {
            fn default() -> Self {
                Self {
                    $( $key: $default, )*
                    $( $section: $struct::default(), )*
                }
            }
        }

        $(
            $(#[doc = $section_doc])+
            #[derive(Clone, Debug, PartialEq)]
            pub struct $struct {
                $( $(#[doc = $inner_doc])+ pub $inner: $inner_type, )*
            }

            impl Default for $struct {
                fn default() -> Self {
                    Self { $( $inner: $inner_default, )* }
                }
            }
        )*

        /// What each section of the file is about, in the order of the file.
        pub(super) const SECTIONS: &[(&str, &[&str])] = &[
            $( (stringify!($section), &[$($section_doc),+]), )*
        ];

        /// All settings, in the order of the file.
        pub const SETTINGS: &[Setting<$config>] = &[
            $( settings!(@row "", $key, [$($doc),+], $type, [$($bounds)?], config => config.$key), )*
            $( $(
                settings!(@row stringify!($section), $inner, [$($inner_doc),+], $inner_type,
                    [$($inner_bounds)?], config => config.$section.$inner),
            )* )*
        ];
    };
    (@row $section:expr, $key:ident, [$($doc:literal),+], $type:ty, [$($bounds:expr)?], $config:ident => $place:expr) => {
        Setting {
            section: $section,
            key: stringify!($key),
            doc: &[$($doc),+],
            kind: <$type as Value>::KIND,
            expected: <$type as Value>::EXPECTED,
            bounds: || settings!(@bounds $type $(, $bounds)?),
            assign: |$config, text| {
                $place = settings!(@read text, $type $(, $bounds)?)?;
                Ok(())
            },
            text: |$config| $place.write(),
        }
    };
    (@bounds $type:ty) => { None };
    (@bounds $type:ty, $bounds:expr) => {{
        let bounds: RangeInclusive<$type> = $bounds;
        Some((bounds.start().write(), bounds.end().write()))
    }};
    (@read $text:ident, $type:ty) => { checked::<$type>($text, None, |_, _| true) };
    (@read $text:ident, $type:ty, $bounds:expr) => {
        checked::<$type>($text, Some($bounds), |bounds, value| bounds.contains(value))
    };
}

pub(super) use settings;

pub(super) const fn loopback(port: u16) -> SocketAddr {
    SocketAddr::new(std::net::IpAddr::V4(Ipv4Addr::LOCALHOST), port)
}

pub(super) const SECOND: Duration = Duration::from_secs(1);
pub(super) const MINUTE: Duration = Duration::from_mins(1);
pub(super) const HOUR: Duration = Duration::from_hours(1);
pub(super) const DAY: Duration = Duration::from_hours(24);

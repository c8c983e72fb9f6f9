//! What is wrong with a configuration, and where it was said.

use super::airframes::AirframeError;
use super::authorities::AuthoritiesError;
use super::tokens::TokensError;
use std::fmt;
use std::net::SocketAddr;
use thiserror::Error;

/// Who said what a setting is.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Origin {
    /// None.
    Default,
    /// A line of the file.
    File {
        /// The file as it was named.
        path: String,
        /// The line, from 1.
        line: usize,
    },
    /// A variable of the environment.
    Environment {
        /// Its name.
        variable: String,
    },
    /// A flag.
    Flag {
        /// As it is written: `--listen`, or `--set limits.body`.
        flag: String,
    },
}

impl fmt::Display for Origin {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Default => write!(formatter, "default"),
            Self::File { path, line } => write!(formatter, "file {path}:{line}"),
            Self::Environment { variable } => write!(formatter, "env {variable}"),
            Self::Flag { flag } => write!(formatter, "flag {flag}"),
        }
    }
}

/// One thing wrong with a configuration.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum ConfigFault {
    /// The file is no TOML.
    #[error("{origin}: {message}")]
    Syntax {
        /// Where.
        origin: Origin,
        /// What the parser says.
        message: String,
    },
    /// There is no such setting, section or variable.
    #[error("{origin}: there is no setting '{name}'{}", did_you_mean(.nearest))]
    Unknown {
        /// Where.
        origin: Origin,
        /// What was named.
        name: String,
        /// What was probably meant.
        nearest: Option<String>,
    },
    /// A section is written as a value, or a setting as a section.
    #[error("{}is {found}, not {expected}", said(origin, name, " "))]
    WrongKind {
        /// Where.
        origin: Origin,
        /// The setting or section.
        name: String,
        /// What the file has.
        found: &'static str,
        /// What it should have.
        expected: String,
    },
    /// The text is no value of the setting.
    #[error("{}'{text}' is not {expected}", said(origin, name, ": "))]
    Unreadable {
        /// Where.
        origin: Origin,
        /// The setting.
        name: String,
        /// What was said.
        text: String,
        /// What it should be, with an example.
        expected: &'static str,
    },
    /// The value is outside its bounds.
    #[error("{}{text} is not from {least} to {most}", said(origin, name, ": "))]
    OutOfBounds {
        /// Where.
        origin: Origin,
        /// The setting.
        name: String,
        /// What was said.
        text: String,
        /// The least it may be.
        least: String,
        /// The most it may be.
        most: String,
    },
    /// Two flags say what one setting is.
    #[error("{}is set twice; keep one of the flags", said(origin, name, " "))]
    Twice {
        /// The second flag.
        origin: Origin,
        /// The setting.
        name: String,
    },
    /// Other machines would reach an edge that knows no callers.
    #[error(
        "{origin}: listen = {address} is not loopback and there are no tokens; set tokens_file, or listen on 127.0.0.1"
    )]
    NoTokens {
        /// Who said where to listen.
        origin: Origin,
        /// The address.
        address: SocketAddr,
    },
    /// Tokens would cross the network in the clear.
    #[error(
        "{origin}: listen = {address} is not loopback and the edge does not encrypt; put a proxy that does in front of \
         it on loopback, or set allow_plaintext = true where the network is trusted"
    )]
    PlainText {
        /// Who said where to listen.
        origin: Origin,
        /// The address.
        address: SocketAddr,
    },
    /// The admin listener is open to every network of the machine, or to the world.
    #[error(
        "{origin}: admin_listen = {address} is neither loopback nor a private address; name the private address"
    )]
    AdminExposed {
        /// Who said where to listen.
        origin: Origin,
        /// The address.
        address: SocketAddr,
    },
    /// Other machines would read the metrics of an edge that knows no callers.
    #[error(
        "{origin}: admin_listen = {address} is not loopback and there are no tokens; set tokens_file, or listen on 127.0.0.1"
    )]
    AdminWithoutTokens {
        /// Who said where to listen.
        origin: Origin,
        /// The address.
        address: SocketAddr,
    },
    /// Both listeners want the same port.
    #[error(
        "{origin}: admin_listen = {address} is also where drones are served; take another port"
    )]
    SameAddress {
        /// Who said where the admin listener is.
        origin: Origin,
        /// The address.
        address: SocketAddr,
    },
    /// Real drones would be served in a time that is not theirs.
    #[error(
        "{origin}: {kind} clock is for loopback only, and {listener} = {address} is not; leave {settings} out"
    )]
    OwnClock {
        /// Who asked for the clock.
        origin: Origin,
        /// What clock it is, with its article.
        kind: &'static str,
        /// The setting with the address.
        listener: &'static str,
        /// The address.
        address: SocketAddr,
        /// What makes it such a clock.
        settings: &'static str,
    },
    /// What a registry tells is of its own time.
    #[error(
        "{}names a registry, which has another clock than clock.kind = external; leave one of the two out",
        said(origin, "registry.url", " ")
    )]
    RegistryOfAnotherClock {
        /// Who named the registry.
        origin: Origin,
    },
    /// A clock that clients move has no rate.
    #[error(
        "{}is of no use with clock.kind = external, which passes as clients move it; leave one of the two out",
        said(origin, "clock.rate", " ")
    )]
    RateOfExternalClock {
        /// Who stated the rate.
        origin: Origin,
    },
    /// One threshold is beyond the other.
    #[error(
        "{}is not longer than freshness.stale_after",
        said(origin, "freshness.degraded_after", " ")
    )]
    Freshness {
        /// Who said the later threshold.
        origin: Origin,
    },
    /// The registry's address, or that of this edge for it, is none.
    #[error(
        "{origin}: {setting} = '{url}' is not one such as http://127.0.0.1:8180 or https://registry.example"
    )]
    RegistryUrl {
        /// Who said so.
        origin: Origin,
        /// The setting.
        setting: &'static str,
        /// The address.
        url: String,
    },
    /// Token and airspace would cross the network in the clear.
    #[error(
        "{}{host} may be another machine, and http does not encrypt; write https, or set \
         registry.allow_plaintext = true where the network is trusted",
        said(origin, "registry.url", ": ")
    )]
    RegistryPlainText {
        /// Who said so.
        origin: Origin,
        /// The host.
        host: String,
    },
    /// A name stands for no airframe.
    #[error("{}{error}", said(origin, setting, ": "))]
    Airframe {
        /// Who named it.
        origin: Origin,
        /// The setting.
        setting: &'static str,
        /// What is wrong.
        error: AirframeError,
    },
    /// It is unclear which of two is meant.
    #[error("{origin}: two airframes have the name '{name}'; name each once")]
    AirframeTwice {
        /// Who named the second.
        origin: Origin,
        /// The name.
        name: String,
    },
    /// There is nothing to fly where a request does not say.
    #[error(
        "{}names airframes, and flight.airframe none; name the one that flies where a request names none",
        said(origin, "flight.airframes", " ")
    )]
    NoDefaultAirframe {
        /// Who named the others.
        origin: Origin,
    },
    /// The floor is what the reserve may be drawn down to.
    #[error(
        "{}is more than flight.reserve_fraction, which it is the rest of",
        said(origin, "flight.floor_fraction", " ")
    )]
    Floor {
        /// Who said what the floor is.
        origin: Origin,
    },
    /// The file of the registry's authorities is of no use.
    #[error("{origin}: {error}")]
    RegistryAuthorities {
        /// Who named the file.
        origin: Origin,
        /// What is wrong with it.
        error: AuthoritiesError,
    },
    /// An edge that waits for news would seem to have lost its registry.
    #[error(
        "{}and a fifth is not shorter than freshness.stale_after",
        said(origin, "registry.poll_wait", " ")
    )]
    PollWait {
        /// Who said how long to wait.
        origin: Origin,
    },
    /// The file of the registry's token is of no use.
    #[error("{origin}: {error}")]
    RegistryToken {
        /// Who named the file.
        origin: Origin,
        /// What is wrong with it.
        error: TokensError,
    },
    /// The file of the token that edges are asked with is of no use.
    #[error("{origin}: {error}")]
    EdgeToken {
        /// Who named the file.
        origin: Origin,
        /// What is wrong with it.
        error: TokensError,
    },
    /// The token for edges may be sent nowhere.
    #[error(
        "{origin}: no address is named that this token may be sent to; set deliveries.edge_origins, such as https://edge-1.example:8443"
    )]
    NoEdgeOrigins {
        /// Who named the file.
        origin: Origin,
    },
    /// The file of tokens is of no use.
    #[error("{origin}: {error}")]
    Tokens {
        /// Who named the file.
        origin: Origin,
        /// What is wrong with it.
        error: TokensError,
    },
}

/// Something in a configuration that an operator should know of.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum ConfigWarning {
    /// Tokens and positions cross the network in the clear.
    #[error(
        "{listener} = {address} serves other machines without encryption; so does everything on the way there"
    )]
    PlainText {
        /// The setting with the address.
        listener: &'static str,
        /// The address.
        address: SocketAddr,
    },
    /// Times are not those of the world.
    #[error(
        "the clock is simulated: every answer says so, and windows of zones open and close by it"
    )]
    SimulatedClock,
    /// Time does not pass by itself.
    #[error(
        "the clock is external and stands still until a client moves it: every answer says so, and windows of zones \
         open and close by it"
    )]
    ExternalClock,
}

impl ConfigFault {
    /// The line of the file that has to be set right; 0 for what the file does not say.
    pub(super) fn line(&self) -> usize {
        match self {
            Self::Syntax { origin, .. }
            | Self::Unknown { origin, .. }
            | Self::WrongKind { origin, .. }
            | Self::Unreadable { origin, .. }
            | Self::OutOfBounds { origin, .. } => match origin {
                Origin::File { line, .. } => *line,
                _ => 0,
            },
            _ => 0,
        }
    }
}

/// Who said what a setting is, and the setting, unless its source has been named already.
fn said(origin: &Origin, name: &str, joint: &str) -> String {
    let told = origin.to_string();
    if told.rsplit(' ').next() == Some(name) {
        return format!("{told}{joint}");
    }
    format!("{told}: {name}{joint}")
}

fn did_you_mean(nearest: &Option<String>) -> String {
    match nearest {
        Some(nearest) => format!("; did you mean {nearest}?"),
        None => String::new(),
    }
}

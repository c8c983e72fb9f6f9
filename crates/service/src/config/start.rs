//! Whether a daemon may start with a configuration: what other machines could do, and in whose time.

use super::fault::{ConfigFault, ConfigWarning};
use super::resolve::EffectiveConfig;
use super::settings::Configuration;
use super::tokens::{Tokens, TokensError};
use std::net::{IpAddr, SocketAddr};
use std::path::Path;

/// What a daemon that may start is started with.
#[derive(Clone, Debug)]
pub struct Admission {
    /// Who may call; none where everyone on loopback may.
    pub tokens: Option<Tokens>,
    /// What the operator should know of.
    pub warnings: Vec<ConfigWarning>,
}

/// The tokens that a daemon starts with: one at least, though all may be taken out of the file while it runs.
fn load(path: &Path) -> Result<Tokens, TokensError> {
    let tokens = Tokens::load(path)?;
    if tokens.is_empty() {
        let path = path.display().to_string();
        return Err(TokensError::Empty { path });
    }
    Ok(tokens)
}

impl<C: Configuration> EffectiveConfig<C> {
    /// Checks whether the daemon may start, and reads the tokens.
    ///
    /// # Errors
    /// Every reason why it may not.
    pub fn admit(&self) -> Result<Admission, Vec<ConfigFault>> {
        let mut faults = Vec::new();
        self.check_listener(&mut faults);
        self.check_admin_listener(&mut faults);
        self.check_clock(&mut faults);
        faults.extend(C::own_faults(self));
        let tokens = self.config.exposure().tokens_file.map(load);
        let tokens = tokens.transpose().unwrap_or_else(|error| {
            let origin = self.origin("tokens_file");
            faults.push(ConfigFault::Tokens { origin, error });
            None
        });
        match faults.is_empty() {
            true => Ok(Admission {
                tokens,
                warnings: self.warnings(),
            }),
            false => Err(faults),
        }
    }

    fn check_listener(&self, faults: &mut Vec<ConfigFault>) {
        let address = self.config.exposure().listen;
        if is_loopback(address) {
            return;
        }
        let origin = self.origin("listen");
        if self.config.exposure().tokens_file.is_none() {
            let origin = origin.clone();
            faults.push(ConfigFault::NoTokens { origin, address });
        }
        if !self.config.exposure().allow_plaintext {
            faults.push(ConfigFault::PlainText { origin, address });
        }
    }

    fn check_admin_listener(&self, faults: &mut Vec<ConfigFault>) {
        let address = self.config.exposure().admin_listen;
        let origin = self.origin("admin_listen");
        let listen = self.config.exposure().listen;
        let is_same_host = address.ip() == listen.ip() || listen.ip().is_unspecified();
        if is_same_host && address.port() == listen.port() && address.port() != 0 {
            let origin = origin.clone();
            faults.push(ConfigFault::SameAddress { origin, address });
        }
        if is_loopback(address) {
            return;
        }
        if !is_private(address) {
            faults.push(ConfigFault::AdminExposed { origin, address });
        } else if self.config.exposure().tokens_file.is_none() {
            faults.push(ConfigFault::AdminWithoutTokens { origin, address });
        }
    }

    fn check_clock(&self, faults: &mut Vec<ConfigFault>) {
        let exposure = self.config.exposure();
        let Some(setting) = exposure.own_clock() else {
            return;
        };
        let (kind, settings) = match exposure.is_clock_external {
            true => ("an external", "clock.kind"),
            false => ("a simulated", "clock.start and clock.rate"),
        };
        for (listener, address) in self.reachable_listeners() {
            faults.push(ConfigFault::OwnClock {
                origin: self.origin(setting),
                kind,
                listener,
                address,
                settings,
            });
        }
    }

    fn warnings(&self) -> Vec<ConfigWarning> {
        let plain = self
            .reachable_listeners()
            .map(|(listener, address)| ConfigWarning::PlainText { listener, address });
        let mut warnings: Vec<ConfigWarning> = plain.collect();
        let exposure = self.config.exposure();
        if exposure.is_clock_external {
            warnings.push(ConfigWarning::ExternalClock);
        } else if exposure.own_clock().is_some() {
            warnings.push(ConfigWarning::SimulatedClock);
        }
        warnings
    }

    /// The listeners that other machines reach.
    fn reachable_listeners(&self) -> impl Iterator<Item = (&'static str, SocketAddr)> {
        let listeners = [
            ("listen", self.config.exposure().listen),
            ("admin_listen", self.config.exposure().admin_listen),
        ];
        listeners
            .into_iter()
            .filter(|(_, address)| !is_loopback(*address))
    }
}

/// True for an address that only this machine reaches, also where IPv4 is written as IPv6.
fn is_loopback(address: SocketAddr) -> bool {
    address.ip().to_canonical().is_loopback()
}

/// True for an address that is routed within an organisation only (RFC 1918, RFC 4193, link-local).
fn is_private(address: SocketAddr) -> bool {
    match address.ip().to_canonical() {
        IpAddr::V4(ip) => ip.is_private() || ip.is_link_local(),
        IpAddr::V6(ip) => ip.is_unique_local() || ip.is_unicast_link_local(),
    }
}

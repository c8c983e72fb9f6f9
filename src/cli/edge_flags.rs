//! The flags that configure an edge.

use super::config_sources::{self, Looked, Named};
use super::stop::Stop;
use crate::config::{Configuration, EdgeConfig, EffectiveConfig};
use clap::Args;
use std::path::PathBuf;

/// How an edge is configured. Every value is checked where all sources come together, so these are texts.
#[derive(Debug, Args)]
#[command(next_help_heading = "Configuration")]
pub(super) struct EdgeFlags {
    /// The configuration file, TOML; `skyway config sample` writes one
    #[arg(long, value_name = "FILE")]
    config: Option<PathBuf>,
    /// Where drones and operators reach the edge [default: 127.0.0.1:8080]
    #[arg(long, value_name = "ADDRESS:PORT")]
    listen: Option<String>,
    /// Where metrics and status are read [default: 127.0.0.1:9090]
    #[arg(long, value_name = "ADDRESS:PORT")]
    admin_listen: Option<String>,
    /// The network: sydney, corridor, or a file [default: the registry's, or sydney]
    #[arg(long, short, value_name = "NAME|FILE")]
    network: Option<String>,
    /// The registry to follow, such as http://127.0.0.1:8180; none by default
    #[arg(long, value_name = "URL")]
    registry_url: Option<String>,
    /// The file in which the edge keeps what it knows [default: edge.db]; of a registry also a postgres://... database
    #[arg(long, value_name = "FILE", conflicts_with = "no_store")]
    store: Option<String>,
    /// Keep nothing: the edge forgets everything when it ends
    #[arg(long)]
    no_store: bool,
    /// The file with the digests of the tokens, which only its owner may read
    #[arg(long, value_name = "FILE")]
    tokens_file: Option<String>,
    /// The file with the keys that packs are signed with, instead of one beside the store
    #[arg(long, value_name = "FILE")]
    pack_keys_file: Option<String>,
    /// A file to write the ports to that were taken
    #[arg(long, value_name = "FILE")]
    ports_file: Option<String>,
    /// What moves the clock: machine, or external, which clients move; loopback only [default: machine]
    #[arg(long, value_name = "KIND")]
    clock: Option<String>,
    /// What a simulated or external clock shows at the start (RFC 3339); loopback only
    #[arg(long, value_name = "TIME")]
    clock_start: Option<String>,
    /// How many times faster than the machine's the clock runs; loopback only
    #[arg(long, value_name = "FACTOR")]
    clock_rate: Option<String>,
    /// Which log lines: a level, and MODULE=LEVEL for a module, with commas [default: info]
    #[arg(long, value_name = "FILTER")]
    log: Option<String>,
    /// How log lines are written: text or json [default: text]
    #[arg(long, value_name = "FORMAT")]
    log_format: Option<String>,
    /// Any setting by its name, as in limits.body=2MiB; may be given several times
    #[arg(long, value_name = "NAME=VALUE")]
    set: Vec<String>,
}

impl EdgeFlags {
    /// The configuration of these flags, the environment and the file.
    ///
    /// # Errors
    /// Everything wrong in any of them.
    pub(super) fn effective(&self) -> Result<EffectiveConfig<EdgeConfig>, Stop> {
        self.effective_of::<EdgeConfig>(&[])
    }

    /// The same for any daemon, as far as it has these settings, with further flags of its own.
    ///
    /// # Errors
    /// Everything wrong in any of them.
    pub(super) fn effective_of<C: Configuration>(
        &self,
        own: &[Named<'_>],
    ) -> Result<EffectiveConfig<C>, Stop> {
        let no_store = self.no_store.then(String::new);
        let named = [&self.named(&no_store)[..], own].concat();
        config_sources::effective(self.config.as_deref(), &named, &self.set)
    }

    /// The same as far as it can be understood, with everything that is wrong beside it.
    ///
    /// # Errors
    /// When the file cannot be read.
    pub(super) fn look<C: Configuration>(&self) -> Result<Looked<C>, Stop> {
        let no_store = self.no_store.then(String::new);
        let named = self.named(&no_store);
        config_sources::look(self.config.as_deref(), &named, &self.set)
    }

    fn named<'a>(&'a self, no_store: &'a Option<String>) -> [Named<'a>; 14] {
        [
            ("--listen", "listen", &self.listen),
            ("--admin-listen", "admin_listen", &self.admin_listen),
            ("--network", "network", &self.network),
            ("--registry-url", "registry.url", &self.registry_url),
            ("--store", "store", &self.store),
            ("--no-store", "store", no_store),
            ("--tokens-file", "tokens_file", &self.tokens_file),
            ("--pack-keys-file", "pack_keys_file", &self.pack_keys_file),
            ("--ports-file", "ports_file", &self.ports_file),
            ("--clock", "clock.kind", &self.clock),
            ("--clock-start", "clock.start", &self.clock_start),
            ("--clock-rate", "clock.rate", &self.clock_rate),
            ("--log", "log.filter", &self.log),
            ("--log-format", "log.format", &self.log_format),
        ]
    }
}

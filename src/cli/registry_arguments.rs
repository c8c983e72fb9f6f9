//! Which registry a command asks, and with which token.

use super::remote::{Remote, START_OR_NAME_REGISTRY};
use super::stop::Stop;
use clap::Args;
use std::path::PathBuf;

/// Which registry is asked.
#[derive(Debug, Args)]
#[command(next_help_heading = "Registry")]
pub(super) struct RegistryArguments {
    /// The registry
    #[arg(long, value_name = "URL", default_value = "http://127.0.0.1:8180")]
    registry: String,
    /// A file with the token to show to the registry
    #[arg(long, value_name = "FILE")]
    token_file: Option<PathBuf>,
}

impl RegistryArguments {
    /// The registry that is meant.
    pub(super) fn remote(&self) -> Result<Remote, Stop> {
        let remedy = START_OR_NAME_REGISTRY.to_owned();
        Remote::of(&self.registry, self.token_file.as_deref(), remedy)
    }
}

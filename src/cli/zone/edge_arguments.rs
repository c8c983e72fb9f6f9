//! Which edge a command asks, and with which token.

use clap::Args;
use std::path::PathBuf;

/// Which edge is asked.
#[derive(Debug, Args)]
#[command(next_help_heading = "Edge")]
pub(super) struct EdgeArguments {
    /// The edge
    #[arg(long, value_name = "URL", default_value = "http://127.0.0.1:8080")]
    pub(super) edge: String,
    /// A file with the token to show to the edge
    #[arg(long, value_name = "FILE")]
    pub(super) token_file: Option<PathBuf>,
}

//! `skyway pack`: packs in files, and the keys that sign them.

#[cfg(feature = "edge")]
mod keys;
mod show;

use super::output::Output;
use super::stop::{Stop, Verdict};
use clap::Subcommand;

/// What is done with packs, for the help.
pub(super) const EXAMPLES: &str = "\
Examples:
  curl -so a.pack http://127.0.0.1:8080/v1/plans/night-mail/pack
  curl -s http://127.0.0.1:8080/v1/keys > keys.json
  skyway pack show a.pack --keys keys.json         what a drone would do on each leg that closes
  skyway pack show a.pack --key 1UcVL... --json    with one key, in base64
  skyway pack rotate edge.db.keys                  a new key signs from now on
  skyway pack revoke edge.db.keys 0f1e2d3c4b5a6978";

/// The commands of `skyway pack`.
#[derive(Debug, Subcommand)]
pub(super) enum Pack {
    /// Show a pack, and say whether its signature holds; exit code 1 when it does not
    Show(show::Show),
    /// Sign with a new key; the one before is listed as retired
    #[cfg(feature = "edge")]
    Rotate(keys::Rotate),
    /// Say that nothing is to be believed that a key has signed
    #[cfg(feature = "edge")]
    Revoke(keys::Revoke),
}

impl Pack {
    pub(super) fn run(&self, output: &Output) -> Result<Verdict, Stop> {
        match self {
            Self::Show(command) => command.run(output),
            #[cfg(feature = "edge")]
            Self::Rotate(command) => command.run(output),
            #[cfg(feature = "edge")]
            Self::Revoke(command) => command.run(output),
        }
    }
}

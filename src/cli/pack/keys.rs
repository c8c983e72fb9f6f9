//! `skyway pack rotate` and `revoke`: the file of keys, which a running edge reads again.

use super::super::clock;
use super::super::output::Output;
use super::super::stop::{Stop, Verdict};
use crate::config::{PackKeys, PackKeysError};
use clap::Args;
use std::path::{Path, PathBuf};

const ROTATE_EXAMPLES: &str = "\
Examples:
  skyway pack rotate edge.db.keys                    a running edge signs with the new key within two seconds";
const REVOKE_EXAMPLES: &str = "\
Examples:
  skyway pack revoke edge.db.keys 0f1e2d3c4b5a6978   after skyway pack rotate, where it is the key that signs";

/// Arguments of `skyway pack rotate`.
#[derive(Debug, Args)]
#[command(after_help = ROTATE_EXAMPLES)]
pub(in crate::cli) struct Rotate {
    /// The file of keys; it is made where there is none
    #[arg(value_name = "FILE")]
    file: PathBuf,
}

/// Arguments of `skyway pack revoke`.
#[derive(Debug, Args)]
#[command(after_help = REVOKE_EXAMPLES)]
pub(in crate::cli) struct Revoke {
    /// The file of keys
    #[arg(value_name = "FILE")]
    file: PathBuf,
    /// The id of the key, as `GET /v1/keys` has it
    #[arg(value_name = "KEY")]
    key: String,
}

impl Rotate {
    pub(super) fn run(&self, output: &Output) -> Result<Verdict, Stop> {
        let mut seed = [0; 32];
        getrandom::fill(&mut seed)
            .map_err(|error| Stop::failed(format!("the system has no random bits: {error}")))?;
        let now = clock::now();
        let keys = match PackKeys::load(&self.file).map_err(stop)? {
            Some(keys) => keys.rotated(seed, now),
            None => PackKeys::of_seed(seed, now),
        };
        saved(&keys, &self.file)?;
        output.line(&keys.signing().id().to_string())?;
        Ok(Verdict::Done)
    }
}

impl Revoke {
    pub(super) fn run(&self, output: &Output) -> Result<Verdict, Stop> {
        let keys = PackKeys::load(&self.file).map_err(stop)?;
        let keys = keys.ok_or_else(|| stop(PackKeysError::Unknown(self.key.clone())))?;
        let keys = keys.revoked(&self.key, clock::now()).map_err(stop)?;
        saved(&keys, &self.file)?;
        output.note("a running edge lists it as revoked within two seconds; tell the drones, which keep keys of their own");
        Ok(Verdict::Done)
    }
}

fn saved(keys: &PackKeys, file: &Path) -> Result<(), Stop> {
    keys.save(file).map_err(stop)
}

fn stop(error: PackKeysError) -> Stop {
    Stop::failed(error.to_string())
}

//! `skyway service publish`: a service out of a file.

use crate::cli::edge::runtime;
use crate::cli::files;
use crate::cli::output::Output;
use crate::cli::registry_arguments::RegistryArguments;
use crate::cli::remote::{Remote, segment};
use crate::cli::stop::{Stop, Verdict};
use crate::wire::PublishedService;
use clap::Args;
use serde_json::Value;
use std::path::{Path, PathBuf};

const EXAMPLES: &str = "\
Examples:
  skyway service publish parcels.toml
  skyway service publish parcels.json --id acme:parcels --registry https://registry.example --token-file acme.token

The file has the fields of `PUT /v1/services/{id}` as TOML or JSON:
  id = \"acme:parcels\"
  name = \"Parcels over the city\"
  network = \"sydney\"
  payload_max_kg = 2.0
  time_zone = \"Australia/Sydney\"
  tariff = { currency = \"AUD\", base = \"4.00\", per_km = \"1.20\" }

Exit codes: 0 when it is published, 1 for a failure, 2 for arguments that make no sense, \
4 when the registry cannot be reached.";

/// Arguments of `skyway service publish`.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(in crate::cli) struct Publish {
    /// The service: a file .json or .toml, or - for JSON on standard input
    #[arg(value_name = "FILE")]
    file: PathBuf,
    /// Its id [default: the one in the file]
    #[arg(long, value_name = "ID")]
    id: Option<String>,
    #[command(flatten)]
    registry: RegistryArguments,
    /// Write the service as the registry understands it, as JSON
    #[arg(long)]
    json: bool,
}

impl Publish {
    pub(super) fn run(&self, output: &Output) -> Result<Verdict, Stop> {
        let mut service = read(&self.file)?;
        let id = self.id.clone().or_else(|| service.id.take());
        let Some(id) = id else {
            let file = self.file.display();
            return Err(Stop::Usage(format!("{file} has no id; name one with --id")));
        };
        service.id = Some(id.clone());
        let remote = self.registry.remote()?;
        let answer = runtime()?.block_on(publish(&remote, &id, &service))?;
        if self.json {
            let told: Value = serde_json::from_slice(&answer).map_err(Stop::failed)?;
            output.json(&told)?;
        } else {
            output.note(&format!("{id} is published"));
        }
        Ok(Verdict::Done)
    }
}

fn read(file: &Path) -> Result<PublishedService, Stop> {
    let text = files::read_text(file)?;
    let is_toml = file
        .extension()
        .is_some_and(|extension| extension == "toml");
    let read = match is_toml {
        true => toml::from_str(&text).map_err(|error| error.to_string()),
        false => serde_json::from_str(&text).map_err(|error| error.to_string()),
    };
    read.map_err(|error| Stop::failed(format!("{} is no service: {error}", file.display())))
}

async fn publish(remote: &Remote, id: &str, service: &PublishedService) -> Result<Vec<u8>, Stop> {
    let path = format!("/v1/services/{}", segment(id));
    let version = remote.version(&path).await?;
    let body = serde_json::to_string(service).map_err(Stop::failed)?;
    remote.put(&path, version.as_deref(), body).await
}

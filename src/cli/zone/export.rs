//! `skyway zone export`: the zones of an edge, as GeoJSON or ED-318.

use super::edge_arguments::EdgeArguments;
use crate::cli::edge::runtime;
use crate::cli::files;
use crate::cli::output::Output;
use crate::cli::remote::{Remote, START_OR_NAME};
use crate::cli::stop::{Stop, Verdict};
use crate::formats::ED318_MEDIA_TYPE;
use crate::wire::ZoneList;
use clap::{Args, ValueEnum};
use serde_json::Value;
use std::path::PathBuf;

const EXAMPLES: &str = "\
Examples:
  skyway zone export -o zones.geojson
  skyway zone export --format ed318 --edge http://127.0.0.1:8080 -o zones.json

Exit codes: 0 when it is done, 1 for a failure, 2 for arguments that make no sense, \
4 when the edge cannot be reached.";

/// Arguments of `skyway zone export`.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(in crate::cli) struct Export {
    /// The format
    #[arg(long, value_enum, value_name = "FORMAT", default_value_t)]
    format: Format,
    /// Where to write it (.gz compresses), or - for standard output
    #[arg(long, short, value_name = "FILE", default_value = "-")]
    output: PathBuf,
    #[command(flatten)]
    edge: EdgeArguments,
}

/// A format that is written.
#[derive(Clone, Copy, Debug, Default, PartialEq, ValueEnum)]
enum Format {
    /// GeoJSON, with everything that is known
    #[default]
    Geojson,
    /// ED-318
    Ed318,
}

impl Export {
    pub(super) fn run(&self, output: &Output) -> Result<Verdict, Stop> {
        let remedy = START_OR_NAME.to_owned();
        let remote = Remote::of(&self.edge.edge, self.edge.token_file.as_deref(), remedy)?;
        let text = match self.format {
            Format::Geojson => {
                let features = runtime()?.block_on(all_zones(&remote))?;
                let lines: Vec<String> = features.iter().map(Value::to_string).collect();
                let lines = lines.join(",\n");
                format!("{{\"type\":\"FeatureCollection\",\"features\":[\n{lines}\n]}}\n")
            }
            Format::Ed318 => {
                let whole = remote.get_as("/v1/zones", ED318_MEDIA_TYPE);
                runtime()?.block_on(whole)?
            }
        };
        files::write_text(&self.output, &text, output)?;
        Ok(Verdict::Done)
    }
}

/// The features of all pages.
async fn all_zones(remote: &Remote) -> Result<Vec<Value>, Stop> {
    let mut features = Vec::new();
    let mut path = "/v1/zones?page_size=1000".to_owned();
    loop {
        let page = remote.get(&path).await?;
        let page: ZoneList<'_> = serde_json::from_slice(&page)
            .map_err(|error| Stop::failed(format!("the edge's answer cannot be read: {error}")))?;
        features.extend(page.features);
        match page.next_page_token {
            Some(token) => path = format!("/v1/zones?page_size=1000&page_token={token}"),
            None => return Ok(features),
        }
    }
}

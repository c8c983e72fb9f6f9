//! `skyway network convert`: a network in another format.

use crate::cli::files;
#[cfg(feature = "edge")]
use crate::cli::geopackage;
use crate::cli::network_source::NetworkArguments;
use crate::cli::output::Output;
use crate::cli::stop::{Stop, Verdict};
#[cfg(feature = "edge")]
use crate::formats::write_geopackage;
use crate::formats::{draft_of, write_graphml, write_network, write_node_link};
use clap::{Args, ValueEnum};
use std::path::{Path, PathBuf};

const EXAMPLES: &str = "\
Examples:
  skyway network convert --network city_nodes.csv.gz -o city.geojson
  skyway network convert -o sydney.graphml                     networkx.read_graphml reads it
  skyway network convert -o sydney.gpkg                        for QGIS and geopandas
  skyway network convert --to node-link -o sydney.json

networkx.node_link_graph(json.load(open('sydney.json')), edges='links') reads the last one.";

/// Arguments of `skyway network convert`.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(in crate::cli) struct Convert {
    #[command(flatten)]
    network: NetworkArguments,
    /// The format [default: by the name of the output: .geojson, .graphml or .gpkg]
    #[arg(help_heading = "Output", long, value_enum, value_name = "FORMAT")]
    to: Option<Target>,
    /// Where to write it (.gz compresses), or - for standard output
    #[arg(
        help_heading = "Output",
        long,
        short,
        value_name = "FILE",
        default_value = "-"
    )]
    output: PathBuf,
}

/// A format that is written.
#[derive(Clone, Copy, Debug, ValueEnum)]
enum Target {
    /// The native format
    Geojson,
    /// GraphML, as NetworkX reads it; the weight of an edge is its length
    Graphml,
    /// GeoPackage, with the layers nodes and segments
    #[cfg(feature = "edge")]
    Geopackage,
    /// NetworkX node-link JSON
    NodeLink,
}

impl Target {
    /// The format that the name of a file stands for.
    fn of_name(path: &Path) -> Option<Self> {
        let name = match path.extension()? == "gz" {
            true => Path::new(path.file_stem()?),
            false => path,
        };
        match name.extension()?.to_str()? {
            "geojson" => Some(Self::Geojson),
            "graphml" => Some(Self::Graphml),
            #[cfg(feature = "edge")]
            "gpkg" => Some(Self::Geopackage),
            _ => None,
        }
    }
}

impl Convert {
    pub(super) fn run(&self, output: &Output) -> Result<Verdict, Stop> {
        let target = self
            .to
            .or_else(|| Target::of_name(&self.output))
            .ok_or_else(|| {
                let output = self.output.display();
                Stop::Usage(format!(
                    "{output} says nothing of a format; name one with --to"
                ))
            })?;
        let network = self.network.load(output)?;
        for unread in &network.unread {
            output.warn(&format!("a network has no place for some {unread}"));
        }
        let draft = draft_of(&network.topology);
        let bytes = match target {
            Target::Geojson => write_network(&draft).into_bytes(),
            Target::NodeLink => write_node_link(&network.topology).into_bytes(),
            Target::Graphml => {
                let written = write_graphml(&draft).map_err(Stop::failed)?;
                written.losses.iter().for_each(|loss| output.warn(loss));
                written.text.into_bytes()
            }
            #[cfg(feature = "edge")]
            Target::Geopackage => {
                let written = write_geopackage(&draft);
                written.losses.iter().for_each(|loss| output.warn(loss));
                geopackage::database_of(&written.statements)?
            }
        };
        files::write_bytes(&self.output, &bytes, output)?;
        Ok(Verdict::Done)
    }
}

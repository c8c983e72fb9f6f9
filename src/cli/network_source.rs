//! Which network a command works on: a bundled one, or a file of any format that is read.

use super::files;
#[cfg(feature = "edge")]
use super::geopackage;
use super::output::Output;
use super::stop::Stop;
#[cfg(feature = "edge")]
use crate::formats::{ForeignFormat, is_foreign};
use crate::formats::{LoadError, LoadedNetwork, load_csv_network, load_network};
use crate::network::{Components, Topology, bundled};
use clap::Args;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// The name of the bundled network that is taken when none is named.
const SYDNEY: &str = "sydney";
const CORRIDOR: &str = "corridor";
/// At most this many repairs are shown; `network info --json` has all of them.
const MAX_REPAIRS_SHOWN: usize = 10;

/// What network to work on.
#[derive(Debug, Args)]
#[command(next_help_heading = "Network")]
pub(super) struct NetworkArguments {
    /// The network: sydney, corridor, or a file (GeoJSON, GraphML, GeoPackage, NetworkX node-link JSON, CSV; .gz too)
    #[arg(long, short, value_name = "NAME|FILE", default_value = SYDNEY)]
    network: String,
    /// The edges of a network in CSV, where they are not beside the nodes (x_nodes.csv, x_edges.csv)
    #[arg(long, value_name = "FILE")]
    edges: Option<PathBuf>,
}

/// A network as loaded.
#[derive(Debug)]
pub(super) struct Loaded {
    pub(super) topology: Arc<Topology>,
    pub(super) components: Components,
    /// What was repaired in foreign data.
    pub(super) repairs: Vec<String>,
    /// What the file has and the network has no place for.
    pub(super) unread: Vec<String>,
}

impl NetworkArguments {
    /// Loads the network and tells what it is.
    pub(super) fn load(&self, output: &Output) -> Result<Loaded, Stop> {
        load(&self.network, self.edges.as_deref(), output)
    }
}

/// Loads a bundled network by its name, or a file, and tells what it is.
pub(super) fn load(name: &str, edges: Option<&Path>, output: &Output) -> Result<Loaded, Stop> {
    let refused = |error: LoadError| Stop::all_of(name, &error.lines());
    let network = match name {
        SYDNEY => load_network(bundled::SYDNEY_CBD).map_err(refused)?,
        CORRIDOR => load_network(bundled::CORRIDOR).map_err(refused)?,
        file => load_file(Path::new(file), edges)?,
    };
    let loaded = Loaded {
        components: Components::of(&network.topology),
        topology: Arc::new(network.topology),
        repairs: network.repairs.iter().map(ToString::to_string).collect(),
        unread: network.unread.lines(),
    };
    introduce(&loaded, output);
    Ok(loaded)
}

/// Loads a network in the native format, with the text it was read from, for those who serve it to others.
#[cfg(feature = "edge")]
pub(super) fn load_with_text(name: &str, output: &Output) -> Result<(Topology, String), Stop> {
    let not_served = || {
        Stop::failed(format!(
            "{name} is not a network in GeoJSON, which an edge serves; make one of it with skyway network convert"
        ))
    };
    let text = match name {
        SYDNEY => bundled::SYDNEY_CBD.to_owned(),
        CORRIDOR => bundled::CORRIDOR.to_owned(),
        file => {
            let path = Path::new(file);
            check_there(path)?;
            let bytes = files::read_bytes(path)?;
            if ForeignFormat::of_bytes(&bytes) == Some(ForeignFormat::Geopackage) {
                return Err(not_served());
            }
            files::text_of(path, bytes)?
        }
    };
    if looks_like_csv(&text) || is_foreign(&text) {
        return Err(not_served());
    }
    let loaded = load_network(&text).map_err(|error| Stop::all_of(name, &error.lines()))?;
    let topology = loaded.topology;
    let (nodes, segments) = (topology.node_count(), topology.segment_count());
    output.note(&format!(
        "{}: {nodes} nodes, {segments} segments",
        topology.name()
    ));
    Ok((topology, text))
}

/// A name that is no file may be a slip in that of a bundled network.
fn check_there(path: &Path) -> Result<(), Stop> {
    if files::exists(path) || path.extension().is_some() || path.as_os_str() == "-" {
        return Ok(());
    }
    Err(Stop::failed(format!(
        "there is no file {}; the bundled networks are {SYDNEY} and {CORRIDOR}",
        path.display()
    )))
}

fn load_file(path: &Path, edges: Option<&Path>) -> Result<LoadedNetwork, Stop> {
    check_there(path)?;
    let bytes = files::read_bytes(path)?;
    #[cfg(feature = "edge")]
    if ForeignFormat::of_bytes(&bytes) == Some(ForeignFormat::Geopackage) {
        return geopackage::load(path, &bytes);
    }
    let text = files::text_of(path, bytes)?;
    let refused = |error: LoadError| Stop::all_of(&path.display().to_string(), &error.lines());
    if edges.is_none() && !looks_like_csv(&text) {
        return load_network(&text).map_err(refused);
    }
    let edges = match edges {
        Some(edges) => edges.to_owned(),
        None => edges_beside(path)?,
    };
    load_csv_network(&text, &files::read_text(&edges)?).map_err(refused)
}

/// True for a text whose first line has columns and is neither JSON nor XML.
fn looks_like_csv(text: &str) -> bool {
    let head = text.trim_start();
    let first_line = head.lines().next().unwrap_or_default();
    !head.starts_with(['{', '[', '"', '<']) && first_line.contains([',', ';', '\t'])
}

/// The edges that belong to a file of nodes: `x_nodes.csv` and `x_edges.csv`, or `x.csv` and `x_edges.csv`.
fn edges_beside(nodes: &Path) -> Result<PathBuf, Stop> {
    let name = nodes.file_name().unwrap_or_default().to_string_lossy();
    let beside = match name.contains("_nodes") {
        true => name.replace("_nodes", "_edges"),
        false => name.replacen(".csv", "_edges.csv", 1),
    };
    let edges = nodes.with_file_name(&beside);
    match beside != *name && files::exists(&edges) {
        true => Ok(edges),
        false => Err(Stop::failed(format!(
            "{} holds nodes, and there is no {} beside it; name the edges with --edges",
            nodes.display(),
            edges.display()
        ))),
    }
}

fn introduce(loaded: &Loaded, output: &Output) {
    let (nodes, segments) = (
        loaded.topology.node_count(),
        loaded.topology.segment_count(),
    );
    let mut text = format!(
        "{}: {nodes} nodes, {segments} segments",
        loaded.topology.name()
    );
    if loaded.components.sizes.len() > 1 {
        let parts = loaded.components.sizes.len();
        let largest = loaded.components.sizes[0];
        text.push_str(&format!(
            "; in {parts} parts, the largest of {largest} nodes"
        ));
    }
    output.note(&text);
    let repairs = loaded.repairs.len();
    if repairs > 0 {
        let plural = if repairs == 1 { "" } else { "s" };
        output.note(&format!(
            "{repairs} repair{plural} to the data; the file is left as it is"
        ));
    }
    for repair in loaded.repairs.iter().take(MAX_REPAIRS_SHOWN) {
        output.note(&format!("  {repair}"));
    }
    if repairs > MAX_REPAIRS_SHOWN {
        output.note("  …; network info --json lists them all");
    }
}

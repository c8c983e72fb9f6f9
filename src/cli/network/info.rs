//! `skyway network info`: what a network is like.

use crate::cli::network_source::{Loaded, NetworkArguments};
use crate::cli::output::{Output, facts_table, metres};
use crate::cli::stop::{Stop, Verdict};
use crate::network::{Arc, NodeBox, NodeIx, Segment, SegmentBox, Topology};
use crate::routing::Searcher;
use clap::Args;
use serde_json::{Value, json};

const EXAMPLES: &str = "\
Examples:
  skyway network info
  skyway network info --network city_nodes.csv.gz --json";

/// At most this many sizes of components are shown to people.
const MAX_COMPONENTS_SHOWN: usize = 5;

/// Arguments of `skyway network info`.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(in crate::cli) struct Info {
    #[command(flatten)]
    network: NetworkArguments,
    /// Write JSON
    #[arg(help_heading = "Output", long)]
    json: bool,
}

impl Info {
    pub(super) fn run(&self, output: &Output) -> Result<Verdict, Stop> {
        let network = self.network.load(output)?;
        let figures = Figures::of(&network.topology);
        match self.json {
            true => output.json(&json(&network, &figures))?,
            false => output.table(&facts_table(facts(&network, &figures)))?,
        }
        Ok(Verdict::Done)
    }
}

/// The smallest, the mean and the largest of something.
struct Spread {
    least: f64,
    mean: f64,
    most: f64,
    total: f64,
}

impl Spread {
    fn of(values: impl Iterator<Item = f64>) -> Self {
        let mut spread = Self {
            least: f64::INFINITY,
            mean: 0.0,
            most: f64::NEG_INFINITY,
            total: 0.0,
        };
        let mut count = 0_u32;
        for value in values {
            spread.least = spread.least.min(value);
            spread.most = spread.most.max(value);
            spread.total += value;
            count += 1;
        }
        if count == 0 {
            (spread.least, spread.most) = (0.0, 0.0);
        }
        spread.mean = spread.total / f64::from(count.max(1));
        spread
    }

    fn json(&self) -> Value {
        json!({"min": self.least, "mean": self.mean, "max": self.most})
    }
}

struct Figures {
    degree: Spread,
    length_m: Spread,
    pads: Spread,
    nodes_with_pads: usize,
    /// Corners of the bounding box, in the coordinates of the file.
    corners: [[f64; 2]; 2],
    memory_bytes: usize,
    table_bytes: usize,
}

impl Figures {
    fn of(topology: &Topology) -> Self {
        let nodes = || topology.nodes();
        let segments = topology.segments();
        let bounds = topology.bounds();
        let table = |node: NodeIx| Searcher::new(topology).tree(topology, node).bytes();
        Self {
            degree: Spread::of(nodes().map(|node| topology.arcs(node).len() as f64)),
            length_m: Spread::of(segments.map(|segment| topology.segment(segment).length_m)),
            pads: Spread::of(nodes().map(|node| f64::from(topology.pads(node)))),
            nodes_with_pads: nodes().filter(|&node| topology.pads(node) > 0).count(),
            corners: [bounds.min, bounds.max].map(|corner| topology.frame().from_plane(corner)),
            memory_bytes: memory_estimate(topology),
            table_bytes: nodes().next().map_or(0, table),
        }
    }
}

/// Roughly what the arrays, trees and ids of a topology take, in bytes.
fn memory_estimate(topology: &Topology) -> usize {
    /// An id as text, its two references, its hash entry and the node's other facts.
    const FACTS_OF_A_NODE: usize = 120;
    /// Inner nodes of an R-tree, for each of its leaves.
    const TREE_OVERHEAD: usize = 12;
    let of_a_node = size_of::<NodeBox>() + size_of::<[f64; 2]>() + TREE_OVERHEAD + FACTS_OF_A_NODE;
    let of_a_segment =
        size_of::<Segment>() + 2 * size_of::<Arc>() + size_of::<SegmentBox>() + TREE_OVERHEAD;
    topology.node_count() * of_a_node + topology.segment_count() * of_a_segment
}

fn facts(network: &Loaded, figures: &Figures) -> Vec<(&'static str, String)> {
    let topology = &network.topology;
    let (degree, length_m) = (&figures.degree, &figures.length_m);
    let kibibytes = |bytes: usize| format!("{:.0} KiB", bytes as f64 / 1024.0);
    let mut facts = vec![
        ("name", topology.name().to_owned()),
        ("nodes", topology.node_count().to_string()),
        ("segments", topology.segment_count().to_string()),
        ("components", components_text(network)),
        (
            "degree",
            format!(
                "{} to {}, mean {:.1}",
                degree.least, degree.most, degree.mean
            ),
        ),
        (
            "segment length",
            format!(
                "{} to {}, mean {}, together {:.1} km",
                metres(length_m.least),
                metres(length_m.most),
                metres(length_m.mean),
                length_m.total / 1e3
            ),
        ),
        ("network size", metres(topology.size_m())),
        ("extent", extent_text(topology, figures)),
        (
            "length / straight line",
            format!("at least {:.6}", topology.straight_line_scale()),
        ),
        (
            "pads",
            format!(
                "{} on {} nodes",
                figures.pads.total, figures.nodes_with_pads
            ),
        ),
        (
            "memory, about",
            format!(
                "{}, and {} for each destination's table",
                kibibytes(figures.memory_bytes),
                kibibytes(figures.table_bytes)
            ),
        ),
        ("sha256", topology.fingerprint_text().to_owned()),
    ];
    if !topology.attribution().is_empty() {
        facts.push(("attribution", topology.attribution().to_owned()));
    }
    let unread = network.unread.iter();
    facts.extend(unread.map(|unread| ("not read", unread.clone())));
    facts
}

fn components_text(network: &Loaded) -> String {
    let components = &network.components;
    let count = components.sizes.len();
    if count == 1 {
        return "1: every node can be reached from every other".to_owned();
    }
    let largest = components.sizes.iter().take(MAX_COMPONENTS_SHOWN);
    let largest: Vec<String> = largest.map(usize::to_string).collect();
    let more = if count > MAX_COMPONENTS_SHOWN {
        ", …"
    } else {
        ""
    };
    format!(
        "{count}, of {}{more} nodes; {} nodes have no segment",
        largest.join(", "),
        components.isolated_count()
    )
}

fn extent_text(topology: &Topology, figures: &Figures) -> String {
    let [min, max] = figures.corners;
    let decimals = if topology.frame().is_geographic() {
        6
    } else {
        1
    };
    let kind = match topology.frame().is_geographic() {
        true => "longitude and latitude",
        false => "metres",
    };
    format!(
        "{:.decimals$}, {:.decimals$} to {:.decimals$}, {:.decimals$} ({kind})",
        min[0], min[1], max[0], max[1]
    )
}

fn json(network: &Loaded, figures: &Figures) -> Value {
    let topology = &network.topology;
    let [min, max] = figures.corners;
    json!({
        "name": topology.name(),
        "attribution": topology.attribution(),
        "sha256": topology.fingerprint_text(),
        "coordinates": if topology.frame().is_geographic() { "geographic" } else { "planar" },
        "bbox": [min[0], min[1], max[0], max[1]],
        "nodes": topology.node_count(),
        "segments": topology.segment_count(),
        "components": network.components.sizes,
        "isolated_nodes": network.components.isolated_count(),
        "degree": figures.degree.json(),
        "length_m": figures.length_m.json(),
        "total_length_m": figures.length_m.total,
        "network_size_m": topology.size_m(),
        "straight_line_scale": topology.straight_line_scale(),
        "pads": figures.pads.total,
        "nodes_with_pads": figures.nodes_with_pads,
        "memory_bytes_estimate": figures.memory_bytes,
        "table_bytes": figures.table_bytes,
        "repairs": network.repairs,
        "not_read": network.unread,
    })
}

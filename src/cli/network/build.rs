//! `skyway network build`: a network from building footprints.

use crate::airspace::Zone;
use crate::buildings::{Building, LineOfSight, PadRule, SkylineReport, plane_of};
use crate::cli::airspace_source::zones_in;
use crate::cli::building_source::buildings_in;
use crate::cli::files;
use crate::cli::output::Output;
use crate::cli::stop::{Stop, Verdict};
use crate::formats::{DegreeBox, OSM_ATTRIBUTION, write_network};
use crate::geo::{AltitudeBand, Frame, Point};
use crate::network::NetworkDraft;
use clap::Args;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::path::PathBuf;
use std::sync::Arc;

const EXAMPLES: &str = "\
Examples:
  skyway network build buildings.geojson --name Town --attribution 'the land registry' -o town.geojson
  skyway network build buildings.geojson --reach 200 --zones zones.geojson -o town.geojson
  skyway network build city.osm.pbf --bbox 151.19,-33.88,151.22,-33.85 -o town.geojson

The buildings are a GeoJSON FeatureCollection of polygons with the properties height_m (above \
ground), and where known name and extract; or an extract of OpenStreetMap, of which the tags height \
and building:levels are read. A building without a height counts as reaching the ceiling.";

/// At most this many repairs are shown.
const MAX_REPAIRS_SHOWN: usize = 10;

/// Arguments of `skyway network build`. What is not given has the default of [`LineOfSight`].
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(in crate::cli) struct Build {
    /// The building footprints (GeoJSON or .osm.pbf), or - for standard input
    #[arg(value_name = "BUILDINGS")]
    buildings: PathBuf,
    /// Take the buildings of an OSM extract with a corner in this box, in degrees
    #[arg(long, value_name = "WEST,SOUTH,EAST,NORTH", value_parser = degree_box, allow_hyphen_values = true)]
    bbox: Option<DegreeBox>,
    /// Lowest roof that becomes a node, in metres above ground [default: 10]
    #[arg(long, value_name = "METRES")]
    min_height: Option<f64>,
    /// Highest roof that becomes a node, in metres above ground [default: 115]
    #[arg(long, value_name = "METRES")]
    max_height: Option<f64>,
    /// Smallest roof that becomes a node, in square metres [default: 200]
    #[arg(long, value_name = "SQUARE_METRES")]
    min_roof_area: Option<f64>,
    /// Longest segment, in metres [default: 300]
    #[arg(long, value_name = "METRES")]
    reach: Option<f64>,
    /// Distance kept from every building, sideways and upwards, in metres [default: 5]
    #[arg(long, value_name = "METRES")]
    clearance: Option<f64>,
    /// Nothing is flown above this, in metres above ground [default: 120]
    #[arg(long, value_name = "METRES")]
    ceiling: Option<f64>,
    /// Roof area that one recharging pad takes, in square metres [default: 400]
    #[arg(long, value_name = "SQUARE_METRES")]
    roof_area_per_pad: Option<f64>,
    /// No roof has more pads than this [default: 8]
    #[arg(long, value_name = "COUNT")]
    max_pads: Option<u16>,
    /// Take nodes from the buildings with this `extract` alone; all buildings are obstacles
    #[arg(long, value_name = "NAME")]
    extract: Option<String>,
    /// Build no segment into these no-fly zones, whenever they count; can be given more than once
    #[arg(long, value_name = "FILE")]
    zones: Vec<PathBuf>,
    /// The name of the network
    #[arg(long, value_name = "TEXT")]
    name: Option<String>,
    /// Who must be named beside every copy of the network: source and licence of the buildings
    #[arg(long, value_name = "TEXT")]
    attribution: Option<String>,
    /// Where to write it (GeoJSON; .gz compresses), or - for standard output
    #[arg(long, short, value_name = "FILE", default_value = "-")]
    output: PathBuf,
}

impl Build {
    pub(super) fn run(&self, output: &Output) -> Result<Verdict, Stop> {
        let read = buildings_in(&self.buildings, self.bbox.as_ref())?;
        tell_repairs(&read.repairs, output);
        let buildings = read.buildings;
        let zones = self.zones(&buildings)?;
        let keep_out = |from: Point, to: Point, band: &AltitudeBand| {
            zones.iter().any(|zone| zone.closes_line(from, to, band))
        };
        let bar = progress_bar(output);
        let mut progress = |done: usize, all: usize| {
            bar.set_length(all as u64);
            bar.set_position(done as u64);
        };
        let built = self.rules().build(&buildings, &keep_out, &mut progress);
        bar.finish_and_clear();
        let skyline = built.map_err(Stop::failed)?;
        let of_source = read.are_of_osm.then(|| OSM_ATTRIBUTION.to_owned());
        let attribution = self.attribution.clone().or(of_source);
        let is_attributed = attribution.is_some();
        let network = NetworkDraft {
            name: self.name.clone().unwrap_or_default(),
            attribution: attribution.unwrap_or_default(),
            ..skyline.network
        };
        files::write_text(&self.output, &write_network(&network), output)?;
        tell(&skyline.report, &network, output);
        if !is_attributed {
            output.warn(
                "no --attribution: name the source of the buildings, if its licence asks for that",
            );
        }
        Ok(Verdict::Done)
    }

    fn zones(&self, buildings: &[Building]) -> Result<Vec<Arc<Zone>>, Stop> {
        match plane_of(buildings) {
            Some(plane) => zones_in(&self.zones, &Frame::Geographic(plane)),
            None => Ok(Vec::new()),
        }
    }

    fn rules(&self) -> LineOfSight {
        let usual = LineOfSight::default();
        LineOfSight {
            min_height_m: self.min_height.unwrap_or(usual.min_height_m),
            max_height_m: self.max_height.unwrap_or(usual.max_height_m),
            min_roof_area_m2: self.min_roof_area.unwrap_or(usual.min_roof_area_m2),
            reach_m: self.reach.unwrap_or(usual.reach_m),
            clearance_m: self.clearance.unwrap_or(usual.clearance_m),
            ceiling_m: self.ceiling.unwrap_or(usual.ceiling_m),
            pads: PadRule {
                roof_area_per_pad_m2: self
                    .roof_area_per_pad
                    .unwrap_or(usual.pads.roof_area_per_pad_m2),
                max_pads: self.max_pads.unwrap_or(usual.pads.max_pads),
            },
            extract: self.extract.clone(),
        }
    }
}

/// Reads the four sides of a box.
fn degree_box(text: &str) -> Result<DegreeBox, String> {
    let sides: Result<Vec<f64>, _> = text.split(',').map(|side| side.trim().parse()).collect();
    let sides: Option<[f64; 4]> = sides.ok().and_then(|sides| sides.try_into().ok());
    let [west, south, east, north] =
        sides.ok_or("write four numbers of degrees: west,south,east,north")?;
    let is_ordered =
        |least: f64, most: f64, limit: f64| -limit <= least && least < most && most <= limit;
    if !is_ordered(west, east, 180.0) || !is_ordered(south, north, 90.0) {
        return Err(
            "west has to be below east, within 180 degrees, and south below north, within 90"
                .to_owned(),
        );
    }
    Ok(DegreeBox {
        west,
        south,
        east,
        north,
    })
}

fn tell_repairs(repairs: &[String], output: &Output) {
    for repair in repairs.iter().take(MAX_REPAIRS_SHOWN) {
        output.warn(repair);
    }
    if repairs.len() > MAX_REPAIRS_SHOWN {
        let more = repairs.len() - MAX_REPAIRS_SHOWN;
        output.warn(&format!(
            "{more} more buildings are drawn wrong or have heights that cannot be read"
        ));
    }
}

/// A bar on standard error, where that is a terminal and someone wants to see it.
fn progress_bar(output: &Output) -> ProgressBar {
    let target = match output.is_quiet() {
        true => ProgressDrawTarget::hidden(),
        false => ProgressDrawTarget::stderr(),
    };
    let bar = ProgressBar::with_draw_target(None, target);
    match ProgressStyle::with_template("{bar:40} {pos}/{len} rooftops, {eta} left") {
        Ok(style) => bar.with_style(style),
        Err(_) => bar,
    }
}

fn tell(report: &SkylineReport, network: &NetworkDraft, output: &Output) {
    output.note(&format!(
        "{} buildings, {} of unknown height; {} rooftops qualify, {} more belong to the building of a higher one",
        report.buildings, report.unknown_heights, report.rooftops, report.overshadowed
    ));
    output.note(&format!(
        "{} pairs within reach: {} blocked by buildings, {} by zones",
        report.pairs, report.blocked_by_buildings, report.blocked_by_zones
    ));
    output.note(&format!(
        "built {} nodes and {} segments; {} rooftops see no other and are left out",
        network.nodes.len(),
        network.segments.len(),
        report.isolated.len()
    ));
}

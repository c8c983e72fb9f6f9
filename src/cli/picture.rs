//! Pictures: what is drawn of an airspace and an answer, and how.

use super::building_source::buildings_in;
use super::plan::planned_nodes;
use super::stop::Stop;
use crate::airspace::{Airspace, Hits, Zone};
use crate::buildings::Building;
use crate::draw::{
    Crop, DrawnFlight, DrawnRecomposition, GroundPlan, Labels, Picture, PictureOptions, svg,
};
use crate::flight::{FailureReport, Location};
use crate::geo::{Frame, Point};
use crate::network::{NodeIx, Topology};
use crate::recompose::Recomposition;
use clap::{Args, ValueEnum};
use std::path::PathBuf;
use std::sync::Arc;

/// How a picture is drawn.
#[derive(Debug, Args)]
#[command(next_help_heading = "Picture")]
pub(super) struct PictureArguments {
    /// Width of the picture, in pixels
    #[arg(long, value_name = "PIXELS", default_value_t = PictureOptions::default().width_px,
        value_parser = clap::value_parser!(u32).range(320..=10_000))]
    width: u32,
    /// The title; an empty one leaves it out [default: the name of the network]
    #[arg(long, value_name = "TEXT")]
    title: Option<String>,
    /// Which nodes are named
    #[arg(long, value_enum, value_name = "WHICH", default_value_t)]
    labels: NamedNodes,
    /// Show the whole network, not only what is around the paths
    #[arg(long)]
    whole: bool,
    /// Draw these building footprints under the network: GeoJSON, in longitude and latitude
    #[arg(long, value_name = "FILE")]
    buildings: Option<PathBuf>,
}

/// Which nodes are named in a picture.
#[derive(Clone, Copy, Debug, Default, ValueEnum)]
enum NamedNodes {
    /// None
    None,
    /// The ends of the paths and of the failed leg, and the zones
    #[default]
    Ends,
    /// Every node of the paths
    Paths,
    /// Every node
    All,
}

impl PictureArguments {
    /// The options of the picture.
    pub(super) fn options(&self) -> PictureOptions {
        PictureOptions {
            width_px: self.width,
            title: self.title.clone(),
            labels: match self.labels {
                NamedNodes::None => Labels::None,
                NamedNodes::Ends => Labels::Ends,
                NamedNodes::Paths => Labels::Paths,
                NamedNodes::All => Labels::All,
            },
            crop: match self.whole {
                true => Crop::Network,
                false => Crop::Auto,
            },
            ..PictureOptions::default()
        }
    }

    /// The buildings to draw, on the plane of the network; none where none are asked for.
    pub(super) fn ground_plans(&self, topology: &Topology) -> Result<Vec<GroundPlan>, Stop> {
        let Some(path) = &self.buildings else {
            return Ok(Vec::new());
        };
        if !topology.frame().is_geographic() {
            return Err(Stop::Usage(format!(
                "--buildings are in longitude and latitude, which the network '{}' has none of; leave them out",
                topology.name()
            )));
        }
        let buildings = buildings_in(path, None)?.buildings;
        let plans = buildings
            .iter()
            .map(|building| ground_plan(building, topology.frame()));
        Ok(plans.collect())
    }
}

fn ground_plan(building: &Building, frame: &Frame) -> GroundPlan {
    let on_plane = |ring: Vec<[f64; 2]>| -> Vec<Point> {
        ring.into_iter()
            .map(|position| frame.to_plane(position))
            .collect()
    };
    let polygons = building.outline.polygons().into_iter();
    GroundPlan {
        polygons: polygons
            .map(|rings| rings.into_iter().map(on_plane).collect())
            .collect(),
        height_m: building.height_m,
    }
}

/// What is to be drawn, put together.
pub(super) struct Scene<'a> {
    airspace: &'a Airspace,
    buildings: Vec<GroundPlan>,
    zones: Vec<Arc<Zone>>,
    closed: Hits,
    answer: Option<DrawnAnswer<'a>>,
    flight: Option<DrawnFlight<'a>>,
    options: PictureOptions,
}

struct DrawnAnswer<'a> {
    old_path: Vec<NodeIx>,
    report: &'a FailureReport,
    answer: &'a Recomposition,
}

impl<'a> Scene<'a> {
    /// An airspace with what is closed in it now.
    pub(super) fn of(airspace: &'a Airspace) -> Self {
        let closures = || airspace.in_force();
        let segments = closures().flat_map(|closure| closure.hits.segments.iter().copied());
        let nodes = closures().flat_map(|closure| closure.hits.nodes.iter().copied());
        Self {
            airspace,
            buildings: Vec::new(),
            zones: closures()
                .filter_map(|closure| closure.zone().cloned())
                .collect(),
            closed: Hits::new(segments.collect(), nodes.collect()),
            answer: None,
            flight: None,
            options: PictureOptions::default(),
        }
    }

    /// The same with the answer to a report.
    pub(super) fn with_answer(self, report: &'a FailureReport, answer: &'a Recomposition) -> Self {
        let old_path = planned_nodes(self.airspace, report);
        Self {
            answer: Some(DrawnAnswer {
                old_path,
                report,
                answer,
            }),
            ..self
        }
    }

    /// The same with a plan that is flown.
    pub(super) fn with_flight(self, flight: DrawnFlight<'a>) -> Self {
        Self {
            flight: Some(flight),
            ..self
        }
    }

    /// The same with buildings under the network.
    pub(super) fn with_buildings(self, buildings: Vec<GroundPlan>) -> Self {
        Self { buildings, ..self }
    }

    /// The same, drawn another way.
    pub(super) fn with_options(self, options: PictureOptions) -> Self {
        Self { options, ..self }
    }

    /// The picture, as the text of an SVG file.
    pub(super) fn svg(&self) -> String {
        let topology = self.airspace.topology();
        svg(&Picture {
            topology,
            buildings: &self.buildings,
            zones: &self.zones,
            closed: &self.closed,
            recomposition: self.answer.as_ref().map(|drawn| DrawnRecomposition {
                old_path: &drawn.old_path,
                failed_leg: drawn.report.leg,
                drone: self.drone(drawn.report),
                answer: drawn.answer,
            }),
            flight: self.flight.clone(),
            criticality: None,
            options: self.options.clone(),
        })
    }

    fn drone(&self, report: &FailureReport) -> Option<Point> {
        match report.location {
            Location::LegStart => Some(self.airspace.topology().position(report.leg.0)),
            Location::At(place) => Some(place),
            Location::Unknown => None,
        }
    }
}

//! What a picture shows, and how it is drawn.

use crate::airspace::{Hits, Zone};
use crate::flight::{FlightPlan, Wind};
use crate::geo::{Bounds, Point};
use crate::network::{NodeIx, Topology};
use crate::recompose::Recomposition;
use crate::routing::Criticality;
use std::sync::Arc;

/// What is to be seen. All indices are of this topology.
#[derive(Clone, Debug)]
pub struct Picture<'a> {
    /// The network.
    pub topology: &'a Topology,
    /// Buildings under it, on the network's plane.
    pub buildings: &'a [GroundPlan],
    /// No-fly zones.
    pub zones: &'a [Arc<Zone>],
    /// Segments and nodes that are closed, whatever the cause.
    pub closed: &'a Hits,
    /// A recomposition on the network.
    pub recomposition: Option<DrawnRecomposition<'a>>,
    /// A plan with times and battery.
    pub flight: Option<DrawnFlight<'a>>,
    /// What each failure on it costs.
    pub criticality: Option<&'a Criticality>,
    /// How it is drawn.
    pub options: PictureOptions,
}

impl<'a> Picture<'a> {
    /// A picture of a network alone, with nothing closed.
    pub fn of(topology: &'a Topology) -> Self {
        static NOTHING_CLOSED: Hits = Hits {
            segments: Vec::new(),
            nodes: Vec::new(),
        };
        Self {
            topology,
            buildings: &[],
            zones: &[],
            closed: &NOTHING_CLOSED,
            recomposition: None,
            flight: None,
            criticality: None,
            options: PictureOptions::default(),
        }
    }
}

/// The ground a building stands on, and how tall it is.
#[derive(Clone, Debug, PartialEq)]
pub struct GroundPlan {
    /// Polygons, each an outer ring and then its holes, in metres of the network's plane; closed or not.
    pub polygons: Vec<Vec<Vec<Point>>>,
    /// Height of its top above ground, in metres; `None` when unknown.
    pub height_m: Option<f64>,
}

/// A recomposition with what it answered.
#[derive(Clone, Debug)]
pub struct DrawnRecomposition<'a> {
    /// The plan before the failure, from the start of the failed leg to the destination.
    pub old_path: &'a [NodeIx],
    /// The failed leg, from the node behind the drone to the node ahead.
    pub failed_leg: (NodeIx, NodeIx),
    /// Where the drone was, if anybody knew.
    pub drone: Option<Point>,
    /// The answer; its stages are drawn where it was asked to explain.
    pub answer: &'a Recomposition,
}

/// How a picture is drawn.
#[derive(Clone, Debug, PartialEq)]
pub struct PictureOptions {
    /// Width of the whole figure in pixels, 320 to 10,000; letters are 11 pixels high whatever the width.
    pub width_px: u32,
    /// The title; `None` takes the network's name, and an empty one leaves it out.
    pub title: Option<String>,
    /// Which nodes are named.
    pub labels: Labels,
    /// Which part is shown.
    pub crop: Crop,
    /// Room left around that part, as a share of its longer side, 0 to 1.
    pub margin: f64,
}

impl Default for PictureOptions {
    fn default() -> Self {
        Self {
            width_px: 720,
            title: None,
            labels: Labels::default(),
            crop: Crop::default(),
            margin: 0.15,
        }
    }
}

/// Which nodes and zones are named in the picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Labels {
    /// None.
    None,
    /// The ends of the paths and of the failed leg, and the zones.
    #[default]
    Ends,
    /// Also every node of the old and the new path.
    Paths,
    /// Every node.
    All,
}

/// Which part of the network is shown.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub enum Crop {
    /// Around the paths and the search area where there is a recomposition, else the whole network.
    #[default]
    Auto,
    /// Around the failed leg, the search area, and where the new path leaves the old one.
    Detour,
    /// The whole network.
    Network,
    /// A box of the plane, in metres; one without an extent is taken as [`Crop::Auto`].
    Box(Bounds),
}

/// A plan to be drawn.
#[derive(Clone, Debug)]
pub struct DrawnFlight<'a> {
    /// Legs and stops.
    pub plan: &'a FlightPlan,
    /// The nodes flown by, from the start on.
    pub nodes: &'a [NodeIx],
    /// The wind over the network.
    pub wind: Wind,
    /// A sentence below the title, without its full stop.
    pub summary: String,
    /// For an answer to a failure, the leg that failed.
    pub failed_leg: Option<(NodeIx, NodeIx)>,
    /// Where the drone was, if anybody knew.
    pub drone: Option<Point>,
}

//! Pictures of a network, and of what a recomposition did on it: values in, the text of an SVG out.
//!
//! A [`Picture`] names what is to be seen; [`svg`] draws it as a figure for a paper or a page: a map in a
//! thin frame, and below it a legend of what is drawn, scale, north and attribution. Everything is
//! told apart by pattern or shape as well as by colour. The text refers to nothing outside itself, runs no
//! script, and is the same to the byte for the same picture.

mod criticality;
mod flight;
mod furniture;
mod labels;
mod legend;
mod lettering;
mod marks;
mod measures;
mod network;
mod recomposition;
mod search_areas;
mod style;
mod svg;
mod view;

use crate::airspace::{Hits, Zone};
use crate::geo::{Bounds, Point};
use crate::network::{NodeIx, Topology};
use crate::recompose::Recomposition;
use crate::routing::Criticality;
pub use flight::DrawnFlight;
use furniture::Sheet;
use labels::Labeller;
use legend::Legend;
use std::sync::Arc;
use svg::Document;

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

/// Draws a picture as the text of an SVG document.
///
/// Of n nodes and m segments in view the text has about 20 (n + m) bytes, and as much again for the nodes of a search area.
pub fn svg(picture: &Picture<'_>) -> String {
    let view = view::View::of(picture);
    let mut map = Document::default();
    let mut legend = Legend::default();
    let mut labeller = Labeller::new(&view);
    let grain = network::Grain::of(picture, &view);

    network::draw_buildings(picture, &view, &mut map, &mut legend);
    network::draw_segments(picture, &view, grain, &mut map, &mut legend);
    let drawn = picture.recomposition.as_ref();
    if let Some(drawn) = drawn {
        search_areas::draw_areas(picture.topology, drawn, &view, &mut map, &mut legend);
    }
    network::draw_zones(picture, &view, &mut map, &mut legend);
    network::draw_closed_segments(picture, &view, grain, &mut map, &mut legend);
    if let Some(found) = picture.criticality {
        criticality::draw_criticality(picture.topology, found, &view, &mut map, &mut legend);
    }
    network::draw_nodes(picture, &view, grain, &mut map, &mut legend);
    if let Some(drawn) = drawn {
        let scene = recomposition::Scene::new(picture.topology, drawn, &view);
        scene.draw_paths(&mut map, &mut legend);
        scene.draw_area_nodes(grain, &mut map, &mut legend);
        scene.draw_marks(&mut map, &mut legend);
        scene.occupy(&mut labeller);
    }
    if let Some(flight) = &picture.flight {
        let course = flight::Course::new(picture.topology, flight, &view);
        course.draw_legs(&mut map, &mut legend);
        course.draw_marks(&mut map, &mut legend);
        course.draw_wind(&mut map);
        course.occupy(&mut labeller);
        course.name_stops(&mut labeller);
    }
    labels::occupy_nodes(picture.topology, &view, &mut labeller);
    labels::name_nodes_and_zones(picture, &view, &mut labeller);
    labeller.draw(&mut map);

    let sheet = Sheet::new(picture, &view, &legend);
    sheet.draw(&map.finish(), &legend)
}

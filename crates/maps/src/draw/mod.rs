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
mod picture;
mod recomposition;
mod search_areas;
mod style;
mod svg;
mod view;

use furniture::Sheet;
use labels::Labeller;
use legend::Legend;
use svg::Document;

pub use picture::{
    Crop, DrawnFlight, DrawnRecomposition, GroundPlan, Labels, Picture, PictureOptions,
};

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

//! Pictures of a network, of an answer on it and of a plan that is flown, as the text of an SVG.

use crate::question::named;
use crate::refusal::{Kind, Refusal};
use skyway_engine::airspace::{Airspace, Hits, Zone};
use skyway_engine::compose::planned_nodes;
use skyway_engine::flight::Location;
use skyway_engine::geo::Point;
use skyway_engine::recompose::{Recomposition, Request, World};
use skyway_engine::routing::Searcher;
use skyway_formats::read_buildings;
use skyway_maps::draw::{
    Crop, DrawnFlight, DrawnRecomposition, GroundPlan, Labels, Picture, PictureOptions, svg,
};
use std::sync::Arc;

const LABELS: [(Labels, &str); 4] = [
    (Labels::None, "none"),
    (Labels::Ends, "ends"),
    (Labels::Paths, "paths"),
    (Labels::All, "all"),
];
const WIDTH_PX: std::ops::RangeInclusive<u32> = 320..=10_000;

/// How something is drawn.
pub(crate) struct Drawing {
    options: PictureOptions,
    buildings: Vec<GroundPlan>,
}

impl Drawing {
    /// Reads what a caller says; `buildings` is GeoJSON in longitude and latitude.
    pub(crate) fn of(
        width_px: u32,
        title: Option<String>,
        labels: &str,
        whole: bool,
        buildings: Option<&str>,
        airspace: &Airspace,
    ) -> Result<Self, Refusal> {
        if !WIDTH_PX.contains(&width_px) {
            let refusal = Refusal::new(
                Kind::Request,
                "out_of_range",
                "width_px",
                format!("it is {width_px}"),
            );
            return Err(refusal.hint(format!(
                "give {} to {} pixels",
                WIDTH_PX.start(),
                WIDTH_PX.end()
            )));
        }
        Ok(Self {
            options: PictureOptions {
                width_px,
                title,
                labels: named("labels", labels, LABELS.into_iter())?,
                crop: match whole {
                    true => Crop::Network,
                    false => Crop::Auto,
                },
                ..PictureOptions::default()
            },
            buildings: buildings
                .map_or_else(|| Ok(Vec::new()), |text| ground_plans(text, airspace))?,
        })
    }
}

fn ground_plans(text: &str, airspace: &Airspace) -> Result<Vec<GroundPlan>, Refusal> {
    let frame = airspace.topology().frame();
    let wrong =
        |message: String| Refusal::new(Kind::Request, "buildings_unreadable", "buildings", message);
    if !frame.is_geographic() {
        let message =
            "buildings are in longitude and latitude, which this network has none of".to_owned();
        return Err(wrong(message).hint("leave them out"));
    }
    let buildings = read_buildings(text).map_err(|errors| {
        let first = errors.first().map(ToString::to_string);
        wrong(first.unwrap_or_default()).hint("give GeoJSON polygons in longitude and latitude")
    })?;
    let plan = |ring: Vec<[f64; 2]>| -> Vec<Point> {
        ring.into_iter()
            .map(|corner| frame.to_plane(corner))
            .collect()
    };
    let plans = buildings.iter().map(|building| GroundPlan {
        polygons: building
            .outline
            .polygons()
            .into_iter()
            .map(|rings| rings.into_iter().map(plan).collect())
            .collect(),
        height_m: building.height_m,
    });
    Ok(plans.collect())
}

/// Draws an airspace, with an answer or a flight on it.
pub(crate) fn draw(
    airspace: &Airspace,
    answer: Option<(&Request, &Recomposition)>,
    flight: Option<DrawnFlight<'_>>,
    drawing: Drawing,
) -> String {
    let topology = airspace.topology();
    let segments = airspace
        .in_force()
        .flat_map(|closure| closure.hits.segments.iter().copied());
    let nodes = airspace
        .in_force()
        .flat_map(|closure| closure.hits.nodes.iter().copied());
    let zones: Vec<Arc<Zone>> = airspace
        .in_force()
        .filter_map(|closure| closure.zone().cloned())
        .collect();
    let closed = Hits::new(segments.collect(), nodes.collect());
    let world = World {
        airspace,
        trees: None,
    };
    let old_path = answer
        .map(|(request, _)| planned_nodes(&world, &request.report, &mut Searcher::new(topology)));
    svg(&Picture {
        topology,
        buildings: &drawing.buildings,
        zones: &zones,
        closed: &closed,
        recomposition: answer.map(|(request, answer)| DrawnRecomposition {
            old_path: old_path.as_deref().unwrap_or_default(),
            failed_leg: request.report.leg,
            drone: match request.report.location {
                Location::LegStart => Some(topology.position(request.report.leg.0)),
                Location::At(place) => Some(place),
                Location::Unknown => None,
            },
            answer,
        }),
        flight,
        criticality: None,
        options: drawing.options,
    })
}

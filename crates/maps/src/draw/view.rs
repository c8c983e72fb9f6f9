//! Which part of the plane is shown, and where its points fall in the picture.

use super::svg::Spot;
use super::{Crop, DrawnFlight, DrawnRecomposition, Picture};
use crate::geo::{Bounds, Point};
use crate::network::{NodeIx, Topology};
use crate::recompose::AreaShape;
use std::collections::BTreeSet;

/// A recomposition is shown with at least this many metres around, or the whole of a smaller network.
const SMALLEST_VIEW_M: f64 = 300.0;
/// What is shown of a network without an extent, in metres.
const VIEW_OF_A_POINT_M: f64 = 100.0;
/// The map is at least this high and at most this high, as a share of its width.
const FLATTEST: f64 = 0.5;
const TALLEST: f64 = 0.9;
/// The room beside the map, for its frame and coordinates, in pixels.
pub(super) const BESIDE_MAP_PX: f64 = 24.0;

/// The part that is shown, and its scale.
#[derive(Clone, Copy, Debug)]
pub(super) struct View {
    pub(super) bounds: Bounds,
    pub(super) px_per_m: f64,
    pub(super) width_px: f64,
    pub(super) height_px: f64,
}

impl View {
    pub(super) fn of(picture: &Picture<'_>) -> Self {
        let shown = part_shown(picture);
        let width_px = f64::from(picture.options.width_px.clamp(320, 10_000)) - 2.0 * BESIDE_MAP_PX;
        let (width_m, height_m) = (shown.width_m(), shown.height_m());
        let shape = (height_m / width_m).clamp(FLATTEST, TALLEST);
        // Whichever side is too short for the shape gets more of the surroundings.
        let (width_m, height_m) = (width_m.max(height_m / shape), height_m.max(width_m * shape));
        let centre = shown.centre();
        let half = Point::new(width_m / 2.0, height_m / 2.0);
        Self {
            bounds: Bounds {
                min: Point::new(centre.x - half.x, centre.y - half.y),
                max: Point::new(centre.x + half.x, centre.y + half.y),
            },
            px_per_m: width_px / width_m,
            width_px,
            height_px: width_px * shape,
        }
    }

    /// Where a point of the plane falls on the map.
    pub(super) fn place(&self, point: Point) -> Spot {
        Spot::new(
            (point.x - self.bounds.min.x) * self.px_per_m,
            (self.bounds.max.y - point.y) * self.px_per_m,
        )
    }

    /// A distance on the map, in pixels.
    pub(super) fn pixels(&self, distance_m: f64) -> f64 {
        distance_m * self.px_per_m
    }

    /// True when a line may be seen: the box around it meets the view.
    pub(super) fn shows_line(&self, from: Point, to: Point) -> bool {
        Bounds::around([from, to]).is_some_and(|around| around.meets(self.bounds))
    }

    /// True when a point is in view.
    pub(super) fn shows(&self, point: Point) -> bool {
        self.bounds.contains(point)
    }

    /// True when a spot lies on the map, this far from its frame, in pixels.
    pub(super) fn holds(&self, spot: Spot, margin_px: f64) -> bool {
        let within = |value: f64, size_px: f64| value >= margin_px && value <= size_px - margin_px;
        within(spot.x, self.width_px) && within(spot.y, self.height_px)
    }
}

fn part_shown(picture: &Picture<'_>) -> Bounds {
    let topology = picture.topology;
    let drawn = picture.recomposition.as_ref();
    let margin = picture.options.margin;
    let margin = if margin.is_finite() {
        margin.clamp(0.0, 1.0)
    } else {
        0.0
    };
    let whole = || {
        let bounds = with_extent(topology.bounds());
        bounds.grown(bounds.longer_side_m() * margin / 3.0)
    };
    match (picture.options.crop, drawn) {
        (Crop::Box(bounds), _) if has_extent(bounds) => bounds,
        (Crop::Network, _) => whole(),
        (_, None) => match picture
            .flight
            .as_ref()
            .and_then(|flown| around_flight(topology, flown))
        {
            Some(bounds) => with_extent(bounds).grown(bounds.longer_side_m() * margin),
            None => whole(),
        },
        (crop, Some(drawn)) => match around_recomposition(topology, drawn, crop == Crop::Detour) {
            Some(bounds) => {
                let grown = bounds.grown(bounds.longer_side_m() * margin);
                let smallest_m =
                    SMALLEST_VIEW_M.min(with_extent(topology.bounds()).longer_side_m());
                grown.grown((smallest_m - grown.longer_side_m()).max(0.0) / 2.0)
            }
            None => whole(),
        },
    }
}

fn has_extent(bounds: Bounds) -> bool {
    let finite = bounds.min.is_finite() && bounds.max.is_finite();
    finite && bounds.width_m() > 0.0 && bounds.height_m() > 0.0
}

fn with_extent(bounds: Bounds) -> Bounds {
    match bounds.longer_side_m() > 0.0 {
        true => bounds,
        false => bounds.grown(VIEW_OF_A_POINT_M / 2.0),
    }
}

/// Around the way of a plan, its failed leg and the drone.
fn around_flight(topology: &Topology, flown: &DrawnFlight<'_>) -> Option<Bounds> {
    let leg = flown
        .failed_leg
        .into_iter()
        .flat_map(|(from, to)| [from, to]);
    let nodes = flown.nodes.iter().copied().chain(leg);
    let drone = flown.drone.filter(|drone| drone.is_finite());
    Bounds::around(nodes.map(|node| topology.position(node)).chain(drone))
}

/// Around both paths (only where they differ, if so asked), the drone and the search areas as far as they hold anything of the network.
fn around_recomposition(
    topology: &Topology,
    drawn: &DrawnRecomposition<'_>,
    only_detour: bool,
) -> Option<Bounds> {
    let (old, new) = (drawn.old_path, &drawn.answer.path.nodes);
    let on_both: BTreeSet<NodeIx> = match only_detour {
        true => old
            .iter()
            .copied()
            .filter(|node| new.contains(node))
            .collect(),
        false => BTreeSet::new(),
    };
    let leg = [drawn.failed_leg.0, drawn.failed_leg.1];
    let on_paths = leg
        .iter()
        .chain(old.iter().chain(new).filter(|node| !on_both.contains(node)))
        .map(|&node| topology.position(node));
    let drone = drawn.drone.filter(|drone| drone.is_finite());
    let network = topology.bounds();
    let corners = drawn.answer.stages.iter().flat_map(|record| {
        let beyond = |corner: Point| {
            Point::new(
                corner.x.clamp(network.min.x, network.max.x),
                corner.y.clamp(network.min.y, network.max.y),
            )
        };
        corners_of(topology, &record.shape).into_iter().map(beyond)
    });
    Bounds::around(on_paths.chain(drone).chain(corners))
}

/// Points that a search area's shape reaches to; none for the whole network.
fn corners_of(topology: &Topology, shape: &AreaShape) -> Vec<Point> {
    let around = |centre: Point, reach_m: f64| {
        let middle = Bounds {
            min: centre,
            max: centre,
        };
        let grown = middle.grown(reach_m);
        [grown.min, grown.max]
    };
    match shape {
        AreaShape::Everything => Vec::new(),
        AreaShape::Circle { centre, radius_m } => around(*centre, *radius_m).to_vec(),
        AreaShape::Squares { squares } => squares
            .iter()
            .flat_map(|&(centre, half_side_m)| around(centre, half_side_m))
            .collect(),
        AreaShape::Polygon { corners } => corners.clone(),
        AreaShape::Grown { corners, added } => {
            let added = added.iter().map(|&node| topology.position(node));
            corners.iter().copied().chain(added).collect()
        }
    }
}

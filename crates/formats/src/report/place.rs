//! The places in a failure report: where the drone and the cause are, and whether that can be.

use super::names::find_named;
use super::problem::{ReadWarning, cut};
use crate::flight::Location;
use crate::geo::{Bounds, Point};
use crate::network::{NodeIx, Topology};
use crate::wire;

/// A place farther from the network than once around the equator, in metres, is not on Earth.
const NOT_ON_EARTH_BEYOND_M: f64 = 40_075_017.0;

/// A place, and how it is written so that it reads as exactly the same place again.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Spot {
    pub(crate) point: Point,
    pub(crate) written: Written,
}

/// How a place is written.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Written {
    /// In the coordinates of the network's file.
    Coordinates([f64; 2]),
    /// As a node.
    Node(NodeIx),
}

impl Spot {
    /// A position of the plane, moved by the little that writing it in the file's coordinates costs.
    pub(crate) fn known(topology: &Topology, position: Point) -> Option<Self> {
        Self::at(topology, topology.frame().from_plane(position))
    }

    /// The place at coordinates of the file; `None` where that is not on Earth.
    fn at(topology: &Topology, coordinates: [f64; 2]) -> Option<Self> {
        let [first, second] = coordinates;
        let frame = topology.frame();
        let beyond_degrees = frame.is_geographic() && (first.abs() > 180.0 || second.abs() > 90.0);
        let point = frame.to_plane(coordinates);
        let off_m = distance_to_box_m(topology.bounds(), point);
        let is_on_earth = point.is_finite() && !beyond_degrees && off_m <= NOT_ON_EARTH_BEYOND_M;
        is_on_earth.then_some(Self {
            point,
            written: Written::Coordinates(coordinates),
        })
    }

    /// The node that the place is stated as.
    pub(crate) fn node(&self) -> Option<NodeIx> {
        match self.written {
            Written::Node(node) => Some(node),
            Written::Coordinates(_) => None,
        }
    }

    /// Where a drone at this place is on a leg. One that has flown on since is not at its start any more.
    pub(crate) fn on_leg_from(&self, start: NodeIx, has_flown_on: bool) -> Location {
        match self.node() == Some(start) && !has_flown_on {
            true => Location::LegStart,
            false => Location::At(self.point),
        }
    }
}

/// The place that a field of a report states; `None`, with a warning, where it cannot be one.
pub(crate) fn find_place(
    topology: &Topology,
    place: &wire::Place,
    name: &str,
    warnings: &mut Vec<ReadWarning>,
) -> Option<Spot> {
    let mut ignore = |message| {
        warnings.push(ReadWarning::new("location_ignored", message));
        None
    };
    let frame = topology.frame();
    let coordinates = match place {
        wire::Place::Node(id) => {
            return match find_named(topology, id) {
                Some(node) => Some(Spot {
                    point: topology.position(node),
                    written: Written::Node(node),
                }),
                None => ignore(format!(
                    "'{name}' names the node '{}', which the network does not have, and is ignored",
                    cut(id.text())
                )),
            };
        }
        wire::Place::Planar { .. } if frame.is_geographic() => {
            return ignore(format!(
                "'{name}' is in metres and is ignored: this network has longitude and latitude"
            ));
        }
        wire::Place::Planar { x, y } => [*x, *y],
        wire::Place::Pair(pair) => *pair,
    };
    let spot = Spot::at(topology, coordinates);
    if spot.is_none() {
        let [first, second] = coordinates;
        let swapped = match frame.is_geographic() {
            true => "; longitude comes first: were they swapped?",
            false => "",
        };
        return ignore(format!(
            "'{name}' [{first}, {second}] is not on Earth and is ignored{swapped}"
        ));
    }
    spot
}

fn distance_to_box_m(bounds: Bounds, point: Point) -> f64 {
    let inside = Point::new(
        point.x.max(bounds.min.x).min(bounds.max.x),
        point.y.max(bounds.min.y).min(bounds.max.y),
    );
    inside.distance_m(point)
}

//! Routes in the formats of ground stations and maps: QGroundControl's plan and list of waypoints,
//! GPX, KML, GeoJSON.
//!
//! All of them have longitudes and latitudes, so that a route on a planar network is refused.
//! Heights keep their reference where the format can say it; where it cannot they are left out, or
//! the route is refused.

mod maps;
mod mission;
#[cfg(test)]
mod tests;

use crate::airspace::{Airspace, Zone};
use crate::compose::Composition;
use crate::delivery::{FlightComposition, FlightEnvironment};
use crate::feed::KML_MEDIA_TYPE;
use crate::flight::LegCourse;
use crate::geo::{Altitude, AltitudeBand, AltitudeReference, Point};
use crate::network::{NodeIx, SegmentIx, Topology};
use crate::wire::Waypoint;
use jiff::{SignedDuration, Timestamp};
use std::sync::Arc;
use thiserror::Error;

/// Zones farther from the route than this are no part of its fence, in metres.
const FENCE_REACH_M: f64 = 1_000.0;

/// A format that routes are written in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RouteFormat {
    /// A plan of QGroundControl: mission, fence and rally points.
    QgcPlan,
    /// A list of waypoints, `QGC WPL 110`.
    QgcWaypoints,
    /// GPX 1.1.
    Gpx,
    /// KML 2.2.
    Kml,
    /// GeoJSON (RFC 7946).
    GeoJson,
}

impl RouteFormat {
    /// All of them.
    pub const ALL: [Self; 5] = [
        Self::QgcPlan,
        Self::QgcWaypoints,
        Self::Gpx,
        Self::Kml,
        Self::GeoJson,
    ];

    /// Its media type; those of QGroundControl are not registered.
    pub const fn media_type(self) -> &'static str {
        match self {
            Self::QgcPlan => "application/vnd.qgroundcontrol.plan+json",
            Self::QgcWaypoints => "text/vnd.qgroundcontrol.waypoints",
            Self::Gpx => "application/gpx+xml",
            Self::Kml => KML_MEDIA_TYPE,
            Self::GeoJson => "application/geo+json",
        }
    }
}

/// A leg of a route.
#[derive(Clone, Debug)]
pub struct RouteLeg {
    /// The node it starts from.
    pub from: NodeIx,
    /// The node it ends at.
    pub to: NodeIx,
    /// Its segment.
    pub segment: SegmentIx,
    /// When it starts.
    pub departs: Timestamp,
    /// When it ends.
    pub arrives: Timestamp,
    /// Whether the drone lands at its end, to recharge or because the route ends there.
    pub lands: bool,
    /// The node to divert to from it.
    pub alternate: Option<NodeIx>,
}

/// A route to write.
#[derive(Clone, Debug)]
pub struct Route {
    /// What it is called.
    pub name: String,
    /// Its legs, in their order.
    pub legs: Vec<RouteLeg>,
    /// Speed over ground, in metres per second.
    pub speed_mps: f64,
    /// From where the drone is in the air to the first node; empty where it takes off there.
    pub lead_in: Vec<Waypoint>,
}

impl Route {
    /// The route of a plan with nominal times; `landings` are the legs, counted from 0, at whose
    /// ends it lands on the way.
    pub fn of_composition(
        name: String,
        composition: &Composition,
        departs: Timestamp,
        landings: &[usize],
    ) -> Self {
        let at = |seconds: f64| later(departs, seconds);
        let last = composition.legs.len().saturating_sub(1);
        let legs = composition.legs.iter().enumerate();
        let legs = legs.map(|(number, leg)| RouteLeg {
            from: leg.from,
            to: leg.to,
            segment: leg.segment,
            departs: at(leg.departure_s),
            arrives: at(leg.arrival_s),
            lands: number == last || landings.contains(&number),
            alternate: leg.safe.as_ref().map(|safe| safe.node),
        });
        let flown_s: f64 = composition
            .legs
            .iter()
            .map(|leg| leg.arrival_s - leg.departure_s)
            .sum();
        let length_m: f64 = composition.legs.iter().map(|leg| leg.length_m).sum();
        Self {
            name,
            legs: legs.collect(),
            speed_mps: mean_speed(length_m, flown_s),
            lead_in: Vec::new(),
        }
    }

    /// The route of a plan that is flown with its battery.
    pub fn of_flight(name: String, skies: &FlightEnvironment, flown: &FlightComposition) -> Self {
        let plan = &flown.plan;
        let last = plan.legs.len().saturating_sub(1);
        let lands_at = |number: usize| {
            let mut stops = plan.stops.iter();
            number == last || stops.any(|stop| stop.before_leg == number + 1)
        };
        let at = |seconds: f64| skies.instant(seconds).unwrap_or(Timestamp::MAX);
        let legs = plan.legs.iter().zip(&flown.contingencies).enumerate();
        let legs = legs.map(|(number, (leg, contingency))| RouteLeg {
            from: leg.from,
            to: leg.to,
            segment: leg.segment,
            departs: at(leg.enters_s),
            arrives: at(leg.leaves_s),
            lands: lands_at(number),
            alternate: contingency
                .safe
                .as_ref()
                .map(|alternate| alternate.safe.node),
        });
        let flown_s = plan
            .legs
            .iter()
            .map(|leg| leg.leaves_s - leg.enters_s)
            .sum();
        Self {
            name,
            legs: legs.collect(),
            speed_mps: mean_speed(flown.figures.distance_m, flown_s),
            lead_in: Vec::new(),
        }
    }
}

fn mean_speed(length_m: f64, time_s: f64) -> f64 {
    let speed_mps = length_m / time_s.max(1.0);
    (10.0 * speed_mps).round() / 10.0
}

fn later(instant: Timestamp, seconds: f64) -> Timestamp {
    let since =
        SignedDuration::try_from_secs_f64((1e6 * seconds).round() / 1e6).unwrap_or_default();
    instant.saturating_add(since).unwrap_or(Timestamp::MAX)
}

/// Why a route cannot be written.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
pub enum RouteProblem {
    /// A planar network.
    #[error("the network is planar, and the format has longitudes and latitudes")]
    Planar,
    /// No leg.
    #[error("the route has no leg: there is nothing to fly")]
    Empty,
    /// A mission needs heights.
    #[error("heights of the route are unknown, and a mission needs them; give nodes an altitude_m")]
    NoHeights,
    /// A mission knows heights above sea and above where it began.
    #[error("heights are above the ellipsoid or of several references, which a mission cannot say")]
    OtherReference,
}

/// A route as text.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct WrittenRoute {
    /// The text.
    pub text: String,
    /// What the format could not say.
    pub notes: Vec<String>,
}

/// A corner of a route.
#[derive(Clone, Debug, PartialEq)]
struct Corner {
    lon_lat: [f64; 2],
    height_m: Option<f64>,
    /// The node that it is over.
    node: Option<NodeIx>,
    time: Option<Timestamp>,
    lands: bool,
}

/// A route with all that is written of it.
struct Told<'a> {
    route: &'a Route,
    topology: &'a Topology,
    corners: Vec<Corner>,
    /// What heights are measured from; `None` where they are unknown or differ.
    reference: Option<AltitudeReference>,
    alternates: Vec<NodeIx>,
    fences: Vec<Arc<Zone>>,
}

/// Writes a route over an airspace; zones that close something near it while it is flown are its
/// fence.
///
/// # Errors
/// When the format cannot say it.
pub fn write_route(
    route: &Route,
    airspace: &Airspace,
    format: RouteFormat,
) -> Result<WrittenRoute, RouteProblem> {
    let topology = airspace.topology();
    if !topology.frame().is_geographic() {
        return Err(RouteProblem::Planar);
    }
    if route.legs.is_empty() {
        return Err(RouteProblem::Empty);
    }
    let told = tell(route, airspace);
    match format {
        RouteFormat::QgcPlan => mission::plan(&told),
        RouteFormat::QgcWaypoints => mission::waypoints(&told),
        RouteFormat::Gpx => Ok(maps::gpx(&told)),
        RouteFormat::Kml => Ok(maps::kml(&told)),
        RouteFormat::GeoJson => Ok(maps::geojson(&told)),
    }
}

fn tell<'a>(route: &'a Route, airspace: &'a Airspace) -> Told<'a> {
    let topology = airspace.topology();
    let lead_in = route.lead_in.iter().map(|place| Corner {
        lon_lat: [place.x, place.y],
        height_m: place.height_m,
        node: None,
        time: None,
        lands: false,
    });
    let mut corners: Vec<Corner> = lead_in.collect();
    let mut references = Vec::new();
    for leg in &route.legs {
        let course = LegCourse::of(topology, leg.from, leg.to, leg.segment);
        references.push(course.reference);
        let last = course.corners.len() - 1;
        for (number, corner) in course.corners.iter().enumerate() {
            let at_end = number == last;
            let told = Corner {
                lon_lat: topology.frame().from_plane(corner.place),
                height_m: corner.height_m,
                node: node_at(topology, corner.place, leg),
                time: match number {
                    0 => Some(leg.departs),
                    _ => at_end.then_some(leg.arrives),
                },
                lands: at_end && leg.lands,
            };
            let is_same = corners.last().is_some_and(|before| {
                before.lon_lat == told.lon_lat && before.height_m == told.height_m && !before.lands
            });
            if !is_same {
                corners.push(told);
            }
        }
    }
    let first = references.first().copied().flatten();
    let reference = first.filter(|first| references.iter().all(|other| *other == Some(*first)));
    let mut alternates: Vec<NodeIx> = Vec::new();
    for alternate in route.legs.iter().filter_map(|leg| leg.alternate) {
        if !alternates.contains(&alternate) {
            alternates.push(alternate);
        }
    }
    let fences = fences(route, airspace, &corners, reference);
    Told {
        route,
        topology,
        corners,
        reference,
        alternates,
        fences,
    }
}

fn node_at(topology: &Topology, place: Point, leg: &RouteLeg) -> Option<NodeIx> {
    let mut ends = [leg.from, leg.to].into_iter();
    ends.find(|&node| topology.position(node) == place)
}

/// The zones that close something while the route is flown, at its heights and near it.
fn fences(
    route: &Route,
    airspace: &Airspace,
    corners: &[Corner],
    reference: Option<AltitudeReference>,
) -> Vec<Arc<Zone>> {
    let (Some(first), Some(last)) = (route.legs.first(), route.legs.last()) else {
        return Vec::new();
    };
    let heights = || corners.iter().filter_map(|corner| corner.height_m);
    let altitude = |value_m: f64| reference.map(|reference| Altitude { value_m, reference });
    let band = AltitudeBand {
        lower: altitude(heights().fold(f64::INFINITY, f64::min)),
        upper: altitude(heights().fold(f64::NEG_INFINITY, f64::max)),
    };
    let lines = lines(airspace.topology(), corners);
    let closing = airspace.closures().filter(|(closure, _)| {
        let mut windows = closure.windows.iter();
        closure.windows.is_empty() || windows.any(|it| it.meets(first.departs, last.arrives))
    });
    let zones = closing.filter_map(|(closure, _)| closure.zone());
    let near = zones.filter(|zone| {
        let is_near = |&(from, to): &(Point, Point)| {
            let shape = zone.shape();
            shape.meets_segment(from, to, FENCE_REACH_M)
        };
        zone.terms().closes() && zone.band().may_meet(&band) && lines.iter().any(is_near)
    });
    near.cloned().collect()
}

/// The straight lines from corner to corner, in the plane of the network.
fn lines(topology: &Topology, corners: &[Corner]) -> Vec<(Point, Point)> {
    let place = |corner: &Corner| topology.frame().to_plane(corner.lon_lat);
    let ends = corners.windows(2);
    ends.map(|ends| (place(&ends[0]), place(&ends[1])))
        .collect()
}

impl Told<'_> {
    /// Where a node is, and its altitude as far as it is known.
    fn place(&self, node: NodeIx) -> ([f64; 2], Option<Altitude>) {
        let lon_lat = self
            .topology
            .frame()
            .from_plane(self.topology.position(node));
        (lon_lat, self.topology.node_altitude(node))
    }
}

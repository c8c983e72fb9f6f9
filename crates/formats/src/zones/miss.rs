//! What a zone that meets nothing was probably meant to be: most often a sign or an order of coordinates is lost.

use crate::airspace::{Zone, ZoneGeometry};
use crate::geo::{Bounds, Point};
use crate::network::Topology;

/// A way in which coordinates are lost, and what to say of it.
type Slip = (fn([f64; 2]) -> [f64; 2], &'static str);

const SLIPS: [Slip; 5] = [
    (|[lon, lat]| [lon, -lat], "the latitude has the other sign"),
    (|[lon, lat]| [-lon, lat], "the longitude has the other sign"),
    (
        |[lon, lat]| [-lon, -lat],
        "both coordinates have the other sign",
    ),
    (
        |[lon, lat]| [lat, lon],
        "longitude and latitude are swapped; longitude comes first",
    ),
    (
        |[lon, lat]| [lat, -lon],
        "longitude and latitude are swapped, and one has the other sign; longitude comes first",
    ),
];

/// Why a zone may meet neither node nor segment of a network, and what to look at.
pub fn miss_hint(zone: &Zone, topology: &Topology) -> String {
    let network = topology.bounds();
    let off_m = gap_m(zone.shape().bounds(), network);
    if off_m <= zone.margin_m() {
        return "it meets no node and no segment, though it lies among them; look at its size and its altitudes"
            .to_owned();
    }
    let off_km = off_m / 1_000.0;
    let far = format!("it meets no node and no segment: it lies {off_km:.1} km beyond the network");
    let frame = topology.frame();
    let [first, second] = middle(zone.geometry());
    // A zone may well lie beside the network, but seldom as far away as the network is wide.
    let reach_m = (network.max.x - network.min.x).max(network.max.y - network.min.y);
    let near = |point: Point| {
        gap_m(
            Bounds {
                min: point,
                max: point,
            },
            network,
        ) <= reach_m
    };
    if !frame.is_geographic() || near(frame.to_plane([first, second])) {
        return far;
    }
    let slip = SLIPS
        .iter()
        .find(|(undo, _)| near(frame.to_plane(undo([first, second]))));
    match slip {
        Some((undo, what)) => {
            let [lon, lat] = undo([first, second]);
            format!("{far}; did you mean [{lon}, {lat}] in place of [{first}, {second}]? ({what})")
        }
        None => far,
    }
}

/// A position in the middle of a zone, in the coordinates of its file.
fn middle(geometry: &ZoneGeometry) -> [f64; 2] {
    let rings: Vec<&[[f64; 2]]> = match geometry {
        ZoneGeometry::Circle { centre, .. } => return *centre,
        ZoneGeometry::Polygon(rings) => rings.iter().map(Vec::as_slice).collect(),
        ZoneGeometry::MultiPolygon(polygons) => {
            let rings = polygons.iter().flatten();
            rings.map(Vec::as_slice).collect()
        }
    };
    let corners = || rings.iter().flat_map(|ring| ring.iter());
    let between = |axis: usize| {
        let least = corners()
            .map(|corner| corner[axis])
            .fold(f64::INFINITY, f64::min);
        let most = corners()
            .map(|corner| corner[axis])
            .fold(f64::NEG_INFINITY, f64::max);
        f64::midpoint(least, most)
    };
    [between(0), between(1)]
}

/// How far two boxes are apart, in metres; 0 where they meet.
fn gap_m(one: Bounds, other: Bounds) -> f64 {
    let apart =
        |one: [f64; 2], other: [f64; 2]| (other[0] - one[1]).max(one[0] - other[1]).max(0.0);
    let east_m = apart([one.min.x, one.max.x], [other.min.x, other.max.x]);
    let north_m = apart([one.min.y, one.max.y], [other.min.y, other.max.y]);
    east_m.hypot(north_m)
}

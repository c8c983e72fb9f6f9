//! The corridor of the paper's motivating scenario: San Marcos to San Antonio, Texas.
//!
//! The paper (section 1.1) gives 94 km, the straight distance is about 74 km. This corridor is as
//! long as the paper's because it goes by towns: along the I-35 to New Braunfels, then not straight
//! on but by McQueeney and Marion in the south-east, and from Schertz on through the suburbs of San
//! Antonio. The towns are real, at approximate positions from general knowledge; every rooftop, pad
//! and segment is synthetic, drawn from a seed.

use super::draft::{Coordinates, NetworkDraft, NodeDraft, Role, SegmentDraft};
use super::neighbours::join_nearest;
use super::seeded::Seeded;
use super::survey::{plane_about, stated_length_m, stated_position};
use crate::geo::{Altitude, AltitudeBand, LocalPlane, Point};

/// The seed of the bundled corridor.
pub const CORRIDOR_SEED: u64 = 2;

/// The longest segment, in metres: the shortest range that the paper gives a delivery drone is 3
/// km.
const REACH_M: f64 = 3_000.0;
/// The largest number of segments at a node.
const MAX_NEIGHBOURS: usize = 8;
/// Rooftops along the road between two towns are about this far apart, in metres.
const STATION_SPACING_M: f64 = 1_500.0;
/// And up to this far beside it, in metres.
const STATION_OFFSET_M: f64 = 300.0;
/// Altitudes flown at above ground, in metres: above every roof, below the ceiling.
const BAND: AltitudeBand = AltitudeBand {
    lower: Some(Altitude::agl(60.0)),
    upper: Some(Altitude::agl(110.0)),
};

/// A town on the way.
struct Town {
    name: &'static str,
    lon_deg: f64,
    lat_deg: f64,
    /// Rooftops about its depot.
    rooftops: u16,
    /// How far from the depot they lie at most, along each axis, in metres.
    spread_m: f64,
    /// The highest of them, in metres above ground.
    highest_m: f64,
}

const fn town(name: &'static str, lat_deg: f64, lon_deg: f64, rooftops: u16) -> Town {
    Town {
        name,
        lon_deg,
        lat_deg,
        rooftops,
        spread_m: 1_500.0,
        highest_m: 12.0,
    }
}

/// The towns in the order in which the corridor goes through them.
const TOWNS: [Town; 13] = [
    Town {
        spread_m: 2_000.0,
        highest_m: 25.0,
        ..town("San Marcos", 29.8833, -97.9414, 30)
    },
    town("Hunter", 29.8016, -98.0350, 6),
    town("Gruene", 29.7386, -98.1047, 10),
    Town {
        spread_m: 2_000.0,
        highest_m: 20.0,
        ..town("New Braunfels", 29.7030, -98.1245, 30)
    },
    town("McQueeney", 29.5916, -98.0336, 8),
    town("Marion", 29.5713, -98.1403, 6),
    town("Cibolo", 29.5616, -98.2270, 12),
    town("Schertz", 29.5522, -98.2697, 18),
    town("Universal City", 29.5480, -98.2911, 12),
    town("Live Oak", 29.5652, -98.3364, 12),
    town("Windcrest", 29.5155, -98.3803, 10),
    town("Kirby", 29.4635, -98.3856, 10),
    Town {
        spread_m: 3_000.0,
        highest_m: 50.0,
        ..town("San Antonio", 29.4241, -98.4936, 50)
    },
];

/// Generates the corridor. Node `1` is the San Marcos depot, the last one the San Antonio depot.
pub fn san_marcos_san_antonio(seed: u64) -> NetworkDraft {
    let mut sites = Sites::new(seed);
    for (place, town) in TOWNS.iter().enumerate() {
        if place > 0 {
            sites.stations(&TOWNS[place - 1], town);
        }
        match place + 1 == TOWNS.len() {
            true => {
                sites.rooftops(town);
                sites.depot(town);
            }
            false => {
                sites.depot(town);
                sites.rooftops(town);
            }
        }
    }
    sites.network(seed)
}

/// The sites found so far.
struct Sites {
    seeded: Seeded,
    plane: LocalPlane,
    nodes: Vec<NodeDraft>,
    /// The depots and the stations between them, which are joined in this order whatever else is.
    spine: Vec<u32>,
}

impl Sites {
    fn new(seed: u64) -> Self {
        let degrees = TOWNS.iter().map(|town| [town.lon_deg, town.lat_deg]);
        let plane = plane_about(degrees).expect("there are towns");
        Self {
            seeded: Seeded::new(seed),
            plane,
            nodes: Vec::new(),
            spine: Vec::new(),
        }
    }

    fn depot(&mut self, town: &Town) {
        let pads = 4 + self.seeded.below(5);
        self.spine.push(self.nodes.len() as u32);
        let point = self.plane.project(town.lon_deg, town.lat_deg);
        self.add(format!("{} depot", town.name), point, 8.0, pads);
    }

    /// Rooftops about the depot, denser towards it.
    fn rooftops(&mut self, town: &Town) {
        let depot = self.plane.project(town.lon_deg, town.lat_deg);
        for number in 1..=town.rooftops {
            let [east_m, north_m] = [(); 2].map(|()| {
                let bell = self.seeded.unit() + self.seeded.unit() - 1.0;
                bell * town.spread_m
            });
            let height_m = self.seeded.between(4.0, town.highest_m);
            let pads = if self.seeded.unit() < 0.4 {
                1 + self.seeded.below(3)
            } else {
                0
            };
            let point = Point::new(depot.x + east_m, depot.y + north_m);
            self.add(format!("{} {number}", town.name), point, height_m, pads);
        }
    }

    /// Rooftops along the road from one town to the next.
    fn stations(&mut self, from: &Town, to: &Town) {
        let [start, end] = [from, to].map(|town| self.plane.project(town.lon_deg, town.lat_deg));
        let length_m = start.distance_m(end);
        let legs = (length_m / STATION_SPACING_M).round().max(1.0);
        let (east, north) = ((end.x - start.x) / length_m, (end.y - start.y) / length_m);
        for number in 1..legs as u32 {
            let on_road = start.towards(end, f64::from(number) / legs);
            let offset_m = self.seeded.between(-STATION_OFFSET_M, STATION_OFFSET_M);
            let point = Point::new(on_road.x - north * offset_m, on_road.y + east * offset_m);
            let height_m = self.seeded.between(4.0, 8.0);
            let pads = self.seeded.below(3);
            self.spine.push(self.nodes.len() as u32);
            self.add(
                format!("{} - {} {number}", from.name, to.name),
                point,
                height_m,
                pads,
            );
        }
    }

    fn add(&mut self, name: String, point: Point, height_m: f64, pads: u16) {
        let id = (self.nodes.len() + 1).to_string();
        self.nodes.push(NodeDraft {
            id,
            position: stated_position(self.plane.unproject(point)),
            altitude: Some(Altitude::agl((height_m * 10.0).round() / 10.0)),
            pads,
            role: if pads == 0 {
                Role::DeliveryTarget
            } else {
                Role::Both
            },
            name: Some(name),
        });
    }

    fn network(self, seed: u64) -> NetworkDraft {
        let positions = self.nodes.iter().map(|node| node.position);
        let plane = plane_about(positions.clone()).expect("there are towns");
        let points: Vec<Point> = positions
            .map(|[lon, lat]| plane.project(lon, lat))
            .collect();
        let mut pairs: Vec<(u32, u32)> = self
            .spine
            .windows(2)
            .map(|leg| (leg[0].min(leg[1]), leg[0].max(leg[1])))
            .collect();
        pairs.extend(join_nearest(&points, MAX_NEIGHBOURS, REACH_M, &pairs));
        pairs.sort_unstable();
        let segments = pairs.into_iter().map(|(from, to)| {
            let (from, to) = (from as usize, to as usize);
            SegmentDraft {
                id: None,
                from: self.nodes[from].id.clone(),
                to: self.nodes[to].id.clone(),
                length_m: Some(stated_length_m(points[from].distance_m(points[to]), 0.0)),
                band: BAND,
                speed_limit_mps: None,
            }
        });
        NetworkDraft {
            name: "San Marcos - San Antonio corridor (synthetic)".to_owned(),
            attribution: format!(
                "Synthetic: generated from seed {seed} about the approximate positions of real towns; no rooftop, pad or segment is real. \
                 About 94 km from depot to depot along the network (the figure of the paper), about 74 km in a straight line."
            ),
            coordinates: Coordinates::Geographic,
            integer_ids: true,
            segments: segments.collect(),
            aliases: Vec::new(),
            nodes: self.nodes,
        }
    }
}

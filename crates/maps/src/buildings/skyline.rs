//! From building footprints to a skyway: rooftops as nodes, clear lines of sight as segments.
//!
//! A flight starts `clearance_m` above its roof and goes straight to `clearance_m` above the other
//! (paper, section 3.1: rooftops joined by line-of-sight segments). A building is in its way where
//! the line comes within `clearance_m` of the footprint, measured on the plane, while it is lower
//! than the building's top plus `clearance_m`. Every building is solid from the ground to its top,
//! also where the map says that a part begins higher up; one of unknown height reaches the ceiling.
//!
//! **The building a flight starts from or lands on** cannot be kept that far away: the drone touches its
//! roof. Over the roof itself (the node's outline, and others that overlap it at the same height)
//! the drone keeps level and drops to the line beyond the edge, so the roof does not block: a line
//! that leaves a tower for a low roof would otherwise always meet the edge it has just left. Lower
//! outlines that overlap it, such as the podium of a tower, need no clearance, but the line must
//! not cut into them. A taller part of the same building blocks like any other building.

use super::footprint::{Building, plane_of};
use super::rooftops::{Footprints, Rooftop, choose};
use crate::geo::{Altitude, AltitudeBand, Bounds, Point, TOLERANCE_M};
use crate::network::survey::{plane_about, stated_length_m};
use crate::network::{Coordinates, NetworkDraft, NodeDraft, Role, SegmentDraft};
use rstar::RTree;
use rstar::primitives::GeomWithData;
use thiserror::Error;

/// How many recharging pads a roof has room for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PadRule {
    /// Roof area that one pad takes, with the room around it, in square metres; above 0.
    pub roof_area_per_pad_m2: f64,
    /// No roof has more pads than this.
    pub max_pads: u16,
}

impl PadRule {
    /// The pads of a roof of this area, in square metres: one for each full share.
    pub fn pads(&self, roof_area_m2: f64) -> u16 {
        let shares = (roof_area_m2 / self.roof_area_per_pad_m2).floor();
        shares.min(f64::from(self.max_pads)) as u16
    }
}

/// The rules by which a skyway is built from buildings. Heights are above ground.
#[derive(Clone, Debug, PartialEq)]
pub struct LineOfSight {
    /// Lowest roof that becomes a node, in metres.
    pub min_height_m: f64,
    /// Highest roof that becomes a node, in metres; with the clearance it stays below the ceiling.
    pub max_height_m: f64,
    /// Smallest roof that becomes a node, in square metres.
    pub min_roof_area_m2: f64,
    /// Longest segment, measured on the plane, in metres.
    pub reach_m: f64,
    /// Distance kept from every building, sideways and upwards, in metres.
    pub clearance_m: f64,
    /// Nothing is flown above this, in metres.
    pub ceiling_m: f64,
    /// How many pads a roof has.
    pub pads: PadRule,
    /// Takes nodes from this extract of the source alone; all buildings are obstacles all the same.
    ///
    /// Where extracts have a gap between them, a line across it would pass buildings that no one
    /// drew.
    pub extract: Option<String>,
}

impl Default for LineOfSight {
    fn default() -> Self {
        Self {
            min_height_m: 10.0,
            max_height_m: 115.0,
            min_roof_area_m2: 200.0,
            reach_m: 300.0,
            clearance_m: 5.0,
            ceiling_m: 120.0,
            pads: PadRule {
                roof_area_per_pad_m2: 400.0,
                max_pads: 8,
            },
            extract: None,
        }
    }
}

/// Why no skyway can be built.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum LineOfSightError {
    /// A rule is not a finite number above 0.
    #[error("{rule} is {value}; give a finite number above 0")]
    NotPositive {
        /// Name of the rule.
        rule: &'static str,
        /// Its value.
        value: f64,
    },
    /// The lowest roof is above the highest.
    #[error("min_height_m {min_height_m} is above max_height_m {max_height_m}; swap them")]
    HeightsReversed {
        /// Lowest roof, in metres.
        min_height_m: f64,
        /// Highest roof, in metres.
        max_height_m: f64,
    },
    /// The highest roofs would be flown from above the ceiling.
    #[error(
        "max_height_m {max_height_m} plus clearance_m {clearance_m} is above ceiling_m {ceiling_m}; lower max_height_m to {} or less",
        ceiling_m - clearance_m
    )]
    AboveCeiling {
        /// Highest roof, in metres.
        max_height_m: f64,
        /// Clearance, in metres.
        clearance_m: f64,
        /// Ceiling, in metres.
        ceiling_m: f64,
    },
    /// There are no buildings.
    #[error("there are no buildings; give at least two")]
    NoBuildings,
    /// No two roofs that qualify see each other.
    #[error(
        "no two of the {rooftops} roofs that qualify see each other; {}",
        remedy(*rooftops, *unknown_heights, *buildings)
    )]
    NoSegments {
        /// How many roofs qualify.
        rooftops: usize,
        /// Of how many buildings the height is unknown: none of them qualifies, and all are in the way.
        unknown_heights: usize,
        /// How many buildings there are.
        buildings: usize,
    },
}

/// What to do where no two roofs see each other: heights first, as without them every building is a wall.
fn remedy(rooftops: usize, unknown_heights: usize, buildings: usize) -> String {
    let widen = "widen the heights, the roof area, the reach or the extract";
    if unknown_heights * 2 > buildings || (rooftops == 0 && unknown_heights > 0) {
        return format!(
            "{unknown_heights} of {buildings} heights are unknown, and such a building counts as reaching the ceiling: \
             state them as the property height_m, or {widen}"
        );
    }
    widen.to_owned()
}

/// What the builder met.
#[derive(Clone, Debug, PartialEq, Eq, Default)]
pub struct SkylineReport {
    /// Buildings given.
    pub buildings: usize,
    /// Of these, those of unknown height.
    pub unknown_heights: usize,
    /// Roofs that qualify as nodes.
    pub rooftops: usize,
    /// Roofs that would, but a higher one of the same building is a node.
    pub overshadowed: usize,
    /// Pairs of rooftops within reach.
    pub pairs: usize,
    /// Of these, those that a building is in the way of.
    pub blocked_by_buildings: usize,
    /// Of the rest, those that are kept out by a zone.
    pub blocked_by_zones: usize,
    /// Ids of the buildings whose roofs see no other roof: they are not in the network.
    pub isolated: Vec<String>,
}

/// A skyway as built, with the report.
#[derive(Clone, Debug, PartialEq)]
pub struct Skyline {
    /// The network; name and attribution are empty, for the caller to fill in.
    pub network: NetworkDraft,
    /// What the builder met.
    pub report: SkylineReport,
}

/// Says whether a straight flight, in the band of altitudes given, is kept out of the air it goes
/// through.
///
/// Points lie on the plane of [`plane_of`] these buildings.
pub type KeepOut<'a> = &'a dyn Fn(Point, Point, &AltitudeBand) -> bool;

impl LineOfSight {
    /// Builds the skyway.
    ///
    /// The same buildings and rules give the same network, whatever the order of the buildings.
    /// Nodes are numbered from 1, west to east and then south to north. `progress` hears how many
    /// rooftops are done, and of how many.
    ///
    /// # Errors
    /// [`LineOfSightError`]: rules that contradict themselves, or nothing to build from.
    pub fn build(
        &self,
        buildings: &[Building],
        keep_out: KeepOut<'_>,
        progress: &mut dyn FnMut(usize, usize),
    ) -> Result<Skyline, LineOfSightError> {
        self.check()?;
        let plane = plane_of(buildings).ok_or(LineOfSightError::NoBuildings)?;
        let footprints = Footprints::on(plane, buildings);
        let rooftops = choose(self, buildings, &footprints);
        let sight = Sight {
            rules: self,
            buildings,
            footprints: &footprints,
        };
        let mut report = SkylineReport {
            buildings: buildings.len(),
            unknown_heights: buildings
                .iter()
                .filter(|building| building.height_m.is_none())
                .count(),
            rooftops: rooftops.chosen.len(),
            overshadowed: rooftops.overshadowed,
            ..SkylineReport::default()
        };
        let lines = sight.lines(&rooftops.chosen, keep_out, progress, &mut report);
        let mut is_joined = vec![false; rooftops.chosen.len()];
        for &(from, to) in &lines {
            is_joined[from] = true;
            is_joined[to] = true;
        }
        let isolated = rooftops
            .chosen
            .iter()
            .zip(&is_joined)
            .filter(|(_, joined)| !**joined);
        report.isolated = isolated
            .map(|(roof, _)| buildings[roof.building].id.clone())
            .collect();
        report.isolated.sort_unstable();

        let network = self.draft(buildings, &rooftops.chosen, &is_joined, &lines);
        let network = network.ok_or(LineOfSightError::NoSegments {
            rooftops: report.rooftops,
            unknown_heights: report.unknown_heights,
            buildings: report.buildings,
        })?;
        Ok(Skyline { network, report })
    }

    fn check(&self) -> Result<(), LineOfSightError> {
        let rules = [
            ("min_height_m", self.min_height_m),
            ("max_height_m", self.max_height_m),
            ("min_roof_area_m2", self.min_roof_area_m2),
            ("reach_m", self.reach_m),
            ("clearance_m", self.clearance_m),
            ("ceiling_m", self.ceiling_m),
            ("roof_area_per_pad_m2", self.pads.roof_area_per_pad_m2),
        ];
        let is_positive = |value: f64| value.is_finite() && value > 0.0;
        if let Some((rule, value)) = rules.into_iter().find(|&(_, value)| !is_positive(value)) {
            return Err(LineOfSightError::NotPositive { rule, value });
        }
        let (min_height_m, max_height_m) = (self.min_height_m, self.max_height_m);
        if min_height_m > max_height_m {
            return Err(LineOfSightError::HeightsReversed {
                min_height_m,
                max_height_m,
            });
        }
        let (clearance_m, ceiling_m) = (self.clearance_m, self.ceiling_m);
        if max_height_m + clearance_m > ceiling_m {
            return Err(LineOfSightError::AboveCeiling {
                max_height_m,
                clearance_m,
                ceiling_m,
            });
        }
        Ok(())
    }

    /// The network of the rooftops that are joined; `None` where none is.
    fn draft(
        &self,
        buildings: &[Building],
        rooftops: &[Rooftop],
        is_joined: &[bool],
        lines: &[(usize, usize)],
    ) -> Option<NetworkDraft> {
        let joined = || {
            rooftops
                .iter()
                .zip(is_joined)
                .filter(|(_, joined)| **joined)
        };
        let plane = plane_about(joined().map(|(roof, _)| roof.position))?;
        let mut ids = vec![String::new(); rooftops.len()];
        let mut nodes = Vec::new();
        for (place, roof) in rooftops
            .iter()
            .enumerate()
            .filter(|&(place, _)| is_joined[place])
        {
            let pads = self.pads.pads(roof.area_m2);
            ids[place] = (nodes.len() + 1).to_string();
            nodes.push(NodeDraft {
                id: ids[place].clone(),
                position: roof.position,
                altitude: Some(Altitude::agl(roof.height_m)),
                pads,
                role: if pads == 0 {
                    Role::DeliveryTarget
                } else {
                    Role::Both
                },
                name: buildings[roof.building].name.clone(),
            });
        }
        let segments = lines.iter().map(|&(from, to)| {
            let (start, end) = (&rooftops[from], &rooftops[to]);
            let ends = [start, end].map(|roof| plane.project(roof.position[0], roof.position[1]));
            let climb_m = end.height_m - start.height_m;
            SegmentDraft {
                id: None,
                from: ids[from].clone(),
                to: ids[to].clone(),
                length_m: Some(stated_length_m(ends[0].distance_m(ends[1]), climb_m)),
                band: self.band(start, end),
                speed_limit_mps: None,
            }
        });
        Some(NetworkDraft {
            coordinates: Coordinates::Geographic,
            integer_ids: true,
            segments: segments.collect(),
            nodes,
            ..NetworkDraft::default()
        })
    }

    fn band(&self, from: &Rooftop, to: &Rooftop) -> AltitudeBand {
        let altitudes = [from, to].map(|roof| roof.height_m + self.clearance_m);
        AltitudeBand {
            lower: Some(Altitude::agl(altitudes[0].min(altitudes[1]))),
            upper: Some(Altitude::agl(altitudes[0].max(altitudes[1]))),
        }
    }
}

/// Everything that decides who sees whom.
struct Sight<'a> {
    rules: &'a LineOfSight,
    buildings: &'a [Building],
    footprints: &'a Footprints,
}

impl Sight<'_> {
    /// The clear lines, each from the rooftop of the lower place to that of the higher, in order.
    fn lines(
        &self,
        rooftops: &[Rooftop],
        keep_out: KeepOut<'_>,
        progress: &mut dyn FnMut(usize, usize),
        report: &mut SkylineReport,
    ) -> Vec<(usize, usize)> {
        let reach_m = self.rules.reach_m;
        let points = rooftops.iter().enumerate();
        let entries =
            points.map(|(place, roof)| GeomWithData::new([roof.point.x, roof.point.y], place));
        let tree = RTree::bulk_load(entries.collect());
        let mut lines = Vec::new();
        for (from, start) in rooftops.iter().enumerate() {
            let around =
                tree.locate_within_distance([start.point.x, start.point.y], reach_m * reach_m);
            let mut within_reach: Vec<usize> = around
                .map(|entry| entry.data)
                .filter(|&to| to > from)
                .collect();
            within_reach.sort_unstable();
            report.pairs += within_reach.len();
            for to in within_reach {
                let end = &rooftops[to];
                if self.is_blocked(start, end) {
                    report.blocked_by_buildings += 1;
                } else if keep_out(start.point, end.point, &self.rules.band(start, end)) {
                    report.blocked_by_zones += 1;
                } else {
                    lines.push((from, to));
                }
            }
            progress(from + 1, rooftops.len());
        }
        lines
    }

    /// True when a building is in the way of the flight.
    fn is_blocked(&self, from: &Rooftop, to: &Rooftop) -> bool {
        let Some(flight) = Bounds::around([from.point, to.point]) else {
            return false;
        };
        let mut candidates = self
            .footprints
            .meeting(flight.grown(self.rules.clearance_m));
        candidates.any(|building| self.blocks(building, from, to))
    }

    /// True when this building is in the way of the flight.
    fn blocks(&self, building: usize, from: &Rooftop, to: &Rooftop) -> bool {
        let clearance_m = self.rules.clearance_m;
        let is_in = |parts: fn(&Rooftop) -> &Vec<usize>| {
            parts(from).contains(&building) || parts(to).contains(&building)
        };
        if is_in(|roof| &roof.level) {
            return false;
        }
        let (beside_m, above_m) = match is_in(|roof| &roof.lower) {
            true => (TOLERANCE_M, 0.0),
            false => (clearance_m, clearance_m),
        };
        let free_from_m = self.buildings[building]
            .height_m
            .map_or(f64::INFINITY, |top_m| top_m + above_m);
        let start_m = from.height_m + clearance_m;
        let end_m = to.height_m + clearance_m;
        if start_m.min(end_m) >= free_from_m {
            return false;
        }
        let footprint = self.footprints.of(building);
        let Some(passage) = footprint.passage(from.point, to.point, beside_m) else {
            return false;
        };
        // The line goes evenly up or down, so it is lowest at one end of the passage.
        let altitude_m = |moment: f64| start_m + (end_m - start_m) * moment;
        altitude_m(passage.first).min(altitude_m(passage.last)) < free_from_m
    }
}

#[cfg(test)]
mod tests;

//! First stretches of versions: a drone that takes a version over begins on the leg that it was on, and that is a leg of the
//! version like others, of which only a part is flown.

use skyway_engine::airspace::{Airspace, Closure};
use skyway_engine::compose::Occupation;
use skyway_engine::flight::{
    FailureReport, FirstStretch, Location, Reentry, StretchKind, StretchLeg,
};
use skyway_engine::geo::Point;
use skyway_engine::network::{Correspondence, NodeIx, Topology};
use skyway_engine::recompose::Recomposition;

/// How the drone of a version comes to its first node.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Stretch {
    pub(crate) reentry: Reentry,
    /// The closures that were known when it was worked out: it was led past them, or away from them.
    pub(crate) knew: Vec<String>,
}

impl Stretch {
    /// How the drone of an answer comes to the first node of its way. What its own report closes for others it knows of.
    pub(crate) fn of_answer(
        airspace: &Airspace,
        report: &FailureReport,
        told: &Recomposition,
    ) -> Option<Self> {
        let mut stretch = match told.reentry {
            Some(_) => Self::of(airspace, told.reentry),
            None => {
                let first = *told.path.nodes.first()?;
                Self::between(airspace, report, first, told.first_stretch_m)
            }
        }?;
        let segment = stretch.reentry.stretch.leg.and_then(|leg| leg.segment);
        if let Some(segment) = segment {
            let id = airspace.topology().segment_id(segment);
            stretch.knew.push(format!("report:{id}"));
        }
        Some(stretch)
    }

    /// The stretch of an answer; `None` where the drone is at the node.
    pub(crate) fn of(airspace: &Airspace, reentry: Option<Reentry>) -> Option<Self> {
        let reentry = reentry.filter(|reentry| reentry.stretch.kind != StretchKind::None)?;
        let stretch = Self {
            reentry,
            knew: Vec::new(),
        };
        let begin = stretch.begin();
        let knew = stretch.met_by(airspace, begin);
        Some(Self { knew, ..stretch })
    }

    /// The stretch of an answer that tells nothing but the node and the length.
    pub(crate) fn between(
        airspace: &Airspace,
        report: &FailureReport,
        first: NodeIx,
        length_m: f64,
    ) -> Option<Self> {
        let topology = airspace.topology();
        let (from, to) = report.leg;
        let [behind, ahead] = [from, to].map(|node| topology.position(node));
        // Where the place is unknown, it is the one farther off.
        let begin = match report.location {
            Location::At(place) => place,
            Location::LegStart => behind,
            Location::Unknown if first == from => ahead,
            Location::Unknown => behind,
        };
        let is_on_leg = first == from || first == to;
        let leg = is_on_leg.then(|| StretchLeg {
            from,
            to,
            segment: topology.segment_between(from, to),
            fraction: begin.fraction_along(behind, ahead),
        });
        let reentry = Reentry {
            node: first,
            stretch: FirstStretch {
                kind: match is_on_leg {
                    true => StretchKind::Leg,
                    false => StretchKind::Straight,
                },
                leg,
                length_m,
                overrun_m: 0.0,
                begin,
            },
        };
        Self::of(airspace, (length_m > 0.0).then_some(reentry))
    }

    /// The same on another network; `None` where its node is gone.
    pub(crate) fn carried_over(
        &self,
        to: &Topology,
        from: &Topology,
        correspondence: &Correspondence,
    ) -> Option<Self> {
        let stretch = self.reentry.stretch;
        let leg = stretch.leg.and_then(|leg| {
            let ends = [leg.from, leg.to].map(|node| correspondence.node(node));
            let [Some(behind), Some(ahead)] = ends else {
                return None;
            };
            Some(StretchLeg {
                from: behind,
                to: ahead,
                segment: to.segment_between(behind, ahead),
                fraction: leg.fraction,
            })
        });
        let begin = to.frame().to_plane(from.frame().from_plane(stretch.begin));
        Some(Self {
            reentry: Reentry {
                node: correspondence.node(self.reentry.node)?,
                stretch: FirstStretch {
                    leg,
                    begin,
                    ..stretch
                },
            },
            knew: self.knew.clone(),
        })
    }

    pub(crate) fn begin(&self) -> Point {
        self.reentry.stretch.begin
    }

    /// The leg that it runs on, as it was flown before; `None` where it runs straight.
    pub(crate) fn leg(&self) -> Option<(NodeIx, NodeIx)> {
        self.reentry.stretch.leg.map(|leg| (leg.from, leg.to))
    }

    /// The closures in force, but for those known before, that are in the way of a drone that is so far on it.
    pub(crate) fn obstructed_by(&self, airspace: &Airspace, place: Point) -> Vec<String> {
        let mut met = self.met_by(airspace, place);
        met.retain(|id| !self.knew.contains(id));
        met
    }

    fn met_by(&self, airspace: &Airspace, place: Point) -> Vec<String> {
        let topology = airspace.topology();
        let closures = airspace.in_force();
        let met = closures.filter(|closure| self.is_met(topology, closure, place));
        met.map(|closure| closure.id.clone()).collect()
    }

    /// Whether a closure lies ahead of a drone that is so far on it. One with a shape lies there;
    /// of any other it is unknown where on the leg, so that it is ahead of who flies on, and not in
    /// the way of who flies back.
    pub(crate) fn is_met(&self, topology: &Topology, closure: &Closure, place: Point) -> bool {
        let node = self.reentry.node;
        if let Some(zone) = closure.zone() {
            let segment = self.reentry.stretch.leg.and_then(|leg| leg.segment);
            let hits = &closure.hits;
            // In another band than that of its segment it is nowhere near.
            let is_in_band = segment
                .is_none_or(|segment| hits.segments.binary_search(&segment).is_ok())
                || hits.nodes.binary_search(&node).is_ok();
            return is_in_band && !zone.coverage(place, topology.position(node)).is_empty();
        }
        let segment = self.reentry.stretch.leg.and_then(|leg| leg.segment);
        let closes_leg = segment.is_some_and(|segment| {
            self.reentry.leads_on() && closure.hits.segments.binary_search(&segment).is_ok()
        });
        closes_leg || closure.hits.nodes.binary_search(&node).is_ok()
    }

    /// Whether it runs beside the network, so that no segment tells of it.
    pub(crate) fn is_off_network(&self) -> bool {
        self.occupation(0.0, 1.0).is_none()
    }

    /// When its segment is flown, in seconds of Unix time, as [`Reentry::leg`] tells it.
    pub(crate) fn occupation(&self, departs_s: f64, leaves_s: f64) -> Option<Occupation> {
        let leg = self.reentry.leg(departs_s, leaves_s)?;
        Some(Occupation {
            segment: leg.segment,
            from: leg.from,
            leg: 0,
            enters_s: leg.enters_s,
            leaves_s: leg.leaves_s,
        })
    }
}

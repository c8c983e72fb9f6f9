//! Small networks with a drone over them.

use jiff::{SignedDuration, Timestamp};
use skyway::airspace::{Airspace, Change, Closure, Hits, Window, Zone, ZoneDraft, ZoneGeometry};
use skyway::delivery::{
    BatteryNow, DEFAULT_REFUGE_STAY_S, DeliveryRequest, DeliveryScratch, DeliveryWorld,
    FlightComposition, FlightEnvironment, FlightFailure, FlightRecomposition, FlightTables,
    Landing, Lands, NoDelivery, OtherPlans, answer_failure, compose_with_stops,
};
use skyway::flight::{
    Airframe, Aloft, Circumstances, FailureReport, FailureType, FlightPlan, FlightRules,
    FlightStart, Location, Reservation, ServiceStop, Tariff, Wind, WindField,
};
use skyway::geo::{AltitudeBand, Point};
use skyway::itinerary::{FlightSetting, Limits, Objective};
use skyway::network::{NetworkDraft, NodeDraft, NodeIx, SegmentDraft, SegmentIx, Topology};
use skyway::recompose::{Flag, Request, Strategy};
use skyway::verify::{FlightFault, FlightPremises, verify_flight};
use std::sync::Arc;

/// Noon, which is second 0.
pub(crate) fn noon() -> Timestamp {
    "2026-11-27T12:00:00Z".parse().expect("a time")
}

/// A network, what is closed in it, and a drone.
pub(crate) struct Town {
    pub(crate) topology: Arc<Topology>,
    pub(crate) changes: Vec<Change>,
    pub(crate) others: OtherPlans,
    pub(crate) airframe: Airframe,
    pub(crate) payload_kg: f64,
    pub(crate) wind: Wind,
    pub(crate) rules: FlightRules,
    pub(crate) deadline_s: Option<f64>,
    /// Of compositions.
    pub(crate) limits: Limits<'static>,
}

impl Town {
    /// Nodes by id, place in metres and pads; segments by their ends. Nothing climbs.
    pub(crate) fn new(nodes: &[(&str, f64, f64, u16)], segments: &[(&str, &str)]) -> Self {
        let nodes = nodes.iter().map(|&(id, x, y, pads)| NodeDraft {
            id: id.to_owned(),
            position: [x, y],
            pads,
            ..NodeDraft::default()
        });
        let segments = segments.iter().map(|&(from, to)| SegmentDraft {
            from: from.to_owned(),
            to: to.to_owned(),
            ..SegmentDraft::default()
        });
        let draft = NetworkDraft {
            name: "town".to_owned(),
            nodes: nodes.collect(),
            segments: segments.collect(),
            ..NetworkDraft::default()
        };
        Self::of(Topology::build(draft, [0; 32]).expect("a town"), 0.0)
    }

    pub(crate) fn of(topology: Topology, unknown_climb_m: f64) -> Self {
        Self {
            topology: Arc::new(topology),
            changes: Vec::new(),
            others: OtherPlans::default(),
            airframe: Airframe::phantom3(),
            payload_kg: 0.0,
            wind: Wind::CALM,
            rules: FlightRules {
                unknown_climb_m,
                ..FlightRules::default()
            },
            deadline_s: None,
            limits: Limits::THOROUGH,
        }
    }

    pub(crate) fn node(&self, id: &str) -> NodeIx {
        self.topology.node(id).expect("a node of the town")
    }

    pub(crate) fn segment(&self, from: &str, to: &str) -> SegmentIx {
        let between = self
            .topology
            .segment_between(self.node(from), self.node(to));
        between.expect("a segment of the town")
    }

    /// A no-fly zone on segments, from one minute to another.
    pub(crate) fn zone(mut self, id: &str, segments: &[(&str, &str)], minutes: (i64, i64)) -> Self {
        let at = |minute: i64| noon() + SignedDuration::from_mins(minute);
        let window = Window::new(Some(at(minutes.0)), Some(at(minutes.1))).expect("a window");
        let zone = Arc::new(zone(id, vec![window], &self.topology));
        let segments = segments.iter().map(|(from, to)| self.segment(from, to));
        let closure = Closure {
            hits: Hits::new(segments.collect(), Vec::new()),
            ..Closure::of_zone(&self.topology, zone)
        };
        self.changes.push(Change::Put(Arc::new(closure)));
        self
    }

    /// A no-fly zone over a node and its segments, for good.
    pub(crate) fn closed_node(mut self, id: &str) -> Self {
        let zone = Arc::new(zone("over", Vec::new(), &self.topology));
        let node = self.node(id);
        let arcs = self.topology.arcs(node).iter();
        let segments = arcs
            .filter(|arc| self.topology.node_id(arc.to) != "b")
            .map(|arc| arc.segment);
        let closure = Closure {
            hits: Hits::new(segments.collect(), vec![node]),
            ..Closure::of_zone(&self.topology, zone)
        };
        self.changes.push(Change::Put(Arc::new(closure)));
        self
    }

    /// All pads of a node are another plan's, for a day.
    pub(crate) fn taken(mut self, id: &str) -> Self {
        let node = self.node(id);
        let pads = 0..self.topology.pads(node);
        self.others.reservations.extend(pads.map(|pad| Reservation {
            node,
            pad,
            from_s: 0.0,
            until_s: 86_400.0,
        }));
        self
    }

    /// A pad of a node is another plan's from now on for so many seconds.
    pub(crate) fn reserved(mut self, id: &str, pad: u16, until_s: f64) -> Self {
        let node = self.node(id);
        self.others.reservations.push(Reservation {
            node,
            pad,
            from_s: 600.0,
            until_s,
        });
        self
    }

    pub(crate) fn skies(&self) -> FlightEnvironment {
        let horizon = SignedDuration::from_mins(60);
        let open = Airspace::open(self.topology.clone(), 1, noon(), horizon);
        let airspace = open.apply(&self.changes, noon());
        FlightEnvironment::of(&airspace, self.others.clone(), &self.rules)
    }

    pub(crate) fn setting(&self, skies: &FlightEnvironment) -> FlightSetting {
        FlightSetting::new(
            self.topology.clone(),
            self.airframe.clone(),
            self.payload_kg,
            WindField::uniform(self.wind),
            self.rules,
            &skies.situation(),
        )
    }

    /// Composes a delivery from a full battery on, checks it, and gives it.
    pub(crate) fn compose(
        &self,
        source: &str,
        destination: &str,
        objective: Objective,
    ) -> Result<FlightComposition, NoDelivery> {
        let stops = (&[][..], Lands::AtDestination);
        self.compose_with_stops((source, destination), stops, objective)
    }

    /// The same with stops on the way.
    pub(crate) fn compose_with_stops(
        &self,
        (source, destination): (&str, &str),
        stops: (&[ServiceStop], Lands),
        objective: Objective,
    ) -> Result<FlightComposition, NoDelivery> {
        let skies = self.skies();
        let setting = self.setting(&skies);
        let tables = FlightTables::new(1 << 20);
        let world = DeliveryWorld {
            limits: self.limits,
            ..world(&skies, &setting, &tables)
        };
        let request = DeliveryRequest {
            pad: None,
            source: self.node(source),
            destination: self.node(destination),
            start_s: 0.0,
            began_s: 0.0,
            battery: 0.98,
            objective,
            deadline_s: self.deadline_s,
        };
        let mut scratch = DeliveryScratch::new(&self.topology);
        let composed = compose_with_stops(&world, &request, stops, &mut scratch);
        if let Ok(composition) = &composed {
            assert_eq!(self.check(composition, &skies), Ok(()), "{composition:#?}");
        }
        composed
    }

    /// What a drone is told that is so far on its leg; its plan is checked.
    pub(crate) fn answer(&self, failure: &Failure<'_>) -> FlightRecomposition {
        let skies = self.skies();
        let setting = self.setting(&skies);
        let tables = FlightTables::new(1 << 20);
        let world = world(&skies, &setting, &tables);
        let request = self.request(failure);
        let asked = FlightFailure {
            request: &request,
            at_s: 0.0,
            battery: failure.by_plan.unwrap_or(match failure.landing {
                Some(_) => BatteryNow::Assumed(failure.battery),
                None => BatteryNow::Given(failure.battery),
            }),
            objective: Objective::Distance,
            deadline_s: self.deadline_s,
            planned_stops: None,
            landing: failure.landing,
        };
        let mut scratch = DeliveryScratch::new(&self.topology);
        let answer = answer_failure(&world, &asked, &mut scratch);
        if let Some(composition) = &answer.composition {
            let checked = self.check(composition, &skies);
            match answer.flags.contains(&Flag::Unseparated) {
                // The checker of plans looks at no way back.
                true => assert!(
                    matches!(checked, Err(FlightFault::Traffic { .. }))
                        || answer.first_stretch_m > 0.0,
                    "{answer:#?}"
                ),
                false => assert_eq!(checked, Ok(()), "{answer:#?}"),
            }
        }
        answer
    }

    fn request(&self, failure: &Failure<'_>) -> Request {
        let (from, to) = failure.leg;
        let (from, to) = (self.node(from), self.node(to));
        let ends = [from, to].map(|node| self.topology.position(node));
        let report = FailureReport {
            failure: failure.kind,
            leg: (from, to),
            location: match failure.flown {
                Some(0.0) => Location::LegStart,
                Some(flown) => Location::At(between(ends, flown)),
                None => Location::Unknown,
            },
            cause_location: failure.cause.map(|at| between(ends, at)),
            destination: self.node(failure.destination),
            remaining_path: None,
        };
        let mut request = Request {
            strategy: failure.strategy,
            circumstances: Circumstances {
                aloft: failure.aloft,
                ..Circumstances::default()
            },
            ..Request::exact(report)
        };
        request.lead_by(failure.onward.clone());
        request
    }

    /// Flies a plan again in code that shares nothing with what made it.
    fn check(
        &self,
        composition: &FlightComposition,
        skies: &FlightEnvironment,
    ) -> Result<(), FlightFault> {
        self.fly(
            skies,
            &composition.plan,
            &Held {
                start: composition.plan.start,
                destination: composition.destination,
                began_s: composition.began_s,
                deadline_s: composition.deadline_s,
                reserve: composition.reserve,
                closed_segments: &composition.closed_segments,
            },
        )
    }

    pub(crate) fn fly(
        &self,
        skies: &FlightEnvironment,
        plan: &FlightPlan,
        held: &Held<'_>,
    ) -> Result<(), FlightFault> {
        verify_flight(
            plan,
            &FlightPremises {
                topology: &self.topology,
                airframe: &self.airframe,
                payload_kg: self.payload_kg,
                wind: &WindField::uniform(self.wind),
                rules: &self.rules,
                situation: &skies.situation(),
                starts: &[held.start],
                destination: held.destination,
                began_s: held.began_s,
                deadline_s: held.deadline_s,
                reserve: held.reserve,
                closed_segments: held.closed_segments,
            },
        )
    }

    pub(crate) fn ids(&self, nodes: &[NodeIx]) -> Vec<&str> {
        let nodes = nodes.iter();
        nodes.map(|&node| self.topology.node_id(node)).collect()
    }
}

/// What a plan is held against, beside the town.
pub(crate) struct Held<'a> {
    pub(crate) start: FlightStart,
    pub(crate) destination: NodeIx,
    pub(crate) began_s: f64,
    pub(crate) deadline_s: f64,
    pub(crate) reserve: f64,
    pub(crate) closed_segments: &'a [SegmentIx],
}

/// A failure on the way.
pub(crate) struct Failure<'a> {
    pub(crate) kind: FailureType,
    pub(crate) leg: (&'a str, &'a str),
    pub(crate) destination: &'a str,
    /// The fraction of the leg that is flown, if anybody knows.
    pub(crate) flown: Option<f64>,
    /// Where the cause is, likewise.
    pub(crate) cause: Option<f64>,
    pub(crate) battery: f64,
    /// What its plan has of the battery, where it does not tell.
    pub(crate) by_plan: Option<BatteryNow>,
    pub(crate) landing: Option<Landing>,
    pub(crate) aloft: Aloft,
    pub(crate) strategy: Strategy,
    /// Where the delivery goes by its stops; its destination first.
    pub(crate) onward: Vec<ServiceStop>,
}

impl Failure<'_> {
    /// On the leg from `a` to `b` with `c` ahead, at its start with a battery of 0.9.
    pub(crate) fn of(kind: FailureType) -> Self {
        Self {
            kind,
            leg: ("a", "b"),
            destination: "c",
            flown: Some(0.0),
            cause: None,
            battery: 0.9,
            by_plan: None,
            landing: None,
            aloft: Aloft::Airborne,
            strategy: Strategy::Exact,
            onward: Vec::new(),
        }
    }
}

pub(crate) fn world<'a>(
    skies: &'a FlightEnvironment,
    setting: &'a FlightSetting,
    tables: &'a FlightTables,
) -> DeliveryWorld<'a> {
    DeliveryWorld {
        skies,
        setting,
        tables,
        tariff: Tariff::default(),
        refuge_stay_s: DEFAULT_REFUGE_STAY_S,
        limits: Limits::THOROUGH,
        with_contingencies: true,
    }
}

fn between([from, to]: [Point; 2], share: f64) -> Point {
    Point::new(
        from.x + share * (to.x - from.x),
        from.y + share * (to.y - from.y),
    )
}

/// A small zone far from everything: what it closes is said elsewhere.
fn zone(id: &str, windows: Vec<Window>, topology: &Topology) -> Zone {
    let draft = ZoneDraft {
        id: id.to_owned(),
        name: None,
        reason: None,
        authority: None,
        geometry: ZoneGeometry::Circle {
            centre: [-50_000.0, -50_000.0],
            radius_m: 10.0,
        },
        band: AltitudeBand::UNLIMITED,
        windows,
        margin_m: 10.0,
        terms: Default::default(),
    };
    Zone::new(draft, topology.frame()).expect("a zone")
}

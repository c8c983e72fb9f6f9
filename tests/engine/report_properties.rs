//! What holds for every failure report: strict and lenient reading agree, a settled report written out
//! settles to the same request, whatever is settled is answered, and no bytes are too strange.

use crate::oracle::generate::Draw;
use jiff::{SignedDuration, Timestamp};
use serde_json::{Value, json};
use skyway::airspace::Airspace;
use skyway::flight::{Aloft, FailureType};
use skyway::formats::{
    IntoTerm, Known, KnownPlan, ParsedReport, lenient_report, load_network, parse_report,
    resolve_report, settled_report,
};
use skyway::geo::Point;
use skyway::network::{NodeIx, bundled, sketch};
use skyway::recompose::{Outcome, Scratch, World, recompose};
use skyway::wire::{
    DroneFacts, FailureReport, Id, OperationalDetail, Parameters, Place, Scope, Service, Strategy,
};
use std::sync::Arc;

fn airspaces() -> [Airspace; 2] {
    let sydney = load_network(bundled::SYDNEY_CBD).expect("the bundled network");
    let drawing = "
C...D
.....
A...B.E..Z";
    let segments = [("A", "B"), ("A", "C"), ("C", "D"), ("D", "B"), ("B", "E")];
    [sydney.topology, sketch(drawing, &segments)].map(|topology| {
        let now = Timestamp::UNIX_EPOCH;
        Airspace::open(Arc::new(topology), 1, now, SignedDuration::from_mins(60))
    })
}

/// Draws reports about a network: mostly sense, with a share of nonsense.
struct Reporter<'a> {
    draw: Draw,
    airspace: &'a Airspace,
}

impl Reporter<'_> {
    fn node(&mut self) -> NodeIx {
        let topology = self.airspace.topology();
        NodeIx(self.draw.below(topology.node_count()) as u32)
    }

    fn id(&mut self) -> Id<'static> {
        if self.draw.chance(0.1) {
            return Id::new("nowhere");
        }
        let node = self.node();
        let id = self.airspace.topology().node_id(node);
        Id::new(id.to_owned())
    }

    fn maybe<T>(&mut self, chance: f64, value: impl FnOnce(&mut Self) -> T) -> Option<T> {
        self.draw.chance(chance).then(|| value(self))
    }

    fn flag(&mut self) -> bool {
        self.draw.chance(0.5)
    }

    fn one_of<T: Copy>(&mut self, all: &[T]) -> T {
        all[self.draw.below(all.len())]
    }

    fn point(&mut self) -> Point {
        let bounds = self.airspace.topology().bounds();
        let (across, up) = (self.draw.unit() * 1.4 - 0.2, self.draw.unit() * 1.4 - 0.2);
        Point::new(
            bounds.min.x + across * bounds.width_m(),
            bounds.min.y + up * bounds.height_m(),
        )
    }

    fn place(&mut self) -> Place {
        let far = self.one_of(&[1.0, 1.0, 1.0, 1.0, 1.0, 2.0, -1.0, 1e9]);
        match self.draw.below(4) {
            0 => Place::Node(self.id()),
            1 => Place::Planar {
                x: self.draw.unit() * 400.0 * far,
                y: self.draw.unit() * 200.0,
            },
            _ => {
                let point = self.point();
                let pair = self.airspace.topology().frame().from_plane(point);
                Place::Pair([pair[0] * far, pair[1]])
            }
        }
    }

    /// A walk along segments, now and then with a leap.
    fn path(&mut self) -> Vec<NodeIx> {
        let airspace = self.airspace;
        let mut path = vec![self.node()];
        for _ in 0..self.draw.below(8) {
            let arcs = airspace.topology().arcs(path[path.len() - 1]);
            let next = match arcs.is_empty() || self.draw.chance(0.05) {
                true => self.node(),
                false => arcs[self.draw.below(arcs.len())].to,
            };
            path.push(next);
        }
        path
    }

    fn ids(&mut self) -> Vec<Id<'static>> {
        let path = self.path();
        let mut ids: Vec<Id<'static>> = Vec::new();
        for node in path {
            let id = skyway::formats::node_id(self.airspace.topology(), node).into_owned();
            let stray = self.maybe(0.03, Self::id);
            ids.push(stray.unwrap_or(id));
        }
        ids
    }

    fn time(&mut self) -> String {
        let times = ["1970-01-01T00:00:01Z", "1970-01-01T01:00:00Z", "yesterday"];
        self.one_of(&times).to_owned()
    }

    fn zone(&mut self) -> Value {
        let frame = *self.airspace.topology().frame();
        let point = self.point();
        let centre = frame.from_plane(point);
        let radius_m = self.draw.unit() * 300.0 - 20.0;
        json!({"type": "Feature", "properties": {"radius_m": radius_m},
            "geometry": {"type": "Point", "coordinates": centre}})
    }

    fn service(&mut self) -> Service {
        let leg = self.path();
        let id =
            |node: NodeIx| skyway::formats::node_id(self.airspace.topology(), node).into_owned();
        let ends = leg.get(1).map(|&to| (id(leg[0]), id(to)));
        let (from, to) = ends.unzip();
        Service {
            plan_id: self.maybe(0.3, |_| "plan".to_owned()),
            leg: self.maybe(0.3, |own| own.draw.below(9) as u32),
            from: from.or_else(|| self.maybe(0.5, Self::id)),
            to: to.or_else(|| self.maybe(0.5, Self::id)),
        }
    }

    fn report(&mut self) -> FailureReport {
        let types = FailureType::ALL.map(IntoTerm::into_term);
        let strategies = [
            Strategy::Exact,
            Strategy::TwoPhased,
            Strategy::CellDensity,
            Strategy::Radius,
            Strategy::Astar,
        ];
        FailureReport {
            id: self.maybe(0.3, Self::id),
            failure: self.maybe(0.8, |own| own.one_of(&types)),
            service: self.maybe(0.6, Self::service),
            location: self.maybe(0.5, Self::place),
            location_unknown: self.maybe(0.1, Self::flag),
            cause_location: self.maybe(0.2, Self::place),
            timestamp: self.maybe(0.3, Self::time),
            zone: self.maybe(0.2, Self::zone),
            drone: self.maybe(0.3, |own| DroneFacts {
                id: own.maybe(0.5, |_| "drone".to_owned()),
                battery_fraction: own.maybe(0.5, |own| own.draw.unit() * 2.0),
                payload_kg: own.maybe(0.5, |own| own.draw.unit()),
                airframe: None,
                airspeed_mps: own.maybe(0.5, |own| own.draw.unit() * 120.0),
            }),
            remaining_path: self.maybe(0.5, Self::ids),
            destination: self.maybe(0.5, Self::id),
            strategy: self.maybe(0.5, |own| own.one_of(&strategies)),
            scope: self.maybe(0.3, |own| own.one_of(&[Scope::Local, Scope::Global])),
            parameters: self.maybe(0.3, |own| Parameters {
                cell_size_m: own.maybe(0.5, |own| own.draw.unit() * 500.0),
                val_ratio: own.maybe(0.5, |own| own.draw.unit() - 0.1),
                stage_skipping: own.maybe(0.5, Self::flag),
                full_tree: own.maybe(0.5, Self::flag),
            }),
            objective: self.maybe(0.2, |own| own.one_of(&["time", "distance"]).to_owned()),
            optimum: self.maybe(0.2, Self::flag),
            deadline: self.maybe(0.2, Self::time),
            explain: self.maybe(0.2, Self::flag),
            dry_run: self.maybe(0.2, Self::flag),
            close: self.maybe(0.1, |own| vec![json!(own.id())]),
            airborne: self.maybe(0.3, Self::flag),
            location_age_s: self.maybe(0.2, |own| own.draw.unit() * 20.0 - 1.0),
            fraction: self.maybe(0.2, |own| own.draw.unit() * 1.2),
            detail: self.maybe(0.3, |own| {
                own.one_of(&[OperationalDetail::LandNow, OperationalDetail::Battery])
            }),
            node: self.maybe(0.2, Self::id),
            pads: self.maybe(0.2, |own| own.draw.below(3) as u32),
            ..FailureReport::default()
        }
    }
}

fn reports(share: u64, mut check: impl FnMut(u64, &Airspace, &mut Reporter<'_>)) {
    for airspace in &airspaces() {
        for seed in 0..share {
            let draw = Draw::new(seed ^ 0xfa17);
            check(seed, airspace, &mut Reporter { draw, airspace });
        }
    }
}

#[test]
fn strict_and_lenient_reading_agree() {
    reports(2_000, |seed, _, reporter| {
        let report = reporter.report();
        let body = json!(report);
        let strict = parse_report(body.to_string().as_bytes()).expect("an object");
        let expected = ParsedReport {
            report: report.clone(),
            warnings: Vec::new(),
        };
        assert_eq!(strict, expected, "seed {seed}: {body}");
        let lenient = lenient_report(body.clone()).expect("an object");
        assert_eq!(lenient, expected, "seed {seed}: {body}");
        let mut more = body;
        more["colour"] = json!("blue");
        let lenient = parse_report(more.to_string().as_bytes()).expect("an object");
        assert_eq!(lenient.report, report, "seed {seed}: {more}");
        let codes: Vec<&str> = lenient
            .warnings
            .iter()
            .map(|warning| warning.code)
            .collect();
        assert_eq!(codes, ["unknown_field"], "seed {seed}: {more}");
    });
}

#[test]
fn a_settled_report_by_itself_settles_to_the_same_request_and_is_answered() {
    let (mut settled_count, mut doubtful_count) = (0, 0);
    reports(3_000, |seed, airspace, reporter| {
        let topology = airspace.topology();
        let report = reporter.report();
        let path = reporter.path();
        let known = Known {
            plan: reporter.maybe(0.3, |own| KnownPlan {
                nodes: &path,
                leg: own.maybe(0.5, |own| own.draw.below(9)),
                before: None,
                is_meant: true,
            }),
            position: reporter.maybe(0.3, Reporter::point),
            position_age_s: 7.5,
            ground_speed_mps: reporter.maybe(0.3, |own| [0.0, 3.0][own.draw.below(2)]),
            airspeed_mps: reporter.maybe(0.5, |_| 12.5),
            is_grounded: reporter.maybe(0.2, |_| ()).is_some(),
            now: Some(Timestamp::UNIX_EPOCH),
            ..Known::nothing()
        };
        let mut warnings = Vec::new();
        let body = json!(report);
        let Ok(first) = resolve_report(&report, &known, airspace, &mut warnings) else {
            let is_lost = known.position.is_none()
                && path.len().min(2) * usize::from(known.plan.is_some()) < 2;
            assert!(is_lost, "seed {seed}: {body}");
            return;
        };
        let written = json!(settled_report(&first, topology)).to_string();
        let mut parsed = parse_report(written.as_bytes()).expect("an object");
        assert_eq!(parsed.warnings, [], "seed {seed}: {written}");
        let nothing = Known::nothing();
        let again = resolve_report(&parsed.report, &nothing, airspace, &mut parsed.warnings);
        let again = again.unwrap_or_else(|problem| panic!("seed {seed}: {problem} {written}"));
        let mut settled = first.request.clone();
        // That telemetry saw it slow at a node has no word in a report: it is taken to fly then.
        let is_slow = known.ground_speed_mps.is_some();
        if is_slow && settled.circumstances.aloft == Aloft::Unknown {
            settled.circumstances.aloft = again.request.circumstances.aloft;
        }
        assert_eq!(again.request, settled, "seed {seed}: {body}\n{written}");
        let left: Vec<&str> = parsed.warnings.iter().map(|warning| warning.code).collect();
        let allowed = ["location_doubtful"];
        assert!(
            left.iter().all(|code| allowed.contains(code)),
            "seed {seed}: {left:?} {written}"
        );
        settled_count += 1;
        doubtful_count += usize::from(first.doubts);
        let world = World {
            airspace,
            trees: None,
        };
        let answer = recompose(&world, &first.request, &mut Scratch::new(topology));
        let has_path = !answer.path.nodes.is_empty();
        assert_eq!(
            has_path,
            answer.outcome != Outcome::NoRoute,
            "seed {seed}: {body}"
        );
    });
    assert!(settled_count > 4_000, "{settled_count} reports settled");
    assert!(doubtful_count > 1_000 && doubtful_count < settled_count);
}

#[test]
fn no_bytes_are_too_strange() {
    let known = Known::nothing();
    reports(2_000, |_, airspace, reporter| {
        let mut body = json!(reporter.report()).to_string().into_bytes();
        for _ in 0..=reporter.draw.below(4) {
            let place = reporter.draw.below(body.len());
            match reporter.draw.below(3) {
                0 => body[place] = reporter.one_of(b"{}[]\",:0-9e.\\x\x00\xff n"),
                1 => drop(body.remove(place)),
                _ => body.truncate(place.max(1)),
            }
            if body.is_empty() {
                return;
            }
        }
        // That it comes back is all there is to show.
        if let Ok(mut parsed) = parse_report(&body) {
            let settled = resolve_report(&parsed.report, &known, airspace, &mut parsed.warnings);
            drop(settled);
        }
    });
}

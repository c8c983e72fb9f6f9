//! What edges showed and answered, against the log of the registry they follow.

use super::{Holding, Logged, Version, apply, holding_at};
use std::collections::BTreeMap;

/// What an edge had in force at a moment, as it said in one answer.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Sight {
    pub(crate) edge: String,
    pub(crate) moment: u64,
    /// The revision of the registry that it states.
    pub(crate) at: Version,
    pub(crate) zones: Holding,
    /// What it has not forwarded yet: the tag, or none for a deletion.
    pub(crate) waiting: BTreeMap<String, Option<String>>,
}

/// A route that an edge answered.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Route {
    pub(crate) edge: String,
    pub(crate) moment: u64,
    /// The revision of the registry that the answer states.
    pub(crate) at: Version,
    /// The positions of the drone and of the nodes that it is sent to, in metres.
    pub(crate) line_m: Vec<[f64; 2]>,
    /// At that moment its edge had lifted these zones, and not forwarded it yet.
    pub(crate) lifted: Vec<String>,
}

/// A circle that is closed, in metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Circle {
    pub(crate) center_m: [f64; 2],
    pub(crate) radius_m: f64,
}

/// A run of edges that follow a registry.
#[derive(Clone, Debug, Default)]
pub(crate) struct Run {
    /// The changes of zones of the registry, of its last epoch and of what it kept of those before.
    pub(crate) log: Vec<Logged>,
    pub(crate) sights: Vec<Sight>,
    pub(crate) routes: Vec<Route>,
    /// The shape of what has a tag.
    pub(crate) shapes: BTreeMap<String, Circle>,
    /// What every edge had in force once all faults were over and the time to catch up had passed.
    pub(crate) healed: Vec<Sight>,
    /// Whether additions of pages that were refused may be in force before their revision.
    pub(crate) early_additions: bool,
}

impl Run {
    /// Everything that must not have happened; nothing where all is well.
    pub(crate) fn violations(&self) -> Vec<String> {
        let mut violations = Vec::new();
        self.check_monotone(&mut violations);
        self.check_sights(&mut violations);
        self.check_routes(&mut violations);
        self.check_healed(&mut violations);
        violations
    }

    /// An edge never goes back: not to an older epoch, nor within one to an older revision.
    fn check_monotone(&self, violations: &mut Vec<String>) {
        let mut stated: Vec<(&str, u64, Version)> = Vec::new();
        let sights = self.sights.iter().chain(&self.healed);
        stated.extend(sights.map(|sight| (&*sight.edge, sight.moment, sight.at)));
        stated.extend(
            self.routes
                .iter()
                .map(|route| (&*route.edge, route.moment, route.at)),
        );
        stated.sort_unstable();
        for pair in stated.windows(2) {
            let [(edge, _, before), (next, moment, after)] = pair else {
                continue;
            };
            if edge == next && after < before {
                violations.push(format!(
                    "{edge} went back from {before} to {after} at {moment}"
                ));
            }
        }
    }

    /// What is in force is what holds at the stated revision, with what the edge has not forwarded yet.
    fn check_sights(&self, violations: &mut Vec<String>) {
        let mut replay = Replay::of(&self.log);
        let mut sights: Vec<&Sight> = self.sights.iter().collect();
        sights.sort_by_key(|sight| sight.at.revision);
        for sight in sights {
            let holding = replay.until(sight.at.revision);
            let Sight {
                edge,
                moment,
                at,
                zones,
                waiting,
            } = sight;
            for (id, tag) in holding {
                let is_shown = zones.get(id) == Some(tag) || waiting.contains_key(id);
                if !is_shown && !self.is_newer(id, zones.get(id), *at) {
                    let found = zones.get(id);
                    violations.push(format!(
                        "{edge} at {moment} states {at} and has {found:?} for zone {id}, which is {tag}"
                    ));
                }
            }
            for (id, tag) in zones {
                let is_known =
                    holding.contains_key(id) || waiting.get(id) == Some(&Some(tag.clone()));
                if !is_known && !self.is_newer(id, Some(tag), *at) {
                    violations.push(format!(
                        "{edge} at {moment} states {at} and has zone {id} ({tag}), which is not of that revision"
                    ));
                }
            }
        }
    }

    /// Whether it is from a later revision, and may be.
    fn is_newer(&self, id: &str, tag: Option<&String>, at: Version) -> bool {
        self.early_additions
            && self.log.iter().any(|change| {
                change.version.revision > at.revision
                    && change.id == id
                    && change.tag.is_some()
                    && change.tag.as_ref() == tag
            })
    }

    /// No answered route crosses a zone that is enforced at the revision that the answer states.
    fn check_routes(&self, violations: &mut Vec<String>) {
        let mut replay = Replay::of(&self.log);
        let mut routes: Vec<&Route> = self.routes.iter().collect();
        routes.sort_by_key(|route| route.at.revision);
        for route in routes {
            for (id, tag) in replay.until(route.at.revision) {
                let Some(circle) = self.shapes.get(tag) else {
                    continue;
                };
                if route.lifted.contains(id) || !crosses(&route.line_m, *circle) {
                    continue;
                }
                let Route {
                    edge, moment, at, ..
                } = route;
                violations.push(format!(
                    "{edge} at {moment} answered a route through zone {id} ({tag}), and states {at}"
                ));
            }
        }
    }

    /// In the end every edge has what the registry has.
    fn check_healed(&self, violations: &mut Vec<String>) {
        let holding = holding_at(&self.log, u64::MAX);
        for sight in &self.healed {
            if !sight.waiting.is_empty() {
                let waiting: Vec<&String> = sight.waiting.keys().collect();
                violations.push(format!("{} still has to forward {waiting:?}", sight.edge));
            }
            if sight.zones != holding {
                let missing = holding
                    .iter()
                    .filter(|(id, tag)| sight.zones.get(*id) != Some(*tag));
                let missing: Vec<_> = missing.collect();
                let further = sight.zones.keys().filter(|id| !holding.contains_key(*id));
                let further: Vec<_> = further.collect();
                violations.push(format!(
                    "{} is not like the registry in the end: without {missing:?}, and with {further:?}",
                    sight.edge
                ));
            }
        }
    }
}

/// What holds at one revision after the other: a long log is gone through once.
struct Replay<'a> {
    rest: &'a [Logged],
    holding: Holding,
}

impl<'a> Replay<'a> {
    fn of(log: &'a [Logged]) -> Self {
        Self {
            rest: log,
            holding: Holding::new(),
        }
    }

    /// What holds at a revision that is not before the one that was asked for last.
    fn until(&mut self, revision: u64) -> &Holding {
        let is_later = |change: &Logged| change.version.revision > revision;
        let count = self
            .rest
            .iter()
            .position(is_later)
            .unwrap_or(self.rest.len());
        let (now, rest) = self.rest.split_at(count);
        self.rest = rest;
        apply(&mut self.holding, now);
        &self.holding
    }
}

/// Whether a line leads through a circle.
pub(crate) fn crosses(line_m: &[[f64; 2]], circle: Circle) -> bool {
    let hits = |pair: &[[f64; 2]]| distance_m(circle.center_m, pair[0], pair[1]) < circle.radius_m;
    line_m.windows(2).any(hits)
}

/// How far a point is from a straight line between two others.
fn distance_m(point: [f64; 2], from: [f64; 2], to: [f64; 2]) -> f64 {
    let [dx, dy] = [to[0] - from[0], to[1] - from[1]];
    let [px, py] = [point[0] - from[0], point[1] - from[1]];
    let length = dx * dx + dy * dy;
    let share = match length > 0.0 {
        true => ((px * dx + py * dy) / length).clamp(0.0, 1.0),
        false => 0.0,
    };
    (px - share * dx).hypot(py - share * dy)
}

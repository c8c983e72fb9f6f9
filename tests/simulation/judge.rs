//! How a run is judged at its end: everything that was noted, held against the logs of all lives of the registry.

use crate::history::edges::{self, Sight};
use crate::history::{Logged, Version, holding_at, log};
use crate::kept::Kept;
use crate::outpost::Outpost;
use crate::places::tag_of_text;
use crate::world::{Notes, World};
use skyway::wire::{LoggedChange, ObjectKind};
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

/// No log is so long.
const FAR: u64 = 1_000_000;

fn zones_of(changes: &[LoggedChange]) -> Vec<Logged> {
    let zones = changes.iter().filter(|it| it.kind == ObjectKind::Zone);
    let logged = zones.map(|it| Logged {
        version: Version {
            epoch: it.epoch,
            revision: it.revision,
        },
        id: it.id.clone(),
        tag: it.body.as_deref().map(tag_of_text),
    });
    logged.collect()
}

/// Everything that must not have happened.
pub(crate) fn violations(world: &World, outposts: &[Arc<Outpost>]) -> Vec<String> {
    let notes = world.notes().clone();
    let healed: Vec<Sight> = outposts.iter().filter_map(|it| it.sight()).collect();
    let mut violations = notes.violations.clone();
    if healed.len() < outposts.len() {
        violations.push("not every edge has read the registry in the end".to_owned());
    }
    let annals = world.central.annals();
    violations.extend(of_log(world, outposts, &annals));
    violations.extend(of_edges(world, &notes, healed, &annals));
    let lost = notes.restored.iter();
    let lost: Vec<Logged> = lost.flat_map(|lost| zones_of(&lost.gone)).collect();
    let operations = world.recorder.operations();
    let holding = holding_at(&zones_of(&annals), u64::MAX);
    let kept = Kept {
        operations: &operations,
        sights: &notes.sights,
        holding: &holding,
        lost: &lost,
        decided: &notes.decided,
    };
    violations.extend(kept.violations());
    violations.extend(of_closures(&annals, outposts));
    violations
}

fn of_log(world: &World, outposts: &[Arc<Outpost>], annals: &[LoggedChange]) -> Vec<String> {
    let mut revisions: Vec<u64> = annals.iter().map(|it| it.revision).collect();
    revisions.dedup();
    let log = zones_of(annals);
    // Of lives that a backup has ended there is what the log has of them.
    let last = world.central.head().epoch;
    let ends = (1..last).map(|epoch| Version {
        epoch,
        revision: annals
            .iter()
            .filter(|it| it.epoch == epoch)
            .map(|it| it.revision)
            .max()
            .unwrap_or(0),
    });
    let run = log::Run {
        operations: world.recorder.operations(),
        holding: holding_at(&log, u64::MAX),
        log,
        revisions,
        restored: ends.collect(),
    };
    let mut violations = run.violations();
    // A change that met another one may be told again in its place; so may one of an edge that has told more than its
    // disk had when it crashed.
    let crashed = outposts.iter().filter(|outpost| outpost.begun() > 1);
    let mut told_again: Vec<String> = crashed.map(|it| format!("id: \"{}-", it.name())).collect();
    told_again.push("id: \"all-".to_owned());
    let may_be = |text: &str| told_again.iter().any(|id| text.contains(id));
    violations.retain(|text| !(text.starts_with("made twice") && may_be(text)));
    violations
}

/// What edges showed and answered, each against the log of the life of the registry that it stated.
fn of_edges(
    world: &World,
    notes: &Notes,
    healed: Vec<Sight>,
    annals: &[LoggedChange],
) -> Vec<String> {
    let mut logs: BTreeMap<u64, Vec<Logged>> = BTreeMap::new();
    for lost in &notes.restored {
        logs.insert(lost.epoch, zones_of(&lost.log));
    }
    let last = world.central.head().epoch;
    logs.insert(last, zones_of(annals));
    let mut violations = backwards(notes, &healed);
    for (&epoch, own) in &logs {
        let mut log = own.clone();
        // Additions of later lives may be in force, too, where their lists were refused.
        let later = logs.range(epoch + 1..).flat_map(|(_, log)| log);
        log.extend(later.map(|theirs| {
            let mut change = theirs.clone();
            change.version.revision += FAR;
            change
        }));
        let is_of = |at: Version| at.epoch == epoch;
        let sights = notes.sights.iter().filter(|sight| is_of(sight.at));
        let routes = notes.routes.iter().filter(|route| is_of(route.at));
        let run = edges::Run {
            log,
            sights: sights.cloned().collect(),
            routes: routes.cloned().collect(),
            shapes: notes.shapes.clone(),
            healed: match epoch == last {
                true => healed.clone(),
                false => Vec::new(),
            },
            early_additions: notes.has_bent,
        };
        violations.extend(run.violations());
    }
    violations
}

/// No edge goes back, over all lives of the registry.
fn backwards(notes: &Notes, healed: &[Sight]) -> Vec<String> {
    let mut stated: Vec<(&str, u64, Version)> = Vec::new();
    let sights = notes.sights.iter().chain(healed);
    stated.extend(sights.map(|it| (&*it.edge, it.moment, it.at)));
    let routes = notes.routes.iter();
    stated.extend(routes.map(|it| (&*it.edge, it.moment, it.at)));
    stated.sort_unstable();
    let mut violations = Vec::new();
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
    violations
}

/// In the end everyone has the same closures.
fn of_closures(annals: &[LoggedChange], outposts: &[Arc<Outpost>]) -> Vec<String> {
    let mut holding = BTreeSet::new();
    for change in annals.iter().filter(|it| it.kind == ObjectKind::Closure) {
        match change.body {
            Some(_) => holding.insert(change.id.clone()),
            None => holding.remove(&change.id),
        };
    }
    let mut violations = Vec::new();
    for outpost in outposts {
        let found = outpost.closures();
        if found != holding {
            let name = outpost.name();
            violations.push(format!(
                "{name} has the closures {found:?} in the end, and the registry {holding:?}"
            ));
        }
    }
    violations
}

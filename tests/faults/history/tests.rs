//! The checkers see what they are there for: histories made by hand, right ones and wrong ones.

use super::edges::{self, Circle, Route, Sight};
use super::log;
use super::objects;
use super::{Act, Holding, Logged, Operation, Outcome, Seen, Version};
use std::collections::BTreeMap;

fn version(revision: u64) -> Version {
    Version { epoch: 1, revision }
}

fn put(id: &str, tag: &str) -> Act {
    Act::Put {
        id: id.to_owned(),
        tag: tag.to_owned(),
    }
}

fn operation(act: Act, began: u64, outcome: Outcome) -> Operation {
    Operation {
        who: "w".to_owned(),
        act,
        began,
        ended: (outcome != Outcome::Unknown).then_some(began + 1),
        outcome,
        life: None,
    }
}

fn done(act: Act, began: u64, revision: u64) -> Operation {
    operation(act, began, Outcome::Done(Some(version(revision))))
}

fn read(id: &str, began: u64, seen: Option<(u64, &str)>) -> Operation {
    let seen = seen.map(|(revision, tag)| Seen {
        version: Some(version(revision)),
        tag: tag.to_owned(),
    });
    let act = Act::Read { id: id.to_owned() };
    operation(act, began, Outcome::Seen(seen))
}

fn logged(revision: u64, id: &str, tag: Option<&str>) -> Logged {
    Logged {
        version: version(revision),
        id: id.to_owned(),
        tag: tag.map(str::to_owned),
    }
}

fn holding(zones: &[(&str, &str)]) -> Holding {
    let owned = zones.iter();
    let owned = owned.map(|(id, tag)| ((*id).to_owned(), (*tag).to_owned()));
    owned.collect()
}

fn gone(id: &str) -> Act {
    Act::Delete { id: id.to_owned() }
}

/// Two zones, one of them lifted; an answer that never came, and a refusal.
fn right() -> log::Run {
    log::Run {
        operations: vec![
            done(put("a", "1"), 0, 2),
            done(put("b", "2"), 10, 3),
            read("a", 15, Some((2, "1"))),
            operation(put("c", "3"), 20, Outcome::Unknown),
            operation(put("d", "4"), 20, Outcome::Unknown),
            operation(put("a", "5"), 30, Outcome::Refused(412)),
            done(gone("b"), 40, 5),
            read("b", 50, None),
        ],
        log: vec![
            logged(2, "a", Some("1")),
            logged(3, "b", Some("2")),
            logged(4, "c", Some("3")),
            logged(5, "b", None),
        ],
        revisions: vec![1, 2, 3, 4, 5],
        holding: holding(&[("a", "1"), ("c", "3")]),
        restored: Vec::new(),
    }
}

#[track_caller]
fn finds(run: &log::Run, what: &str) {
    let violations = run.violations();
    let found = violations.iter().any(|violation| violation.contains(what));
    assert!(found, "no '{what}' in {violations:?}");
}

#[test]
fn a_history_that_is_right_has_no_violation() {
    assert_eq!(right().violations(), Vec::<String>::new());
}

#[test]
fn what_is_lost_is_found() {
    let mut run = right();
    run.log.remove(0);
    run.holding.remove("a");
    finds(&run, "acknowledged and lost");
    let mut run = right();
    run.revisions.remove(1);
    finds(&run, "revision 3 follows 1");
    let mut run = right();
    run.holding.insert("b".to_owned(), "2".to_owned());
    finds(&run, "zone b holds, and is not in the log");
    let mut run = right();
    run.holding.remove("c");
    finds(&run, "zone c is 3 by the log");
}

#[test]
fn what_was_not_to_happen_is_found() {
    let mut run = right();
    run.log.push(logged(6, "a", Some("5")));
    run.holding.insert("a".to_owned(), "5".to_owned());
    finds(&run, "no party did it, or it was refused");
    let mut run = right();
    run.log.push(logged(6, "c", Some("3")));
    finds(&run, "made twice");
}

#[test]
fn what_came_in_the_wrong_order_is_found() {
    let mut run = right();
    run.operations[0] = done(put("a", "1"), 100, 2);
    finds(&run, "was acknowledged before");
    let mut run = right();
    run.operations.push(read("a", 60, None));
    finds(&run, "not what held at");
    let mut run = right();
    run.operations.push(read("b", 60, Some((3, "2"))));
    finds(&run, "not what held at");
}

#[test]
fn what_a_backup_does_not_have_may_be_lost_and_nothing_else() {
    let mut run = right();
    run.log.truncate(2);
    run.revisions.truncate(3);
    run.holding = holding(&[("a", "1"), ("b", "2")]);
    run.restored.push(version(3));
    run.operations.truncate(6);
    run.operations.push(done(gone("b"), 40, 5));
    assert_eq!(run.violations(), Vec::<String>::new());
    run.restored[0] = version(1);
    finds(&run, "it was not in the backup");
}

fn sight(edge: &str, moment: u64, revision: u64, zones: &[(&str, &str)]) -> Sight {
    Sight {
        edge: edge.to_owned(),
        moment,
        at: version(revision),
        zones: holding(zones),
        waiting: BTreeMap::new(),
    }
}

fn route(revision: u64, y_m: f64) -> Route {
    Route {
        edge: "e".to_owned(),
        moment: 30,
        at: version(revision),
        line_m: vec![[0.0, y_m], [100.0, y_m]],
        lifted: Vec::new(),
    }
}

/// An edge that follows, and has a zone of its own that the registry does not know yet.
fn followed() -> edges::Run {
    let mut own = sight("e", 20, 3, &[("a", "1"), ("b", "2"), ("mine", "9")]);
    own.waiting.insert("mine".to_owned(), Some("9".to_owned()));
    let circle = Circle {
        center_m: [50.0, 10.0],
        radius_m: 5.0,
    };
    edges::Run {
        log: right().log,
        sights: vec![sight("e", 10, 2, &[("a", "1")]), own],
        routes: vec![route(3, 0.0), route(5, 10.0)],
        shapes: BTreeMap::from([("2".to_owned(), circle)]),
        healed: vec![sight("e", 90, 5, &[("a", "1"), ("c", "3")])],
        early_additions: false,
    }
}

#[track_caller]
fn finds_of_edges(run: &edges::Run, what: &str) {
    let violations = run.violations();
    let found = violations.iter().any(|violation| violation.contains(what));
    assert!(found, "no '{what}' in {violations:?}");
}

#[test]
fn an_edge_that_follows_has_no_violation() {
    assert_eq!(followed().violations(), Vec::<String>::new());
}

#[test]
fn an_edge_that_goes_back_or_shows_what_was_not_is_found() {
    let mut run = followed();
    run.sights.push(sight("e", 25, 2, &[("a", "1")]));
    finds_of_edges(&run, "went back from 1-3 to 1-2");
    let mut run = followed();
    run.sights[0].zones.clear();
    finds_of_edges(&run, "has None for zone a");
    let mut run = followed();
    run.sights[1].waiting.clear();
    finds_of_edges(&run, "which is not of that revision");
    let mut run = followed();
    let early = ("c".to_owned(), "3".to_owned());
    run.sights[0].zones.extend([early]);
    finds_of_edges(&run, "which is not of that revision");
    run.early_additions = true;
    assert_eq!(run.violations(), Vec::<String>::new());
}

#[test]
fn a_route_through_a_zone_is_found() {
    let mut run = followed();
    run.routes[0] = route(3, 6.0);
    finds_of_edges(&run, "answered a route through zone b");
    run.routes[0].lifted.push("b".to_owned());
    assert_eq!(run.violations(), Vec::<String>::new());
}

#[test]
fn an_edge_that_does_not_catch_up_is_found() {
    let mut run = followed();
    run.healed[0].zones.remove("c");
    finds_of_edges(&run, "not like the registry in the end");
    let mut run = followed();
    run.healed[0].waiting.insert("x".to_owned(), None);
    finds_of_edges(&run, "still has to forward");
}

#[test]
fn without_a_log_each_object_is_what_it_may_be() {
    let operations = vec![
        done(put("a", "1"), 0, 1),
        operation(gone("a"), 10, Outcome::Unknown),
        done(put("b", "2"), 20, 2),
        operation(put("b", "3"), 30, Outcome::Refused(412)),
    ];
    let check = |operations: &[Operation], zones: &[(&str, &str)]| {
        objects::violations(operations, &holding(zones)).len()
    };
    assert_eq!(check(&operations, &[("a", "1"), ("b", "2")]), 0);
    assert_eq!(check(&operations, &[("b", "2")]), 0);
    assert_eq!(check(&operations, &[("a", "1")]), 1, "lost");
    assert_eq!(check(&operations, &[("a", "1"), ("b", "3")]), 1, "refused");
    let mut seen = operations;
    seen.push(read("a", 40, None));
    assert_eq!(check(&seen, &[("b", "2")]), 0);
    assert_eq!(check(&seen, &[("a", "1"), ("b", "2")]), 1, "it has flipped");
    seen.push(read("b", 50, None));
    assert_eq!(check(&seen, &[]), 1, "it was not there before its end");
}

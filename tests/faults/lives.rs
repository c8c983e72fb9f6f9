//! What edges stated over all their lives: a process that was killed knows again what it had stored, and what it had
//! acknowledged was stored.

use crate::history::edges::{Circle, Route, Sight, crosses};
use crate::history::{Act, Holding, Operation, Outcome, Version};
use std::collections::BTreeMap;

/// What an answer of an edge says of it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Statement {
    pub(crate) edge: String,
    /// When it was asked for, and when it had come.
    pub(crate) began: u64,
    pub(crate) ended: u64,
    /// Its own epoch, of which each life has another, and revision.
    pub(crate) own: Version,
    /// The revision of the registry that it states.
    pub(crate) at: Version,
}

impl Statement {
    /// The edge in this life: within it, it never goes back.
    pub(crate) fn life(&self) -> String {
        format!("{}@{}", self.edge, self.own.epoch)
    }
}

/// The zones that an edge has in force.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Shown {
    pub(crate) statement: Statement,
    pub(crate) zones: Holding,
    /// What the registry has lifted and an operator has to decide here.
    pub(crate) held: Vec<String>,
}

impl Shown {
    /// The same as it is held against the log of the registry, where what was written at this edge does not count, as with
    /// that it may be ahead, nor what waits for an operator.
    pub(crate) fn sight(&self, own: &[String]) -> Sight {
        let apart = || own.iter().chain(&self.held);
        let mut zones = self.zones.clone();
        zones.retain(|id, _| !apart().any(|it| it == id));
        Sight {
            edge: self.statement.life(),
            moment: self.statement.began,
            at: self.statement.at,
            zones,
            waiting: apart().map(|id| (id.clone(), None)).collect(),
        }
    }
}

/// A run of edges that were killed. Those who write at an edge have names that begin with its name.
#[derive(Clone, Debug, Default)]
pub(crate) struct Run {
    /// What was answered, also without zones.
    pub(crate) statements: Vec<Statement>,
    pub(crate) shown: Vec<Shown>,
    pub(crate) routes: Vec<(Statement, Route)>,
    pub(crate) operations: Vec<Operation>,
    /// The shape of what has a tag.
    pub(crate) shapes: BTreeMap<String, Circle>,
    /// Whether additions of pages that were refused may be in force: also of what was lifted since.
    pub(crate) early_additions: bool,
}

impl Run {
    /// Everything that must not have happened.
    pub(crate) fn violations(&self) -> Vec<String> {
        let mut violations = Vec::new();
        let mut by_edge: BTreeMap<&str, Vec<&Statement>> = BTreeMap::new();
        for statement in &self.statements {
            by_edge.entry(&statement.edge).or_default().push(statement);
        }
        for (edge, mut statements) in by_edge {
            statements.sort_by_key(|statement| statement.began);
            check_own(&statements, &mut violations);
            self.check_stored(edge, &statements, &mut violations);
            self.check_kept(edge, &mut violations);
        }
        violations
    }

    fn of<'a>(&'a self, edge: &'a str) -> impl Iterator<Item = &'a Operation> {
        self.operations
            .iter()
            .filter(move |it| it.who.starts_with(edge))
    }

    /// With an acknowledgement is stored what was in force in the same life before its write began: no later life is behind
    /// that. What an earlier one has told last may have been lost with it.
    fn check_stored(&self, edge: &str, statements: &[&Statement], violations: &mut Vec<String>) {
        let mut lives: BTreeMap<u64, Vec<&Statement>> = BTreeMap::new();
        for statement in statements {
            let life = lives.entry(statement.own.epoch).or_default();
            life.push(statement);
        }
        let floor_of = |operation: &Operation| {
            let told = lives.get(&operation.life?)?.iter();
            let before = told.filter(|it| it.ended < operation.began);
            Some((operation.ended?, before.map(|it| it.at).max()?))
        };
        let done = self.of(edge).filter(|it| it.is_done());
        let mut floors: Vec<(u64, Version)> = done.filter_map(floor_of).collect();
        floors.sort_unstable();
        let mut floors = floors.into_iter().peekable();
        let mut floor = None;
        for statement in statements {
            while let Some((_, known)) = floors.next_if(|(ended, _)| *ended < statement.began) {
                floor = floor.max(Some(known));
            }
            if let Some(floor) = floor.filter(|floor| *floor > statement.at) {
                let Statement { began, at, .. } = statement;
                violations.push(format!(
                    "{edge} at {began} states {at}, and had stored {floor} with a write that it acknowledged"
                ));
            }
        }
    }

    /// The writes of zones at an edge, by id, in the order of the one who makes them.
    fn zones_of<'a>(&'a self, edge: &'a str) -> BTreeMap<&'a str, Vec<&'a Operation>> {
        let mut by_id: BTreeMap<&str, Vec<&Operation>> = BTreeMap::new();
        let writes = self
            .of(edge)
            .filter(|it| !matches!(it.act, Act::Read { .. }));
        for operation in writes.filter(|it| it.act.id().starts_with("zone-")) {
            by_id.entry(operation.act.id()).or_default().push(operation);
        }
        by_id
    }

    /// The zones that were written at an edge.
    pub(crate) fn own_zones(&self, edge: &str) -> Vec<String> {
        let own = self.zones_of(edge).into_keys();
        own.map(str::to_owned).collect()
    }

    /// A zone that was acknowledged at an edge is in force there until it is lifted or replaced, and no answered way
    /// leads through it.
    fn check_kept(&self, edge: &str, violations: &mut Vec<String>) {
        let zones = self.zones_of(edge);
        for shown in self.shown.iter().filter(|it| it.statement.edge == edge) {
            for last in zones.values().filter_map(|it| last(it, &shown.statement)) {
                let began = shown.statement.began;
                let found = shown.zones.get(last.act.id()).map(String::as_str);
                let may_be_early = self.early_additions && last.act.tag().is_none();
                if found != last.act.tag() && !may_be_early {
                    violations.push(format!("{edge} at {began} shows {found:?} after {last}"));
                }
            }
        }
        for (statement, route) in self.routes.iter().filter(|(it, _)| it.edge == edge) {
            for last in zones.values().filter_map(|it| last(it, statement)) {
                let circle = last.act.tag().and_then(|tag| self.shapes.get(tag));
                if circle.is_some_and(|circle| crosses(&route.line_m, *circle)) {
                    let began = statement.began;
                    violations.push(format!("{edge} at {began} answered a route through {last}"));
                }
            }
        }
    }
}

/// The write that says what a zone was at the time of a statement, where that is known.
fn last<'a>(operations: &[&'a Operation], at: &Statement) -> Option<&'a Operation> {
    let place = operations.partition_point(|it| it.began < at.ended);
    let is_refused = |it: &Operation| matches!(it.outcome, Outcome::Refused(_));
    let last = operations[..place]
        .iter()
        .rev()
        .find(|it| !is_refused(it))?;
    let is_over = last.ended.is_some_and(|end| end < at.began);
    is_over.then_some(*last)
}

/// The own revision of an edge never goes back, whatever happens to it.
fn check_own(statements: &[&Statement], violations: &mut Vec<String>) {
    for pair in statements.windows(2) {
        let (before, after) = (pair[0], pair[1]);
        if after.own < before.own {
            violations.push(format!(
                "{} went back from its revision {} to {} at {}",
                after.edge, before.own, after.own, after.began
            ));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn version(epoch: u64, revision: u64) -> Version {
        Version { epoch, revision }
    }

    fn statement(began: u64, own: Version, at: u64) -> Statement {
        Statement {
            edge: "e".to_owned(),
            began,
            ended: began + 1,
            own,
            at: version(1, at),
        }
    }

    fn put(began: u64, id: &str, tag: &str) -> Operation {
        Operation {
            who: "e0".to_owned(),
            act: Act::Put {
                id: id.to_owned(),
                tag: tag.to_owned(),
            },
            began,
            ended: Some(began + 2),
            outcome: Outcome::Done(None),
            life: Some(7),
        }
    }

    /// Two lives; in the first a zone was put.
    fn right() -> Run {
        let statements = vec![
            statement(0, version(7, 3), 4),
            statement(20, version(7, 5), 9),
            statement(30, version(8, 1), 5),
        ];
        let zones = Holding::from([("zone-a".to_owned(), "t".to_owned())]);
        let shown = Shown {
            statement: statements[2].clone(),
            zones,
            held: Vec::new(),
        };
        Run {
            shown: vec![shown],
            operations: vec![put(10, "zone-a", "t")],
            statements,
            ..Run::default()
        }
    }

    #[track_caller]
    fn finds(run: &Run, what: &str) {
        let violations = run.violations();
        let found = violations.iter().any(|violation| violation.contains(what));
        assert!(found, "no '{what}' in {violations:?}");
    }

    #[test]
    fn what_was_not_stored_may_be_read_again() {
        assert_eq!(right().violations(), Vec::<String>::new());
        let mut run = right();
        let mut later = put(24, "zone-b", "u");
        later.life = Some(8);
        run.operations.push(later);
        let zones = &mut run.shown[0].zones;
        zones.insert("zone-b".to_owned(), "u".to_owned());
        assert_eq!(run.violations(), Vec::<String>::new());
    }

    #[test]
    fn what_goes_back_or_is_lost_is_found() {
        let mut run = right();
        run.statements[2].at.revision = 3;
        finds(&run, "had stored 1-4");
        let mut run = right();
        run.statements[2].own = version(7, 4);
        finds(&run, "went back from its revision 7-5");
        let mut run = right();
        run.shown[0].zones.clear();
        finds(&run, "shows None after");
        let mut run = right();
        run.shapes.insert(
            "t".to_owned(),
            Circle {
                center_m: [50.0, 0.0],
                radius_m: 10.0,
            },
        );
        let route = Route {
            edge: "e@8".to_owned(),
            moment: 30,
            at: version(1, 5),
            line_m: vec![[0.0, 0.0], [100.0, 0.0]],
            lifted: Vec::new(),
        };
        run.routes.push((run.statements[2].clone(), route));
        finds(&run, "answered a route through");
    }
}

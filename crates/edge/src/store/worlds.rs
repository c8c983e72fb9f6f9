//! The worlds of decisions: what closed anything when an answer was given, each thing written once.
//!
//! Worlds are numbered in the order in which their answers are written. A **part** is what one closure closed; its
//! **span** says from which world to which it counted. So a world is put together from the parts whose spans it
//! lies in, and a world that differs from the one before by one zone costs one part.

use super::codec::{number_key, number_of, read, write};
use super::file::{Row, StoreFault, StoreFile, Table};
use crate::failures::views::recorded_closure;
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};
use skyway_contract::RecordedClosure;
use skyway_engine::airspace::{Airspace, Closure};
use skyway_engine::network::Topology;
use std::collections::{BTreeMap, VecDeque};
use std::sync::Arc;

/// Worlds known again by their revision: answers given side by side are written out of order.
const RECENT: usize = 64;

#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Span {
    id: String,
    digest: String,
    since: u64,
    until: Option<u64>,
}

impl Span {
    fn has(&self, world: u64) -> bool {
        self.since <= world && self.until.is_none_or(|until| world < until)
    }
}

/// A part that counts in the last world.
#[derive(Debug)]
struct Part {
    number: u64,
    digest: String,
    since: u64,
    /// What it is of; none where it was written before this start.
    closure: Option<Arc<Closure>>,
}

/// What the file has of worlds.
#[derive(Debug)]
pub(super) struct Worlds {
    last: u64,
    next_part: u64,
    parts: BTreeMap<String, Part>,
    /// Parts that ended: by the world in which they no longer counted.
    ended: BTreeMap<(u64, u64), ()>,
    recent: VecDeque<(Arc<Topology>, u64, u64)>,
}

impl Worlds {
    /// What the file has.
    pub(super) async fn load(file: &mut dyn StoreFile) -> Result<Self, StoreFault> {
        let mut worlds = Self {
            last: 0,
            next_part: 0,
            parts: BTreeMap::new(),
            ended: BTreeMap::new(),
            recent: VecDeque::new(),
        };
        for (key, body) in file.load(Table::Spans).await? {
            let number = number_of("a span", &key)?;
            let span: Span = read("span", &key, &body)?;
            worlds.next_part = worlds.next_part.max(number + 1);
            worlds.last = worlds.last.max(span.until.unwrap_or(span.since));
            match span.until {
                Some(until) => drop(worlds.ended.insert((until, number), ())),
                None => {
                    let part = Part {
                        number,
                        digest: span.digest,
                        since: span.since,
                        closure: None,
                    };
                    worlds.parts.insert(span.id, part);
                }
            }
        }
        Ok(worlds)
    }

    /// The number given last.
    pub(super) fn last(&self) -> u64 {
        self.last
    }

    /// Worlds given from now on come after this one.
    pub(super) fn begin_after(&mut self, world: u64) {
        self.last = self.last.max(world);
    }

    /// The number of the world of an airspace, with the rows that are missing for it.
    pub(super) fn number(&mut self, airspace: &Airspace, rows: &mut Vec<Row>) -> u64 {
        let (topology, revision) = (airspace.topology(), airspace.revision());
        let known = self
            .recent
            .iter()
            .find(|(of, at, _)| *at == revision && Arc::ptr_eq(of, topology));
        if let Some((_, _, world)) = known {
            return *world;
        }
        self.last += 1;
        let world = self.last;
        let mut before = std::mem::take(&mut self.parts);
        for closure in airspace.in_force() {
            let old = before.remove(&closure.id);
            let part = match old {
                Some(part) if part.is_of(closure) => part,
                old => self.renew(topology, closure, old, world, rows),
            };
            self.parts.insert(closure.id.clone(), part);
        }
        for (id, part) in before {
            self.end(id, &part, world, rows);
        }
        self.recent.push_back((topology.clone(), revision, world));
        if self.recent.len() > RECENT {
            self.recent.pop_front();
        }
        world
    }

    /// The part of a closure that is new, or perhaps another than before.
    fn renew(
        &mut self,
        topology: &Topology,
        closure: &Arc<Closure>,
        old: Option<Part>,
        world: u64,
        rows: &mut Vec<Row>,
    ) -> Part {
        let body = write(&recorded_closure(topology, closure));
        let digest = hex::encode(&Sha256::digest(&body)[..16]);
        if let Some(old) = old {
            if old.digest == digest {
                return Part {
                    closure: Some(closure.clone()),
                    ..old
                };
            }
            self.end(closure.id.clone(), &old, world, rows);
        }
        let number = self.next_part;
        self.next_part += 1;
        rows.push(Row::put(Table::Parts, number_key(number), body));
        let span = Span {
            id: closure.id.clone(),
            digest: digest.clone(),
            since: world,
            until: None,
        };
        rows.push(Row::put(Table::Spans, number_key(number), write(&span)));
        Part {
            number,
            digest,
            since: world,
            closure: Some(closure.clone()),
        }
    }

    fn end(&mut self, id: String, part: &Part, world: u64, rows: &mut Vec<Row>) {
        let span = Span {
            id,
            digest: part.digest.clone(),
            since: part.since,
            until: Some(world),
        };
        rows.push(Row::put(
            Table::Spans,
            number_key(part.number),
            write(&span),
        ));
        self.ended.insert((world, part.number), ());
    }

    /// Drops the parts that counted only in worlds before this one.
    pub(super) fn forget_before(&mut self, oldest: u64, rows: &mut Vec<Row>) {
        // Answers given side by side may be of worlds that were known a little earlier.
        let oldest = oldest.saturating_sub(RECENT as u64);
        let kept = self.ended.split_off(&(oldest + 1, 0));
        for (_, number) in std::mem::replace(&mut self.ended, kept).into_keys() {
            rows.push(Row::remove(Table::Spans, number_key(number)));
            rows.push(Row::remove(Table::Parts, number_key(number)));
        }
    }
}

impl Part {
    fn is_of(&self, closure: &Arc<Closure>) -> bool {
        let own = self.closure.as_ref();
        own.is_some_and(|own| Arc::ptr_eq(own, closure))
    }
}

/// Everything that closed anything in a world.
pub(super) async fn closures_of(
    file: &mut dyn StoreFile,
    world: u64,
) -> Result<Vec<RecordedClosure<'static>>, StoreFault> {
    let mut spans = Vec::new();
    for (key, body) in file.load(Table::Spans).await? {
        let span: Span = read("span", &key, &body)?;
        if span.has(world) {
            spans.push((span.id, key));
        }
    }
    spans.sort();
    let mut closures = Vec::with_capacity(spans.len());
    for (id, key) in spans {
        let body = file.read(Table::Parts, &key).await?;
        let body = body.ok_or_else(|| StoreFault::damaged(format!("the part '{id}' is gone")))?;
        closures.push(read("part", &key, &body)?);
    }
    Ok(closures)
}

//! Operators: those who change zones and closures at an edge, and those who change zones at the registry. Each has
//! zones of its own, which no other party touches, and some that all of them change.

use crate::history::edges::Circle;
use crate::history::{Act, Outcome, Version};
use crate::line::{Line, Taken};
use crate::outpost::Outpost;
use crate::places::{self, draw_circle, draw_segment, tag_of_text, zone};
use crate::rounds::Chance;
use crate::world::{Who, World};
use skyway::api::problem;
use skyway::edge::sync::ClientError;
use skyway::edge::{Edge, Idempotency, Refusal, ZoneWrite};
use skyway::registry::WriteOptions;
use skyway::wire::{self, ObjectKind};
use std::sync::Arc;
use std::time::Duration;

/// Zones that each has for itself, and that are for all.
const OWN: u64 = 7;
const SHARED: u64 = 4;

/// Names things and their versions.
struct Names {
    prefix: String,
    made: u64,
}

impl Names {
    fn draw(&self, chance: &mut Chance) -> String {
        match chance.below(100) {
            0..75 => format!("{}-{}", self.prefix, chance.below(OWN)),
            _ => format!("all-{}", chance.below(SHARED)),
        }
    }

    fn circle(&mut self, world: &World, id: &str, chance: &mut Chance) -> (String, Circle) {
        self.made += 1;
        let circle = draw_circle(id, chance);
        let tag = places::tag(&format!("{}/{}", self.prefix, self.made), circle);
        world.notes().shapes.insert(tag.clone(), circle);
        (tag, circle)
    }
}

/// One who works at an edge until the run is over.
pub(crate) async fn operate(outpost: Arc<Outpost>) {
    let world = outpost.world.clone();
    let who = Who::Operator(outpost.number);
    let mut operator = Operator {
        chance: world.chance(who, 0),
        names: Names {
            prefix: outpost.name(),
            made: 0,
        },
        outpost,
        who,
    };
    while !world.over.is_cancelled() {
        let pause = Duration::from_millis(operator.chance.below(1_200));
        world.pause(who, pause).await;
        operator.work().await;
    }
}

struct Operator {
    outpost: Arc<Outpost>,
    who: Who,
    chance: Chance,
    names: Names,
}

impl Operator {
    async fn work(&mut self) {
        let Some(edge) = self.outpost.edge() else {
            return;
        };
        let id = self.names.draw(&mut self.chance);
        match self.chance.below(100) {
            0..60 => self.put(&edge, id).await,
            60..85 => self.lift(&edge, id).await,
            85..93 => self.close(&edge).await,
            93..97 => self.open(&edge).await,
            _ => {
                let accepts = self.chance.below(2) == 0;
                self.outpost.decide_holds(|| accepts).await;
            }
        }
    }

    async fn put(&mut self, edge: &Arc<Edge>, id: String) {
        let world = self.outpost.world.clone();
        let (tag, circle) = self.names.circle(&world, &id, &mut self.chance);
        let write = self.write_of(edge, &id);
        let feature = zone(&id, &tag, circle);
        let put = edge.put_zone(&self.outpost.caller, feature, write);
        let putting = async { put.await.map(drop) };
        self.note(Act::Put { id, tag }, putting).await;
    }

    async fn lift(&mut self, edge: &Arc<Edge>, id: String) {
        let write = self.write_of(edge, &id);
        let lifted = edge.delete_zone(&self.outpost.caller, write, None);
        let lifting = async { lifted.await.map(drop) };
        self.note(Act::Delete { id }, lifting).await;
    }

    fn write_of(&self, edge: &Edge, id: &str) -> ZoneWrite {
        let known = edge.zone(&self.outpost.caller, id).ok();
        ZoneWrite {
            id: Some(id.to_owned()),
            if_match: known.map(|(_, etag)| etag),
            validate_only: false,
        }
    }

    /// Does something, and notes how it ended.
    async fn note(&self, act: Act, doing: impl Future<Output = Result<(), Refusal>>) {
        let world = &self.outpost.world;
        let begun = world.recorder.begin(&self.outpost.name(), act.clone());
        let life = self.outpost.begun();
        let done = doing.await;
        let is_same_life = self.outpost.begun() == life && self.outpost.edge().is_some();
        let outcome = match done {
            // A party that crashes meanwhile tells no one.
            _ if !is_same_life => Outcome::Unknown,
            Ok(()) => Outcome::Done(None),
            Err(refusal) => refused(&refusal),
        };
        world.tell(self.who, format!("{act:?}: {outcome:?}"));
        world.count(match outcome {
            Outcome::Done(_) => "acknowledged at edges",
            _ => "not acknowledged at edges",
        });
        world.recorder.end(&begun, outcome, None);
    }

    async fn close(&mut self, edge: &Arc<Edge>) {
        let (from, to) = draw_segment(&mut self.chance);
        let id = format!("closure-{}-{}", self.names.prefix, self.chance.below(3));
        let draft = wire::ClosureDraft {
            id: Some(id.clone()),
            segments: vec![format!("{from}-{to}")],
            ..wire::ClosureDraft::default()
        };
        let closed = edge.close(&self.outpost.caller, draft, Idempotency::default());
        let closed = closed.await.is_ok();
        let world = &self.outpost.world;
        world.tell(self.who, format!("closes {id}: {closed}"));
    }

    async fn open(&mut self, edge: &Arc<Edge>) {
        let id = format!("closure-{}-{}", self.names.prefix, self.chance.below(3));
        let lifted = edge
            .lift_closure(&self.outpost.caller, &id, None, None)
            .await;
        let world = &self.outpost.world;
        world.tell(self.who, format!("opens {id}: {}", lifted.is_ok()));
    }
}

fn refused(refusal: &Refusal) -> Outcome {
    match problem::document(refusal, None).status {
        status @ 400..500 => Outcome::Refused(status),
        _ => Outcome::Unknown,
    }
}

/// One who works at the registry until the run is over.
pub(crate) async fn administer(world: Arc<World>, number: usize) {
    let who = Who::Central(number);
    let mut clerk = Clerk {
        line: Line::new(&world, who, 0, &Taken::default()),
        chance: world.chance(who, 0),
        names: Names {
            prefix: who.name(),
            made: 0,
        },
        world: world.clone(),
        who,
    };
    while !world.over.is_cancelled() {
        let pause = Duration::from_millis(clerk.chance.below(1_500));
        world.pause(who, pause).await;
        let id = clerk.names.draw(&mut clerk.chance);
        clerk.work(id).await;
    }
}

struct Clerk {
    world: Arc<World>,
    who: Who,
    line: Line,
    chance: Chance,
    names: Names,
}

impl Clerk {
    /// Looks what there is, and changes it.
    async fn work(&mut self, id: String) {
        let Some(known) = self.read(&id).await else {
            return;
        };
        let act = match self.chance.below(100) {
            0..30 if known.is_some() => Act::Delete { id: id.clone() },
            0..90 => {
                let (tag, _) = self.names.circle(&self.world, &id, &mut self.chance);
                Act::Put {
                    id: id.clone(),
                    tag,
                }
            }
            _ => return,
        };
        let is_keyed = self.chance.below(2) == 0;
        let key = is_keyed.then(|| format!("key-{}-{}", self.names.prefix, self.world.now_ms()));
        let manner = WriteOptions {
            subject: self.names.prefix.clone(),
            key,
            fingerprint: format!("{act:?} {known:?}"),
            if_match: known.map(|version| format!("\"{version}\"")),
            validate_only: false,
            on_behalf_of: None,
        };
        // However often it is sent, it is one operation.
        let begun = self.world.recorder.begin(&self.names.prefix, act.clone());
        let mut outcome = Outcome::Unknown;
        for sent in 0..4 {
            outcome = match self.write(&act, &manner).await {
                // What was sent before may be in a backup.
                Outcome::Refused(_) if sent > 0 => Outcome::Unknown,
                known => known,
            };
            if !is_keyed || outcome != Outcome::Unknown {
                break;
            }
        }
        self.world.recorder.end(&begun, outcome, None);
    }

    async fn write(&self, act: &Act, manner: &WriteOptions) -> Outcome {
        let body = act.tag().map(|tag| {
            let circle = self.world.notes().shapes[tag];
            zone(act.id(), tag, circle).to_string()
        });
        let put = self
            .line
            .put(ObjectKind::Zone, act.id(), body.as_deref(), manner);
        let outcome = match put.await {
            Ok(written) => Outcome::Done(Some(Version {
                epoch: written.epoch,
                revision: written.revision,
            })),
            Err(error) => failed(&error),
        };
        self.world.tell(self.who, format!("{act:?}: {outcome:?}"));
        self.world.count(match outcome {
            Outcome::Done(_) => "acknowledged at the registry",
            _ => "not acknowledged at the registry",
        });
        outcome
    }

    /// The version of a zone, where it could be read.
    async fn read(&self, id: &str) -> Option<Option<Version>> {
        let act = Act::Read { id: id.to_owned() };
        let begun = self.world.recorder.begin(&self.names.prefix, act);
        let read = self.line.zone(id).await;
        let seen = match read {
            Ok((body, etag)) => Some(crate::history::Seen {
                version: Version::read(&etag),
                tag: tag_of_text(&body),
            }),
            Err(ClientError::Refused { status: 404, .. }) => None,
            Err(error) => {
                self.world.recorder.end(&begun, failed(&error), None);
                return None;
            }
        };
        let version = seen.as_ref().map(|seen| seen.version.expect("a version"));
        self.world.recorder.end(&begun, Outcome::Seen(seen), None);
        Some(version)
    }
}

fn failed(error: &ClientError) -> Outcome {
    match error {
        // The first sending may still be under way.
        ClientError::Refused { code, .. } if code == "idempotency_in_progress" => Outcome::Unknown,
        ClientError::Refused {
            status: status @ 400..500,
            ..
        } => Outcome::Refused(*status),
        _ => Outcome::Unknown,
    }
}

//! The state machine behind the writer: commands in, the next snapshot, events and replies out.
//!
//! It knows no thread and no clock: it is handed instants, and the same commands at the same instants make the
//! same state. A batch of commands makes one snapshot: what they change of the airspace is applied together,
//! then plans are looked over once.

mod affected;
mod airspace;
mod alarms;
mod checked;
mod clock;
mod contingencies;
mod doubted;
pub(crate) mod ends;
mod fleet;
mod guarded;
pub(crate) mod import;
mod mail;
mod migrated_ends;
mod migrated_plans;
mod news;
mod outbox;
mod pads;
mod replanning;
mod reviews;
mod silence;
mod store;
mod sync;
mod timers;
mod topology;
mod versions;

pub(crate) use airspace::check_new_zone;

use crate::drones::Drones;
use crate::events::Happening;
use crate::failures::guard::Guard;
use crate::network::replacement::Succession;
use crate::planner::{Concern, Planner};
use crate::plans::fleet::Detour;
use crate::replanning::{Look, Queue, Tally};
use crate::settings::Settings;
use crate::snapshot::{Snapshot, revision_text};
use crate::store::Health;
use crate::upstream::news::Flights;
use crate::upstream::{Ended, Told};
use crate::writer::commands::{Command, Done, Outcome, Reply};
use jiff::Timestamp;
use serde_json::Value;
use skyway_contract::{AlarmKind, Author, EventKind};
use skyway_engine::airspace::{Airspace, Change, Closure};
use skyway_engine::network::SegmentIx;
use skyway_service::intake::Expected;
use skyway_service::refusal::Refusal;
use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::sync::Arc;
use timers::{Due, HeardClock, Timers};

/// What a batch of commands came to, before any plan was looked at.
#[derive(Debug)]
pub(crate) struct Enforced {
    /// One for each command, in their order.
    pub(crate) done: Vec<Result<Done, Refusal>>,
    pub(crate) airspace_changed: bool,
    /// Whether something has ended before its time, or has become another thing.
    pub(crate) has_opened: bool,
    /// What plans have to be looked at for.
    pub(crate) look: Look,
}

/// The state that the writer alone changes.
#[derive(Debug)]
pub(crate) struct State {
    pub(crate) settings: Settings,
    pub(crate) next: Snapshot,
    pub(crate) drones: Arc<Drones>,
    pub(crate) planner: Arc<dyn Planner>,
    /// What the checker has not let pass.
    pub(crate) guard: Arc<Guard>,
    /// How the store stands: what must not be lost is refused while it fails.
    pub(crate) store: Arc<Health>,
    pub(crate) timers: Timers,
    /// The instant of the batch being carried out.
    pub(crate) now: Timestamp,
    /// How many timers and windows came due in it.
    pub(crate) fired: u64,
    /// Counts writes; versions of things are numbers of writes.
    pub(crate) writes: u64,
    /// What the commands of this batch change of the airspace.
    pub(crate) changes: Vec<Change>,
    pub(crate) events: Vec<Happening>,
    /// Plans that are over, in the order they ended.
    pub(crate) over: VecDeque<Arc<str>>,
    /// Plans that have to be looked over though no closure has changed.
    pub(crate) touched_plans: BTreeSet<Arc<str>>,
    /// Plans that are looked at again at an instant that is set.
    pub(crate) timed_looks: BTreeMap<Arc<str>, Timestamp>,
    /// Active plans with a first stretch beside the network, which no index of the air has.
    pub(crate) off_network: BTreeSet<Arc<str>>,
    /// When what an edge knew before was taken up; what drones had told was not.
    pub(crate) restored_at: Option<Timestamp>,
    /// Ids of plans that were cancelled and not known, the latest last.
    pub(crate) cancelled_before: VecDeque<Arc<str>>,
    /// What is taken of the air beside the versions of plans whose drones have not acknowledged, by
    /// plan.
    pub(crate) guarded: BTreeMap<Arc<str>, Vec<SegmentIx>>,
    /// Closures that close other things since the network changed in this batch.
    pub(crate) relaid: Vec<Arc<Closure>>,
    /// The plans whose drones are to be answered.
    pub(crate) queue: Queue,
    /// How the plans of each closure have been answered so far.
    pub(crate) tallies: BTreeMap<Arc<str>, Tally>,
    /// How many of the pending plans each closure meets.
    pub(crate) pending_counts: BTreeMap<Arc<str>, usize>,
    /// Plans whose contingencies are to be worked out.
    pub(crate) lacking_contingencies: BTreeSet<Arc<str>>,
    /// Plans that have taken something since the last wave began.
    pub(crate) occupied_since: BTreeSet<Arc<str>>,
    /// Whether a closure has been lifted or changed in this batch.
    pub(crate) has_opened: bool,
    /// Whether the weather has changed in this batch.
    pub(crate) weather_turned: bool,
    /// The network before the one in service, and what of it is there still: for commands that were made on it.
    pub(crate) succession: Option<Succession>,
    /// The alarms that have not ended, by kind and by what they are about.
    pub(crate) open_alarms: BTreeMap<(AlarmKind, Arc<str>), u64>,
    /// What was last heard of the clock.
    pub(crate) clock: HeardClock,
    /// The last versions at the registry that changes from here have made after the cursor.
    pub(crate) told: Told,
    /// Those that were taken from pages in doubt.
    pub(crate) doubted: Told,
    /// The versions at the registry of closures that have ended by themselves.
    pub(crate) ended: Ended,
    /// What the registry is to be told of plans.
    pub(crate) flights: Flights,
    /// Who has given the order that is being carried out, if anyone.
    pub(crate) author: Option<Arc<Author>>,
}

impl State {
    pub(crate) fn new(
        next: Snapshot,
        now: Timestamp,
        settings: Settings,
        drones: Arc<Drones>,
        planner: Arc<dyn Planner>,
    ) -> Self {
        Self {
            next,
            settings,
            drones,
            planner,
            guard: Arc::default(),
            store: Arc::default(),
            timers: Timers::default(),
            now,
            fired: 0,
            writes: 0,
            changes: Vec::new(),
            events: Vec::new(),
            over: VecDeque::new(),
            touched_plans: BTreeSet::new(),
            timed_looks: BTreeMap::new(),
            off_network: BTreeSet::new(),
            restored_at: None,
            cancelled_before: VecDeque::new(),
            guarded: BTreeMap::new(),
            relaid: Vec::new(),
            queue: Queue::default(),
            tallies: BTreeMap::new(),
            pending_counts: BTreeMap::new(),
            lacking_contingencies: BTreeSet::new(),
            occupied_since: BTreeSet::new(),
            has_opened: false,
            weather_turned: false,
            succession: None,
            open_alarms: BTreeMap::new(),
            clock: HeardClock::default(),
            told: Told::default(),
            doubted: Told::default(),
            ended: Ended::default(),
            flights: Flights::default(),
            author: None,
        }
    }

    /// The next instant at which something happens by itself.
    pub(crate) fn next_due(&self) -> Option<Timestamp> {
        let own = self.timers.next(self.clock.behind());
        let windows = self.next.airspace.next_change();
        own.into_iter().chain(windows).min()
    }

    /// Carries out commands, then what is due by now. Nothing here depends on how many plans there are.
    pub(crate) fn enforce(&mut self, commands: Vec<Command>, now: Timestamp) -> Enforced {
        let revision = self.next.airspace.revision();
        self.now = now;
        self.fired = 0;
        let done: Vec<Result<Done, Refusal>> = commands
            .into_iter()
            .map(|order| self.carry_out(order, now))
            .collect();
        self.follow_timers(now);
        let look = self.change_airspace(now);
        Enforced {
            done,
            airspace_changed: self.next.airspace.revision() != revision,
            has_opened: std::mem::take(&mut self.has_opened),
            look,
        }
    }

    /// The state as it is now, and what has happened since this was last asked.
    pub(crate) fn told(&mut self) -> (Arc<Snapshot>, Vec<Happening>) {
        self.tell_flights();
        (
            Arc::new(self.next.clone()),
            std::mem::take(&mut self.events),
        )
    }

    /// What is answered to commands, with what drones are told already.
    pub(crate) fn replies(
        &self,
        done: Vec<Result<Done, Refusal>>,
        detours: Vec<Detour>,
    ) -> Vec<Reply> {
        let detours = Arc::new(detours);
        let told = detours.iter().map(|detour| &*detour.plan.id).collect();
        let replies = done.into_iter().map(|done| {
            done.map(|done| Outcome {
                pending: self.pending_of(&done, &told),
                done: self.refreshed(done),
                durable: false,
                detours: detours.clone(),
            })
        });
        replies.collect()
    }

    pub(crate) fn carry_out(&mut self, order: Command, now: Timestamp) -> Result<Done, Refusal> {
        self.check_store(&order)?;
        match order {
            Command::PutZone { closure, expected } => self.put_zone(closure, &expected),
            Command::DeleteZone { id, expected } => self.delete_zone(&id, &expected),
            Command::ImportZones(update) => self.import_zones(&update),
            Command::PutClosure(entry) => self.put_closure(entry),
            Command::ChangeClosure {
                id,
                confirmed,
                until,
                expected,
            } => self.change_closure(&id, confirmed, until, &expected, now),
            Command::LiftClosure { id, expected } => self.lift_closure(&id, &expected),
            Command::Publish(publication) => Ok(self.publish_report(*publication)),
            Command::Propose(proposal) => Ok(self.propose(*proposal)),
            Command::DecideProposal { number, decision } => self.decide_proposal(number, decision),
            Command::Follow(followed) => self.follow(*followed),
            Command::Forwarded {
                number,
                upstream,
                epoch,
            } => {
                self.note_answered(number, upstream, epoch);
                Ok(Done::Nothing)
            }
            Command::NotForwarded {
                number,
                code,
                detail,
            } => {
                self.give_up(number, &code, &detail);
                Ok(Done::Nothing)
            }
            Command::News(order) => Ok(self.change_news(order)),
            Command::DecideHold { number, decision } => self.decide_hold(number, decision),
            Command::PutWeather { text, expected } => self.put_weather(text, &expected),
            Command::AddPlan(plan) => self.add_plan(*plan),
            Command::CancelPlan { id, when } => self.cancel_plan(&id, when),
            Command::AcknowledgePlan { id, version } => self.acknowledge_plan(&id, version),
            Command::DeclinePlan {
                id,
                version,
                reason,
            } => self.decline_plan(&id, version, reason),
            Command::CompletePlan { id, landed, place } => self.complete_plan(&id, landed, place),
            Command::ReleasePlan { id, ended_as } => self.release_plan(&id, ended_as),
            Command::SeePlan { id, seen } => Ok(self.see_plan(&id, seen)),
            Command::ProposeVersion { plan, version } => Ok(self.propose_version(&plan, *version)),
            Command::OfferVersion {
                plan,
                instead_of,
                version,
            } => Ok(self.offer_version(&plan, instead_of, *version)),
            Command::ReceiveMail { drone, through } => Ok(self.receive_mail(&drone, through)),
            Command::RaiseAlarm(draft) => Ok(Done::Alarm(self.raise_alarm(*draft, now))),
            Command::AcknowledgeAlarm { number, by } => self.acknowledge_alarm(number, by, now),
            Command::ReplaceNetwork(network) => self.replace_network(&network, now),
            Command::MadeOn { topology, command } => {
                self.carry_out_made_on(&topology, *command, now)
            }
            Command::By {
                author,
                reason,
                command,
            } => self.carry_out_by((author, reason), *command, now),
            Command::AdvanceTo(to) => Ok(self.advanced(to)),
            Command::Tick | Command::Settle => Ok(Done::Nothing),
        }
    }

    /// Carries out a command that somebody has given: they stand on all that it tells.
    fn carry_out_by(
        &mut self,
        (author, reason): (Arc<Author>, Option<Arc<str>>),
        order: Command,
        now: Timestamp,
    ) -> Result<Done, Refusal> {
        let told_before = self.events.len();
        self.author = Some(author);
        let done = self.carry_out(order, now);
        let author = self.author.take();
        for event in &mut self.events[told_before..] {
            event.by.clone_from(&author);
            event.reason.clone_from(&reason);
        }
        done
    }

    /// Something has happened, which is told with this batch.
    fn happen(&mut self, kind: EventKind, data: Value) {
        self.events.push(Happening::new(kind, data));
    }

    /// The number of the next write.
    pub(crate) fn write_number(&mut self) -> u64 {
        self.writes += 1;
        self.writes
    }

    /// Makes the airspace what the changes and the time make of it; gives what plans have to be looked at for.
    fn change_airspace(&mut self, now: Timestamp) -> Look {
        let before = self.next.airspace.clone();
        let clock_turned = std::mem::take(&mut self.clock.has_turned);
        let windows_turn =
            clock_turned || before.next_change().is_some_and(|instant| instant <= now);
        let changes = std::mem::take(&mut self.changes);
        let mut look = Look {
            in_force: std::mem::take(&mut self.relaid),
            has_turned_wind: std::mem::take(&mut self.weather_turned),
            ..Look::default()
        };
        if changes.is_empty() && !windows_turn && !look.has_turned_wind {
            return look;
        }
        self.has_opened = changes
            .iter()
            .any(|change| before.closure(changed_id(change)).is_some());
        let mut after = before.apply(&changes, now);
        if look.has_turned_wind {
            // Answers name the revision of the world that they were computed on, and the wind is part of it.
            after = after.at_next_revision();
        }
        let after = Arc::new(after);
        self.next.airspace = after.clone();
        self.next.revision = revision_text(self.next.epoch, after.revision());
        self.tell_turned_windows(&before, &after, &changes);
        look.in_force
            .retain(|closure| after.is_in_force(&closure.id));
        look.in_force.extend(newly_in_force(&before, &after));
        look.announced = changes
            .iter()
            .filter_map(|change| after.closure(changed_id(change)).cloned())
            .filter(|closure| !after.is_in_force(&closure.id))
            .collect();
        look.has_opened = after.opened_at() != before.opened_at();
        // What is only put lifts nothing.
        look.announcements = self.planner.minds(Concern::Announced, None)
            && (self.has_opened || windows_turn)
            && after.revision() != before.revision();
        look
    }

    fn tell_turned_windows(&mut self, before: &Airspace, after: &Airspace, changes: &[Change]) {
        let changed: BTreeSet<&str> = changes.iter().map(changed_id).collect();
        let unchanged = after
            .closures()
            .filter(|(closure, _)| !changed.contains(closure.id.as_str()));
        let (mut began, mut ended) = (Vec::new(), Vec::new());
        for (closure, in_force) in unchanged {
            if in_force != before.is_in_force(&closure.id) {
                match in_force {
                    true => began.push(closure.id.clone()),
                    false => ended.push(closure.id.clone()),
                }
            }
        }
        if !began.is_empty() || !ended.is_empty() {
            self.fired += (began.len() + ended.len()) as u64;
            let data = serde_json::json!({"began": began, "ended": ended});
            self.happen(EventKind::WindowsTurned, data);
        }
    }

    fn follow_timers(&mut self, now: Timestamp) {
        while let Some((due, now)) = self.timers.pop(now, self.clock.behind()) {
            self.fired += 1;
            match due {
                Due::Closure(id) => self.end_closure(&id, now),
                Due::Proposal(number) => self.expire_proposal(number, now),
                Due::Acknowledgement { plan, version } => {
                    self.miss_acknowledgement(&plan, version, now)
                }
                Due::Departure(plan) => self.depart(&plan),
                Due::TakeOff(plan) => self.tell_take_off(&plan),
                Due::Quote(plan) => self.expire_quote(&plan, now),
                Due::Arrival { plan, version } => self.pass_arrival(&plan, version, now),
                Due::Sign(plan) => self.miss_sign(&plan, now),
                Due::Silence(plan) => self.miss_plan(&plan, now),
                Due::Way(plan) => self.look_for_way(plan, now),
            }
        }
    }

    /// How many plans wait for their answer because of what was put, apart from those that are told with it.
    fn pending_of(&self, done: &Done, told: &BTreeSet<&str>) -> usize {
        let put = match done {
            Done::Zone { entry, .. } => entry.zone.id(),
            Done::Closure(entry) => &entry.closure.id,
            _ => return 0,
        };
        let waiting = self.pending_counts.get(put).copied().unwrap_or_default();
        let waits = |plan: &&&str| {
            let causes = self.next.pending.get(**plan);
            causes.is_some_and(|causes| causes.contains(put))
        };
        waiting.saturating_sub(told.iter().filter(waits).count())
    }

    /// What was done as the end of the batch has it: plans may have been looked over since.
    fn refreshed(&self, done: Done) -> Done {
        match done {
            Done::Plan(plan) => {
                let latest = self.next.plans.get(&plan.id).cloned();
                Done::Plan(latest.unwrap_or(plan))
            }
            Done::Advanced { to, .. } => self.advanced(to),
            other => other,
        }
    }
}

fn changed_id(change: &Change) -> &str {
    match change {
        Change::Put(closure) => &closure.id,
        Change::Lift(id) => id,
    }
}

/// The closures that count now and did not before, or do so in another form.
fn newly_in_force(before: &Airspace, after: &Airspace) -> Vec<Arc<Closure>> {
    let counting = after.in_force();
    let fresh = counting.filter(|closure| {
        let same = before
            .closure(&closure.id)
            .is_some_and(|old| Arc::ptr_eq(old, closure));
        !same || !before.is_in_force(&closure.id)
    });
    fresh.cloned().collect()
}

/// Checks what a write expects against the version there is.
pub(crate) fn check_expected(
    expected: &Expected,
    current: Option<u64>,
    epoch: u64,
    what: &str,
    id: &str,
) -> Result<(), Refusal> {
    let tag = current.map(|version| format!("\"{epoch}-{version}\""));
    expected.check(tag.as_deref(), what, id)
}

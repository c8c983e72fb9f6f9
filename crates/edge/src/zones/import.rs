//! A feed of zones, imported as one batch: one preview, one revision.

use crate::Edge;
use crate::background::give_way;
use crate::entries::{ProposalEntry, ProposedBy};
use crate::failures::publication::hits_bytes;
use crate::plans::fleet::Detour;
use crate::snapshot::Snapshot;
use crate::state::import::{FeedChanges, FeedUpdate};
use crate::views::{IDS_MAX, PLANS_TOLD_MAX, affected_plan};
use crate::writer::commands::{Command, Done, unexpected};
use jiff::{SignedDuration, Timestamp};
use skyway_contract::{self as wire, Fault, ImportAction};
use skyway_engine::airspace::{Airspace, Change, Closure, Zone};
use skyway_engine::network::Topology;
use skyway_formats::{
    FeedNote, FeedTerms, FeedZone, MAX_FEED_BYTES, ZoneCode, ZoneFeed, read_feed, zone_to_feature,
};
use skyway_service::access::Caller;
use skyway_service::refusal::{Code, Refusal};
use std::borrow::Cow;
use std::collections::BTreeSet;
use std::sync::Arc;
use std::sync::atomic::Ordering;

/// How large a feed may be, in bytes.
pub const FEED_BYTES_MAX: usize = MAX_FEED_BYTES;
/// How long what can be read of a refused zone is proposed, unless the feed is imported again before.
const PROPOSED_FOR: SignedDuration = SignedDuration::from_hours(24);
/// The longest name of a feed and the longest prefix, in characters.
const NAME_MAX: usize = 100;

/// How a feed is imported.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct FeedImport {
    /// Its name: what is absent from it the next time is lifted.
    pub feed: String,
    /// What is put before each identifier to make the id of a zone.
    pub prefix: String,
    /// Which of its zones the drones of the network are authorized for: kinds and identifiers.
    pub authorized: Vec<String>,
    /// The same checks and the same answer, without effect.
    pub validate_only: bool,
}

/// A feed that has been read, with what its zones close, and the state that it was worked out on.
struct ReadFeed {
    feed: ZoneFeed,
    update: FeedUpdate,
    on: Arc<Snapshot>,
}

/// What an import has come to.
struct Imported<'a> {
    feed: &'a str,
    /// The state that it was worked out on.
    before: &'a Snapshot,
    changes: &'a FeedChanges,
    airspace: &'a Airspace,
    detours: Vec<&'a Detour>,
    snapshot: &'a Snapshot,
    durable: bool,
    enforced: bool,
}

impl Edge {
    /// Imports a feed of zones: its valid zones apply, those that are refused are told and keep their last version, and those
    /// that it has no more are lifted.
    ///
    /// # Errors
    /// When the feed as a whole cannot be read, or there would be too many zones.
    pub async fn import_zones(
        self: &Arc<Self>,
        caller: &Caller,
        text: String,
        import: FeedImport,
    ) -> Result<wire::ZoneImport<'static>, Refusal> {
        check_name("?feed", &import.feed, "?feed=national")?;
        check_name("?prefix", &import.prefix, "")?;
        for rule in &import.authorized {
            check_name("?authorized", rule, "?authorized=req_authorization,LPR12")?;
        }
        let validate_only = import.validate_only;
        let read = self.read_feed(text, import).await?;
        if validate_only {
            return self.preview_import(read).await;
        }
        let ReadFeed { feed, update, on } = read;
        let (name, puts) = (update.feed.clone(), update.puts.clone());
        let command = Command::ImportZones(Box::new(update)).made_on(on.topology());
        let (outcome, snapshot) = self.command(command.by(caller)).await?;
        let Done::ZonesImported(changes) = outcome.done else {
            return Err(unexpected());
        };
        let ids: BTreeSet<&str> = puts.iter().map(|closure| closure.id.as_str()).collect();
        let is_met = |detour: &&Detour| {
            let mut causes = detour.plan.affected_by.iter();
            causes.any(|cause| ids.contains(cause.as_str()))
        };
        let imported = Imported {
            feed: &name,
            before: &on,
            changes: &changes,
            airspace: &snapshot.airspace,
            detours: outcome.detours.iter().filter(is_met).collect(),
            snapshot: &snapshot,
            durable: outcome.durable,
            enforced: true,
        };
        Ok(self.told_import(feed, &puts, &imported))
    }

    /// Reads a feed and works out what its zones close.
    async fn read_feed(
        self: &Arc<Self>,
        text: String,
        import: FeedImport,
    ) -> Result<ReadFeed, Refusal> {
        let on = self.on_network()?;
        let margin_m = self.settings.margin_m;
        let edge = self.clone();
        self.aside(move || {
            let topology = on.topology();
            let terms = FeedTerms {
                feed: &import.feed,
                prefix: &import.prefix,
                margin_m,
            };
            let mut feed = read_feed(&text, &terms, topology.frame())
                .map_err(|problem| Refusal::of_zone(vec![problem]))?;
            feed.authorize(&import.authorized);
            let mut update = FeedUpdate {
                feed: Arc::from(import.feed.as_str()),
                puts: Vec::new(),
                refused: BTreeSet::new(),
                outlines: Vec::new(),
                has_nameless: false,
            };
            for zone in &mut feed.zones {
                update.outlines.extend(edge.outlines(topology, zone));
                match &mut zone.outcome {
                    Ok(zones) => {
                        for zone in std::mem::take(zones) {
                            give_way();
                            let closure = Closure::of_zone(topology, Arc::new(zone));
                            update.puts.push(Arc::new(closure));
                        }
                    }
                    Err(_) => match &zone.identifier {
                        Some(identifier) => {
                            update.refused.insert(identifier.clone());
                        }
                        None => update.has_nameless = true,
                    },
                }
            }
            Ok(ReadFeed { feed, update, on })
        })
        .await?
    }

    /// What can be read of a zone that is refused, as proposals.
    fn outlines(&self, topology: &Topology, zone: &mut FeedZone) -> Vec<ProposalEntry> {
        let outlines = std::mem::take(&mut zone.outlines);
        if outlines.is_empty() {
            return Vec::new();
        }
        let faults: Arc<[Fault]> = faults(zone).into();
        let now = self.clock.now();
        let proposals = outlines.into_iter().map(|outline| {
            let source = outline.terms().source.as_ref();
            let feed = source.map_or_else(String::new, |source| format!("feed:{}", source.feed));
            let text_bytes = zone_to_feature(&outline).to_string().len();
            let closure = Arc::new(Closure::of_zone(topology, Arc::new(outline)));
            ProposalEntry {
                number: self.next_number.fetch_add(1, Ordering::Relaxed),
                reason: Cow::Borrowed("refused_in_feed"),
                proposed_at: now,
                expires_at: now.checked_add(PROPOSED_FOR).unwrap_or(Timestamp::MAX),
                by: ProposedBy::Feed {
                    faults: faults.clone(),
                },
                subject: Arc::from(feed),
                bytes: size_of::<ProposalEntry>() + text_bytes + hits_bytes(&closure),
                closure,
            }
        });
        proposals.collect()
    }

    /// What an import would do, in a world that is thrown away afterwards.
    async fn preview_import(
        self: &Arc<Self>,
        read: ReadFeed,
    ) -> Result<wire::ZoneImport<'static>, Refusal> {
        let edge = self.clone();
        self.aside(move || {
            let ReadFeed { feed, update, on } = read;
            let changes = FeedChanges::of(&on, &update);
            changes.check_room(&on, edge.settings.zones_max)?;
            let brought: Vec<Arc<Closure>> = changes
                .brought
                .iter()
                .filter(|(_, action)| *action != ImportAction::Unchanged)
                .map(|(place, _)| update.puts[*place].clone())
                .collect();
            let puts = brought.iter().cloned().map(Change::Put);
            let lifts = changes.absent.iter();
            let lifts = lifts
                .filter(|(_, action)| *action == ImportAction::Removed)
                .map(|(id, _)| Change::Lift(id.to_string()));
            let all: Vec<Change> = puts.chain(lifts).collect();
            let now = edge.clock.now();
            let (airspace, detours) = edge.imagine(&on, &all, &brought, now);
            let imported = Imported {
                feed: &update.feed,
                before: &on,
                changes: &changes,
                airspace: &airspace,
                detours: detours.iter().collect(),
                snapshot: &on,
                durable: false,
                enforced: false,
            };
            Ok(edge.told_import(feed, &update.puts, &imported))
        })
        .await?
    }

    fn told_import(
        &self,
        feed: ZoneFeed,
        puts: &[Arc<Closure>],
        imported: &Imported<'_>,
    ) -> wire::ZoneImport<'static> {
        let Imported {
            changes, snapshot, ..
        } = imported;
        let taken: Vec<wire::RefusedZone<'static>> = changes
            .taken
            .iter()
            .map(|place| taken_id(&puts[*place]))
            .collect();
        let entries = feed.zones.iter();
        let refused: Vec<wire::RefusedZone<'static>> = entries
            .filter_map(|zone| refused_zone(zone, changes))
            .chain(taken)
            .collect();
        let count = |action| changes.count(action);
        let counts = wire::ImportCounts {
            created: count(ImportAction::Created),
            changed: count(ImportAction::Changed),
            unchanged: count(ImportAction::Unchanged),
            removed: count(ImportAction::Removed),
            held: count(ImportAction::Held),
            kept: count(ImportAction::Kept),
            refused: refused.len(),
            proposed: changes.proposed.len(),
        };
        let told = imported.detours.iter().take(PLANS_TOLD_MAX);
        let topology = snapshot.topology();
        wire::ZoneImport {
            feed: Cow::Owned(imported.feed.to_owned()),
            format: Cow::Borrowed(feed.format.name()),
            counts,
            zones: imported_zones(puts, imported),
            refused: refused.into_iter().take(IDS_MAX).collect(),
            further_notes: feed.further_notes,
            notes: feed.notes.into_iter().map(note).collect(),
            plan_count: imported.detours.len(),
            plans: told.map(|detour| affected_plan(topology, detour)).collect(),
            enforced: imported.enforced,
            durable: imported.durable,
            stamp: self.stamp_of(snapshot),
        }
    }
}

/// The zones that an import says something of, those that change first.
fn imported_zones(
    puts: &[Arc<Closure>],
    imported: &Imported<'_>,
) -> Vec<wire::ImportedZone<'static>> {
    let changes = imported.changes;
    let brought = changes.brought.iter().filter_map(|(place, action)| {
        let zone = puts[*place].zone()?;
        Some((*action, zone.clone()))
    });
    let absent = changes.absent.iter().filter_map(|(id, action)| {
        let before = imported.before.zones.get(id)?;
        Some((*action, before.zone.clone()))
    });
    let mut all: Vec<(ImportAction, Arc<Zone>)> = brought.chain(absent).collect();
    all.sort_by_key(|(action, _)| *action == ImportAction::Unchanged);
    let told = all.into_iter().take(IDS_MAX);
    told.map(|(action, zone)| imported_zone(action, &zone, imported.airspace))
        .collect()
}

fn imported_zone(
    action: ImportAction,
    zone: &Zone,
    airspace: &Airspace,
) -> wire::ImportedZone<'static> {
    let terms = zone.terms();
    let identifier = terms.source.as_ref().map_or(zone.id(), |source| &source.id);
    let held = airspace.closure(zone.id());
    let is_active = held.is_some_and(|held| airspace.is_active(held, airspace.as_of()));
    wire::ImportedZone {
        id: Cow::Owned(zone.id().to_owned()),
        identifier: Cow::Owned(identifier.to_owned()),
        kind: Cow::Borrowed(terms.kind.name()),
        authorized: terms.is_authorized,
        action,
        in_force: is_active && terms.closes(),
    }
}

fn refused_zone(zone: &FeedZone, changes: &FeedChanges) -> Option<wire::RefusedZone<'static>> {
    zone.outcome.as_ref().err()?;
    let identifier = zone.identifier.as_ref();
    Some(wire::RefusedZone {
        is_proposed: identifier.is_some_and(|id| changes.proposed.contains(id)),
        identifier: identifier.cloned().map(Cow::Owned),
        pointer: Cow::Owned(zone.pointer.clone()),
        faults: faults(zone),
    })
}

/// Why a zone is refused.
fn faults(zone: &FeedZone) -> Vec<Fault> {
    let problems = zone.outcome.as_ref().err().into_iter().flatten();
    let faults = problems.map(|problem| Fault {
        code: problem.code.to_owned(),
        pointer: problem.pointer.clone(),
        message: problem.message.clone(),
        hint: problem.hint.clone(),
    });
    faults.collect()
}

/// A zone whose id is that of something that this feed did not bring.
fn taken_id(closure: &Closure) -> wire::RefusedZone<'static> {
    let source = closure.zone().and_then(|zone| zone.terms().source.as_ref());
    let fault = Fault {
        code: ZoneCode::IdTaken.code().to_owned(),
        pointer: String::new(),
        message: format!(
            "'{}' is the id of something that is not of this feed",
            closure.id
        ),
        hint: Some("import the feed with a prefix, or lift the other first".to_owned()),
    };
    wire::RefusedZone {
        identifier: source.map(|source| Cow::Owned(source.id.clone())),
        pointer: Cow::Borrowed(""),
        faults: vec![fault],
        is_proposed: false,
    }
}

fn note(note: FeedNote) -> wire::ImportNote<'static> {
    wire::ImportNote {
        identifier: note.identifier.map(Cow::Owned),
        pointer: Cow::Owned(note.pointer),
        message: Cow::Owned(note.message),
    }
}

/// Checks a parameter, which has to be there where it has an example.
fn check_name(place: &str, name: &str, example: &str) -> Result<(), Refusal> {
    let is_required = !example.is_empty();
    let is_missing = is_required && name.is_empty();
    let is_short = name.chars().count() <= NAME_MAX;
    if !is_missing && is_short && !name.chars().any(char::is_control) {
        return Ok(());
    }
    let fault = Fault {
        code: "name_invalid".to_owned(),
        pointer: place.to_owned(),
        message: format!(
            "has to have {} to {NAME_MAX} characters, none of them a control character",
            usize::from(is_required)
        ),
        hint: is_missing.then(|| format!("as in {example}")),
    };
    Err(Refusal::at(Code::ParameterInvalid, fault))
}

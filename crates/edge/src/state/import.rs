//! What a feed of zones changes: its zones are put as one batch, and those that it has no more are lifted.
//!
//! A zone that is in the feed but refused keeps its last version. Many removals at once wait for an operator, as those
//! that a registry tells do.

use super::State;
use crate::entries::{PendingReview, ProposalEntry, ProposedBy};
use crate::snapshot::{Snapshot, ZoneEntry};
use crate::writer::commands::Done;
use skyway_contract::{ImportAction, ObjectKind};
use skyway_engine::airspace::Closure;
use skyway_service::refusal::{Code, Refusal};
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

/// How the origin of a hold says that a feed has some zones no more.
const FEED_ORIGIN: &str = "feed:";
/// So many refused zones of a feed are proposed at most: proposals of drones share the room.
const PROPOSED_MAX: usize = 100;

/// What a feed has now.
#[derive(Debug)]
pub(crate) struct FeedUpdate {
    /// Its name.
    pub(crate) feed: Arc<str>,
    /// Its zones, as the closures they cause.
    pub(crate) puts: Vec<Arc<Closure>>,
    /// The identifiers of its zones that are refused.
    pub(crate) refused: BTreeSet<String>,
    /// What can be read of its zones that are refused.
    pub(crate) outlines: Vec<ProposalEntry>,
    /// Whether a zone is refused of which nobody knows the identifier: any absent one may be it.
    pub(crate) has_nameless: bool,
}

/// What becomes of each zone.
#[derive(Clone, Debug, Default)]
pub(crate) struct FeedChanges {
    /// The zones that the feed brings, with their place in it.
    pub(crate) brought: Vec<(usize, ImportAction)>,
    /// The zones that came from it before and are not brought now.
    pub(crate) absent: Vec<(Arc<str>, ImportAction)>,
    /// The places of zones whose ids are those of something else.
    pub(crate) taken: Vec<usize>,
    /// The identifiers of refused zones whose outlines are proposed.
    pub(crate) proposed: BTreeSet<String>,
    /// The places of the outlines that become proposals.
    new_proposals: Vec<usize>,
    /// Proposals of the feed that it makes no more.
    outdated_proposals: Vec<u64>,
}

/// The feed that a hold is about; `None` where it is none of a feed.
pub(crate) fn feed_of(origin: &str) -> Option<&str> {
    origin.strip_prefix(FEED_ORIGIN)
}

impl FeedChanges {
    /// Works out what an update does to what stands.
    pub(crate) fn of(snapshot: &Snapshot, update: &FeedUpdate) -> Self {
        let mut changes = Self::default();
        let mut ids: BTreeSet<&str> = BTreeSet::new();
        for (place, closure) in update.puts.iter().enumerate() {
            let id = closure.id.as_str();
            ids.insert(id);
            let standing = snapshot.zones.get(id);
            let is_taken = snapshot.closures.contains_key(id)
                || standing.is_some_and(|entry| feed_name(entry) != Some(&*update.feed));
            if is_taken {
                changes.taken.push(place);
                continue;
            }
            let action = match standing {
                None => ImportAction::Created,
                Some(entry) if closure.zone() == Some(&entry.zone) => ImportAction::Unchanged,
                Some(_) => ImportAction::Changed,
            };
            changes.brought.push((place, action));
        }
        changes.find_absent(snapshot, update, &ids);
        changes.find_proposed(snapshot, update);
        changes
    }

    /// Outlines are proposed where no last version is in force; proposals that say the same already are left as they are.
    fn find_proposed(&mut self, snapshot: &Snapshot, update: &FeedUpdate) {
        let proposals = snapshot.proposals.iter();
        let of_feed = proposals.filter_map(|(number, proposal)| {
            let source = proposal.closure.zone()?.terms().source.as_ref()?;
            let is_own = matches!(proposal.by, ProposedBy::Feed { .. });
            (is_own && source.feed == *update.feed).then_some((*number, proposal))
        });
        let mut standing: BTreeMap<&str, (u64, &Arc<ProposalEntry>)> = of_feed
            .map(|(number, proposal)| (proposal.closure.id.as_str(), (number, proposal)))
            .collect();
        let kept: BTreeSet<&str> = self
            .absent
            .iter()
            .filter_map(|(id, _)| snapshot.zones.get(id))
            .filter_map(|entry| entry.zone.terms().source.as_ref())
            .map(|source| source.id.as_str())
            .collect();
        for (place, outline) in update.outlines.iter().enumerate() {
            let id = outline.closure.id.as_str();
            let source = outline
                .closure
                .zone()
                .and_then(|zone| zone.terms().source.as_ref());
            let identifier = source.map_or(id, |source| &source.id);
            let is_taken = snapshot.zones.contains_key(id) || snapshot.closures.contains_key(id);
            if is_taken || kept.contains(identifier) || self.proposed.len() >= PROPOSED_MAX {
                continue;
            }
            self.proposed.insert(identifier.to_owned());
            let same = |(_, proposal): &(u64, &Arc<ProposalEntry>)| {
                proposal.by == outline.by && proposal.closure.zone() == outline.closure.zone()
            };
            match standing.get(id).is_some_and(same) {
                true => drop(standing.remove(id)),
                false => self.new_proposals.push(place),
            }
        }
        let outdated = standing.into_values();
        self.outdated_proposals = outdated.map(|(number, _)| number).collect();
    }

    fn find_absent(&mut self, snapshot: &Snapshot, update: &FeedUpdate, ids: &BTreeSet<&str>) {
        let of_feed = snapshot.zones.iter();
        let of_feed: Vec<(&Arc<str>, &Arc<ZoneEntry>)> = of_feed
            .filter(|(_, entry)| feed_name(entry) == Some(&*update.feed))
            .collect();
        let waiting = held_of(snapshot, &update.feed);
        for (id, entry) in &of_feed {
            if ids.contains(&***id) {
                continue;
            }
            let source = entry.zone.terms().source.as_ref();
            let is_refused = source.is_some_and(|source| update.refused.contains(&source.id));
            let action = match is_refused || update.has_nameless {
                true => ImportAction::Kept,
                false => ImportAction::Removed,
            };
            // What an operator has yet to decide on stays so, however little the feed lacks by now.
            let action = match action == ImportAction::Removed && waiting.contains(&***id) {
                true => ImportAction::Held,
                false => action,
            };
            self.absent.push(((*id).clone(), action));
        }
        let removed = self.count(ImportAction::Removed);
        if State::is_mass_removal(removed, of_feed.len()) {
            let absent = self.absent.iter_mut();
            for (_, action) in absent.filter(|(_, action)| *action == ImportAction::Removed) {
                *action = ImportAction::Held;
            }
        }
    }

    /// Whether the zones there would be are not too many.
    pub(crate) fn check_room(&self, snapshot: &Snapshot, limit: usize) -> Result<(), Refusal> {
        let count = snapshot.zones.len() + self.count(ImportAction::Created);
        if count > limit {
            let detail = format!(
                "with this feed there would be {count} zones, and this edge holds {limit}; raise airspace.zones_max"
            );
            return Err(Refusal::new(Code::LimitReached, detail));
        }
        Ok(())
    }

    /// To how many zones something is done.
    pub(crate) fn count(&self, wanted: ImportAction) -> usize {
        let brought = self.brought.iter().map(|(_, action)| action);
        let absent = self.absent.iter().map(|(_, action)| action);
        brought
            .chain(absent)
            .filter(|action| **action == wanted)
            .count()
    }
}

/// The zones of a feed whose removals wait for an operator.
fn held_of<'a>(snapshot: &'a Snapshot, feed: &str) -> BTreeSet<&'a str> {
    let holds = snapshot.holds.values();
    let of_feed = holds.filter(|hold| feed_of(&hold.origin) == Some(feed));
    let ids = of_feed.flat_map(|hold| hold.lifts.iter());
    ids.map(String::as_str).collect()
}

fn feed_name(entry: &ZoneEntry) -> Option<&str> {
    let source = entry.zone.terms().source.as_ref();
    source.map(|source| source.feed.as_str())
}

impl State {
    pub(super) fn import_zones(&mut self, update: &FeedUpdate) -> Result<Done, Refusal> {
        let changes = FeedChanges::of(&self.next, update);
        changes.check_room(&self.next, self.settings.zones_max)?;
        for (place, action) in &changes.brought {
            let closure = &update.puts[*place];
            self.release_from_holds(&closure.id);
            if *action != ImportAction::Unchanged {
                self.put_imported(closure);
            }
        }
        for number in &changes.outdated_proposals {
            self.drop_proposal(*number, "superseded");
        }
        for place in &changes.new_proposals {
            self.propose(update.outlines[*place].clone());
        }
        let of_feed = held_of(&self.next, &update.feed);
        let kept = changes.absent.iter();
        let kept =
            kept.filter(|(id, action)| *action == ImportAction::Kept && of_feed.contains(&**id));
        let again: Vec<Arc<str>> = kept.map(|(id, _)| id.clone()).collect();
        for id in again {
            self.release_from_holds(&id);
        }
        let waiting = self.held_ids();
        let mut held = Vec::new();
        for (id, action) in &changes.absent {
            match action {
                ImportAction::Removed => self.remove_zone(id),
                ImportAction::Held if !waiting.contains(&**id) => held.push(id.to_string()),
                _ => {}
            }
        }
        if !held.is_empty() {
            self.hold_removals(&format!("{FEED_ORIGIN}{}", update.feed), held);
        }
        Ok(Done::ZonesImported(changes))
    }

    /// Whether nothing that stands is opened by an update.
    pub(super) fn import_only_closes_more(&self, update: &FeedUpdate) -> bool {
        let changes = FeedChanges::of(&self.next, update);
        let mut brought = changes.brought.iter();
        changes.count(ImportAction::Removed) == 0
            && brought.all(|(place, _)| self.encloses_what_stands(&update.puts[*place]))
    }

    fn put_imported(&mut self, closure: &Arc<Closure>) {
        let standing = self.next.zones.get(closure.id.as_str());
        let upstream = standing.and_then(|entry| entry.upstream);
        let version = self.write_number();
        self.place_zone(closure, version, upstream);
        self.introduce(ObjectKind::Zone, &closure.id);
    }

    /// Lifts a zone here and at the registry; what is gone already needs no lifting.
    fn remove_zone(&mut self, id: &str) {
        if let Some(entry) = self.next.zones.get(id).cloned() {
            self.drop_zone(id);
            self.forward_removal(ObjectKind::Zone, id, entry.upstream);
        }
    }

    /// Lifts what a feed has no more, as far as it is still of that feed.
    pub(super) fn lift_absent(&mut self, hold: &PendingReview) {
        let feed = feed_of(&hold.origin);
        for id in &hold.lifts {
            let standing = self.next.zones.get(id.as_str());
            if standing.is_some_and(|entry| feed_name(entry) == feed) {
                self.remove_zone(id);
            }
        }
    }
}

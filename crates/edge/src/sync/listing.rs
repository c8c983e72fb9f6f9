//! Everything that the registry has, put together beside what is in service out of pages at one revision.

use super::followed::{
    BACKWARDS, CHECKSUM, Extent, NOT_AUTHORITATIVE, OUT_OF_PLACE, RegistryDelta, Rejected, Verdict,
};
use super::follower::{Fault, Follower, bounded, named};
use super::ground::BaseNetwork;
use crate::upstream::published::{BodyFault, Published, check_weather, read_thing};
use crate::upstream::{RegistryCursor, Upstream};
use skyway_contract::{ChangeOperation, Nack, ObjectKind, RegistrySnapshot, SnapshotObject};
use skyway_planted::{self as planted, Bug};
use std::collections::BTreeMap;
use std::sync::Arc;

/// No registry has more objects over one network.
const OBJECTS_MAX: usize = 2_100_000;

/// The pages of a list so far.
#[derive(Debug, Default)]
pub(crate) struct Listing {
    /// The first page without its objects: all pages have to be of its registry, epoch and revision.
    head: Option<RegistrySnapshot>,
    objects: BTreeMap<(ObjectKind, String), SnapshotObject>,
}

/// What came of a page of a list.
#[derive(Debug)]
pub(crate) enum Page {
    /// There are more: the token of the next one.
    More(String),
    /// It was the last.
    Last,
    /// It is of no use, and neither is the list.
    Nack(Box<Rejected>),
}

impl Follower {
    /// Judges a page of a list, and adds what it has.
    pub(crate) fn add_page(
        &self,
        listing: &mut Listing,
        page: RegistrySnapshot,
        cursor: Option<&Arc<RegistryCursor>>,
        ground: &BaseNetwork,
    ) -> Page {
        let revision = page.revision;
        let refuse = |code: &str, reason: String, restrictions: Option<Box<RegistryDelta>>| {
            let nack = Nack {
                revision,
                code: code.to_owned(),
                object: None,
                reason: bounded(reason),
            };
            Page::Nack(Box::new(Rejected { nack, restrictions }))
        };
        if !page.is_intact() && !planted::is(Bug::AcceptBadChecksum) {
            let reason = "the page is not as its digests say".to_owned();
            let restrictions = self.restrictions_of(&page, cursor, ground);
            return refuse(CHECKSUM, reason, restrictions);
        }
        if let Some((code, reason)) = self.foreign(&page.registry_id, &page.network, cursor) {
            return refuse(code, reason, None);
        }
        if let Some(cursor) = cursor
            && (page.epoch, revision) < (cursor.epoch, cursor.revision)
            && !planted::is(Bug::AcceptOlderRevision)
        {
            let reason = format!(
                "the list is of {}-{revision}, and {}-{} is in service",
                page.epoch, cursor.epoch, cursor.revision
            );
            return refuse(BACKWARDS, reason, None);
        }
        let goes_on = listing.head.as_ref().is_none_or(|head| {
            head.registry_id == page.registry_id
                && (head.epoch, head.revision) == (page.epoch, page.revision)
                && head.object_count == page.object_count
        });
        if !goes_on {
            let reason = "its pages are not of one revision".to_owned();
            return refuse(OUT_OF_PLACE, reason, None);
        }
        listing.add(page)
    }

    /// Judges a list that is whole.
    pub(crate) fn read_listing(
        &self,
        listing: &Listing,
        cursor: Option<&Arc<RegistryCursor>>,
        ground: &BaseNetwork,
    ) -> Verdict {
        let Some(head) = &listing.head else {
            return Verdict::Resync("the list has no pages".to_owned());
        };
        let empty = self.nothing(head, cursor, ground);
        match self.read_objects(listing, head, empty.clone(), ground) {
            Ok(followed) => Verdict::Follow(Box::new(followed)),
            Err(fault) => {
                let mut strict = RegistryDelta {
                    extent: Extent::Restrictions,
                    ..empty
                };
                for object in listing.objects.values() {
                    // What cannot be read is what the list is refused for.
                    let _ = self.take_object(object, &mut strict);
                }
                strict.weather = None;
                let restrictions = (!strict.puts.is_empty()).then(|| Box::new(strict));
                let nack = fault.nack();
                Verdict::Nack(Box::new(Rejected { nack, restrictions }))
            }
        }
    }

    fn nothing(
        &self,
        head: &RegistrySnapshot,
        cursor: Option<&Arc<RegistryCursor>>,
        ground: &BaseNetwork,
    ) -> RegistryDelta {
        RegistryDelta {
            extent: Extent::Everything,
            after: cursor.cloned(),
            cursor: RegistryCursor {
                registry_id: Arc::from(head.registry_id.as_str()),
                epoch: head.epoch,
                revision: head.revision,
            },
            topology: ground.topology.clone(),
            network: None,
            superseded: Vec::new(),
            puts: Vec::new(),
            lifts: Vec::new(),
            weather: None,
        }
    }

    fn read_objects(
        &self,
        listing: &Listing,
        head: &RegistrySnapshot,
        mut followed: RegistryDelta,
        ground: &BaseNetwork,
    ) -> Result<RegistryDelta, Fault> {
        let whole = |code, reason: String| Fault {
            revision: head.revision,
            object: None,
            body: BodyFault { code, reason },
        };
        let count = listing.objects.len() as u64;
        if count != head.object_count {
            let reason = format!("it has {count} objects, and says {}", head.object_count);
            return Err(whole(OUT_OF_PLACE, reason));
        }
        let is_restriction = |kind| matches!(kind, ObjectKind::Zone | ObjectKind::Closure);
        let mut kinds = listing.objects.keys().map(|(kind, _)| *kind);
        if !kinds.any(is_restriction) && !head.authoritative_empty {
            let reason = "it has neither a zone nor a closure, and does not say that none holds";
            return Err(whole(NOT_AUTHORITATIVE, reason.to_owned()));
        }
        let network = listing.objects.values();
        let mut network = network.filter(|object| object.kind == ObjectKind::Network);
        let Some(network) = network.next() else {
            return Err(whole(OUT_OF_PLACE, "it has no network".to_owned()));
        };
        let blamed = |object: &SnapshotObject, body: BodyFault| Fault {
            revision: object.revision,
            object: Some(named(object.kind, &object.id)),
            body,
        };
        let body = (ChangeOperation::Put, network.body.as_str());
        followed.network = ground
            .changed([body])
            .map_err(|body| blamed(network, body))?;
        if let Some(network) = &followed.network {
            followed.topology = network.topology.clone();
        }
        for object in listing.objects.values() {
            let taken = self.take_object(object, &mut followed);
            taken.map_err(|body| blamed(object, body))?;
        }
        Ok(followed)
    }

    fn take_object(
        &self,
        object: &SnapshotObject,
        followed: &mut RegistryDelta,
    ) -> Result<(), BodyFault> {
        let kind = object.kind;
        let topology = &followed.topology;
        match kind {
            ObjectKind::Network => Ok(()),
            ObjectKind::Weather => {
                check_weather(&object.body, topology)?;
                followed.weather = Some(Arc::from(object.body.as_str()));
                Ok(())
            }
            ObjectKind::Zone | ObjectKind::Closure => {
                let thing = read_thing(kind, &object.id, &object.body, topology, self.margin_m)?;
                followed.puts.push(Published {
                    kind,
                    id: Arc::from(object.id.as_str()),
                    upstream: Upstream {
                        epoch: object.epoch,
                        revision: object.revision,
                    },
                    body: Arc::from(object.body.as_str()),
                    thing,
                });
                Ok(())
            }
        }
    }

    /// What may be taken over of a page of a list that is not good.
    fn restrictions_of(
        &self,
        page: &RegistrySnapshot,
        cursor: Option<&Arc<RegistryCursor>>,
        ground: &BaseNetwork,
    ) -> Option<Box<RegistryDelta>> {
        // Only of the registry that is known, and only what it has done since.
        let cursor = cursor.filter(|cursor| {
            page.registry_id == *cursor.registry_id && page.network == *self.network
        })?;
        let mut strict = RegistryDelta {
            extent: Extent::Restrictions,
            ..self.nothing(page, Some(cursor), ground)
        };
        for object in &page.objects {
            let is_new = (object.epoch, object.revision) > (cursor.epoch, cursor.revision);
            if is_new && object.sha256 == object.digest(&self.network) {
                // What cannot be read is left out.
                let _ = self.take_object(object, &mut strict);
            }
        }
        strict.weather = None;
        (!strict.puts.is_empty()).then(|| Box::new(strict))
    }
}

impl Listing {
    fn add(&mut self, mut page: RegistrySnapshot) -> Page {
        let next = page.next_page_token.take();
        let revision = page.revision;
        let refuse = |reason: String| {
            let nack = Nack {
                revision,
                code: OUT_OF_PLACE.to_owned(),
                object: None,
                reason,
            };
            Page::Nack(Box::new(Rejected {
                nack,
                restrictions: None,
            }))
        };
        let has_none = page.objects.is_empty();
        for object in std::mem::take(&mut page.objects) {
            let key = (object.kind, object.id.clone());
            let is_of_it = (object.epoch, object.revision) <= (page.epoch, page.revision);
            if !is_of_it || self.objects.insert(key, object).is_some() {
                return refuse("an object comes twice, or from after the list".to_owned());
            }
        }
        if self.objects.len() > OBJECTS_MAX {
            return refuse(format!("it has more than {OBJECTS_MAX} objects"));
        }
        self.head = Some(page);
        match next {
            Some(_) if has_none => refuse("a page without objects says that there are more".into()),
            Some(next) => Page::More(next),
            None => Page::Last,
        }
    }
}

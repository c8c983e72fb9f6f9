//! What a bad line, or something else that answers there, makes of what a registry says.

use crate::places::{self, NETWORK};
use crate::rounds::Chance;
use skyway::edge::sync::ClientError;
use skyway::wire::{ChangeOperation, ChangesPage, LoggedChange, ObjectKind, RegistrySnapshot};
use std::collections::VecDeque;

/// Pages that a line remembers.
const REMEMBERED: usize = 12;

/// Pages that were carried before.
#[derive(Debug, Default)]
pub(crate) struct Remembered(VecDeque<ChangesPage>);

impl Remembered {
    pub(crate) fn keep(&mut self, page: &ChangesPage) {
        let is_good = page.is_intact() && !page.changes.is_empty();
        if !is_good || page.registry_id.starts_with("foreign") {
            return;
        }
        self.0.push_back(page.clone());
        if self.0.len() > REMEMBERED {
            self.0.pop_front();
        }
    }
}

/// A page that did not come as JSON.
fn unreadable<T>() -> Result<T, ClientError> {
    Err(ClientError::Unreadable("it is cut off".to_owned()))
}

/// Bends a page of the log; tells how.
pub(crate) fn bend_changes(
    mut page: ChangesPage,
    remembered: &Remembered,
    chance: &mut Chance,
) -> (&'static str, Result<ChangesPage, ClientError>) {
    let how = match chance.below(6) {
        0 => return ("cut off", unreadable()),
        1 => {
            bend_body(
                page.changes.iter_mut().filter_map(|it| it.body.as_mut()),
                chance,
            );
            page.head += 1;
            "bent body"
        }
        2 => {
            page.changes.pop();
            "without its end"
        }
        3 => {
            let place = chance.below(remembered.0.len() as u64) as usize;
            match remembered.0.get(place) {
                Some(older) => page = older.clone(),
                None => return ("cut off", unreadable()),
            }
            "an older page"
        }
        4 => {
            page = foreign(page, chance);
            "a foreign registry"
        }
        _ => {
            page = with_removals(page, remembered);
            "removals without a checksum"
        }
    };
    (how, Ok(page))
}

/// Bends a page of a list; tells how.
pub(crate) fn bend_list(
    mut page: RegistrySnapshot,
    chance: &mut Chance,
) -> (&'static str, Result<RegistrySnapshot, ClientError>) {
    let how = match chance.below(4) {
        0 => return ("cut off", unreadable()),
        1 => {
            bend_body(page.objects.iter_mut().map(|it| &mut it.body), chance);
            page.object_count += 1;
            "bent body"
        }
        2 => {
            page.objects.pop();
            page.next_page_token = None;
            "without its end"
        }
        _ => {
            // Everything is gone, it says, and does not say that it means it.
            page.objects.retain(|it| it.kind == ObjectKind::Network);
            page.object_count = page.objects.len() as u64;
            page.next_page_token = None;
            page.authoritative_empty = false;
            page.checksum = page.digest();
            "an empty list"
        }
    };
    (how, Ok(page))
}

/// Another digit in one of the bodies.
fn bend_body<'a>(bodies: impl Iterator<Item = &'a mut String>, chance: &mut Chance) {
    let mut bodies: Vec<&mut String> = bodies.collect();
    let place = chance.below(bodies.len() as u64) as usize;
    if let Some(body) = bodies.get_mut(place) {
        let bent = body.replacen("radius_m\":", "radius_m\":1", 1);
        **body = bent;
    }
}

/// What another registry would say after the same revision: all right by its digests, and a zone that no party made.
fn foreign(page: ChangesPage, chance: &mut Chance) -> ChangesPage {
    let id = "foreign";
    let circle = places::draw_circle(id, chance);
    let change = LoggedChange {
        revision: page.after + 1,
        epoch: page.epoch,
        at: "2026-11-21T06:00:00Z".to_owned(),
        subject: "operator".to_owned(),
        kind: ObjectKind::Zone,
        id: id.to_owned(),
        operation: ChangeOperation::Put,
        body: Some(places::zone(id, "foreign", circle).to_string()),
        sha256: String::new(),
    };
    let mut page = ChangesPage {
        registry_id: format!("foreign to {}", page.registry_id),
        revision: page.after + 1,
        head: page.after + 1,
        changes: vec![sealed(change)],
        ..page
    };
    page.checksum = page.digest();
    page
}

/// Removals of what was told before, each right by its own digest, in a page that is not.
fn with_removals(page: ChangesPage, remembered: &Remembered) -> ChangesPage {
    let told = remembered.0.iter().rev().flat_map(|page| &page.changes);
    let told: Vec<&LoggedChange> = told.filter(|it| it.body.is_some()).take(4).collect();
    let removals = told.into_iter().map(|put| {
        sealed(LoggedChange {
            revision: page.revision + 1,
            epoch: page.epoch,
            operation: ChangeOperation::Delete,
            body: None,
            ..put.clone()
        })
    });
    let removals: Vec<LoggedChange> = removals.collect();
    let mut bent = page;
    bent.changes.extend(removals);
    bent
}

fn sealed(mut change: LoggedChange) -> LoggedChange {
    change.sha256 = change.digest(NETWORK);
    change
}

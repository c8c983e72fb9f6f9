//! What is taken over of a page of the registry that is in doubt: only what is surely stricter than what stands.

use super::State;
use super::sync::{Tally, namesake};
use crate::upstream::published::Published;
use crate::upstream::{RegistryCursor, is_after};

impl State {
    /// Takes over what is surely stricter than what stands, and is of no change that waits here.
    pub(super) fn follow_strict(&mut self, put: Published, tally: &mut Tally) {
        let is_free = self.waiting_for(put.kind, &put.id).is_empty();
        if is_free && self.is_stricter(&put) {
            self.doubted.note(put.kind, &put.id, put.upstream);
            self.take(put, tally);
        }
    }

    /// Whether a put from a page in doubt surely closes no less than what stands.
    fn is_stricter(&self, put: &Published) -> bool {
        if self.has(namesake(put.kind), &put.id) {
            return false;
        }
        let known = self.last_known(put.kind, &put.id, &[]);
        if self.is_over(put) || known.is_some_and(|known| known >= put.upstream) {
            return false;
        }
        let standing = self.closure_of(put.kind, &put.id);
        standing.is_none_or(|standing| put.thing.closure().encloses(&standing, self.now))
    }

    /// Whether what stands is a later version from a page in doubt, which does not count against this one: it leaves open what
    /// this one closes, or the log has come beyond it.
    pub(super) fn stands_in_doubt(&self, put: &Published, cursor: &RegistryCursor) -> bool {
        let (kind, id) = (put.kind, &*put.id);
        let Some(known) = self.upstream_of(kind, id) else {
            return false;
        };
        let is_told = self
            .told
            .of(kind, id)
            .is_some_and(|told| told >= put.upstream);
        if self.doubted.of(kind, id) != Some(known) || is_told || self.is_over(put) {
            return false;
        }
        let standing = self.closure_of(kind, id);
        let is_open = standing.is_some_and(|it| !it.encloses(put.thing.closure(), self.now));
        is_open || !is_after(known, cursor)
    }
}

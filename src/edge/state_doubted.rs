//! What is taken over of a page of the registry that is in doubt: only what is surely stricter than what stands.

use super::published::Published;
use super::state::State;
use super::state_sync::{Tally, namesake};
use super::upstream::{RegistryCursor, is_after};

impl State {
    /// Takes over what is surely stricter than what stands, and is of no change that waits here.
    pub(super) fn follow_strict(&mut self, put: Published, tally: &mut Tally) {
        let is_free = self.waiting_for(put.kind, &put.id).is_empty();
        if is_free && self.is_stricter(&put) {
            self.take(put, tally);
        }
    }

    /// Whether a put from a page in doubt surely closes no less than what stands.
    fn is_stricter(&self, put: &Published) -> bool {
        if self.has(namesake(put.kind), &put.id) {
            return false;
        }
        let is_over = put.thing.ends_at().is_some_and(|end| end < self.now);
        let known = self.last_known(put.kind, &put.id, &[]);
        if is_over || known.is_some_and(|known| known >= put.upstream) {
            return false;
        }
        let standing = self.closure_of(put.kind, &put.id);
        standing.is_none_or(|standing| put.thing.closure().encloses(&standing, self.now))
    }
    /// Whether what stands is a later version from a page in doubt, and leaves open what this one closes. Until the log
    /// has come to that version, this one holds.
    pub(super) fn stands_in_doubt(&self, put: &Published, cursor: &RegistryCursor) -> bool {
        let known = self.upstream_of(put.kind, &put.id);
        let is_ahead = known.is_some_and(|known| is_after(known, cursor));
        let is_ours = known.is_some() && known == self.told.of(put.kind, &put.id);
        let standing = self.closure_of(put.kind, &put.id);
        let is_open = standing.is_some_and(|it| !it.encloses(put.thing.closure(), self.now));
        is_ahead && !is_ours && is_open
    }
}

//! What the registry says, judged where blocking is allowed: pages may be large, and requests are answered meanwhile.

use super::client::RegistryClient;
use super::followed::{RegistryDelta, Verdict};
use super::ground::BaseNetwork;
use super::listing::{Listing, Page};
use super::task::Sync;
use crate::background::begin_turn;
use crate::upstream::RegistryCursor;
use skyway_contract::{ChangesPage, RegistrySnapshot};
use skyway_service::refusal::Refusal;
use std::sync::Arc;

/// A page with fewer bytes of bodies is judged at once.
const SMALL_PAGE_BYTES: usize = 32 << 10;

impl<C: RegistryClient> Sync<C> {
    /// Judges a page of the log that was asked for after a cursor.
    pub(super) async fn judge(
        &self,
        page: ChangesPage,
        after: Arc<RegistryCursor>,
    ) -> Result<Verdict, Refusal> {
        let ground = self.ground();
        let bodies = page
            .changes
            .iter()
            .filter_map(|change| change.body.as_ref());
        let body_bytes: usize = bodies.map(String::len).sum();
        if body_bytes < SMALL_PAGE_BYTES {
            return Ok(self.follower.read_changes(&page, &after, &ground));
        }
        let follower = self.follower.clone();
        let judge = move || {
            begin_turn();
            follower.read_changes(&page, &after, &ground)
        };
        self.edge.aside(judge).await
    }

    /// Judges a page of a list, and adds what it has.
    pub(super) async fn add_page(
        &self,
        listing: &mut Listing,
        page: RegistrySnapshot,
        cursor: Option<&Arc<RegistryCursor>>,
        ground: &BaseNetwork,
    ) -> Result<Page, Refusal> {
        let (follower, cursor, ground) = (self.follower.clone(), cursor.cloned(), ground.clone());
        let mut so_far = std::mem::take(listing);
        let add = move || {
            begin_turn();
            let added = follower.add_page(&mut so_far, page, cursor.as_ref(), &ground);
            (so_far, added)
        };
        let (so_far, added) = self.edge.aside(add).await?;
        *listing = so_far;
        Ok(added)
    }

    /// Judges a list that is whole.
    pub(super) async fn judge_listing(
        &self,
        listing: Listing,
        cursor: Option<&Arc<RegistryCursor>>,
        ground: BaseNetwork,
    ) -> Result<Verdict, Refusal> {
        let (follower, cursor) = (self.follower.clone(), cursor.cloned());
        let judge = move || {
            begin_turn();
            follower.read_listing(&listing, cursor.as_ref(), &ground)
        };
        self.edge.aside(judge).await
    }

    /// What may be taken over of a batch whose network cannot be.
    pub(super) async fn without_network(
        &self,
        followed: RegistryDelta,
    ) -> Result<Option<Box<RegistryDelta>>, Refusal> {
        let (follower, ground) = (self.follower.clone(), self.ground());
        let judge = move || {
            begin_turn();
            follower.without_network(followed, &ground)
        };
        self.edge.aside(judge).await
    }
}

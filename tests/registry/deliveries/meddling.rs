//! What others do in the moment in which something is written: a store that lets them go first.

use super::world::{SERVICE, World, customer, errand, of};
use serde_json::json;
use skyway::access::Role;
use skyway::dispatch::{Dispatch, Settings};
use skyway::refusal::{Code, Refusal};
use skyway::registry::WriteOptions;
use skyway::registry::documents::{
    Commit, Committed, Document, DocumentKind, DocumentQuery, Documents, FailureCount, Message,
    PositionRow, Settlement,
};
use skyway::registry::store::{Answer, KeptReply};
use skyway::wire::{Delivery, DeliveryOrder, DeliveryStatus, PublishedService};
use std::fmt;
use std::pin::Pin;
use std::sync::{Arc, Mutex};

type Deed = Pin<Box<dyn Future<Output = ()> + Send>>;

/// Before which commit something is done, and what.
struct Meddler {
    is_before: Box<dyn FnMut(&Commit) -> bool + Send>,
    deed: Option<Deed>,
}

/// The documents of a store, with someone who does something right before a commit.
pub(super) struct Meddled {
    documents: Arc<dyn Documents>,
    meddler: Mutex<Meddler>,
}

impl fmt::Debug for Meddled {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.documents.fmt(formatter)
    }
}

impl Meddled {
    /// Who dispatches over a store in which a deed is done right before the first commit that is one of these.
    pub(super) fn dispatch(
        world: &World,
        is_before: impl FnMut(&Commit) -> bool + Send + 'static,
        deed: impl Future<Output = ()> + Send + 'static,
    ) -> Arc<Dispatch> {
        let meddled = Self {
            documents: world.documents.clone(),
            meddler: Mutex::new(Meddler {
                is_before: Box::new(is_before),
                deed: Some(Box::pin(deed)),
            }),
        };
        let registry = world.dispatch.registry().clone();
        let (documents, edge) = (Arc::new(meddled), world.edge.clone());
        Dispatch::with_edges(registry, documents, Settings::default(), edge)
    }
}

impl Documents for Meddled {
    fn commit<'a>(&'a self, commit: &'a Commit) -> Answer<'a, Committed> {
        Box::pin(async move {
            let deed = {
                let mut meddler = self.meddler.lock().expect("no panic elsewhere");
                match meddler.deed.is_some() && (meddler.is_before)(commit) {
                    true => meddler.deed.take(),
                    false => None,
                }
            };
            if let Some(deed) = deed {
                deed.await;
            }
            self.documents.commit(commit).await
        })
    }

    fn document<'a>(&'a self, kind: DocumentKind, id: &'a str) -> Answer<'a, Option<Document>> {
        self.documents.document(kind, id)
    }

    fn documents<'a>(&'a self, query: &'a DocumentQuery) -> Answer<'a, Vec<Document>> {
        self.documents.documents(query)
    }

    fn count_documents<'a>(
        &'a self,
        kind: DocumentKind,
        tenant: Option<&'a str>,
    ) -> Answer<'a, u64> {
        self.documents.count_documents(kind, tenant)
    }

    fn count_standing<'a>(
        &'a self,
        kind: DocumentKind,
        tenant: &'a str,
        states: &'a [&'static str],
        after: Option<&'a str>,
    ) -> Answer<'a, u64> {
        self.documents.count_standing(kind, tenant, states, after)
    }

    fn kept_reply<'a>(
        &'a self,
        subject: &'a str,
        key: &'a str,
    ) -> Answer<'a, Option<(String, KeptReply)>> {
        self.documents.kept_reply(subject, key)
    }

    fn news_through<'a>(
        &'a self,
        network: &'a str,
        edge: &'a str,
        lineage: u64,
    ) -> Answer<'a, u64> {
        self.documents.news_through(network, edge, lineage)
    }

    fn due_messages<'a>(
        &'a self,
        now_ms: i64,
        limit: u64,
        without: &'a [String],
    ) -> Answer<'a, Vec<Message>> {
        self.documents.due_messages(now_ms, limit, without)
    }

    fn next_due(&self) -> Answer<'_, Option<i64>> {
        self.documents.next_due()
    }

    fn settle_messages<'a>(&'a self, settled: &'a [Settlement]) -> Answer<'a, Vec<bool>> {
        self.documents.settle_messages(settled)
    }

    fn messages<'a>(
        &'a self,
        webhook: &'a str,
        before: Option<(i64, String)>,
        limit: u64,
    ) -> Answer<'a, Vec<Message>> {
        self.documents.messages(webhook, before, limit)
    }

    fn message<'a>(&'a self, id: &'a str) -> Answer<'a, Option<Message>> {
        self.documents.message(id)
    }

    fn keep_positions<'a>(&'a self, positions: &'a [PositionRow]) -> Answer<'a, u64> {
        self.documents.keep_positions(positions)
    }

    fn positions<'a>(
        &'a self,
        drone: &'a str,
        from_ms: i64,
        until_ms: i64,
        limit: u64,
    ) -> Answer<'a, Vec<PositionRow>> {
        self.documents.positions(drone, from_ms, until_ms, limit)
    }

    fn last_positions<'a>(
        &'a self,
        drones: &'a [String],
        from_ms: i64,
    ) -> Answer<'a, Vec<PositionRow>> {
        self.documents.last_positions(drones, from_ms)
    }

    fn count_failures<'a>(
        &'a self,
        network: &'a str,
        from_ms: i64,
        until_ms: i64,
        limit: u64,
    ) -> Answer<'a, Vec<FailureCount>> {
        let documents = &self.documents;
        documents.count_failures(network, from_ms, until_ms, limit)
    }

    fn drop_before(&self, before_ms: i64, failures_before_ms: i64) -> Answer<'_, ()> {
        self.documents.drop_before(before_ms, failures_before_ms)
    }
}

pub(super) type Placed = Arc<Mutex<Option<Result<Delivery, Refusal>>>>;

/// What became of an order, and the deed that places it.
pub(super) fn placing(
    world: &Arc<World>,
    order: DeliveryOrder,
) -> (Placed, impl Future<Output = ()> + Send + 'static) {
    let placed = Placed::default();
    let (world, told) = (world.clone(), placed.clone());
    let deed = async move {
        let became = world.try_order(&order).await;
        *told.lock().expect("no panic elsewhere") = Some(became);
    };
    (placed, deed)
}

pub(super) fn became(placed: &Placed) -> Result<Delivery, Refusal> {
    let became = placed.lock().expect("no panic elsewhere").take();
    became.expect("something was written after it")
}

async fn delete_service(dispatch: &Dispatch) -> Result<(), Refusal> {
    let swift = of(Role::Provider, "swift");
    let any = Some("*".to_owned());
    let deleted = dispatch.delete_entry::<PublishedService>(&swift, SERVICE, any);
    deleted.await
}

fn deletes_service(commit: &Commit) -> bool {
    let mut deletes = commit.deletes.iter();
    deletes.any(|(kind, _)| *kind == DocumentKind::Service)
}

fn puts_order(commit: &Commit) -> bool {
    let mut puts = commit.puts.iter();
    puts.any(|put| put.kind == DocumentKind::Delivery)
}

fn orders(is_named: bool) -> DeliveryOrder {
    DeliveryOrder {
        service_id: is_named.then(|| SERVICE.to_owned()),
        ..errand("shop", "door")
    }
}

#[tokio::test]
async fn a_service_is_not_deleted_under_an_order() {
    for is_named in [true, false] {
        let world = Arc::new(World::with_drones(&["depot"]).await);
        let (placed, deed) = placing(&world, orders(is_named));
        let dispatch = Meddled::dispatch(&world, deletes_service, deed);
        let refused = delete_service(&dispatch).await.unwrap_err();
        assert_eq!(refused.code, Code::InUse);
        let id = became(&placed).expect("an order").id;
        world.assign().await;
        assert_eq!(world.status(&id).await, DeliveryStatus::Assigned);
    }
}

#[tokio::test]
async fn what_is_ordered_while_its_service_is_deleted_is_not_bound_to_it() {
    for is_named in [true, false] {
        let world = Arc::new(World::with_drones(&["depot"]).await);
        let another = world.clone();
        let deed = async move {
            delete_service(&another.dispatch).await.expect("unused");
        };
        let dispatch = Meddled::dispatch(&world, puts_order, deed);
        let (shop, options) = (customer("shop"), WriteOptions::default());
        let order = orders(is_named);
        let placed = dispatch.create_delivery(&shop, &order, &options).await;
        match placed {
            Ok(reply) => {
                let placed: Delivery = serde_json::from_str(&reply.body).expect("a delivery");
                assert!(!is_named && placed.service_id.is_none(), "{placed:?}");
            }
            Err(refusal) => assert!(is_named && refusal.code == Code::NotFound, "{refusal}"),
        }
    }
}

#[tokio::test]
async fn an_order_that_waits_is_not_filled_by_a_service_that_is_deleted() {
    let world = Arc::new(World::with_drones(&["depot"]).await);
    delete_service(&world.dispatch).await.expect("unused");
    let id = world.order("shop", "door").await;
    world.put_service(&json!({})).await;
    let another = world.clone();
    let deed = async move {
        delete_service(&another.dispatch).await.expect("unused");
    };
    let fills = |commit: &Commit| commit.puts.iter().any(|put| !put.party.is_empty());
    let dispatch = Meddled::dispatch(&world, fills, deed);
    dispatch.assign_now().await.expect("the store answers");
    assert_eq!(world.delivery(&id).await.service_id, None);
    world.put_service(&json!({})).await;
    world.pass(10);
    world.assign().await;
    let filled = world.delivery(&id).await.service_id;
    assert_eq!(filled.as_deref(), Some(SERVICE));
}

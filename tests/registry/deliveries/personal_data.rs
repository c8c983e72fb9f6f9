//! What is kept of a customer while its data are being deleted, and afterwards.

use super::meddling::{Meddled, became, placing};
use super::ordering::quoted;
use super::world::{World, customer, errand};
use serde_json::json;
use skyway::refusal::Code;
use skyway::registry::documents::{Commit, Committed, Document, DocumentKind};
use skyway::wire::{DeliveryOrder, Recipient};
use std::sync::Arc;

/// More deliveries that are over than are read at once.
const OVER: usize = 200;

async fn put_over(world: &World) {
    let over = (0..OVER).map(|number| Document {
        kind: DocumentKind::Delivery,
        id: format!("c{number:03}"),
        tenant: "shop".to_owned(),
        party: "swift".to_owned(),
        state: "delivered".to_owned(),
        version: 1,
        changed_ms: 0,
        body: json!({"reference": "4711"}).to_string(),
    });
    let commit = Commit {
        puts: over.collect(),
        ..Commit::default()
    };
    let committed = world.documents.commit(&commit).await;
    assert_eq!(committed, Ok(Committed::Done));
}

fn strips(commit: &Commit) -> bool {
    let mut puts = commit.puts.iter();
    puts.any(|put| put.kind == DocumentKind::Delivery)
}

fn deletes_quotes(commit: &Commit) -> bool {
    let mut deletes = commit.deletes.iter();
    deletes.any(|(kind, _)| *kind == DocumentKind::Quote)
}

/// An order is placed right before a commit of the deletion: it keeps what is its own.
async fn keeps_its_own(is_before: fn(&Commit) -> bool) {
    let world = Arc::new(World::with_drones(&["depot"]).await);
    let shop = customer("shop");
    put_over(&world).await;
    let quote = world.dispatch.create_quote(&shop, quoted());
    quote.await.expect("a quote");
    let order = DeliveryOrder {
        reference: Some("4712".to_owned()),
        recipient: Some(Recipient {
            name: Some("Ada".to_owned()),
            ..Recipient::default()
        }),
        ..errand("shop", "door")
    };
    let (placed, deed) = placing(&world, order);
    let dispatch = Meddled::dispatch(&world, is_before, deed);
    let deleted = dispatch.delete_customer_data(&shop, "shop", None).await;
    let id = became(&placed).expect("an order").id;
    let kept = world.delivery(&id).await;
    let name = kept.recipient.and_then(|recipient| recipient.name);
    assert_eq!(name.as_deref(), Some("Ada"));
    assert_eq!(kept.reference.as_deref(), Some("4712"));
    assert_eq!(deleted.unwrap_err().code, Code::InUse);
}

#[tokio::test]
async fn an_order_keeps_its_reference_while_its_customers_deliveries_are_stripped() {
    keeps_its_own(strips).await;
}

#[tokio::test]
async fn an_order_keeps_its_recipient_while_its_customers_data_are_deleted() {
    keeps_its_own(deletes_quotes).await;
}

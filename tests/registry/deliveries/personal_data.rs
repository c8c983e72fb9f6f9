//! What is kept of a customer while its data are being deleted, and afterwards.

use super::meddling::{Meddled, became, placing};
use super::ordering::quoted;
use super::world::{World, customer, errand, of};
use serde_json::json;
use skyway::access::Role;
use skyway::refusal::Code;
use skyway::registry::documents::{Commit, Committed, Document, DocumentKind};
use skyway::wire::{DeliveryOrder, ProofOfDelivery, Recipient};
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

#[tokio::test]
async fn a_proof_that_comes_after_its_customers_data_were_deleted_names_no_person() {
    let world = World::with_drones(&["depot"]).await;
    let id = world.order("shop", "door").await;
    world.assign().await;
    let flight = world.whole_flight(&id, "depot").await;
    world.tell(1, &flight).await;
    let shop = customer("shop");
    let deleted = world.dispatch.delete_customer_data(&shop, "shop", None);
    deleted.await.expect("it is over");
    let proof = ProofOfDelivery {
        at: "2026-11-27T18:00:00Z".to_owned(),
        lon: None,
        lat: None,
        photo: Some("https://proofs.example/ada.jpg".to_owned()),
        code: Some("2718".to_owned()),
    };
    let swift = of(Role::Provider, "swift");
    let proved = world.dispatch.prove_delivery(&swift, &id, &proof).await;
    let told = proved.expect("delivered").proof.expect("a proof");
    assert_eq!((told.photo, told.code), (None, None));
    assert_eq!(told.lon, Some(2_500.0));
    let kept = world.documents.document(DocumentKind::Delivery, &id).await;
    let body = kept.expect("answers").expect("a delivery").body;
    assert!(
        !body.contains("ada.jpg") && !body.contains("2718"),
        "{body}"
    );
}
